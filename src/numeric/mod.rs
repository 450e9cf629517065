//! Numbers and the small algorithms on them that every other floor uses.
//!
//! Deliberately absent: jets, models, files.

mod double;
mod double_double;
mod scalar;

pub use double_double::{Dd, ParseDdError};
pub use scalar::{Real, Scalar};
