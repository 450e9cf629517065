//! Results that are not what was asked for, though the input was right.

use crate::analysis::{DirectEnd, EarlyEnd};
use crate::numeric::Shown;
use crate::orbit::CurveEnd;

/// How a computation ended without what was asked for.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Ended {
    /// No orbit of the itineraries asked for.
    #[error(
        "no periodic orbit was found (parameter values tried: {at}), which says nothing beyond \
         what was searched: {searched}"
    )]
    NoOrbits {
        /// Values of the parameters that were tried.
        at: usize,
        /// What was searched.
        searched: String,
    },
    /// No locus of them.
    #[error(
        "no {kinds} of a physical orbit was found, which says nothing beyond what was searched: \
         {searched}"
    )]
    NoLoci {
        /// What was looked for.
        kinds: String,
        /// What was searched.
        searched: String,
    },
    /// No branch of the itineraries asked for.
    #[error(
        "no branch with a physical orbit was found (itineraries tried: {itineraries}); a wider \
         range of the parameter (--from, --to) or other itineraries may have some"
    )]
    NoBranch {
        /// How many itineraries were tried.
        itineraries: usize,
    },
    /// A simulation that did not last as long as was asked.
    #[error("the trajectory ends at t = {}: {}", Shown(.0.time), .0.reason)]
    Trajectory(EarlyEnd),
    /// A grazing curve that ended before its goal.
    #[error(
        "the grazing curve did not reach {parameter} = {}: {end}; its last point is at \
         {parameter} = {}",
        Shown(*goal),
        Shown(*last)
    )]
    Curve {
        /// The parameter that it was followed in.
        parameter: String,
        /// The value that was asked for.
        goal: f64,
        /// The value of its last point.
        last: f64,
        /// Why it ended.
        end: CurveEnd,
    },
    /// A grazing curve that is not one of the oscillator with its stops.
    #[error(
        "every orbit of the grazing curve found goes through a surface elsewhere: it is not one \
         of the oscillator with its stops; another `guess` or `grazing.passages` may name one"
    )]
    NoPhysicalGraze,
    /// A point without an image.
    #[error("row {row} has no image at iteration {iteration}: {}", imageless(.end))]
    NoImage {
        /// The row of starting points, from 0.
        row: usize,
        /// The iteration, from 1.
        iteration: usize,
        /// How its direct simulation ended.
        end: Option<DirectEnd>,
    },
}

/// How a point came to have no image.
fn imageless(end: &Option<DirectEnd>) -> &'static str {
    match end {
        Some(DirectEnd::NoReturn) => "no section point within three return times",
        Some(DirectEnd::Penetrating) => "it is beyond the surface, and no free flight leads there",
        Some(DirectEnd::Ambiguous) => {
            "its section falls inside a contact that the coordinates do not tell; choose another \
             `section.phase`, at which nothing is in contact"
        }
        Some(DirectEnd::HeldTwice) => {
            "two surfaces hold the state at once, and the model has no field for both"
        }
        Some(DirectEnd::Ended) => "the simulation ended before the section",
        Some(DirectEnd::Returned) | None => "it is not finite",
    }
}
