//! Errors of the library as exceptions of `grazemap._errors`.

use grazemap::Error;
use pyo3::prelude::*;

/// Exception for an error: a fault of a scene with its place, a computation without a result, or
/// wrong input.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let made = py.import("grazemap._errors").and_then(|errors| match error {
        Error::Scene(fault) => {
            let (line, column) = fault.position().unzip();
            let words = (fault.to_string(), fault.file_name(), line, column);
            errors.getattr("SceneError")?.call1(words)
        }
        Error::Memory { .. } => errors.getattr("TooLargeError")?.call1((error.to_string(),)),
        other if other.ended_otherwise() => {
            errors.getattr("NoResult")?.call1((other.with_reasons(),))
        }
        other => errors.getattr("InputError")?.call1((other.with_reasons(),)),
    });
    made.map_or_else(|failed| failed, PyErr::from_value)
}
