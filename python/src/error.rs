//! Errors of the library as exceptions of `grazemap._errors`.

use grazemap::Error;
use pyo3::prelude::*;

/// The exception of an error: a fault of a scene with its place, a computation that ended
/// otherwise, or wrong input.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let made = py.import("grazemap._errors").and_then(|errors| match error {
        Error::Scene(fault) => {
            let (line, column) = fault.position().unzip();
            let words = (fault.to_string(), fault.file_name(), line, column);
            errors.getattr("SceneError")?.call1(words)
        }
        other if other.ended_otherwise() => errors.getattr("NoResult")?.call1((words(other),)),
        other => errors.getattr("InputError")?.call1((words(other),)),
    });
    made.map_or_else(|failed| failed, PyErr::from_value)
}

/// An error with what led to it.
fn words(error: &Error) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(reason) = source {
        let more = reason.to_string();
        if !text.contains(&more) {
            text.push_str(": ");
            text.push_str(&more);
        }
        source = reason.source();
    }
    text
}
