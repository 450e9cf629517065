//! Local maps: images of arrays of points, and diagrams, charts and basins.

use std::path::PathBuf;

use grazemap::Error;
use grazemap::analysis::basin::Basin;
use grazemap::analysis::{Joining, Precision, Progress, Using};
use grazemap::emission::{EmittedCrate, Target};
use grazemap::expansion::MapWindow;
use grazemap::iteration::Batch;
use grazemap::pipeline::{self, Device, EmitRequest, write_emitted};
use grazemap::report::{
    Rows, basin_figure, basin_rows, basin_warnings, chart_figure, chart_rows, chart_warnings,
    diagram_figures, diagram_rows, diagram_warnings, to_json,
};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::background::{compute, compute_borrowing};
use crate::error::exception;
use crate::result::Computed;
use crate::scene::Graze;
use crate::share::{joined, share};

/// Largest number of values whose images are computed without a thread of their own.
const AT_ONCE: usize = 100_000;

/// Rows of doubles.
type Points<'py> = PyReadonlyArray2<'py, f64>;

/// Local map.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Map(pub(crate) grazemap::Map);

#[pymethods]
impl Map {
    /// Reads a map from its JSON document.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        grazemap::Map::from_json(text).map(Self).map_err(|error| exception(py, &error))
    }

    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        self.0.to_json().map_err(|error| exception(py, &error))
    }

    #[getter]
    fn graze(&self) -> Graze {
        Graze(self.0.settled().graze().clone())
    }

    /// Names of the section's coordinates.
    #[getter]
    fn coordinates(&self) -> Vec<String> {
        self.0.section().coordinates.to_vec()
    }

    /// Names of the active parameters.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.0.local().parameters.iter().map(|parameter| parameter.name.clone()).collect()
    }

    /// Number of passages, smooth order, contact weight.
    #[getter]
    fn orders(&self) -> (usize, u32, u32) {
        let orders = self.0.orders();
        (self.0.local().passages(), orders.smooth_order, orders.contact_weight)
    }

    /// Bounds of the window: depth, half-widths of coordinates, half-widths of parameters.
    #[getter]
    fn window(&self) -> (f64, Vec<f64>, Vec<f64>) {
        let MapWindow { depth, state, parameter } = self.0.local().window.clone();
        (depth, state, parameter)
    }

    /// Largest error measured in the window, by coordinate; `None` if no image is finite.
    #[getter]
    fn errors(&self) -> Vec<Option<f64>> {
        self.0.window().errors.iter().map(|coordinate| coordinate.error).collect()
    }

    /// Coefficients, as in the program's table.
    fn polynomials(&self, py: Python<'_>) -> PyResult<Computed> {
        let table = self.0.listing().and_then(|listing| Ok(listing.coefficient_table()?));
        let table = table.map_err(|error| exception(py, &error))?;
        Ok(Computed::new(self.to_json(py)?, table.into_rows(), Vec::new()))
    }

    /// Writes the map as source code into a folder and returns the paths of its files there; `None`
    /// for an unknown language.
    fn emit(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        target: &str,
        measure: bool,
    ) -> PyResult<Option<Vec<String>>> {
        let Some(target) = Target::ALL.into_iter().find(|known| known.word() == target) else {
            return Ok(None);
        };
        let map = self.0.clone();
        let paths = compute(py, None, move |_| {
            let module = map.module(EmitRequest { target, measure, ..EmitRequest::default() })?;
            let emitted = EmittedCrate::standalone(&module)?;
            write_emitted(&emitted, &folder)?;
            Ok(emitted.files.into_keys().collect())
        })?;
        Ok(Some(paths))
    }

    /// Rows of images, depths and, if asked for, derivatives for rows of states, with one row of
    /// parameters or one per state.
    fn batch<'py>(
        &self,
        py: Python<'py>,
        states: Points<'py>,
        parameters: Points<'py>,
        derivatives: bool,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (states, parameters) = (states.as_slice()?, parameters.as_slice()?);
        let map = &self.0;
        let images = || map.batch(states, parameters, derivatives);
        let Batch { rows, width } = match states.len() <= AT_ONCE {
            true => py.detach(images).map_err(|error| exception(py, &error))?,
            false => compute_borrowing(py, images)?,
        };
        let count = rows.len() / width;
        PyArray1::from_vec(py, rows).reshape([count, width])
    }

    /// Whether each row of states lies in the window.
    fn inside<'py>(
        &self,
        py: Python<'py>,
        states: Points<'py>,
        parameters: Points<'py>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (states, parameters) = (states.as_slice()?, parameters.as_slice()?);
        let map = &self.0;
        let inside = py.detach(|| map.inside(states, parameters));
        Ok(PyArray1::from_vec(py, inside.map_err(|error| exception(py, &error))?))
    }

    /// Iterated images of rows of states by a method of `image`; shape: states, iterates,
    /// coordinates.
    fn orbits<'py>(
        &self,
        py: Python<'py>,
        states: Points<'py>,
        parameters: Points<'py>,
        iterations: usize,
        using: &str,
        precision: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let points = pipeline::Points {
            states: states.as_slice()?.to_vec(),
            parameters: parameters.as_slice()?.to_vec(),
        };
        let method = method(using, precision)?;
        let (map, dimension) = (self.0.clone(), self.0.local().dimension());
        let count = points.states.len() / dimension;
        let images =
            compute(py, None, move |watch| map.point_orbits(points, iterations, method, watch))?;
        PyArray1::from_vec(py, images).reshape([count, iterations, dimension])
    }

    /// Table of `image`.
    fn image(
        &self,
        py: Python<'_>,
        states: Points<'_>,
        parameters: Points<'_>,
        iterations: usize,
        using: &str,
        precision: &str,
    ) -> PyResult<Computed> {
        let (states, parameters) = (states.as_slice()?, parameters.as_slice()?);
        let method = method(using, precision)?;
        let request = self.0.image_request((states, parameters), iterations, method);
        let request = request.map_err(|error| exception(py, &error))?;
        let map = self.0.clone();
        compute(py, None, move |_| {
            let images = map.image_answer(request)?;
            let computed = Computed::new(images.document()?, images.rows(), Vec::new());
            Ok(computed.with_remarks(images.remarks().collect(), images.ended()))
        })
    }
}

