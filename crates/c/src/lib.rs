//! Grazemap as a library for C, and for all languages that call C: Julia, MATLAB, Octave, Fortran.
//!
//! A function of the [`border`] reads its arguments, calls `values` once and writes the result.
//! cbindgen generates `include/grazemap.h` from this package; a test checks that the file is
//! current.
//!
//! Deliberately absent: numerics, defaults, messages other than those about wrong calls.

#[expect(unsafe_code, reason = "a foreign border; each function says what its caller promises")]
pub mod border;
mod failure;
mod values;

pub use values::{Graze, Map, Scene, Table};
