//! Tables of an affine flow over a span of several steps: a look at each piece of it, and the motion near any time.
//!
//! One idea: a flight to the next contact needs no state between. Pieces of the span are looked at one after another, by
//! the control points of the gaps alone; the contact, and the state where the flight ends, then come from a short series
//! about the nearest of a row of nodes. Everything is linear in the start: nothing is formed that is not asked for.

use super::flow::{AffineFieldRows, leading_states};
use super::matrix::{Matrix, control_rows, largest, sum_at, unit};
use super::rows::{RowTable, padded};
use crate::numeric::{Real, polynomial};

/// Pieces of a span.
const PIECES: usize = 4;
/// Length of a piece in units of the fastest rate: four make a period of a force that is the fastest.
const REACH: f64 = 1.6;
/// Nodes of a piece, one of them its start.
const NODES: usize = 8;
/// Terms of the control points below this share of the largest are left out: a quarter of the margin that signs need.
const SMALL: f64 = 16.0 * f64::EPSILON;

/// Tables of one affine field over a span.
#[derive(Clone, Debug)]
pub struct AffineLeaps<S: Real> {
    spacing: S,
    inverse_spacing: f64,
    piece: f64,
    points: usize,
    terms: usize,
    phase_rate: S,
    time_scale: f64,
    /// Per watched function and piece.
    looks: Vec<Vec<RowTable<f64>>>,
    /// Per watched function the largest control point of each component.
    sizes: Vec<Vec<f64>>,
    /// Per watched function and node.
    watched: Vec<Vec<RowTable<S>>>,
    /// The states that are no other state's derivative, per node, and the state that is theirs.
    states: Vec<(usize, Vec<RowTable<S>>, Option<usize>)>,
}

impl<S: Real> AffineLeaps<S> {
    /// Computes the tables; `None` for a field whose flow is a polynomial, or leaves the numbers of the type.
    pub fn new(field: &AffineFieldRows<'_, S>) -> Option<Self> {
        let matrix = Matrix::new(field);
        let (rate, columns) = (matrix.rate(), matrix.columns);
        let length = REACH / rate;
        let spacing = length / NODES as f64;
        if !spacing.is_finite() {
            return None;
        }
        let piece = |row: &[S]| matrix.series(row.to_vec(), length);
        let local = |row: Vec<S>| matrix.series(row, spacing);
        let whole: Option<Vec<_>> = field.watched.iter().map(|row| piece(row)).collect();
        let near: Option<Vec<_>> = field
            .watched
            .iter()
            .map(|row| local(row.to_vec()))
            .collect();
        let all: Option<Vec<_>> = (0..columns).map(|i| local(unit(i, columns))).collect();
        let (whole, near, all) = (whole?, near?, all?);
        let first: Vec<_> = all
            .iter()
            .map(|rows| sum_at(rows, S::from_f64(spacing)))
            .collect();
        let nodes = Nodes::new(first);
        let significant = |rows: &Vec<Vec<S>>| significant(rows, length);
        let points = padded(whole.iter().map(significant).max()?);
        let longest = all.iter().chain(&near).map(Vec::len).max()?;
        let terms = padded(longest);
        let control: Vec<_> = whole
            .iter()
            .map(|rows| nodes.control(rows, length, points))
            .collect();
        let table = |rows: &Vec<Vec<f64>>| RowTable::new(rows, columns);
        let at_nodes = |rows: &Vec<Vec<S>>| nodes.tables(rows, terms);
        Some(Self {
            spacing: S::from_f64(spacing),
            inverse_spacing: 1.0 / spacing,
            piece: length,
            points,
            terms,
            phase_rate: field.phase_rate,
            time_scale: 1.0 / rate,
            looks: control
                .iter()
                .map(|pieces| pieces.iter().map(table).collect())
                .collect(),
            sizes: control
                .iter()
                .map(|pieces| largest(&pieces.concat()))
                .collect(),
            watched: near.iter().map(at_nodes).collect(),
            states: leading_states(field.derivatives)
                .map(|(state, slope)| (state, at_nodes(&all[state]), slope))
                .collect(),
        })
    }

