//! Tables of an affine flow over a span of several steps: the control points of each of its pieces,
//! and the motion near any time; of one orbit, or of several in lanes.
//!
//! One idea: a flight to the next event needs no state between. The pieces of the span are tested
//! one after another, by the control points of the gaps alone; the event, and the state where the
//! flight ends, then come from a short series about the nearest of a row of nodes. Everything is
//! linear in the start: nothing is formed that is not asked for. In lanes the rows of all orbits
//! stand side by side, so that a product with the extended states is the one of a single orbit.

use num_traits::{One as _, Zero as _};

use super::economy::{CONTROL_BLOCK, ChebyshevSeries, MAX_POINTS};
use super::matrix::{AffineFieldRows, Matrix, largest, leading_states, terms_within, unit};
use super::nodes::{
    Backend, Batch, LaneNodes, NODES, Nodes, NumberMask, PIECES, RoundedNumber, Single,
};
use super::rows::{RowTable, Rows, padded};
use crate::numeric::{Branched, Lanes, Mask, Real, Scalar, polynomial};

/// Length of a piece in units of the fastest rate: three make a period of a force that is the
/// fastest.
const REACH: f64 = 2.1;
/// How far from a node its series are good, in units of the distance of two.
const NEAR: f64 = 0.6;
/// What control points leave out, as a share of the largest of them: a sixteenth of the margin that
/// signs need.
const SMALL: f64 = 4.0 * f64::EPSILON;

/// Tables of one affine field over a span.
#[derive(Clone, Debug)]
pub(crate) struct SpanTables<B: Backend> {
    span: B::Number,
    spacing: B::Number,
    inverse_spacing: RoundedNumber<B>,
    /// How far from a node its series are good: more than half the distance of two.
    reach: B::Number,
    piece: RoundedNumber<B>,
    phase_rate: B::Number,
    time_scale: RoundedNumber<B>,
    columns: usize,
    points: usize,
    terms: usize,
    /// Per watched function.
    control: Vec<ControlTables<RoundedNumber<B>>>,
    watched: Vec<RowTable<B::Number>>,
    states: Vec<LeadingState<B::Number>>,
    nodes: B::Nodes,
}

/// A state that is no other state's derivative, its series, and the state that is its derivative,
/// if there is one.
type LeadingState<S> = (usize, RowTable<S>, Option<usize>);

/// The control points of one watched function, in `f64` whatever the numbers of the flow, or in
/// lanes of it.
#[derive(Clone, Debug)]
struct ControlTables<R> {
    pieces: [RowTable<R, CONTROL_BLOCK>; PIECES],
    /// The largest control point of each component.
    sizes: Vec<R>,
}

impl<S: Real> SpanTables<Single<S>> {
    /// Computes the tables; `None` for a field whose flow is a polynomial, or leaves the numbers of
    /// the type.
    pub(crate) fn new(field: &AffineFieldRows<'_, S>) -> Option<Self> {
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
        let (control, points) = ControlTables::all(&matrix, field.watched, length, &nodes)?;
        let table = |rows: &Rows<S>| RowTable::first(rows, terms);
        Some(Self {
            span: S::from_f64(spacing) * S::from_f64((PIECES * NODES) as f64),
            spacing: S::from_f64(spacing),
            reach: S::from_f64(NEAR * spacing),
            inverse_spacing: 1.0 / spacing,
            piece: length,
            columns,
            points,
            terms,
            phase_rate: field.phase_rate,
            time_scale: 1.0 / rate,
            control,
            nodes,
            watched: watched.iter().map(table).collect(),
            states: leading_states(field.derivatives)
                .map(|(state, slope)| (state, table(&states[state]), slope))
                .collect(),
        })
    }
}

impl<const N: usize> SpanTables<Batch<N>> {
    /// From the tables of every lane; `None` where they have other shapes.
    pub(crate) fn interleaved(alone: [&SpanTables<Single<f64>>; N]) -> Option<Self> {
        let first = alone[0];
        let is_alike = |own: &&SpanTables<Single<f64>>| {
            let mut states = own.states.iter().zip(&first.states);
            own.points == first.points
                && own.states.len() == first.states.len()
                && states.all(|(own, first)| (own.0, own.2) == (first.0, first.2))
        };
        if first.watched.is_empty() || !alone.iter().all(is_alike) {
            return None;
        }
        let terms = alone.iter().map(|own| own.terms).max()?;
        let each =
            |value: fn(&SpanTables<Single<f64>>) -> f64| Lanes::from_fn(|lane| value(alone[lane]));
        let series = |table: &dyn Fn(&SpanTables<Single<f64>>) -> RowTable<f64>| {
            let tables = alone.map(table);
            RowTable::interleaved(tables.each_ref(), terms)
        };
        let watches = 0..first.watched.len();
        let control =
            |watch: usize| ControlTables::interleaved(alone.map(|own| &own.control[watch]));
        Some(Self {
            span: each(|own| own.span),
            spacing: each(|own| own.spacing),
            inverse_spacing: each(|own| own.inverse_spacing),
            reach: each(|own| own.reach),
            piece: each(|own| own.piece),
            phase_rate: each(|own| own.phase_rate),
            time_scale: each(|own| own.time_scale),
            columns: first.columns,
            points: first.points,
            terms,
            control: watches.clone().map(control).collect(),
            watched: watches.map(|watch| series(&|own| own.watched[watch].clone())).collect(),
            states: (first.states.iter().enumerate())
                .map(|(place, &(state, _, slope))| {
                    (state, series(&|own| own.states[place].1.clone()), slope)
                })
                .collect(),
            nodes: LaneNodes::new(alone.map(|own| &own.nodes), first.columns),
        })
    }
}