/// Method and number format of images.
fn method(using: &str, precision: &str) -> PyResult<(Using, Precision)> {
    let using = named("using", using, &Using::ALL)?;
    Ok((using, named("precision", precision, &Precision::ALL)?))
}

/// Value of a word.
fn named<T: Copy>(what: &str, word: &str, all: &[(&str, T)]) -> PyResult<T> {
    let known = || all.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
    let found = all.iter().find(|(known, _)| *known == word).map(|(_, value)| *value);
    found.ok_or_else(|| {
        PyValueError::new_err(format!("{what} is one of {}, found {word:?}", known()))
    })
}

/// Words for the methods and number formats of images, and for the languages of emitted maps.
#[pyfunction]
pub(crate) fn words() -> (Vec<&'static str>, Vec<&'static str>, Vec<&'static str>) {
    let (using, precision) = (Using::ALL.iter(), Precision::ALL.iter());
    (
        using.map(|(word, _)| *word).collect(),
        precision.map(|(word, _)| *word).collect(),
        Target::ALL.iter().map(|target| target.word()).collect(),
    )
}

/// Results of tables of one kind, `[[diagram]]`, `[[chart]]` or `[[basin]]`, without times. Pieces
/// found by shares are not computed again. Charts are iterated on a device.
#[pyfunction]
#[pyo3(signature = (m, tables, progress=None, shares=Vec::new(), device="cpu".to_owned()))]
pub(crate) fn draw(
    py: Python<'_>,
    m: &Map,
    tables: String,
    progress: Option<&Bound<'_, PyAny>>,
    shares: Vec<Vec<u8>>,
    device: String,
) -> PyResult<Computed> {
    let map = m.0.clone();
    let pieces = joined(&shares)?;
    compute(py, progress, move |progress| {
        let progress = &Joining::new(progress, pieces);
        let map = map.asking(&tables)?.on(&Device::open(&device)?)?;
        let scene = map.scene();
        match (scene.diagrams.is_empty(), scene.charts.is_empty()) {
            (false, _) => diagrams(&map, progress),
            (true, false) => charts(&map, progress),
            (true, true) => basins(&map, progress),
        }
    })
}

/// Pieces found by share `number` of `of` (from 1) of such tables.
#[pyfunction]
pub(crate) fn draw_share<'py>(
    py: Python<'py>,
    m: &Map,
    tables: String,
    device: String,
    number: usize,
    of: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    let map = m.0.clone();
    share(py, (number, of), move |shard| {
        let map = map.asking(&tables)?.on(&Device::open(&device)?)?;
        let scene = map.scene();
        match (scene.diagrams.is_empty(), scene.charts.is_empty()) {
            (false, _) => map.share_diagrams(shard),
            (true, false) => map.share_charts(shard),
            (true, true) => map.share_basins(&map.basin_requests()?, shard),
        }
    })
}

fn diagrams(map: &grazemap::Map, progress: &dyn Progress) -> Result<Computed, Error> {
    let mut diagrams = map.diagrams(progress)?;
    diagrams.iter_mut().for_each(grazemap::Diagram::take_timing);
    let figures = diagrams.iter().flat_map(diagram_figures);
    let figures = figures.map(|(name, figure)| (format!("diagram{name}"), figure)).collect();
    let document = to_json(&map.diagram_documents(&diagrams))?;
    let remarks = map.remarks().chain(map.diagram_offset_remarks());
    let remarks = remarks.chain(diagram_warnings(&diagrams)).collect();
    Ok(Computed::new(document, diagram_rows(&diagrams), figures).with_remarks(remarks, None))
}

fn charts(map: &grazemap::Map, progress: &dyn Progress) -> Result<Computed, Error> {
    let charts = map.charts(progress)?;
    let charts: Vec<_> = charts.iter().map(grazemap::Chart::without_timing).collect();
    let figures = charts.iter().map(|chart| ("chart".to_owned(), chart_figure(chart))).collect();
    let document = to_json(&map.chart_documents(&charts))?;
    let remarks = map.remarks().chain(map.chart_offset_remarks());
    let remarks = remarks.chain(chart_warnings(&charts)).collect();
    Ok(Computed::new(document, chart_rows(&charts), figures).with_remarks(remarks, None))
}

fn basins(map: &grazemap::Map, progress: &dyn Progress) -> Result<Computed, Error> {
    let requests = map.basin_requests()?;
    let mut basins = map.basins(&requests, progress)?;
    basins.iter_mut().for_each(Basin::take_timing);
    let figures = basins.iter().map(|basin| ("basin".to_owned(), basin_figure(basin))).collect();
    let rows = basins.first().map(basin_rows);
    let rows = rows.unwrap_or_else(|| Rows::new(Vec::new(), std::iter::empty()));
    let documents: Vec<_> = basins.iter().map(|basin| map.basin_document(basin)).collect();
    let remarks = map.remarks().chain(map.basin_offset_remarks(&requests));
    let remarks = remarks.chain(basin_warnings(&basins)).collect();
    Ok(Computed::new(to_json(&documents)?, rows, figures).with_remarks(remarks, None))
}
