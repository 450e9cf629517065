//! Numbers and the small algorithms on them that every other floor uses.
//!
//! Deliberately absent: jets, models, files.

mod double_double;
mod scalar;

pub use double_double::Dd;
pub use scalar::{Real, Scalar};
