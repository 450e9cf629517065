//! Numbers and the small algorithms on them that every other floor uses.
//!
//! Everything here is generic over [`Scalar`] (`f64`, `f32`, double-doubles [`Dd`], [`Lanes`]) or
//! over its ordered part [`Real`] (`f64`, `f32`, [`Dd`]): roots in a [`Bracket`], all extrema and
//! roots of a polynomial on an interval, small dense linear algebra on nalgebra's containers.
//!
//! Deliberately absent: jets, models, files.

mod bracket;
mod branched;
mod decimals;
mod dispatch;
mod double_double;
mod error;
mod float;
mod lanes;
pub mod linear;
pub mod polynomial;
#[cfg(test)]
mod sampling;
mod scalar;
mod shown;
mod sine;

pub use bracket::{Bracket, BracketOutcome, NewtonStep, NewtonSteps, last_that_holds};
pub use branched::{Branched, LaneMask, Mask};
pub use decimals::decimal_above;
pub use dispatch::wide;
pub use dispatch::{Kernel, is_wide, widest};
pub use double_double::{Dd, ParseDdError};
pub use error::NumericError;
pub use float::FloatFormat;
pub use lanes::Lanes;
pub use lanes::one_by_one;
pub use scalar::{Real, Scalar};
pub use shown::Shown;
