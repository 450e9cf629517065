//! Errors of the pipeline, and computations that ended without a result although their input was
//! right.

use std::io;
use std::path::PathBuf;

use super::keys::KeyError;
use crate::analysis::branches::BranchLabel;
use crate::analysis::soft_stop::NoDirection;
use crate::analysis::{AnalysisError, EarlyEnd};
use crate::convergence::{ConvergenceError, Limit};
use crate::emission::EmissionError;
use crate::expansion::{ExpansionError, SidesError};
use crate::model::{Digest, MapOrders, SceneError};
use crate::numeric::{FloatFormat, Shown};
use crate::orbit::{CurveEnd, DerivativesError, NotLocated, OrbitError};
use crate::report::{ReportError, limit_words};

/// Error of a step: wrong input, or a computation that [ended without a
/// result](Error::ended_otherwise).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene has a fault.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The name is neither a file nor a scene of the catalogue.
    #[error(
        "no scene file `{}`, and no scene of that name in the catalogue{}",
        .path.display(), meant(.nearest)
    )]
    NoSuchScene {
        /// Path or name given.
        path: PathBuf,
        /// Nearest name in the catalogue.
        nearest: Option<String>,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file does not hold an orbit or a map of this format.
    #[error("{} holds no saved orbit or map: {reason}", .path.display())]
    NotSaved {
        /// Path of the file.
        path: PathBuf,
        /// Expected and found content.
        reason: String,
    },
    /// The file does not hold an atlas of the scene.
    #[error("{} holds no atlas of this scene: {reason}", .path.display())]
    NotAnAtlas {
        /// Path of the file.
        path: PathBuf,
        /// Expected and found content.
        reason: String,
    },
    /// Overrides were given for saved results.
    #[error(
        "{} holds results at values that are fixed; `{key}` can be set in a scene alone",
        .path.display()
    )]
    FixedValues {
        /// Path of the file.
        path: PathBuf,
        /// Key of the override.
        key: String,
    },
    /// No grazing orbit is searched for from a point of a document.
    #[error("{}: {reason}", .path.display())]
    BranchPlace {
        /// Path of the document.
        path: PathBuf,
        /// Reason.
        reason: Box<BranchPlaceError>,
    },
    /// The input of the orbit search is wrong, or the flow failed.
    #[error("{}{}", locating(.0), .0)]
    Orbit(#[from] OrbitError),
    /// A trajectory has no derivatives.
    #[error(transparent)]
    Derivatives(Box<DerivativesError>),
    /// A trajectory that grazes has no series on the sides of its graze.
    #[error(transparent)]
    Sides(Box<SidesError>),
    /// The stop of a scene pushes nothing.
    #[error(transparent)]
    StopDirection(#[from] NoDirection),
    /// There is no grazing orbit.
    #[error("no grazing orbit: {0}")]
    NotLocated(#[from] NotLocated),
    /// The scene has no parameter of this name.
    #[error("no parameter `{name}` in the scene{}", meant(.nearest))]
    NoSuchParameter {
        /// Name given.
        name: String,
        /// Nearest name of a parameter.
        nearest: Option<String>,
    },
    /// The map could not be expanded.
    #[error("no expansion: {0}")]
    Expansion(#[from] ExpansionError),
    /// A variable of the scene has the name of a depth variable.
    #[error(
        "`{name}` names a {kind} of the scene and the depth variable of the expansion; rename the \
         {kind}"
    )]
    DepthVariableName {
        /// Name of the variable.
        name: String,
        /// `state` or `parameter`.
        kind: &'static str,
    },
    /// No orders of the sweep meet the scene's tolerance.
    #[error(
        "no orders up to those tried stay within the tolerance {tolerance:e} on the window; the \
         best, N = {}, W = {}, reach {}{}",
        .orders.smooth_order,
        .orders.contact_weight,
        .error.map_or("no finite error".to_owned(), |error| format!("{error:.1e}")),
        .limit.map_or(String::new(), |limit| format!(": {}", limit_words(limit, *.precision)))
    )]
    ToleranceNotMet {
        /// Tolerance of the scene.
        tolerance: f64,
        /// Orders of the best map.
        orders: MapOrders,
        /// Largest error of the best map on the sample of its window; `None` if it is not finite.
        error: Option<f64>,
        /// Number format of the best map.
        precision: FloatFormat,
        /// Cause that keeps the maps from the tolerance.
        limit: Option<Limit>,
    },
    /// The number of offsets differs from the map's number of coordinates or parameters.
    #[error("the map has {expected} {what}, found {found}")]
    Length {
        /// `coordinates` or `parameters`.
        what: &'static str,
        /// Number expected.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// The length of an array is not a whole number of rows.
    #[error("expected {expected}, found {found} numbers")]
    Rows {
        /// Description of the rows.
        expected: String,
        /// Length given.
        found: usize,
    },
    /// The text is not a command with its keys.
    #[error("no command with its keys: {reason}")]
    NoCommand {
        /// Expected content and place of the fault.
        reason: String,
    },
    /// The results exceed the memory of the machine.
    #[error(
        "the results take about {needed} MB of memory, and {available} MB are free; ask for fewer \
         points, starts or kept iterates"
    )]
    Memory {
        /// Memory needed, in MB.
        needed: u64,
        /// Free memory, in MB.
        available: u64,
    },
    /// The device is absent or unusable.
    #[error("no charts on this device: {reason}; the device `cpu` gives the same charts")]
    NoDevice {
        /// Device looked for, and what was found.
        reason: String,
    },
    /// A key of a command has an invalid value.
    #[error(transparent)]
    Key(Box<KeyError>),
    /// The computation ended without the result that was asked for.
    #[error(transparent)]
    Ended(#[from] Ended),
    /// An analysis, or a lower floor, refused its input.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The convergence study failed.
    #[error(transparent)]
    Convergence(#[from] ConvergenceError),
    /// The emission refused the map.
    #[error(transparent)]
    Emission(#[from] EmissionError),
    /// A result could not be laid out or written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl From<KeyError> for Error {
    fn from(error: KeyError) -> Self {
        Self::Key(Box::new(error))
    }
}

impl From<SidesError> for Error {
    fn from(error: SidesError) -> Self {
        match error {
            SidesError::Derivatives(error) => error.into(),
            SidesError::Expansion(error) => error.into(),
            error => Self::Sides(Box::new(error)),
        }
    }
}

impl From<DerivativesError> for Error {
    fn from(error: DerivativesError) -> Self {
        Self::Derivatives(Box::new(error))
    }
}

impl Error {
    /// Message with its causes, on one line.
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

    /// Whether the input was right, but the computation ended without a result.
    pub fn ended_otherwise(&self) -> bool {
        match self {
            Self::NotLocated(_) | Self::Orbit(OrbitError::Flow(_)) => true,
            Self::Derivatives(error) => error.ended_otherwise(),
            Self::Sides(_) => true,
            Self::BranchPlace { reason, .. } => reason.ended_otherwise(),
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

/// Start of the message: names the step that failed, unless the error concerns options.
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

/// ` (did you mean ...?)`, or the empty text.
fn meant(nearest: &Option<String>) -> String {
    let words = |name| format!(" (did you mean `{name}`?)");
    nearest.as_ref().map_or_else(String::new, words)
}

/// Outcome of a computation that ended without the result that was asked for.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Ended {
    /// No periodic orbit has one of the itineraries.
    #[error(
        "no periodic orbit was found (parameter values tried: {at}), which says nothing beyond \
         what was searched: {searched}"
    )]
    NoOrbits {
        /// Number of parameter values tried.
        at: usize,
        /// Description of the search.
        searched: String,
    },
    /// No locus of a physical orbit was found.
    #[error(
        "no {kinds} of a physical orbit was found, which says nothing beyond what was searched: \
         {searched}"
    )]
    NoLoci {
        /// Kinds of loci looked for.
        kinds: String,
        /// Description of the search.
        searched: String,
    },
    /// No branch has a physical orbit of the itineraries.
    #[error(
        "no branch with a physical orbit was found (itineraries tried: {itineraries}); another \
         range of the parameter, further starts or other itineraries may have some"
    )]
    NoBranch {
        /// Number of itineraries tried.
        itineraries: usize,
    },
    /// A simulation ended before the time asked for.
    #[error("the trajectory ends at t = {}: {}", Shown(.0.time), .0.reason)]
    Trajectory(EarlyEnd),
    /// A grazing curve ended before its goal.
    #[error(
        "the grazing curve did not reach {parameter} = {}: {end}; its last point is at \
         {parameter} = {}",
        Shown(*goal),
        Shown(*last)
    )]
    Curve {
        /// Parameter along which the curve was followed.
        parameter: String,
        /// Value asked for.
        goal: f64,
        /// Value at the last point.
        last: f64,
        /// Reason for the end.
        end: CurveEnd,
    },
    /// All orbits of the grazing curve pass through a surface.
    #[error(
        "every orbit of the grazing curve found passes through a surface: {words}; name the \
         surfaces that the orbit hits in [grazing]: `hits = [...]`"
    )]
    NoPhysicalGraze {
        /// Penetration of the orbits: surface, place and depth.
        words: String,
    },
    /// A point has no image.
    #[error("row {row} has no image at iteration {iteration}: {reason}")]
    NoImage {
        /// Row of the starting point, from 0.
        row: usize,
        /// Iteration, from 1.
        iteration: usize,
        /// Reason.
        reason: String,
    },
}

