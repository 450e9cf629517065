//! Shares of a computation for several processes. The pieces of a share are passed as bytes.

use grazemap::Error;
use grazemap::analysis::{Gathered, Pieces, Shard, Share};
use grazemap::report::{pieces_from_bytes, pieces_to_bytes};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::background::compute;

/// Pieces found by a share, as bytes; the share is given by its number from 1 and the number of
/// shares.
pub(crate) fn share<'py>(
    py: Python<'py>,
    (number, of): (usize, usize),
    find: impl FnOnce(&Shard<'_>) -> Result<(), Error> + Send + 'static,
) -> PyResult<Bound<'py, PyBytes>> {
    let share = Share::new(number, of);
    let share = share.ok_or_else(|| PyValueError::new_err(format!("no share {number} of {of}")))?;
    let found = compute(py, None, move |progress| {
        let gathered = Gathered::default();
        find(&Shard::new(share, progress, &gathered))?;
        Ok(pieces_to_bytes(&gathered.into_pieces()))
    })?;
    Ok(PyBytes::new(py, &found))
}

/// Pieces found by all shares.
pub(crate) fn joined(shares: &[Vec<u8>]) -> PyResult<Pieces> {
    let pieces = shares.iter().map(|bytes| pieces_from_bytes(bytes));
    let pieces: Option<Vec<Pieces>> = pieces.collect();
    let pieces = pieces.ok_or_else(|| PyValueError::new_err("the bytes of a share are damaged"))?;
    Ok(pieces.into_iter().flatten().collect())
}
