//! Why a step of the pipeline gave no value, and results that are not what was asked for, though
//! the input was right.

use std::io;
use std::path::PathBuf;

use super::keys::KeyError;
use crate::analysis::{AnalysisError, EarlyEnd};
use crate::convergence::{ConvergenceError, Limit};
use crate::emission::EmissionError;
use crate::expansion::ExpansionError;
use crate::model::{MapOrders, SceneError};
use crate::numeric::{FloatFormat, Shown};
use crate::orbit::{CurveEnd, NotLocated, OrbitError};
use crate::report::{ReportError, limit_words};

/// Why a step gave no value: wrong input, or mathematics that [ended
/// otherwise](Error::ended_otherwise).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene with a fault.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Neither a file nor a scene of the catalogue.
    #[error(
        "no scene file `{}`, and no scene of that name in the catalogue{}",
        .path.display(), meant(.nearest)
    )]
    NoSuchScene {
        /// What was named.
        path: PathBuf,
        /// The nearest name of the catalogue.
        nearest: Option<String>,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system answered.
        source: io::Error,
    },
    /// A file that holds no orbit and no map of this format.
    #[error("{} holds no saved orbit or map: {reason}", .path.display())]
    NotSaved {
        /// The file.
        path: PathBuf,
        /// What was expected and found.
        reason: String,
    },
    /// Overrides of what is saved.
    #[error(
        "{} holds results at values that are fixed; `{key}` can be set in a scene alone",
        .path.display()
    )]
    FixedValues {
        /// The file.
        path: PathBuf,
        /// The key that was to be set.
        key: String,
    },
    /// Wrong input to the location of the orbit, or a flow that failed.
    #[error("{}{}", locating(.0), .0)]
    Orbit(#[from] OrbitError),
    /// No grazing orbit.
    #[error("no grazing orbit: {0}")]
    NotLocated(#[from] NotLocated),
    /// A name that is no parameter.
    #[error("no parameter `{name}` in the scene{}", meant(.nearest))]
    NoSuchParameter {
        /// The name.
        name: String,
        /// The nearest name of a parameter.
        nearest: Option<String>,
    },
    /// An expansion that could not be made.
    #[error("no expansion: {0}")]
    Expansion(#[from] ExpansionError),
    /// A name that listed coefficients use already.
    #[error(
        "`{name}` names a {kind} of the scene and the depth variable of the expansion; rename the \
         {kind}"
    )]
    DepthVariableName {
        /// The name.
        name: String,
        /// `state` or `parameter`.
        kind: &'static str,
    },
    /// No orders of the sweep meet the tolerance of the scene.
    #[error(
        "no orders up to those tried stay within the tolerance {tolerance:e} on the window; the \
         best, N = {}, W = {}, reach {}{}",
        .orders.smooth_order,
        .orders.contact_weight,
        .error.map_or("no finite error".to_owned(), |error| format!("{error:.1e}")),
        .limit.map_or(String::new(), |limit| format!(": {}", limit_words(limit, *.precision)))
    )]
    ToleranceNotMet {
        /// The tolerance of the scene.
        tolerance: f64,
        /// Orders of the best map.
        orders: MapOrders,
        /// Its error.
        error: Option<f64>,
        /// The numbers that it is run in.
        precision: FloatFormat,
        /// What keeps maps from the tolerance.
        limit: Option<Limit>,
    },
    /// Offsets that are not as many as the map's coordinates or parameters.
    #[error("the map has {expected} {what}, found {found}")]
    Length {
        /// `coordinates` or `parameters`.
        what: &'static str,
        /// How many the map has.
        expected: usize,
        /// How many were given.
        found: usize,
    },
    /// Numbers that are no rows of the map's length.
    #[error("expected {expected}, found {found} numbers")]
    Rows {
        /// Which rows.
        expected: String,
        /// How many numbers were given.
        found: usize,
    },
    /// A text that is no command with its keys.
    #[error("no command with its keys: {reason}")]
    NoCommand {
        /// What was expected, and where.
        reason: String,
    },
    /// Results larger than the memory of the machine.
    #[error(
        "the results take about {needed} MB of memory, and {available} MB are free; ask for fewer \
         points, starts or kept iterates"
    )]
    Memory {
        /// What they take, in MB.
        needed: u64,
        /// What is free, in MB.
        available: u64,
    },
    /// A device that is not there, or cannot be used.
    #[error("no charts on this device: {reason}; the device `cpu` gives the same charts")]
    NoDevice {
        /// What was looked for, and what was found.
        reason: String,
    },
    /// A key of a command whose value asks for nothing that there is.
    #[error(transparent)]
    Key(Box<KeyError>),
    /// A computation that ended without what was asked for.
    #[error(transparent)]
    Ended(#[from] Ended),
    /// An analysis that refused its input, or a floor below it.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A study of convergence that could not be made.
    #[error(transparent)]
    Convergence(#[from] ConvergenceError),
    /// An emission that refused the map.
    #[error(transparent)]
    Emission(#[from] EmissionError),
    /// A result that could not be laid out or written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl From<KeyError> for Error {
    fn from(error: KeyError) -> Self {
        Self::Key(Box::new(error))
    }
}

impl Error {
    /// The message with what led to it, on one line.
    pub fn with_reasons(&self) -> String {
        let mut text = self.to_string();
        let mut source = std::error::Error::source(self);
        while let Some(reason) = source {
            let more = reason.to_string();
            if !text.contains(&more) {
                text.push_str(": ");
                text.push_str(&more);
            }
            source = reason.source();
        }
        text
    }

    /// Whether the input was right and the mathematics ended without what was asked for.
    pub fn ended_otherwise(&self) -> bool {
        match self {
            Self::NotLocated(_) | Self::Orbit(OrbitError::Flow(_)) => true,
            Self::ToleranceNotMet { .. } | Self::Ended(_) => true,
            Self::Analysis(error) => of_analysis(error),
            Self::Expansion(error) => of_expansion(error),
            Self::Convergence(ConvergenceError::NoTruth { .. }) => true,
            Self::Convergence(ConvergenceError::Analysis(error)) => of_analysis(error),
            Self::Convergence(ConvergenceError::Expansion(error)) => of_expansion(error),
            _ => false,
        }
    }
}

/// What failed, where it is not what was asked for.
fn locating(error: &OrbitError) -> &'static str {
    match error {
        OrbitError::MarginParameters { .. }
        | OrbitError::MarginScale { .. }
        | OrbitError::MarginGrazes { .. }
        | OrbitError::SecondParameter { .. } => "",
        _ => "cannot locate the grazing orbit: ",
    }
}

fn of_analysis(error: &AnalysisError) -> bool {
    match error {
        AnalysisError::Flow(_) => true,
        AnalysisError::Expansion(error) => of_expansion(error),
        _ => false,
    }
}

fn of_expansion(error: &ExpansionError) -> bool {
    !matches!(error, ExpansionError::Jet(_) | ExpansionError::TooMuchWork { .. })
}

/// ` (did you mean ...?)`, or nothing.
fn meant(nearest: &Option<String>) -> String {
    let words = |name| format!(" (did you mean `{name}`?)");
    nearest.as_ref().map_or_else(String::new, words)
}

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
        "no branch with a physical orbit was found (itineraries tried: {itineraries}); another \
         range of the parameter (--from, --to), further --start or other itineraries may have some"
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
        "every orbit of the grazing curve found passes through a surface: {words}; hits beside \
         grazes are not expressible yet: use direct simulation (`branch --using direct`)"
    )]
    NoPhysicalGraze {
        /// Where the orbits pass through which surface, and how far.
        words: String,
    },
    /// A point without an image.
    #[error("row {row} has no image at iteration {iteration}: {reason}")]
    NoImage {
        /// The row of starting points, from 0.
        row: usize,
        /// The iteration, from 1.
        iteration: usize,
        /// Why, in words.
        reason: String,
    },
}
