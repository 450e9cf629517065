//! Errors of analyses: wrong requests, and failures of the layers below.

use super::periodic::ItineraryError;
use crate::atlas::{OptionsError, RegionError, RestoreError};
use crate::expansion::{ExpansionError, LocalMap};
use crate::flow::FlowError;
use crate::hybrid::HybridError;
use crate::orbit::OrbitError;

/// Wrong input to an analysis, or a failure in a layer below.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// A row of offsets is not as long as the section's coordinates or the active parameters.
    #[error("{what}: {expected} numbers expected, {found} were given")]
    Length {
        /// Name of the row of numbers, for the message.
        what: &'static str,
        /// Numbers expected.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A diagram sweeps a parameter that the map does not keep as a variable.
    #[error("the map has no variable `{parameter}`: parameters swept must be active")]
    NotActive {
        /// Name of the parameter.
        parameter: String,
    },
    /// A start names a component of the state that is no coordinate of the section.
    #[error("`start` names `{name}`, which is no coordinate of the section; expected {known}")]
    NotACoordinate {
        /// Name of the component.
        name: String,
        /// Names of the section's coordinates.
        known: String,
    },
    /// Starts are to be spread over a coordinate for which the window has no bound.
    #[error(
        "the window says nothing of `{name}`, over which starts are to be spread; name its \
         half-width in `window.state`"
    )]
    NoWidth {
        /// Name of the coordinate.
        name: String,
    },
    /// The axes of a basin are not two coordinates of the section.
    #[error("a basin is drawn over two coordinates of the section; expected two of {known}")]
    NotAPlane {
        /// Names of the section's coordinates.
        known: String,
    },
    /// Manifolds were asked for on a section that does not have two coordinates.
    #[error(
        "stable and unstable manifolds of saddles are curves on a section of two coordinates; this \
         one has {dimension}; ask for a basin without manifolds, for loci without crises"
    )]
    NotPlanar {
        /// Coordinates of the section.
        dimension: usize,
    },
    /// A fit has no more measured numbers than unknowns.
    #[error(
        "{measured} numbers were measured, and {unknowns} are unknown (every piece has a start of \
         its own): longer series or pieces are needed"
    )]
    TooFewMeasured {
        /// Numbers measured.
        measured: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// A number of a fit whose square may be no number.
    #[error("{what} is {found:e}; expected a number of at most {largest:e} in size")]
    Unbounded {
        /// Meaning of the number.
        what: &'static str,
        /// The number.
        found: f64,
        /// Largest size of such a number.
        largest: f64,
    },
    /// A standard deviation of a measurement that is not positive and finite.
    #[error("the noise of a coordinate is {found:e}; expected a standard deviation above 0")]
    NotAStandardDeviation {
        /// The number stated.
        found: f64,
    },
    /// Too many itineraries were asked for.
    #[error(transparent)]
    Itinerary(#[from] ItineraryError),
    /// A basin has no range along an axis: none is given, and the window is unbounded there.
    #[error(
        "the window says nothing of `{name}`, over which a basin is to be drawn; name a range, or \
         its half-width in `window.state`"
    )]
    NoRange {
        /// Name of the coordinate.
        name: String,
    },
    /// A request needs the contacts of a map whose contacts are not expanded.
    #[error(
        "the contacts of this map are not expanded; direct simulation alone can be asked for \
         (method `direct`)"
    )]
    NoContacts,
    /// Direct simulation was asked for in single precision.
    #[error(
        "direct simulation computes in double precision or double-double; single precision is \
            for maps"
    )]
    SingleSimulation,
    /// The direct simulation rejected its input.
    #[error(transparent)]
    Hybrid(#[from] HybridError),
    /// The region of an atlas does not fit the model.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// A setting of an atlas cannot be used.
    #[error(transparent)]
    AtlasOptions(#[from] OptionsError),
    /// A section map has too many coordinates and parameters for an atlas.
    #[error(
        "an atlas holds at most {most} coordinates and parameters that vary, and here are {found}"
    )]
    TooManyAxes {
        /// Number of coordinates and parameters that vary.
        found: usize,
        /// Most of them.
        most: usize,
    },
    /// An analysis takes no images from an atlas.
    #[error("{what} takes no images from an atlas")]
    NotTabulated {
        /// Analysis that takes none.
        what: &'static str,
    },
    /// A saved atlas does not fit the map.
    #[error(transparent)]
    Restore(#[from] RestoreError),
    /// The grazing orbit has no moment between its events.
    #[error("the grazing orbit has no moment without an event, at which a section could be")]
    NoMoment,
    /// A free flight failed.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The flow of the grazing orbit through its hits failed.
    #[error(transparent)]
    Orbit(Box<OrbitError>),
    /// An expansion failed.
    #[error(transparent)]
    Expansion(#[from] ExpansionError),
}

impl From<OrbitError> for AnalysisError {
    fn from(error: OrbitError) -> Self {
        Self::Orbit(Box::new(error))
    }
}

/// Rejects a map whose contacts are not expanded.
pub(crate) fn check_contacts(map: &LocalMap) -> Result<(), AnalysisError> {
    if map.has_contacts() { Ok(()) } else { Err(AnalysisError::NoContacts) }
}

/// Index of a parameter among the active parameters of a map.
pub(crate) fn active_place(map: &LocalMap, parameter: &str) -> Result<usize, AnalysisError> {
    let place = map.parameters.iter().position(|active| active.name == parameter);
    place.ok_or_else(|| AnalysisError::NotActive { parameter: parameter.to_owned() })
}

/// Index of a component of the state among the coordinates of a map's section.
pub(crate) fn coordinate_place(map: &LocalMap, name: &str) -> Result<usize, AnalysisError> {
    let coordinates = &map.section.coordinates;
    let place = coordinates.iter().position(|coordinate| coordinate == name);
    place.ok_or_else(|| AnalysisError::NotACoordinate {
        name: name.to_owned(),
        known: coordinates.join(", "),
    })
}

/// Checks the length of a row of numbers.
pub(crate) fn check_length(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), AnalysisError> {
    if expected == found { Ok(()) } else { Err(AnalysisError::Length { what, expected, found }) }
}
