//! What is asked of a periodic orbit, and how the search ended.

use super::orbit::PeriodicOrbit;
use crate::expansion::MapWindow;
use crate::iteration::PassageSet;

/// Which periodic orbit is looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicProblem {
    /// Returns of the map to one period of the orbit.
    pub returns: usize,
    /// The parameter that may vary, among the active ones.
    pub free: usize,
    /// Passages that make contact, return by return; `None` accepts any.
    pub itinerary: Option<Vec<PassageSet>>,
    /// Lengths on which the map varies: of the coordinates, then of the active parameters.
    pub scales: Vec<f64>,
}

/// The variable that keeps its value while the others are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// The free parameter: the orbit at that parameter.
    Parameter,
    /// A coordinate of the first point: the parameter at which the orbit passes there.
    Coordinate(usize),
}

/// Where a search begins: the first point of an orbit and all active parameters, in offsets.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess<S> {
    /// One offset per coordinate.
    pub state: Vec<S>,
    /// One offset per active parameter.
    pub parameters: Vec<S>,
}

/// How a search ended.
#[derive(Clone, Debug, PartialEq)]
pub enum PeriodicOutcome<S> {
    /// An orbit of the itinerary asked for.
    Found(PeriodicOrbit<S>),
    /// An orbit of the map that makes other contacts: the one asked for does not exist there.
    OtherItinerary(PeriodicOrbit<S>),
    /// The map has no image, or no derivative, on the way.
    NoImage {
        /// Newton steps made.
        steps: usize,
    },
    /// The equations are singular: a fold at a held parameter.
    Singular {
        /// Newton steps made.
        steps: usize,
    },
    /// No step led nearer, or the steps did not shrink.
    NotConverged {
        /// Length of the last one, in the scales.
        last_step: f64,
    },
}

impl<S> PeriodicOutcome<S> {
    /// The orbit, if it is the one asked for.
    pub fn found(self) -> Option<PeriodicOrbit<S>> {
        match self {
            Self::Found(orbit) => Some(orbit),
            _ => None,
        }
    }
}

/// Lengths on which a map varies: the half-widths of its window, 1 where it is unbounded.
pub fn window_scales(window: &MapWindow) -> Vec<f64> {
    let widths = window.state.iter().chain(&window.parameter);
    widths.map(|&width| finite_or_one(width)).collect()
}

/// A half-width of a window, 1 where it is unbounded.
pub(in crate::analysis) fn finite_or_one(width: f64) -> f64 {
    if width.is_finite() { width } else { 1.0 }
}
