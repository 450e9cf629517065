//! How a command can fail, and the exit code that says so.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use miette::{GraphicalReportHandler, GraphicalTheme};

use super::output::note;
use crate::expansion::ExpansionError;
use crate::model::{SceneError, SceneHeadline};
use crate::orbit::{NotLocated, OrbitError};
use crate::report::ReportError;

/// Exit code of mathematics that ended otherwise.
const ENDED_OTHERWISE: u8 = 1;
/// Exit code of wrong input.
const WRONG_INPUT: u8 = 2;

/// Why a command ended without doing what it was asked.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    /// A scene with a fault.
    #[error(transparent)]
    Scene(Box<SceneHeadline>),
    /// Neither a file nor a scene of the catalogue.
    #[error("no scene file `{}`, and no scene of that name in the catalogue{}", .path.display(), meant(.nearest))]
    NoSuchScene {
        path: PathBuf,
        nearest: Option<String>,
    },
    /// No such scene in the catalogue.
    #[error("no scene `{name}` in the catalogue{}; `grazemap new --list` shows it", meant(.nearest))]
    NotInCatalogue {
        name: String,
        nearest: Option<String>,
    },
    /// A file that would be overwritten.
    #[error("`{}` exists and is not overwritten; name another file with -o", .path.display())]
    Exists { path: PathBuf },
    /// A command without a table was asked for one.
    #[error("`grazemap {command}` has no table; use --json")]
    NoTable { command: &'static str },
    /// A name that the output already uses.
    #[error(
        "`{name}` names a {kind} of the scene and the depth variable of the expansion; rename the {kind}"
    )]
    DepthVariableName { name: String, kind: &'static str },
    /// Wrong input to the location of the orbit, or a flow that failed.
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    /// No grazing orbit.
    #[error("no grazing orbit: {0}")]
    NotLocated(#[from] NotLocated),
    /// An expansion that could not be made.
    #[error("no expansion: {0}")]
    Expansion(#[from] ExpansionError),
    /// A result that could not be laid out or written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// Standard output refused.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(io::Error),
    /// No threads.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl CliError {
    /// 1: the mathematics ended otherwise; 2: wrong input.
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::NotLocated(_) | Self::Orbit(OrbitError::Flow(_)) => ENDED_OTHERWISE,
            Self::Expansion(error) => expansion_code(error),
            _ => WRONG_INPUT,
        }
    }

    /// Says the error on standard error, a scene's fault drawn in its text.
    pub(super) fn show(&self) {
        match self {
            Self::Scene(headline) => note(drawn(headline).trim_end()),
            other => note(&format!("error: {}", chain(other))),
        }
    }
}

impl From<SceneError> for CliError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error.headline()))
    }
}

fn expansion_code(error: &ExpansionError) -> u8 {
    match error {
        ExpansionError::Jet(_)
        | ExpansionError::CompliantSurface { .. }
        | ExpansionError::SeveralPassages { .. } => WRONG_INPUT,
        _ => ENDED_OTHERWISE,
    }
}

/// ` (did you mean ...?)`, or nothing.
fn meant(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// A fault drawn in the text of its scene; colours only on a terminal.
fn drawn(headline: &SceneHeadline) -> String {
    let theme = if io::stderr().is_terminal() {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(120)
        .with_context_lines(1);
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
