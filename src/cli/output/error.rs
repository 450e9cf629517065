//! How a command can fail, and the exit code that says so.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use miette::{GraphicalReportHandler, GraphicalTheme};

use super::{Destination, note};
use grazemap::Error;
use grazemap::model::SceneHeadline;
use grazemap::numeric::INSTRUCTION_LIMIT;
use grazemap::report::{ReportError, ShardError};

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
    /// Several basins for one file or stream.
    #[error("the scene asks for {found} basins, and --json and --csv write one; -o DIR writes all")]
    SeveralBasins { found: usize },
    /// No diagram in the scene.
    #[error("the scene asks for no diagram; add a [[diagram]] table")]
    NoDiagram,
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
    /// Results asked of a shard.
    #[error(
        "a shard has pieces alone, which go into -o DIR; ask `grazemap merge` for --json, --csv"
    )]
    ShardHasNoResults,
    /// Files of pieces that cannot be joined.
    #[error(transparent)]
    Shards(#[from] ShardError),
    /// The program cannot read itself.
    #[error("cannot read this very program, which pieces are marked with: {0}")]
    Program(io::Error),
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
            Self::Unexplained { .. } | Self::NotCurrent { .. } => ENDED_OTHERWISE,
            _ => WRONG_INPUT,
        }
    }

    /// Says the error on standard error, a scene's fault drawn in its text.
    pub(in crate::cli) fn show(&self) {
        match self {
            Self::Library(Error::Scene(error)) => note(drawn(&error.clone().headline()).trim_end()),
            // A key of a command is an option here.
            Self::Library(Error::Key(error)) if error.begins_with_key() => {
                note(&format!("error: --{error}"));
            }
            other => note(&format!("error: {}", chain(other))),
        }
    }
}

/// ` (did you mean ...?)`, or nothing.
fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
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