/// Reason why no grazing orbit is searched for from a point of a document.
#[derive(Clone, Debug, thiserror::Error)]
pub enum BranchPlaceError {
    /// The file is no branch document.
    #[error("expected the JSON document of `branch`: {reason}")]
    NotBranches {
        /// Expected and found content.
        reason: String,
    },
    /// The branches are those of another scene, or of other values.
    #[error(
        "its branches are those of a scene `{name}` with the digest {found}; that of this scene, \
         with what was set in it, is {expected}"
    )]
    OtherScene {
        /// Name of the document's scene.
        name: String,
        /// Digest in the document.
        found: Digest,
        /// Digest of the scene.
        expected: Digest,
    },
    /// The document has no special point of this number.
    #[error("no special point {number}: it has {count}, numbered from 1")]
    NoSuchPoint {
        /// Number asked for.
        number: usize,
        /// Number of special points.
        count: usize,
    },
    /// The special point is no graze.
    #[error(
        "special point {number} is a {}, not a graze (GR); {}",
        .label.letters(), grazes_words(.grazes)
    )]
    NotAGraze {
        /// Number asked for.
        number: usize,
        /// Kind of the point.
        label: BranchLabel,
        /// Numbers of the grazes of the document.
        grazes: Vec<usize>,
    },
    /// Several passages graze at the point.
    #[error(
        "at special point {number} {grazes} passages graze at once; `passages` and as many \
         parameters in `solve_for` describe such an orbit"
    )]
    SeveralGrazes {
        /// Number asked for.
        number: usize,
        /// Number of passages that graze.
        grazes: usize,
    },
    /// The orbit of the point is no motion of the oscillator.
    #[error("special point {number} is virtual: contacts of its itinerary are not made")]
    Virtual {
        /// Number asked for.
        number: usize,
    },
    /// The orbit takes several returns, and no forcing period tells how long that is.
    #[error(
        "the orbit of special point {number} takes {returns} returns, and the scene has no phase: \
         only orbits of one return are located"
    )]
    SeveralReturns {
        /// Number asked for.
        number: usize,
        /// Number of returns.
        returns: usize,
    },
    /// Direct simulation of the orbit ends early.
    #[error(
        "the orbit of special point {number} ends at t = {}: {}",
        Shown(.end.time), .end.reason
    )]
    EndsEarly {
        /// Number asked for.
        number: usize,
        /// End of the simulation.
        end: EarlyEnd,
    },
    /// The orbit hits the surface that it grazes for too short a time.
    #[error(
        "the orbit of special point {number} also hits `{surface}`, which it grazes, at the speed \
         {}: it stays beyond it for {}, and less than {} counts as a graze",
        Shown(*.speed), Shown(*.stay), Shown(*.least)
    )]
    BriefHit {
        /// Number asked for.
        number: usize,
        /// Name of the surface.
        surface: String,
        /// Normal velocity at which the surface is met.
        speed: f64,
        /// Time that the free flow would stay beyond the surface.
        stay: f64,
        /// Shortest stay of a hit.
        least: f64,
    },
}

impl BranchPlaceError {
    /// Whether the input was right, but the point is one of an orbit that cannot be located.
    fn ended_otherwise(&self) -> bool {
        matches!(self, Self::EndsEarly { .. } | Self::BriefHit { .. })
    }
}

/// Words for the numbers of a document's grazes.
fn grazes_words(grazes: &[usize]) -> String {
    let numbers: Vec<String> = grazes.iter().map(ToString::to_string).collect();
    match numbers.len() {
        0 => "it has none".to_owned(),
        _ => format!("its grazes have the numbers {}", numbers.join(", ")),
    }
}
