//! The Python package: the values of the pipeline as Python objects, arrays in and out.
//!
//! What is computed and how it is laid out is the library's. Deliberately absent: numerics, words
//! for people, and defaults, which are the library's or stand in the typed layer in Python; but for
//! the program itself, whose text is compiled here as well.

mod background;
#[path = "../../src/cli/mod.rs"]
mod cli;
mod command;
mod error;
mod fit;
mod map;
mod result;
mod scene;
mod share;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program on these arguments, its name the first; gives its exit code.
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| cli::run(arguments))
}

/// What the typed layer in Python stands on.
#[pymodule]
mod _lib {
    #[pymodule_export]
    use super::command::{answer, answer_share, report};
    #[pymodule_export]
    use super::fit::fit;
    #[pymodule_export]
    use super::map::{Map, draw, draw_share, words};
    #[pymodule_export]
    use super::program;
    #[pymodule_export]
    use super::result::Computed;
    #[pymodule_export]
    use super::scene::{Graze, Scene, catalogue};
}
