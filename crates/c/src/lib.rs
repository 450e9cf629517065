//! The library of maps for programs in C, and for all that calls C: Julia, MATLAB, Octave, Fortran.
//!
//! A function of the [`border`] reads its arguments, calls [`values`] once and writes what it gave.
//! `include/grazemap.h` is made of this package by cbindgen; a test holds it current.
//!
//! Deliberately absent: numerics, defaults, words of its own beyond wrong calls.

#[expect(unsafe_code, reason = "a foreign border; each function says what its caller promises")]
pub mod border;
mod failure;
mod values;

pub use values::{Graze, Map, Scene, Table};
