//! Maps against direct simulation: errors, rates and times of every pair of truncation orders, and
//! the map and the section chosen for a tolerance.
//!
//! The one place where expansion and simulation meet, so that their agreement is evidence. What
//! both parts measure with (points of a window, their exact images, truncations of one expansion)
//! is here; [`study`] uses [`choice`], never the reverse. Deliberately absent: plotting. See
//! docs/mathematics/convergence.md.

pub mod choice;
mod error;
mod family;
mod resumed;
mod sample;
pub mod study;
mod timing;
mod truth;
mod window;

pub use choice::{
    Choice, ChoiceOptions, Chooser, Decay, LeastOrders, Limit, Monomials, OrderRule, Polynomials,
    SectionChoice, SectionVerdict, SettledScene, choose, choose_orders, choose_sections,
    chosen_map, settle_section,
};
pub use error::ConvergenceError;
pub use family::{MapFamily, cut_legs};
pub use sample::{SamplePoint, WindowSample};
pub use study::{
    ConvergenceOptions, ConvergenceStudy, DepthAccuracy, DirectSummary, FactorRate, OrderResult,
    ParetoMap, ParetoPoint, Rate, SlopeFit, Validity, WindowAccuracy, converge, fit_slope,
    validity,
};
pub use timing::{multiply_add_ns, step_ns};
pub use truth::{ErrorSummary, ExactImages, SampleSummary};
pub use window::{
    BoundKind, BoundOrigin, CoordinateError, MeasuredWindow, WindowBound, WindowMeasurement,
    WindowTolerance, measure_window,
};
