//! What was computed: a JSON document, a table by columns, figures.

use std::collections::HashMap;

use grazemap::pipeline::{Answer, Ended};
use grazemap::report::{Alignment, Cell, Column, Figure, Rows};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A column of a table: numbers, or words by their numbers in a list.
enum Values {
    /// NaN where nothing is known.
    Numbers(Vec<f64>),
    /// Each word once.
    Words(Words),
}

/// Data of a command: what the program writes, as values.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Computed {
    /// The JSON document.
    #[pyo3(get)]
    document: String,
    columns: Vec<(String, Values)>,
    /// Figures as SVG: the names of their files without endings, and the texts.
    #[pyo3(get)]
    figures: Vec<(String, String)>,
    /// What may not be trusted, or not be all.
    #[pyo3(get)]
    remarks: Vec<String>,
    /// Why it is not what was asked for.
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

    /// With what is to be said of it.
    pub(crate) fn with_remarks(self, remarks: Vec<String>, ended: Option<Ended>) -> Self {
        Self { remarks, ended: ended.map(|ended| ended.to_string()), ..self }
    }

    /// An answer of a command.
    pub(crate) fn of(answer: Answer) -> Self {
        let table = answer.tables.into_iter().next_back();
        let rows =
            table.map_or(Rows::new(Vec::new(), std::iter::empty()), |(_, table)| table.into_rows());
        Self::new(answer.document, rows, answer.figures).with_remarks(answer.remarks, answer.ended)
    }
}

#[pymethods]
impl Computed {
    /// The columns by name: an array of numbers, or an array of indices and the words they stand
    /// for.
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

/// Rows by column.
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

/// Words of a column, each kept once.
#[derive(Default)]
struct Words {
    /// Of each row, the number of its word; -1 where nothing is known.
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
