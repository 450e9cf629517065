//! Tables of an affine flow over a span of several steps: a look at each piece of it, and the motion near any time.
//!
//! One idea: a flight to the next contact needs no state between. Pieces of the span are looked at one after another, by
//! the control points of the gaps alone; the contact, and the state where the flight ends, then come from a short series
//! about the nearest of a row of nodes. Everything is linear in the start: nothing is formed that is not asked for.

use super::economy::economised;
use super::flow::{AffineFieldRows, leading_states};
use super::matrix::{Matrix, control_rows, largest, sum_at, unit};
use super::rows::{RowTable, padded};
use crate::numeric::{Real, polynomial};

/// Pieces of a span.
const PIECES: usize = 3;
/// Length of a piece in units of the fastest rate: three make a period of a force that is the fastest.
const REACH: f64 = 2.1;
/// Nodes of a piece, one of them its start.
const NODES: usize = 10;
/// How far from a node its series are good, in units of the distance of two.
const NEAR: f64 = 0.6;
/// What control points leave out, as a share of the largest of them: a quarter of the margin that signs need.
const SMALL: f64 = 16.0 * f64::EPSILON;
/// Control points that are formed together.
const LOOK: usize = 8;
/// Most control points of a piece.
const MAX_POINTS: usize = 64;

/// Tables of one affine field over a span.
#[derive(Clone, Debug)]
pub struct AffineLeaps<S: Real> {
    spacing: S,
    /// How far from a node its series are good.
    reach: S,
    inverse_spacing: f64,
    piece: f64,
    points: usize,
    terms: usize,
    phase_rate: S,
    time_scale: f64,
    /// Per watched function and piece.
    looks: Vec<Vec<RowTable<f64, LOOK>>>,
    /// Per watched function the largest control point of each component.
    sizes: Vec<Vec<f64>>,
    /// The flow from the start of the span to each node but the first, without the number 1.
    nodes: Vec<RowTable<S>>,
    watched: Vec<RowTable<S>>,
    /// The states that are no other state's derivative, and the state that is theirs.
    states: Vec<(usize, RowTable<S>, Option<usize>)>,
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
        let units = || (0..columns).map(|component| unit(component, columns));
        let series = |row: Vec<S>, length| matrix.series(row, length);
        let watched = |length| -> Option<Vec<_>> {
            let rows = field.watched.iter().map(|row| row.to_vec());
            rows.map(|row| series(row, length)).collect()
        };
        let whole = watched(length)?;
        let near = watched(NEAR * spacing)?;
        let states: Option<Vec<_>> = units()
            .take(matrix.states)
            .map(|row| series(row, NEAR * spacing))
            .collect();
        let first: Option<Vec<_>> = units()
            .map(|row| series(row, spacing))
            .map(|rows| rows.map(|rows| sum_at(&rows, S::from_f64(spacing))))
            .collect();
        let (states, nodes) = (states?, Nodes::new(first?));
        let longest = states.iter().chain(&near).map(Vec::len).max()?;
        let terms = padded(longest);
        let starts = nodes.starts();
        let pieces: Vec<_> = whole
            .iter()
            .map(|rows| economised_on(&starts, rows, length))
            .collect();
        let points = pieces.iter().flatten().map(Vec::len).max()?;
        let points = points.next_multiple_of(LOOK);
        if points > MAX_POINTS {
            return None;
        }
        let control: Vec<Vec<_>> = pieces
            .iter()
            .map(|pieces| {
                let control = pieces.iter().map(|rows| control_rows(rows, 1.0, points));
                control.collect()
            })
            .collect();
        let look = |rows: &Vec<Vec<f64>>| RowTable::<f64, LOOK>::new(rows, columns);
        let table = |rows: &Vec<Vec<S>>| {
            let mut rows = rows.clone();
            rows.resize(terms, vec![S::zero(); columns]);
            RowTable::new(&rows, columns)
        };
        Some(Self {
            spacing: S::from_f64(spacing),
            reach: S::from_f64(NEAR * spacing),
            inverse_spacing: 1.0 / spacing,
            piece: length,
            points,
            terms,
            phase_rate: field.phase_rate,
            time_scale: 1.0 / rate,
            looks: control
                .iter()
                .map(|pieces| pieces.iter().map(look).collect())
                .collect(),
            sizes: control
                .iter()
                .map(|pieces| largest(&pieces.concat()))
                .collect(),
            nodes: nodes.tables(columns),
            watched: near.iter().map(table).collect(),
            states: leading_states(field.derivatives)
                .map(|(state, slope)| (state, table(&states[state]), slope))
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

    /// How far from a node its series are good: more than half the distance of two.
    pub fn reach(&self) -> S {
        self.reach
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

    /// The extended state at a node; `out` has the padded length.
    #[inline(always)]
    pub fn at_node(&self, node: usize, extended: &[S], out: &mut [S]) {
        match node.checked_sub(1) {
            Some(table) => {
                self.nodes[table].combine(extended, out);
                out[extended.len() - 1] = S::one();
            }
            None => out[..extended.len()].copy_from_slice(extended),
        }
    }

    /// Length of an extended state at a node, padded.
    pub fn padded_columns(columns: usize) -> usize {
        padded(columns)
    }

    /// Taylor coefficients of a watched function about a node, from the extended state there.
    #[inline(always)]
    pub fn watched_series(&self, watched: usize, at_node: &[S], out: &mut [S]) {
        self.watched[watched].combine(at_node, out);
    }

    /// The states at a time after a node, or before, from the extended state there; `series` holds one series.
    #[inline(always)]
    pub fn states_at(&self, time: S, at_node: &[S], series: &mut [S], states: &mut [S]) {
        for (state, table, slope) in &self.states {
            table.combine(at_node, series);
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

    /// All rows but that of the number 1, for every node but the first.
    fn tables(&self, columns: usize) -> Vec<RowTable<S>> {
        let table = |matrix: &Vec<Vec<S>>| RowTable::new(&matrix[..columns - 1], columns);
        self.matrices[1..].iter().map(table).collect()
    }

    /// The flows to the starts of the pieces, in `f64`.
    fn starts(&self) -> Vec<Vec<Vec<f64>>> {
        let starts = self.matrices.iter().step_by(NODES).take(PIECES);
        starts.map(|matrix| rounded(matrix)).collect()
    }
}

/// Coefficients of a row's powers of time on every piece, in units of its length, as few as are needed.
fn economised_on<S: Real>(
    starts: &[Vec<Vec<f64>>],
    rows: &[Vec<S>],
    length: f64,
) -> Vec<Vec<Vec<f64>>> {
    let mut rows = rounded(rows);
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    for (row, power) in rows.iter_mut().zip(powers) {
        row.iter_mut().for_each(|value| *value *= power);
    }
    let pieces: Vec<_> = starts.iter().map(|start| composed(&rows, start)).collect();
    let sizes = largest(&pieces.concat());
    let piece = |rows| economised(rows, &sizes, SMALL);
    pieces.into_iter().map(piece).collect()
}

/// Rows in `f64`.
fn rounded<S: Real>(rows: &[Vec<S>]) -> Vec<Vec<f64>> {
    let row = |row: &Vec<S>| row.iter().map(|value| value.to_f64()).collect();
    rows.iter().map(row).collect()
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
