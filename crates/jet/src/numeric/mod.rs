//! Numbers, and the small algorithms on numbers that every other floor uses.
//!
//! Everything here is generic over [`Scalar`] (`f64`, `f32`, double-doubles [`Dd`], [`Lanes`]) or
//! over its ordered part [`Real`] (`f64`, `f32`, [`Dd`]): roots in a [`Bracket`], all extrema and
//! roots of a polynomial on an interval, small dense linear algebra on nalgebra's containers.
//!
//! Deliberately absent: jets, models, files.

mod bracket;
mod decimals;
mod dispatch;
mod double_double;
mod float;
mod lanes;
pub mod linear;
mod low_discrepancy;
pub mod polynomial;
mod scalar;

pub use bracket::{
    Bracket, BracketOutcome, NewtonOutcome, NewtonStep, NewtonSteps, damped_newton, last_that_holds,
};
pub use decimals::{Shown, decimal_above, decimal_below, unbounded, unbounded_number};
pub use dispatch::{
    INSTRUCTION_LIMIT, Vectorised, is_wide, unknown_instruction_limit, wide, widest,
};
pub use double_double::{Dd, ParseDdError};
pub use float::FloatFormat;
pub use lanes::{LaneMask, Lanes, one_by_one};
pub use linear::NumericError;
pub use low_discrepancy::low_discrepancy;
pub use scalar::{Branched, Mask, Real, Scalar, converted};

/// Sampling of this floor's property tests: `cases` samples, the same in every run, without a
/// record of failures on disk.
#[cfg(test)]
fn fixed_samples(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases,
        rng_seed: proptest::test_runner::RngSeed::Fixed(2),
        failure_persistence: None,
        ..Default::default()
    }
}