    /// Length of the whole span.
    pub fn span(&self) -> S {
        self.spacing * S::from_f64((PIECES * NODES) as f64)
    }

    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        PIECES
    }

    /// Length of a piece.
    pub fn piece(&self) -> f64 {
        self.piece
    }

    /// Distance of the nodes: a time is near a node that is not further.
    pub fn spacing(&self) -> S {
        self.spacing
    }

    /// The time in which the field changes.
    pub fn time_scale(&self) -> f64 {
        self.time_scale
    }

    /// Rate of the phase.
    pub fn phase_rate(&self) -> S {
        self.phase_rate
    }

    /// Number of control points on a piece.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Number of coefficients of a series about a node.
    pub fn terms(&self) -> usize {
        self.terms
    }

    /// Control points of a watched function on a piece.
    #[inline(always)]
    pub fn look(&self, watched: usize, piece: usize, extended: &[f64], out: &mut [f64]) {
        self.looks[watched][piece].combine(extended, out);
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub fn size(&self, watched: usize, extended: &[f64]) -> f64 {
        let terms = self.sizes[watched].iter().zip(extended);
        terms.fold(0.0, |sum, (size, y)| sum + size * y.abs())
    }

    /// The node nearest to a time of the span, and its time.
    #[inline(always)]
    pub fn node(&self, time: f64) -> (usize, S) {
        let last = (PIECES * NODES) as f64;
        let node = (time * self.inverse_spacing + 0.5).clamp(0.0, last) as usize;
        (node, self.spacing * S::from_f64(node as f64))
    }

    /// Taylor coefficients of a watched function about a node.
    #[inline(always)]
    pub fn watched_series(&self, watched: usize, node: usize, extended: &[S], out: &mut [S]) {
        self.watched[watched][node].combine(extended, out);
    }

    /// The states at a time of the span; `series` holds one series.
    #[inline(always)]
    pub fn states_at(&self, time: S, extended: &[S], series: &mut [S], states: &mut [S]) {
        let (node, start) = self.node(time.to_f64());
        let time = time - start;
        for (state, nodes, slope) in &self.states {
            nodes[node].combine(extended, series);
            match slope {
                Some(slope) => {
                    (states[*state], states[*slope]) = polynomial::value_and_slope(series, time);
                }
                None => states[*state] = polynomial::value(series, time),
            }
        }
    }
}

/// The flow from the start of a span to each of its nodes.
struct Nodes<S> {
    matrices: Vec<Vec<Vec<S>>>,
}

impl<S: Real> Nodes<S> {
    /// From the flow to the first node: by squares, so that rounding grows with the number of digits of a node alone.
    fn new(first: Vec<Vec<S>>) -> Self {
        let columns = first.len();
        let mut matrices: Vec<Vec<Vec<S>>> = vec![
            (0..columns).map(|column| unit(column, columns)).collect(),
            first,
        ];
        for node in 2..=PIECES * NODES {
            let half = composed(&matrices[node / 2], &matrices[node - node / 2]);
            matrices.push(half);
        }
        Self { matrices }
    }

    /// Series of a row about every node.
    fn tables(&self, rows: &[Vec<S>], terms: usize) -> Vec<RowTable<S>> {
        let table = |matrix: &Vec<Vec<S>>| {
            let columns = matrix.len();
            let mut rows = composed(rows, matrix);
            rows.resize(terms, vec![S::zero(); columns]);
            RowTable::new(&rows, columns)
        };
        self.matrices.iter().map(table).collect()
    }

    /// Rows of the control points of a row's series on every piece.
    fn control(&self, rows: &[Vec<S>], length: f64, points: usize) -> Vec<Vec<Vec<f64>>> {
        let rows = &rows[..rows.len().min(points)];
        let control = |matrix: &Vec<Vec<S>>| control_rows(&composed(rows, matrix), length, points);
        let starts = self.matrices.iter().step_by(NODES).take(PIECES);
        starts.map(control).collect()
    }
}

/// Rows after a linear map.
fn composed<S: Real>(rows: &[Vec<S>], matrix: &[Vec<S>]) -> Vec<Vec<S>> {
    let image = |row: &Vec<S>| {
        let mut image = vec![S::zero(); matrix.len()];
        for (&factor, line) in row.iter().zip(matrix) {
            for (value, &entry) in image.iter_mut().zip(line) {
                *value = factor.mul_add(entry, *value);
            }
        }
        image
    };
    rows.iter().map(image).collect()
}

/// Number of leading rows that hold every term above the small share of the largest of its column.
fn significant<S: Real>(rows: &[Vec<S>], length: f64) -> usize {
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    let scaled: Vec<Vec<f64>> = rows
        .iter()
        .zip(powers)
        .map(|(row, power)| row.iter().map(|value| value.magnitude() * power).collect())
        .collect();
    let sizes = largest(&scaled);
    let matters = |row: &Vec<f64>| {
        row.iter()
            .zip(&sizes)
            .any(|(&term, &size)| term > SMALL * size)
    };
    scaled.iter().rposition(matters).map_or(1, |last| last + 1)
}
