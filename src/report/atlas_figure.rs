//! Plane of two coordinates of an atlas as a figure.

use super::figure::{Axis, CellCategory, CellChart, CellColor, Figure, Series, Stroke};
use crate::analysis::{AtlasPlane, PlaneCell};
use crate::model::Model;

/// Figure of a plane: cells by word of contacts, boxes as thin lines, the graze curve in ink. Grey
/// cells are simulated; no point came to white ones.
pub fn atlas_figure(plane: &AtlasPlane, model: &Model) -> Figure {
    let axis = |number: usize| {
        let [low, high] = plane.ranges[number];
        Axis::linear(plane.names[number].clone()).with_range(low, high)
    };
    let mut figure = Figure::new(axis(0), axis(1));
    let count = plane.words.len();
    let mut categories: Vec<CellCategory> = plane
        .words
        .iter()
        .enumerate()
        .map(|(number, word)| {
            CellCategory::new(
                word_name(word, model),
                match count {
                    0..=9 => CellColor::Paler(number, 0.5),
                    _ => CellColor::Ordered(number as f64 / (count - 1) as f64),
                },
            )
        })
        .collect();
    if plane.cells.contains(&PlaneCell::Direct) {
        categories.push(CellCategory::new("direct simulation", CellColor::Grey));
    }
    let cell = |cell: &PlaneCell| match cell {
        PlaneCell::Word(word) => Some(*word),
        PlaneCell::Direct => Some(count),
        PlaneCell::Open => None,
    };
    let edges = plane.ranges.map(|[low, high]| (low, high));
    figure.cells = Some(CellChart {
        horizontal: edges[0],
        vertical: edges[1],
        columns: plane.cells_per_axis,
        rows: plane.cells_per_axis,
        cells: plane.cells.iter().map(cell).collect(),
        categories,
        bar: None,
    });
    // NOTE: a point that is not finite interrupts a line.
    let gap = [f64::NAN; 2];
    let outline = |&[[left, right], [low, high]]: &[[f64; 2]; 2]| {
        [[left, low], [right, low], [right, high], [left, high], [left, low], gap]
    };
    let boxes = plane.boxes.iter().flat_map(outline).collect();
    figure.series.push(Series::line("boxes", Stroke::Solid, boxes).in_grey());
    let graze: Vec<_> = plane.graze.iter().flat_map(|&[from, to]| [from, to, gap]).collect();
    if !graze.is_empty() {
        figure.series.push(Series::line("graze", Stroke::Solid, graze).in_ink());
    }
    figure
}

/// Surfaces of a word in order, with counts of repeated hits.
fn word_name(word: &[usize], model: &Model) -> String {
    let runs = word.chunk_by(|a, b| a == b).map(|run| {
        let name = &model.surfaces[run[0]].name;
        match run.len() {
            1 => name.clone(),
            times => format!("{name} × {times}"),
        }
    });
    let runs: Vec<String> = runs.collect();
    if runs.is_empty() { "no contact".to_owned() } else { runs.join(", ") }
}
