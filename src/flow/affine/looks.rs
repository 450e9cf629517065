//! Tables of the control points of watched functions on the pieces of a span.

use super::economy::economised;
use super::leaps::PIECES;
use super::matrix::{Matrix, control_rows, largest};
use super::nodes::Nodes;
use super::rows::RowTable;
use crate::numeric::Real;

/// Control points that are formed together.
pub(super) const LOOK: usize = 8;
/// Most control points of a piece.
const MAX_POINTS: usize = 64;
/// What control points leave out, as a share of the largest of them: a sixteenth of the margin that signs need.
const SMALL: f64 = 4.0 * f64::EPSILON;

/// Control points of every watched function, in `f64` whatever the numbers of the flow.
pub(super) struct Looks {
    /// Number of control points on a piece.
    pub(super) points: usize,
    /// Per watched function and piece.
    pub(super) tables: Vec<Vec<RowTable<f64, LOOK>>>,
    /// Per watched function the largest control point of each component.
    pub(super) sizes: Vec<Vec<f64>>,
}

impl Looks {
    /// `None` where a series does not end, or needs too many points.
    pub(super) fn new<S: Real>(
        matrix: &Matrix<S>,
        watched: &[&[S]],
        length: f64,
        nodes: &Nodes<S>,
    ) -> Option<Self> {
        let matrix = matrix.rounded();
        let series = |row: &&[S]| {
            let row = row.iter().map(|value| value.to_f64()).collect();
            let mut rows = matrix.series(row, length)?;
            let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
            for (row, power) in rows.iter_mut().zip(powers) {
                row.iter_mut().for_each(|value| *value *= power);
            }
            let sizes = largest(&rows);
            Some(economised(rows, &sizes, SMALL))
        };
        let series: Option<Vec<_>> = watched.iter().map(series).collect();
        let series = series?;
        let points = series.iter().map(Vec::len).max()?.next_multiple_of(LOOK);
        if points > MAX_POINTS {
            return None;
        }
        let (mut tables, mut sizes) = (Vec::new(), Vec::new());
        for rows in &series {
            let control = control_rows(rows, 1.0, points);
            let on_piece = |piece| nodes.before_piece(piece, &control);
            let pieces: Vec<_> = (0..PIECES).map(on_piece).collect();
            sizes.push(largest(&pieces.concat()));
            let table = |rows: &Vec<Vec<f64>>| RowTable::new(rows, matrix.columns);
            tables.push(pieces.iter().map(table).collect());
        }
        Some(Self {
            points,
            tables,
            sizes,
        })
    }
}
