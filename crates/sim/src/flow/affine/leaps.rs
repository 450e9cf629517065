//! Tables of an affine flow over a span of several steps: a look at each piece of it, and the
//! motion near any time.
//!
//! One idea: a flight to the next event needs no state between. Pieces of the span are looked at
//! one after another, by the control points of the gaps alone; the event, and the state where the
//! flight ends, then come from a short series about the nearest of a row of nodes. Everything is
//! linear in the start: nothing is formed that is not asked for.

use super::flow::{AffineFieldRows, leading_states};
use super::looks::Looks;
use super::matrix::{Matrix, terms_within, unit};
use super::nodes::Nodes;
use super::rows::{RowTable, Rows, padded};
use crate::numeric::{Branched, Real, Scalar, polynomial};

/// Pieces of a span.
pub(super) const PIECES: usize = 3;
/// Length of a piece in units of the fastest rate: three make a period of a force that is the
/// fastest.
const REACH: f64 = 2.1;
/// Nodes of a piece, one of them its start.
pub(super) const NODES: usize = 12;
/// How far from a node its series are good, in units of the distance of two.
const NEAR: f64 = 0.6;

/// Tables of one affine field over a span.
#[derive(Clone, Debug)]
pub struct AffineLeaps<S: Real> {
    pub(super) spacing: S,
    /// How far from a node its series are good.
    pub(super) reach: S,
    pub(super) inverse_spacing: f64,
    piece: f64,
    points: usize,
    pub(super) terms: usize,
    phase_rate: S,
    time_scale: f64,
    /// Per watched function.
    pub(super) looks: Vec<Looks<f64>>,
    pub(super) nodes: Nodes<S>,
    pub(super) watched: Vec<RowTable<S>>,
    pub(super) states: Vec<LeadingState<S>>,
}

/// A state that is no other state's derivative, its series, and the state that is its derivative,
/// if there is one.
pub(crate) type LeadingState<S> = (usize, RowTable<S>, Option<usize>);