impl<B: Backend> SpanTables<B> {
    /// Length of the whole span.
    #[inline(always)]
    pub(crate) fn span(&self) -> B::Number {
        self.span
    }

    /// Number of pieces.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> usize {
        PIECES
    }

    /// Length of a piece.
    #[inline(always)]
    pub(crate) fn piece(&self) -> RoundedNumber<B> {
        self.piece
    }

    /// How far from a node its series are good: more than half the distance of two.
    #[inline(always)]
    pub(crate) fn reach(&self) -> B::Number {
        self.reach
    }

    /// The time in which the field changes.
    #[inline(always)]
    pub(crate) fn time_scale(&self) -> B::Number {
        B::Number::from_rounded(self.time_scale)
    }

    /// Rate of the phase.
    #[inline(always)]
    pub(crate) fn phase_rate(&self) -> B::Number {
        self.phase_rate
    }

    /// Number of watched functions.
    pub(crate) fn watches(&self) -> usize {
        self.watched.len()
    }

    /// Number of control points on a piece.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// Number of coefficients of a series about a node.
    pub(crate) fn terms(&self) -> usize {
        self.terms
    }

    /// Length of an extended state at a node, padded.
    pub(crate) fn padded_columns(&self) -> usize {
        padded(self.columns)
    }

    /// Control points of a watched function on a piece.
    #[inline(always)]
    pub(crate) fn control_points(
        &self,
        watched: usize,
        piece: usize,
        extended: &[B::Number],
        out: &mut [RoundedNumber<B>],
    ) {
        self.control[watched].pieces[piece].combine_as(extended, |&y| y.rounded(), out);
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub(crate) fn size(&self, watched: usize, extended: &[B::Number]) -> RoundedNumber<B> {
        let mut sum = RoundedNumber::<B>::zero();
        for (&size, y) in self.control[watched].sizes.iter().zip(extended) {
            sum += size * y.rounded().abs();
        }
        sum
    }

    /// The node nearest to a time of the span, and its time.
    #[inline(always)]
    pub(crate) fn node(&self, time: RoundedNumber<B>) -> (B::Node, B::Number) {
        let half = RoundedNumber::<B>::from_f64(0.5);
        let node = B::nearest_node(time * self.inverse_spacing + half);
        let number = B::Number::from_rounded(B::node_number(node));
        (node, self.spacing * number)
    }

    /// The extended state at a node, where that is wanted and not known; `out` has the padded
    /// length.
    #[inline(always)]
    pub(crate) fn go_to(
        &self,
        node: B::Node,
        wanted: NumberMask<B>,
        known: &mut B::Node,
        extended: &[B::Number],
        out: &mut [B::Number],
    ) {
        if (wanted & B::differ(node, *known)).any() {
            *known = node;
            B::flow_to_node(&self.nodes, node, &extended[..self.columns], out);
            out[self.columns - 1] = B::Number::one();
        }
    }

    /// Taylor coefficients of a watched function about a node, from the extended state there.
    #[inline(always)]
    pub(crate) fn watched_series(
        &self,
        watched: usize,
        at_node: &[B::Number],
        out: &mut [B::Number],
    ) {
        self.watched[watched].combine(at_node, out);
    }

    /// The states at a time after a node, or before, from the extended state there; `series` holds
    /// one series.
    #[inline(always)]
    pub(crate) fn states_at(
        &self,
        time: B::Number,
        at_node: &[B::Number],
        series: &mut [B::Number],
        states: &mut [B::Number],
    ) {
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

impl ControlTables<f64> {
    /// Those of every watched function, and the number of points of a piece; `None` where a series
    /// does not end, or needs too many points.
    fn all<S: Real>(
        matrix: &Matrix<S>,
        watched: &[&[S]],
        length: f64,
        nodes: &Nodes<S>,
    ) -> Option<(Vec<Self>, usize)> {
        let matrix = matrix.rounded();
        let (mut all, mut points) = (Vec::with_capacity(watched.len()), CONTROL_BLOCK);
        for row in watched {
            let row: Vec<f64> = row.iter().map(|value| value.to_f64()).collect();
            let rows = scaled(&matrix.series(&row, length)?, length);
            let series = ChebyshevSeries::new(&rows);
            points = points.max(series.needed(&largest(&rows), SMALL));
            all.push(series);
        }
        points = points.next_multiple_of(CONTROL_BLOCK);
        if points > MAX_POINTS {
            return None;
        }
        let flow = |piece: usize| (piece > 0).then(|| nodes.get(piece * NODES).rounded());
        let flows: [_; PIECES] = std::array::from_fn(flow);
        let tables = all.iter().map(|series| Self::new(series.control_points(points), &flows));
        Some((tables.collect(), points))
    }

    /// From the points of the first piece and the flows to the starts of all.
    fn new(first: RowTable<f64, CONTROL_BLOCK>, flows: &[Option<RowTable<f64>>; PIECES]) -> Self {
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

impl<const N: usize> ControlTables<Lanes<N>> {
    fn interleaved(alone: [&ControlTables<f64>; N]) -> Self {
        let piece = |piece: usize| {
            let tables = alone.map(|own| &own.pieces[piece]);
            RowTable::interleaved(tables, tables[0].rows())
        };
        let size = |column: usize| Lanes::from_fn(|lane| alone[lane].sizes[column]);
        Self {
            pieces: std::array::from_fn(piece),
            sizes: (0..alone[0].sizes.len()).map(size).collect(),
        }
    }
}

/// The coefficients of powers of a share of a length.
fn scaled(series: &Rows<f64>, length: f64) -> Rows<f64> {
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    let rows = series.iter().zip(powers);
    let values = rows.flat_map(|(row, power)| row.iter().map(move |value| value * power));
    Rows::new(series.columns(), values.collect())
}
