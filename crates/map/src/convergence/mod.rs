//! Maps against direct simulation: errors, rates and times of every pair of truncation orders, and
//! the map and the section chosen for a tolerance.
//!
//! Expansion and simulation meet only here, so that their agreement is evidence. This module holds
//! the tools that both parts measure with (points of a window, their exact images, truncations of
//! one expansion); [`study`] uses [`choice`], never the reverse. Deliberately absent: plotting. See
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

/// Error of a study of convergence that could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConvergenceError {
    /// No sample point of the window has an exact image to compare the map's with.
    #[error(
        "of {tried} sample points in the window none returns with no contact but those of the \
            grazing passages: the window reaches beyond the local map"
    )]
    NoTruth {
        /// Number of points tried.
        tried: usize,
    },
    /// Simulation of an image failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// An expansion failed.
    #[error(transparent)]
    Expansion(#[from] ExpansionError),
}

/// Result at a place: read back if an earlier run kept it, otherwise computed and kept.
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

/// Result that an earlier run kept at a place; `None` if there is none that can be read.
fn kept<T: DeserializeOwned>(progress: &dyn Progress, place: &[u64]) -> Option<T> {
    serde_json::from_slice(&progress.recall(place)?).ok()
}

/// Computes the result at a place and keeps it for later runs.
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
