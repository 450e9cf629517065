//! How a command can fail, and the exit code that says so.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use miette::{GraphicalReportHandler, GraphicalTheme};

use super::{Destination, note};
use grazemap::Error;
use grazemap::analysis::periodic::ItineraryError;
use grazemap::analysis::{DirectEnd, EarlyEnd};
use grazemap::model::SceneHeadline;
use grazemap::numeric::{INSTRUCTION_LIMIT, Shown};
use grazemap::orbit::CurveEnd;
use grazemap::report::ReportError;

/// Exit code of mathematics that ended otherwise.
const ENDED_OTHERWISE: u8 = 1;
/// Exit code of wrong input.
const WRONG_INPUT: u8 = 2;

/// Why a command ended without doing what it was asked.
#[derive(Debug, thiserror::Error)]
pub(in crate::cli) enum CliError {
    /// The library refused its input, or the mathematics ended otherwise.
    #[error(transparent)]
    Library(#[from] Error),
    /// No such scene in the catalogue.
    #[error(
        "no scene `{name}` in the catalogue{}; `grazemap new --list` shows it",
        meant(.nearest)
    )]
    NotInCatalogue { name: String, nearest: Option<String> },
    /// A file that would be overwritten.
    #[error("`{}` exists and is not overwritten; name another file with -o", .path.display())]
    Exists { path: PathBuf },
    /// A command without a table was asked for one.
    #[error("`grazemap {command}` has no table; use --json")]
    NoTable { command: &'static str },
    /// JSON and table in one place, where one would be lost.
    #[error("--json and --csv both write to {place}; name another place for one of them")]
    OnePlace { place: Destination },
    /// A folder that does not hold what would be emitted now.
    #[error("{} is not what would be emitted now:{differences}", .folder.display())]
    NotCurrent { folder: PathBuf, differences: String },
    /// A second parameter that is the first one.
    #[error("`{name}` is already adjusted so that the orbit grazes; continue in another parameter")]
    AlreadyAdjusted { name: String },
    /// A scale of a parameter that does not change.
    #[error("--scale names `{name}`, which is no parameter of --nearest")]
    NotNearest { name: String },
    /// A grazing curve that is not one of the oscillator with its stops.
    #[error(
        "every orbit of the grazing curve found goes through a surface elsewhere: it is not one \
         of the oscillator with its stops; another `guess` or `grazing.passages` may name one"
    )]
    NoPhysicalGraze,
    /// An end of a range that is no finite number.
    #[error("{flag} must be a finite number, found {value}")]
    NotFinite { flag: &'static str, value: f64 },
    /// A grazing curve that ended before its goal.
    #[error(
        "the grazing curve did not reach {parameter} = {}: {end}; its last point is at \
         {parameter} = {}",
        Shown(*goal),
        Shown(*last)
    )]
    CurveEnded { parameter: String, goal: f64, last: f64, end: CurveEnd },
    /// A name that is none of those known; what it would have to be, and what those known are.
    #[error(
        "{flag}: {} `{}`{}; {} are {known}",
        .kind[0], .name.escape_default(), meant(.nearest), .kind[1]
    )]
    UnknownName {
        flag: &'static str,
        kind: [&'static str; 2],
        name: String,
        nearest: Option<String>,
        known: String,
    },
    /// A parameter named twice.
    #[error("{flag} names `{name}` twice")]
    NamedTwice { flag: &'static str, name: String },
    /// More parameters than a locus has.
    #[error(
        "--in takes two parameters; of `orbits` also one, the one that is solved for; found {found}"
    )]
    NotAPlane { found: usize },
    /// Another number of axes, or of numbers of cells, than a plane has.
    #[error("a basin has two axes; found {found}")]
    NotTwoAxes { found: usize },
    /// Several basins for one file or stream.
    #[error("the scene asks for {found} basins, and --json and --csv write one; -o DIR writes all")]
    SeveralBasins { found: usize },
    /// A range along what is no axis.
    #[error("--range names `{name}`, which is no axis of the basin; name it in --axes")]
    NoAxis { name: String },
    /// A map without parameters.
    #[error("the map has no parameter; name some in `expansion.active`")]
    NoParameter,
    /// No itinerary, or not of this scene.
    #[error(transparent)]
    Itinerary(#[from] ItineraryError),
    /// No orbit of the itineraries asked for.
    #[error(
        "no periodic orbit was found (parameter values tried: {at}), which says nothing beyond \
         what was searched: {searched}"
    )]
    NoOrbits { at: usize, searched: String },
    /// No fold or flip of them.
    #[error(
        "no {kinds} of a physical orbit was found, which says nothing beyond what was searched: \
         {searched}"
    )]
    NoLoci { kinds: String, searched: String },
    /// No branch of the itineraries asked for.
    #[error(
        "no branch with a physical orbit was found (itineraries tried: {itineraries}); a wider \
         range of the parameter (--from, --to) or other itineraries may have some"
    )]
    NoBranch { itineraries: usize },
    /// A simulation that did not last as long as was asked.
    #[error("the trajectory ends at t = {}: {}", Shown(.0.time), .0.reason)]
    TrajectoryEnded(EarlyEnd),
    /// No diagram in the scene.
    #[error("the scene asks for no diagram; add a [[diagram]] table")]
    NoDiagram,
    /// Results larger than the memory of the machine.
    #[error(
        "the results take about {needed} MB of memory, and {available} MB are free; ask for fewer \
         points, starts or kept iterates"
    )]
    Memory { needed: u64, available: u64 },
    /// No chart in the scene.
    #[error("the scene asks for no chart; add a [[chart]] table with `parameters` and `ranges`")]
    NoChart,
    /// Scene and starting points in one input.
    #[error("SCENE and --states are both standard input; name a file for one of them")]
    StandardInputTwice,
    /// A file of starting points that cannot be read.
    #[error("cannot read the starting points {}: {source}", .path.display())]
    UnreadableStates { path: PathBuf, source: csv::Error },
    /// A file of starting points without rows.
    #[error(
        "no starting points in {}: a header and at least one row are expected",
        .path.display()
    )]
    NoStates { path: PathBuf },
    /// Too many starting points.
    #[error("more than {limit} starting points in {}", .path.display())]
    TooManyStates { path: PathBuf, limit: usize },
    /// A column that is nothing of the map.
    #[error(
        "unknown column `{}` in {}; expected some of {known}: coordinates of {section} and \
         active parameters",
        .name.escape_default(), .path.display()
    )]
    UnknownColumn { path: PathBuf, name: String, known: String, section: String },
    /// A column that stands twice.
    #[error("column `{}` stands twice in {}", .name.escape_default(), .path.display())]
    ColumnTwice { path: PathBuf, name: String },
    /// A cell that is no number.
    #[error(
        "`{}` in line {line} of {} is no finite decimal number",
        .text.escape_default(), .path.display()
    )]
    NotANumber { path: PathBuf, line: u64, text: String },
    /// A point without an image.
    #[error("row {row} has no image at iteration {iteration}: {}", ended(.end))]
    NoImage { row: usize, iteration: usize, end: Option<DirectEnd> },
    /// No such entry in the gallery.
    #[error(
        "no entry `{name}` in the gallery{}; `grazemap gallery --list` shows it",
        meant(.nearest)
    )]
    NotInGallery { name: String, nearest: Option<String> },
    /// An entry of the gallery that cannot be read.
    #[error("the gallery: {0}")]
    Gallery(String),
    /// Numbers of the gallery that differ from what was expected.
    #[error("the gallery differs from what it says: {what}")]
    Unexplained { what: String },
    /// A result that could not be laid out or written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// An environment variable with a value that is not known.
    #[error("{INSTRUCTION_LIMIT} is `{}`; expected sse2, avx2 or avx512", .value.escape_default())]
    InstructionLimit { value: String },
    /// Standard output refused.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(io::Error),
    /// No threads.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl CliError {
    /// 1: the mathematics ended otherwise; 2: wrong input.
    pub(in crate::cli) fn exit_code(&self) -> u8 {
        match self {
            Self::Library(error) if error.ended_otherwise() => ENDED_OTHERWISE,
            Self::CurveEnded { .. }
            | Self::NoImage { .. }
            | Self::NoOrbits { .. }
            | Self::NoBranch { .. }
            | Self::NoLoci { .. }
            | Self::TrajectoryEnded(_)
            | Self::NoPhysicalGraze
            | Self::Unexplained { .. }
            | Self::NotCurrent { .. } => ENDED_OTHERWISE,
            _ => WRONG_INPUT,
        }
    }

    /// Says the error on standard error, a scene's fault drawn in its text.
    pub(in crate::cli) fn show(&self) {
        match self {
            Self::Library(Error::Scene(error)) => note(drawn(&error.clone().headline()).trim_end()),
            other => note(&format!("error: {}", chain(other))),
        }
    }
}

/// ` (did you mean ...?)`, or nothing.
fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// How a point came to have no image.
fn ended(end: &Option<DirectEnd>) -> &'static str {
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

/// A fault drawn in the text of its scene; colours only on a terminal.
fn drawn(headline: &SceneHeadline) -> String {
    let mut theme = if io::stderr().is_terminal() {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    theme.characters.error = "error:".to_owned();
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).with_width(120).with_context_lines(1);
    match handler.render_report(&mut text, headline) {
        Ok(()) => text,
        Err(_) => format!("error: {headline}"),
    }
}

/// An error and its causes, each said once.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let said = inner.to_string();
        if !text.contains(&said) {
            text = format!("{text}: {said}");
        }
        cause = inner.source();
    }
    text
}
