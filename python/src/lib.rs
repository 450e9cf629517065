//! Python package: the pipeline's values as Python objects, with arrays as input and output.
//!
//! The library computes and lays out all results. Deliberately absent: numerics, words for people,
//! and defaults, which are those of the library or of the typed layer in Python; except for the
//! program itself, whose source is compiled here as well.

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

/// Runs the program and returns its exit code. The first argument is the program's name.
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| cli::run(arguments))
}

/// Foundation of the typed layer in Python.
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
