//! Maps against direct simulation: errors, rates and times of every pair of truncation orders, and
//! the map and the section chosen for a tolerance.
//!
//! The one place where expansion and simulation meet, so that their agreement is evidence. What
//! both parts measure with (points of a window, their exact images, truncations of one expansion)
//! is here; [`study`] uses [`choice`], never the reverse. Deliberately absent: plotting. See
//! docs/mathematics/convergence.md.

mod ascent;
pub mod choice;
mod family;
mod sample;
pub mod study;
mod truth;
mod window;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::analysis::{AnalysisError, Progress};
use crate::expansion::ExpansionError;

pub use choice::{
    Choice, ChoiceOptions, Chooser, Decay, LeastOrders, Limit, Monomials, OrderRule, Polynomials,
    SectionChoice, SectionVerdict, SettledScene, choose, choose_orders, choose_sections,
    chosen_map, settle_section,
};
pub use family::{MapFamily, cut_legs};
pub use sample::{SamplePoint, WindowSample};
pub use study::{
    ConvergenceOptions, ConvergenceStudy, DepthAccuracy, DirectSummary, FactorRate, OrderResult,
    ParetoMap, ParetoPoint, Rate, SlopeFit, Validity, WindowAccuracy, converge, fit_slope,
    validity,
};
pub use truth::{ErrorSummary, ExactImages, SampleSummary, multiply_add_ns, step_ns};
pub use window::{
    BoundKind, BoundOrigin, CoordinateError, MeasuredWindow, WindowBound, WindowMeasurement,
    WindowTolerance, measure_window,
};

/// A study of convergence that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConvergenceError {
    /// No sample point of the window has an image that the map could be compared with.
    #[error(
        "of {tried} sample points in the window none returns with no contact but those of the \
            grazing passages: the window reaches beyond the local map"
    )]
    NoTruth {
        /// Points tried.
        tried: usize,
    },
    /// An image by simulation failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// An expansion failed.
    #[error(transparent)]
    Expansion(#[from] ExpansionError),
}

/// The result at a place: as an earlier run kept it, or computed and kept.
fn resumed<T: Serialize + DeserializeOwned, E>(
    progress: &dyn Progress,
    place: &[u64],
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    if let Some(value) = kept(progress, place) {
        return Ok(value);
    }
    computed(progress, place, compute)
}

/// The result at a place as an earlier run kept it.
fn kept<T: DeserializeOwned>(progress: &dyn Progress, place: &[u64]) -> Option<T> {
    serde_json::from_slice(&progress.recall(place)?).ok()
}

/// The result at a place, computed and kept.
fn computed<T: Serialize, E>(
    progress: &dyn Progress,
    place: &[u64],
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let value = compute()?;
    if let Ok(piece) = serde_json::to_vec(&value) {
        progress.keep(place, &piece);
    }
    Ok(value)
}
