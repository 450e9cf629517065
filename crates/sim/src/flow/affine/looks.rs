//! Tables of the control points of watched functions on the pieces of a span.

use super::economy::ChebyshevSeries;
use super::leaps::{NODES, PIECES};
use super::matrix::{Matrix, largest};
use super::nodes::Nodes;
use super::rows::{RowTable, Rows};
use crate::numeric::Real;

/// Control points that are formed together.
pub(super) const LOOK: usize = 8;
/// Most control points of a piece.
pub(super) const MAX_POINTS: usize = 64;
/// What control points leave out, as a share of the largest of them: a sixteenth of the margin that
/// signs need.
const SMALL: f64 = 4.0 * f64::EPSILON;

/// The control points of one watched function, in `f64` whatever the numbers of the flow, or in
/// lanes of it.
#[derive(Clone, Debug)]
pub(crate) struct Looks<R> {
    pub(super) pieces: [RowTable<R, LOOK>; PIECES],
    /// The largest control point of each component.
    pub(super) sizes: Vec<R>,
}

impl Looks<f64> {
    /// Those of every watched function, and the number of points of a piece; `None` where a series
    /// does not end, or needs too many points.
    pub(super) fn all<S: Real>(
        matrix: &Matrix<S>,
        watched: &[&[S]],
        length: f64,
        nodes: &Nodes<S>,
    ) -> Option<(Vec<Self>, usize)> {
        let matrix = matrix.rounded();
        let (mut all, mut points) = (Vec::with_capacity(watched.len()), LOOK);
        for row in watched {
            let row: Vec<f64> = row.iter().map(|value| value.to_f64()).collect();
            let rows = scaled(&matrix.series(&row, length)?, length);
            let series = ChebyshevSeries::new(&rows);
            points = points.max(series.needed(&largest(&rows), SMALL));
            all.push(series);
        }
        points = points.next_multiple_of(LOOK);
        if points > MAX_POINTS {
            return None;
        }
        let flow = |piece: usize| (piece > 0).then(|| nodes.get(piece * NODES).rounded());
        let flows: [_; PIECES] = std::array::from_fn(flow);
        let looks = all
            .iter()
            .map(|series| Self::new(series.control_points(points), &flows));
        Some((looks.collect(), points))
    }

    /// From the points of the first piece and the flows to the starts of all.
    fn new(first: RowTable<f64, LOOK>, flows: &[Option<RowTable<f64>>; PIECES]) -> Self {
        let pieces = flows.each_ref().map(|flow| match flow {
            Some(flow) => first.after(flow),
            None => first.clone(),
        });
        let size = |column| {
            let points = pieces.iter().flat_map(|piece| piece.column(column));
            points.fold(0.0f64, |largest, point| largest.max(point.abs()))
        };
        let sizes = (0..first.columns()).map(size).collect();
        Self { pieces, sizes }
    }
}

/// The coefficients of powers of a share of a length.
fn scaled(series: &Rows<f64>, length: f64) -> Rows<f64> {
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    let rows = series.iter().zip(powers);
    let values = rows.flat_map(|(row, power)| row.iter().map(move |value| value * power));
    Rows::new(series.columns(), values.collect())
}
