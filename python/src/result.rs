//! Results: a JSON document, a table by columns, figures.

use std::collections::HashMap;

use grazemap::pipeline::{Answer, Ended};
use grazemap::report::{Alignment, Cell, Column, Figure, Rows};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Column of a table: numbers, or indices into a list of words.
enum Values {
    /// Numbers, NaN if missing.
    Numbers(Vec<f64>),
    /// Words, each stored once.
    Words(Words),
}

/// Results of a command, with the values that the program writes.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Computed {
    /// JSON document.
    #[pyo3(get)]
    document: String,
    columns: Vec<(String, Values)>,
    /// Figures as SVG: file names without extension, and texts.
    #[pyo3(get)]
    figures: Vec<(String, String)>,
    /// Warnings about accuracy or completeness.
    #[pyo3(get)]
    remarks: Vec<String>,
    /// Reason why the result is not the one asked for.
    #[pyo3(get)]
    ended: Option<String>,
}

impl Computed {
    /// Lays out rows by column.
    pub(crate) fn new(document: String, rows: Rows<'_>, figures: Vec<(String, Figure)>) -> Self {
        let drawn = figures.into_iter();
        let drawn = drawn.filter_map(|(name, figure)| Some((name, figure.to_svg().ok()?)));
        let (columns, figures) = (columns(rows), drawn.collect());
        Self { document, columns, figures, remarks: Vec::new(), ended: None }
    }

    /// Adds remarks and the reason for an early end.
    pub(crate) fn with_remarks(self, remarks: Vec<String>, ended: Option<Ended>) -> Self {
        Self { remarks, ended: ended.map(|ended| ended.to_string()), ..self }
    }

    /// Results of a command's answer.
    pub(crate) fn of(answer: Answer) -> Self {
        let table = answer.tables.into_iter().next_back();
        let rows =
            table.map_or(Rows::new(Vec::new(), std::iter::empty()), |(_, table)| table.into_rows());
        Self::new(answer.document, rows, answer.figures).with_remarks(answer.remarks, answer.ended)
    }
}

#[pymethods]
impl Computed {
    /// Columns by name: an array of numbers, or an array of indices with their words.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, values) in &self.columns {
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
