//! What can be wrong with a scene, and where in its file.

use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use super::problem::SceneProblem;

/// A fault of a scene, pointing into its file where it has a place there.
///
/// Its `Display` is one line, `file:line:column: message (label)`. As a [`miette::Diagnostic`] it
/// carries the text of the file and the labelled bytes; [`headline`](SceneError::headline) is the
/// same diagnostic under a plain message, for graphical rendering.
#[derive(Clone, Debug)]
pub struct SceneError(Box<Located>);

#[derive(Clone, Debug)]
struct Located {
    problem: SceneProblem,
    source: NamedSource<String>,
    span: Option<Range<usize>>,
}

/// A [`SceneError`] whose `Display` is the message alone.
#[derive(Clone, Debug, Error)]
#[error("{}", .0.problem())]
pub struct SceneHeadline(SceneError);

/// A fault with its bytes in the text, the file not yet named.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub(super) problem: Box<SceneProblem>,
    pub(super) span: Option<Range<usize>>,
}

/// The outcome of reading a part of a scene.
pub(super) type Checked<T> = Result<T, Fault>;

impl Fault {
    /// A fault at `span`.
    pub(super) fn at(span: Range<usize>, problem: SceneProblem) -> Self {
        Self {
            problem: Box::new(problem),
            span: Some(span),
        }
    }

    /// A fault that has no place in the text.
    pub(super) fn nowhere(problem: SceneProblem) -> Self {
        Self {
            problem: Box::new(problem),
            span: None,
        }
    }

    /// The error once the file is known.
    pub(super) fn in_file(self, file_name: &str, text: &str) -> SceneError {
        let span = self
            .span
            .map(|span| span.start.min(text.len())..span.end.min(text.len()));
        let source = NamedSource::new(file_name, text.to_owned()).with_language("TOML");
        SceneError(Box::new(Located {
            problem: *self.problem,
            source,
            span,
        }))
    }
}

impl SceneError {
    /// What is wrong.
    pub fn problem(&self) -> &SceneProblem {
        &self.0.problem
    }

    /// Name of the file, as it was given.
    pub fn file_name(&self) -> &str {
        self.0.source.name()
    }

    /// Line and column of the fault, both from 1, columns in characters.
    pub fn position(&self) -> Option<(usize, usize)> {
        let start = self.0.span.as_ref()?.start;
        let before = self.0.source.inner().get(..start)?;
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = before.matches('\n').count() + 1;
        Some((line, before[line_start..].chars().count() + 1))
    }

    /// The same diagnostic under the message alone, the place being drawn below it.
    pub fn headline(self) -> SceneHeadline {
        SceneHeadline(self)
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file_name())?;
        if let Some((line, column)) = self.position() {
            write!(f, "{line}:{column}:")?;
        }
        write!(f, " {}", self.0.problem)?;
        match self.0.problem.label() {
            Some(label) => write!(f, " ({label})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0
            .span
            .as_ref()
            .map(|_| &self.0.source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.0.span.clone()?;
        let label = self.0.problem.label().unwrap_or_else(|| "here".to_owned());
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(
            Some(label),
            span,
        ))))
    }
}

impl Diagnostic for SceneHeadline {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.0.labels()
    }
}
