//! The Python package: the values of the pipeline as Python objects, arrays in and out.
//!
//! What is computed and how it is laid out is the library's. Deliberately absent: numerics, words
//! for people, and defaults, which are the library's or stand in the typed layer in Python.

mod background;
mod command;
mod error;
mod fit;
mod map;
mod result;
mod scene;
mod share;

use pyo3::prelude::*;

/// What the typed layer in Python stands on.
#[pymodule]
mod _lib {
    #[pymodule_export]
    use super::command::{answer, report};
    #[pymodule_export]
    use super::fit::fit;
    #[pymodule_export]
    use super::map::{Map, draw, draw_share, words};
    #[pymodule_export]
    use super::result::Computed;
    #[pymodule_export]
    use super::scene::{Graze, Scene, catalogue};
}
