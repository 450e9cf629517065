//! Results that a later run of the same study need not compute again.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::analysis::Progress;

/// The result at a place: as an earlier run kept it, or computed and kept.
pub(super) fn resumed<T: Serialize + DeserializeOwned, E>(
    progress: &dyn Progress,
    place: &[u64],
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    if let Some(value) = kept(progress, place) {
        return Ok(value);
    }
    computed(progress, place, compute)
}

/// The result at a place as an earlier run kept it.
pub(super) fn kept<T: DeserializeOwned>(progress: &dyn Progress, place: &[u64]) -> Option<T> {
    serde_json::from_slice(&progress.recall(place)?).ok()
}

/// The result at a place, computed and kept.
pub(super) fn computed<T: Serialize, E>(
    progress: &dyn Progress,
    place: &[u64],
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let value = compute()?;
    if let Ok(piece) = serde_json::to_vec(&value) {
        progress.keep(place, &piece);
    }
    Ok(value)
}
