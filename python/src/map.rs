//! Local maps: images of arrays of points, and diagrams, charts and basins.

use std::path::PathBuf;

use grazemap::analysis::{Joining, Precision, Using};
use grazemap::emission::{EmittedCrate, Target};
use grazemap::expansion::MapWindow;
use grazemap::iteration::Batch;
use grazemap::pipeline::{self, Answer, Device, EmitRequest, write_emitted};
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
        let table = self.0.listing().map(|listing| listing.coefficient_table());
        let table = table.map_err(|error| exception(py, &error))?;
        Ok(Computed::of(Answer::new("map", String::new(), self.to_json(py)?, table)))
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
        compute(py, None, move |_| Ok(Computed::of(map.image_answer(request)?)))
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
        Ok(match (scene.diagrams.is_empty(), scene.charts.is_empty()) {
            (false, _) => Computed::of(map.drawn_diagrams(progress)?)
                .with_remarks(map.diagram_offset_remarks()),
            (true, false) => {
                Computed::of(map.drawn_charts(progress)?).with_remarks(map.chart_offset_remarks())
            }
            (true, true) => {
                let requests = map.basin_requests()?;
                Computed::of(map.drawn_basins(&requests, progress)?)
                    .with_remarks(map.basin_offset_remarks(&requests))
            }
        })
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
