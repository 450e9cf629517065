//! Commands of the program, with their keys as text; and runs.

use std::path::PathBuf;

use grazemap::analysis::{Joining, Progress};
use grazemap::pipeline::{Command, RunWatch, Source, run};
use grazemap::report::PictureForm;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::background::compute;
use crate::error::exception;
use crate::map::Map;
use crate::result::Computed;
use crate::scene::{Graze, Scene};
use crate::share::{joined, share};

/// Input of a command.
#[derive(FromPyObject)]
pub(crate) enum Held<'py> {
    Map(PyRef<'py, Map>),
    Graze(PyRef<'py, Graze>),
    Scene(PyRef<'py, Scene>),
}

impl Held<'_> {
    fn source(&self) -> Source {
        match self {
            Self::Map(map) => Source::Map(map.0.clone()),
            Self::Graze(graze) => Source::Graze(graze.0.clone()),
            Self::Scene(scene) => Source::Scene(Box::new(scene.0.clone())),
        }
    }
}

/// Result of a command, which is given as a JSON object with its name and keys; without a source,
/// that of a command that needs none. Pieces found by shares are not computed again.
#[pyfunction]
#[pyo3(signature = (source, command, progress=None, shares=Vec::new()))]
pub(crate) fn answer(
    py: Python<'_>,
    source: Option<Held<'_>>,
    command: &str,
    progress: Option<&Bound<'_, PyAny>>,
    shares: Vec<Vec<u8>>,
) -> PyResult<Computed> {
    let command = Command::from_json(command).map_err(|error| exception(py, &error))?;
    let (source, pieces) = (source.map(|held| held.source()), joined(&shares)?);
    compute(py, progress, move |progress| {
        let progress = Joining::new(progress, pieces);
        Ok(Computed::of(match source {
            Some(source) => command.answer(source, &progress)?,
            None => command.answer_alone(&progress)?,
        }))
    })
}

/// Pieces found by share `number` of `of` (from 1) of a command.
#[pyfunction]
pub(crate) fn answer_share<'py>(
    py: Python<'py>,
    source: Held<'_>,
    command: &str,
    number: usize,
    of: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    let command = Command::from_json(command).map_err(|error| exception(py, &error))?;
    let source = source.source();
    share(py, (number, of), move |shard| command.share(source, shard))
}

/// Computes everything that a scene asks for and writes it into a folder.
#[pyfunction]
#[pyo3(signature = (source, folder, progress=None))]
pub(crate) fn report(
    py: Python<'_>,
    source: Held<'_>,
    folder: PathBuf,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let source = source.source();
    compute(py, progress, move |progress| {
        run(source, folder, PictureForm::default(), &Told(progress))
    })
}

/// Observer of a run that reports to one progress.
struct Told<'a>(&'a dyn Progress);

impl RunWatch for Told<'_> {
    fn progress(&self, _heading: &'static str, _number: u64) -> Box<dyn Progress + '_> {
        Box::new(Self(self.0))
    }
}

impl Progress for Told<'_> {
    fn expect(&self, total: u64) {
        self.0.expect(total);
    }

    fn advance(&self, units: u64) {
        self.0.advance(units);
    }
}
