//! The flat list of shapes that both painters understand, in CSS pixels, `y` downwards.

use super::palette::Rgb;
use super::series::{Marker, Stroke};

/// A place in the picture.
pub(super) type Point = (f64, f64);

/// Where a text stands against its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Which way a text runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Across,
    Upwards,
}

/// Cells of a grid in one colour, as runs along rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DotRuns {
    /// Centre of cell (0, 0).
    pub(super) origin: Point,
    /// Distance between centres.
    pub(super) pitch: Point,
    /// Row, first column, number of cells; ascending.
    pub(super) runs: Vec<(u32, u32, u32)>,
    /// Diameter of a dot.
    pub(super) diameter: f64,
    pub(super) color: Rgb,
}

impl DotRuns {
    /// The centres of all cells.
    pub(super) fn centres(&self) -> impl Iterator<Item = Point> {
        let place = |start: f64, pitch: f64, cell: u32| start + f64::from(cell) * pitch;
        let (origin, pitch) = (self.origin, self.pitch);
        self.runs.iter().flat_map(move |&(row, first, count)| {
            let y = place(origin.1, pitch.1, row);
            (first..first + count).map(move |column| (place(origin.0, pitch.0, column), y))
        })
    }
}

/// A rectangle of coloured cells, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mosaic {
    pub(super) from: Point,
    pub(super) to: Point,
    pub(super) columns: usize,
    pub(super) colors: Vec<Rgb>,
}

/// One shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Line {
        points: Vec<Point>,
        width: f64,
        stroke: Stroke,
        color: Rgb,
    },
    Rectangle {
        from: Point,
        to: Point,
        fill: Rgb,
    },
    Mark {
        at: Point,
        radius: f64,
        marker: Marker,
        color: Rgb,
    },
    Dots(DotRuns),
    Mosaic(Mosaic),
    /// `at` is on the baseline; `halo` is paper-coloured space around the letters.
    Text {
        at: Point,
        anchor: Anchor,
        direction: Direction,
        size: f64,
        color: Rgb,
        text: String,
        halo: bool,
    },
}

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawing {
    pub(super) size: (u32, u32),
    /// What the picture is, for readers who cannot see it.
    pub(super) title: String,
    pub(super) shapes: Vec<Shape>,
}

/// Outline of a filled marker around a point, or the strokes of a cross; empty for round ones.
pub(super) fn outline(marker: Marker, (x, y): Point, r: f64) -> Vec<Point> {
    match marker {
        Marker::Circle | Marker::Ring | Marker::Cross => Vec::new(),
        Marker::Square => {
            let s = 0.88 * r;
            vec![(x - s, y - s), (x + s, y - s), (x + s, y + s), (x - s, y + s)]
        }
        Marker::Diamond => {
            let s = 1.25 * r;
            vec![(x, y - s), (x + s, y), (x, y + s), (x - s, y)]
        }
        Marker::Triangle => {
            let s = 1.2 * r;
            vec![(x, y - s), (x + 0.95 * s, y + 0.7 * s), (x - 0.95 * s, y + 0.7 * s)]
        }
    }
}

/// Lengths of strokes and gaps for a line of a width; empty for a solid one.
pub(super) fn dashes(stroke: Stroke, width: f64) -> Vec<f64> {
    match stroke {
        Stroke::Solid => Vec::new(),
        Stroke::Dashed => vec![4.5 * width, 3.0 * width],
        Stroke::Dotted => vec![1.2 * width, 2.2 * width],
    }
}