impl<S: Real> AffineLeaps<S> {
    /// Computes the tables; `None` for a field whose flow is a polynomial, or leaves the numbers of
    /// the type.
    pub fn new(field: &AffineFieldRows<'_, S>) -> Option<Self> {
        let matrix = Matrix::new(field);
        let (rate, columns) = (matrix.rate(), matrix.columns);
        let length = REACH / rate;
        let spacing = length / NODES as f64;
        if !spacing.is_finite() {
            return None;
        }
        let series = |row: &[S]| matrix.series(row, spacing);
        let units = (0..matrix.states).map(|state| unit(state, columns));
        let states: Option<Vec<_>> = units.map(|row| series(&row)).collect();
        let states = states?;
        let gap = |row: &&[S]| matrix.series_from_states(row, &states, spacing);
        let watched: Option<Vec<_>> = field.watched.iter().map(gap).collect();
        let watched = watched?;
        let nodes = Nodes::new(field, &states, S::from_f64(spacing));
        let needed = |rows| terms_within(rows, NEAR * spacing);
        let terms = padded(watched.iter().chain(&states).map(needed).max()?);
        let (looks, points) = Looks::all(&matrix, field.watched, length, &nodes)?;
        let table = |rows: &Rows<S>| RowTable::first(rows, terms);
        Some(Self {
            spacing: S::from_f64(spacing),
            reach: S::from_f64(NEAR * spacing),
            inverse_spacing: 1.0 / spacing,
            piece: length,
            points,
            terms,
            phase_rate: field.phase_rate,
            time_scale: 1.0 / rate,
            looks,
            nodes,
            watched: watched.iter().map(table).collect(),
            states: leading_states(field.derivatives)
                .map(|(state, slope)| (state, table(&states[state]), slope))
                .collect(),
        })
    }

    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        PIECES
    }

    /// Length of a piece.
    pub fn piece(&self) -> f64 {
        self.piece
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

    /// Control points of a watched function on a piece, in `f64`.
    #[inline(always)]
    pub fn look(&self, watched: usize, piece: usize, extended: &[S], out: &mut [f64]) {
        self.looks[watched].pieces[piece].combine_as(extended, |y| y.to_f64(), out);
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub fn size(&self, watched: usize, extended: &[S]) -> f64 {
        let terms = self.looks[watched].sizes.iter().zip(extended);
        terms.fold(0.0, |sum, (size, y)| sum + size * y.magnitude())
    }

    /// The flow to a node other than the start.
    #[inline(always)]
    pub(super) fn flow_to(&self, node: usize) -> &RowTable<S> {
        self.nodes.get(node)
    }

    /// Length of an extended state at a node, padded.
    pub fn padded_columns(columns: usize) -> usize {
        padded(columns)
    }
}

/// Tables of leaps of one orbit, or of several in lanes: the motion about nodes.
pub(crate) trait LeapTables {
    /// What states and times are.
    type Number: Branched;
    /// A node of every orbit.
    type Node: Copy;
    /// No node.
    const NOWHERE: Self::Node;

    /// Length of the whole span.
    fn span(&self) -> Self::Number;

    /// How far from a node its series are good: more than half the distance of two.
    fn reach(&self) -> Self::Number;

    /// Number of coefficients of a series about a node.
    fn terms(&self) -> usize;

    /// The node nearest to a time of the span, and its time.
    fn node(&self, time: RoundedNumber<Self>) -> (Self::Node, Self::Number);

    /// The extended state at a node, where that is wanted and not known; `out` has the padded
    /// length.
    fn go_to(
        &self,
        node: Self::Node,
        wanted: NumberMask<Self>,
        known: &mut Self::Node,
        extended: &[Self::Number],
        out: &mut [Self::Number],
    );

    /// Taylor coefficients of a watched function about a node, from the extended state there.
    fn watched_series(&self, watched: usize, at_node: &[Self::Number], out: &mut [Self::Number]);

    /// The states at a time after a node, or before, from the extended state there; `series` holds
    /// one series.
    fn states_at(
        &self,
        time: Self::Number,
        at_node: &[Self::Number],
        series: &mut [Self::Number],
        states: &mut [Self::Number],
    );
}

/// The doubles of the numbers of tables.
pub(crate) type RoundedNumber<T> = <<T as LeapTables>::Number as Branched>::Rounded;
/// The truth values of the numbers of tables.
pub(crate) type NumberMask<T> = <<T as LeapTables>::Number as Branched>::Mask;

impl<S: Real> LeapTables for AffineLeaps<S> {
    type Number = S;
    type Node = Option<usize>;
    const NOWHERE: Option<usize> = None;

    #[inline(always)]
    fn span(&self) -> S {
        self.spacing * S::from_f64((PIECES * NODES) as f64)
    }

    #[inline(always)]
    fn reach(&self) -> S {
        self.reach
    }

    fn terms(&self) -> usize {
        self.terms
    }

    #[inline(always)]
    fn node(&self, time: f64) -> (Option<usize>, S) {
        let last = (PIECES * NODES) as f64;
        let node = (time * self.inverse_spacing + 0.5).clamp(0.0, last) as usize;
        (Some(node), self.spacing * S::from_f64(node as f64))
    }

    #[inline(always)]
    fn go_to(
        &self,
        node: Option<usize>,
        _: bool,
        known: &mut Option<usize>,
        extended: &[S],
        out: &mut [S],
    ) {
        if *known == node {
            return;
        }
        *known = node;
        match node {
            None | Some(0) => out[..extended.len()].copy_from_slice(extended),
            Some(node) => {
                self.nodes.get(node).combine(extended, out);
                out[extended.len() - 1] = S::one();
            }
        }
    }

    #[inline(always)]
    fn watched_series(&self, watched: usize, at_node: &[S], out: &mut [S]) {
        self.watched[watched].combine(at_node, out);
    }

    #[inline(always)]
    fn states_at(&self, time: S, at_node: &[S], series: &mut [S], states: &mut [S]) {
        states_at(&self.states, time, at_node, series, states);
    }
}

/// The states about a node, from the series of those that are no other state's derivative.
#[inline(always)]
pub(super) fn states_at<S: Scalar>(
    tables: &[LeadingState<S>],
    time: S,
    at_node: &[S],
    series: &mut [S],
    states: &mut [S],
) {
    for (state, table, slope) in tables {
        table.combine(at_node, series);
        match slope {
            Some(slope) => {
                (states[*state], states[*slope]) = polynomial::value_and_slope(series, time);
            }
            None => states[*state] = polynomial::value(series, time),
        }
    }
}
