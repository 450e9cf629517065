//! Fits to arrays of measured points.

use grazemap::analysis::fit::MeasuredSeries;
use grazemap::pipeline::FitKeys;
use numpy::{PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::background::compute;
use crate::map::Map;
use crate::result::Computed;

/// Fits parameters to several series. The series stand one after another: lengths, rows of points,
/// and a row of controls for each series; keys are JSON.
#[pyfunction]
#[pyo3(signature = (m, keys, lengths, points, controls, progress=None))]
pub(crate) fn fit(
    py: Python<'_>,
    m: &Map,
    keys: &str,
    lengths: Vec<usize>,
    points: PyReadonlyArray2<'_, f64>,
    controls: PyReadonlyArray2<'_, f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Computed> {
    let keys: FitKeys =
        serde_json::from_str(keys).map_err(|fault| PyValueError::new_err(fault.to_string()))?;
    let (width, count) = (points.dims()[1], controls.dims()[1]);
    let mut rows = points.as_slice()?.chunks_exact(width.max(1)).map(<[f64]>::to_vec);
    let mut controls = controls.as_slice()?.chunks_exact(count.max(1)).map(<[f64]>::to_vec);
    let series = lengths.into_iter().map(|length| MeasuredSeries {
        controls: controls.next().unwrap_or_default(),
        points: rows.by_ref().take(length).collect(),
    });
    let (map, series) = (m.0.clone(), series.collect());
    compute(py, progress, move |progress| Ok(Computed::of(keys.answer(&map, series, progress)?)))
}
