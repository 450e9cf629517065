//! Results: a JSON document, a table by columns, figures.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use grazemap::Error;
use grazemap::pipeline::{Extent, Results};
use grazemap::report::{Alignment, Cell, Column, Rows};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::exception;

/// Column of a table: numbers, or indices into a list of words.
enum Values {
    /// Numbers, NaN if missing.
    Numbers(Vec<f64>),
    /// Words, each stored once.
    Words(Words),
}

/// Results of a command, with the values that the program writes, each laid out when it is asked
/// for.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Computed {
    results: Mutex<Box<dyn Results>>,
    /// Warnings about accuracy or completeness.
    #[pyo3(get)]
    remarks: Vec<String>,
    /// Reason why the result is not the one asked for.
    #[pyo3(get)]
    ended: Option<String>,
}

impl Computed {
    /// Holds results.
    pub(crate) fn of(results: impl Results + 'static) -> Self {
        let (remarks, ended) = (results.remarks(), results.ended());
        let ended = ended.map(|ended| ended.to_string());
        Self { results: Mutex::new(Box::new(results)), remarks, ended }
    }

    /// Adds remarks.
    pub(crate) fn with_remarks(mut self, remarks: Vec<String>) -> Self {
        self.remarks.extend(remarks);
        self
    }

    /// Runs `work` on the results, other threads of Python beside it.
    fn laid_out<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut dyn Results) -> T + Send,
    ) -> T {
        py.detach(|| {
            // What a panic leaves of a document is not read again.
            let mut results = self.results.lock().unwrap_or_else(PoisonError::into_inner);
            work(&mut **results)
        })
    }

    fn written(&self, py: Python<'_>, extent: Extent) -> PyResult<String> {
        let written = self.laid_out(py, |results| results.document(extent));
        written.map_err(|error| exception(py, &Error::from(error)))
    }
}

#[pymethods]
impl Computed {
    /// JSON document, without measured times.
    fn document(&self, py: Python<'_>) -> PyResult<String> {
        self.written(py, Extent::Timeless)
    }

    /// JSON document without what stands in the columns, where that is long.
    fn head(&self, py: Python<'_>) -> PyResult<String> {
        self.written(py, Extent::Head)
    }

    /// Figures as SVG: file names without extension, and texts.
    fn figures(&self, py: Python<'_>) -> Vec<(String, String)> {
        self.laid_out(py, |results| {
            let figures = results.figures().into_iter();
            figures.filter_map(|(name, figure)| Some((name, figure.to_svg().ok()?))).collect()
        })
    }

    /// Columns by name: an array of numbers, or an array of indices with their words.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, values) in &self.laid_out(py, |results| columns(results.rows())) {
            match values {
                Values::Numbers(values) => {
                    all.set_item(name, PyArray1::from_slice(py, values))?;
                }
                Values::Words(words) => {
                    let numbers = PyArray1::from_slice(py, &words.numbers);
                    all.set_item(name, (numbers, &words.list))?;
                }
            }
        }
        Ok(all)
    }
}

/// Columns of a table, from its rows.
fn columns(rows: Rows<'_>) -> Vec<(String, Values)> {
    let begin = |column: &Column| match column.alignment {
        Alignment::Right => Values::Numbers(Vec::new()),
        Alignment::Left => Values::Words(Words::default()),
    };
    let mut columns: Vec<(String, Values)> =
        rows.columns().iter().map(|column| (column.header.clone(), begin(column))).collect();
    for row in rows {
        for (cell, (_, values)) in row.iter().zip(&mut columns) {
            match values {
                Values::Numbers(values) => values.push(cell.value()),
                Values::Words(words) => words.push(cell),
            }
        }
    }
    columns
}

/// Words of a column, each stored once.
#[derive(Default)]
struct Words {
    /// Index of each row's word; -1 if missing.
    numbers: Vec<i32>,
    list: Vec<String>,
    places: HashMap<String, i32>,
}

impl Words {
    fn push(&mut self, cell: &Cell) {
        let text = cell.for_programs();
        if *cell == Cell::Missing {
            self.numbers.push(-1);
            return;
        }
        let next = self.list.len() as i32;
        let place = *self.places.entry(text.clone()).or_insert(next);
        if place == next {
            self.list.push(text);
        }
        self.numbers.push(place);
    }
}
