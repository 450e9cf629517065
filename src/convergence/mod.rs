//! Truncation orders against direct simulation: errors, rates, times, and the choice of orders.
//!
//! The one place where expansion and simulation meet, so that their agreement is evidence.
//! Deliberately absent: plotting. See docs/mathematics/convergence.md.

mod choice;
mod data;
mod engine;
mod error;
mod errors;
mod extremes;
mod family;
mod fit;
mod rates;
mod sample;
mod timing;
mod truth;

pub use choice::choose_orders;
pub use data::{
    Choice, ConvergenceStudy, DirectSummary, ErrorSummary, FactorRate, OrderResult, Rate,
    SampleSummary,
};
pub use engine::{ConvergenceOptions, converge};
pub use error::ConvergenceError;
pub use extremes::{
    Coefficients, ExtremeAxis, ExtremeCase, ExtremeOutcome, ExtremeRow, ExtremesStudy, Measured,
    extreme_cases, extremes, measure_extreme,
};
pub use family::MapFamily;
pub use fit::{SlopeFit, fit_slope};
pub use sample::{SamplePoint, WindowSample};
