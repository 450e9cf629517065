//! The flat list of shapes that all painters understand, in CSS pixels, `y` downwards; lines are
//! cut at the edges of the plot area (Liang and Barsky, 1984).

use super::series::{Marker, Rgb, Stroke};

/// A place in the picture.
pub(super) type Point = (f64, f64);

/// Alignment of a text at its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Direction in which a text runs.
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
    /// Share of the colour; the rest is what lies below.
    pub(super) share: f64,
}

impl DotRuns {
    /// The centres of all cells.
    pub(super) fn centres(&self) -> impl Iterator<Item = Point> {
        let runs = self.runs.iter();
        runs.flat_map(move |&(row, first, count)| {
            (first..first + count).map(move |column| self.centre(row, column))
        })
    }

    /// The centres of the first and of the last cell of every run.
    pub(super) fn ends(&self) -> impl Iterator<Item = [Point; 2]> {
        let runs = self.runs.iter();
        runs.map(move |&(row, first, count)| {
            [first, first + count - 1].map(|column| self.centre(row, column))
        })
    }

    fn centre(&self, row: u32, column: u32) -> Point {
        let place = |start: f64, pitch: f64, cell: u32| start + f64::from(cell) * pitch;
        (place(self.origin.0, self.pitch.0, column), place(self.origin.1, self.pitch.1, row))
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

impl Mosaic {
    /// Corners of every cell, with its colour.
    pub(super) fn cells(&self) -> impl Iterator<Item = ((Point, Point), Rgb)> {
        let rows = self.colors.len() / self.columns;
        let pitch = (
            (self.to.0 - self.from.0) / self.columns as f64,
            (self.to.1 - self.from.1) / rows as f64,
        );
        let corner = move |row: usize, column: usize| {
            (self.from.0 + column as f64 * pitch.0, self.from.1 + row as f64 * pitch.1)
        };
        self.colors.iter().enumerate().map(move |(index, &color)| {
            let (row, column) = (index / self.columns, index % self.columns);
            ((corner(row, column), corner(row + 1, column + 1)), color)
        })
    }
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
    /// Title of the picture, for readers who cannot see it.
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

/// The plot area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    /// The square from (0, 0) to (1, 1).
    pub(super) const UNIT: Self = Self { left: 0.0, top: 0.0, right: 1.0, bottom: 1.0 };

    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Whether a point is inside, the edge included.
    pub(super) fn holds(&self, (x, y): Point) -> bool {
        x >= self.left - 1e-6
            && x <= self.right + 1e-6
            && y >= self.top - 1e-6
            && y <= self.bottom + 1e-6
    }

    /// The part of a segment inside, if any.
    fn cut(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let sides = [
            (-dx, a.0 - self.left),
            (dx, self.right - a.0),
            (-dy, a.1 - self.top),
            (dy, self.bottom - a.1),
        ];
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (p, q) in sides {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                from = from.max(q / p);
            } else {
                to = to.min(q / p);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (from <= to).then(|| (at(from), at(to)))
    }

    /// The pieces of a line inside, interrupted at points that are not finite.
    ///
    /// Steps shorter than a fifth of a pixel are joined with the next.
    pub(super) fn pieces(&self, points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
        let mut pieces: Vec<Vec<Point>> = Vec::new();
        let mut before: Option<Point> = None;
        for point in points {
            if !(point.0.is_finite() && point.1.is_finite()) {
                before = None;
                continue;
            }
            let Some(last) = before.replace(point) else {
                continue;
            };
            if let Some((from, to)) = self.cut(last, point) {
                match pieces.last_mut() {
                    Some(piece) if piece.last() == Some(&from) => piece.push(to),
                    _ => pieces.push(vec![from, to]),
                }
            }
        }
        pieces.into_iter().map(joined).collect()
    }
}

fn joined(piece: Vec<Point>) -> Vec<Point> {
    let last = piece.len() - 1;
    let mut kept: Vec<Point> = Vec::with_capacity(piece.len());
    for (index, point) in piece.into_iter().enumerate() {
        let far = kept.last().is_none_or(|k| (k.0 - point.0).hypot(k.1 - point.1) >= 0.2);
        if far || index == last {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn lines_end_at_the_edge_and_at_gaps() {
        let line = [(-5.0, 5.0), (5.0, 5.0), (5.0, 15.0), (f64::NAN, 0.0), (1.0, 1.0), (2.0, 2.0)];
        let pieces = AREA.pieces(line.into_iter());
        assert_eq!(
            pieces,
            [vec![(0.0, 5.0), (5.0, 5.0), (5.0, 10.0)], vec![(1.0, 1.0), (2.0, 2.0)]]
        );
    }

    #[test]
    fn lines_outside_are_not_drawn() {
        assert!(AREA.pieces([(-1.0, 5.0), (5.0, 50.0)].into_iter()).is_empty());
        assert!(AREA.pieces([(3.0, 3.0)].into_iter()).is_empty());
    }
}
