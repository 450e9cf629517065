//! Tables of an affine flow over a span of several steps: the control points of each of its pieces,
//! and the motion near any time; for one orbit, or for several in lanes.
//!
//! One idea: a flight to the next event needs no states in between. The pieces of the span are
//! tested one after another by the control points of the gaps alone. The event, and the state where
//! the flight ends, then come from a short series about the nearest of equally spaced nodes. All
//! tables are linear in the start, and only results that are needed are computed. In lanes the rows
//! of all orbits are stored side by side, so that a product with the extended states has the form
//! of that of one orbit.
//!
//! A few control points replace long series, by Lanczos's economisation. A power series on `[0, 1]`
//! is a sum of shifted Chebyshev polynomials `T_m(2x − 1)`, none of them larger than 1. Terms with
//! small coefficients are left out; the error is at most the sum of these coefficients. With
//!
//! ```text
//! x^k = 2^{1−2k} Σ_m C(2k, k−m) T_m(2x − 1),     half of that for m = 0,
//! ```
//!
//! the conversion consists of sums with fixed coefficients. The control points of `T_m(2x − 1)` of
//! degree `m` are `(−1)^{m−i} C(2m, 2i)/C(m, i)`; those of a higher degree are means of neighbours.

use std::sync::{LazyLock, OnceLock};

use num_traits::{One as _, Zero as _};

use super::matrix::{
    AffineFieldRows, MAX_TERMS, Matrix, largest, leading_states, terms_within, unit,
};
use super::nodes::{
    Backend, Batch, LaneNodes, NODES, Nodes, NumberMask, PIECES, RoundedNumber, Single,
};
use super::rows::{RowTable, Rows, accumulate, padded};
use crate::numeric::{Branched, Lanes, Mask, Real, Scalar, polynomial};

/// Length of a piece times the fastest rate: three pieces make a period of a force with this rate.
const REACH: f64 = 2.1;
/// Radius about a node in which its series are accurate, in units of the distance of two nodes.
const NEAR: f64 = 0.6;
/// Error of the control points, as a share of the largest of them: a sixteenth of the margin that
/// signs need.
const SMALL: f64 = 4.0 * f64::EPSILON;

/// Tables of one affine field over a span.
#[derive(Clone, Debug)]
pub(crate) struct SpanTables<B: Backend> {
    span: B::Number,
    spacing: B::Number,
    inverse_spacing: RoundedNumber<B>,
    /// Radius about a node in which its series are accurate: more than half the distance of two
    /// nodes.
    reach: B::Number,
    piece: RoundedNumber<B>,
    phase_rate: B::Number,
    time_scale: RoundedNumber<B>,
    columns: usize,
    points: usize,
    terms: usize,
    /// Control points, one table for each watched function.
    control: Vec<ControlTables<RoundedNumber<B>>>,
    watched: Vec<RowTable<B::Number>>,
    states: Vec<LeadingState<B::Number>>,
    nodes: B::Nodes,
}

/// A state that is not a derivative of another state, its series, and the state that is its
/// derivative, if there is one.
type LeadingState<S> = (usize, RowTable<S>, Option<usize>);

/// Control points of one watched function, in `f64` for every number type of the flow, or in lanes
/// of `f64`.
#[derive(Clone, Debug)]
struct ControlTables<R> {
    pieces: [RowTable<R, CONTROL_BLOCK>; PIECES],
    /// Largest control point of each component.
    sizes: Vec<R>,
}

impl<S: Real> SpanTables<Single<S>> {
    /// Computes the tables; `None` for a field whose flow is a polynomial, or if the numbers
    /// overflow.
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
    /// Combines the tables of all lanes; `None` if their shapes differ.
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

    /// Radius about a node in which its series are accurate: more than half the distance of two
    /// nodes.
    #[inline(always)]
    pub(crate) fn reach(&self) -> B::Number {
        self.reach
    }

    /// Time scale of the field.
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

    /// Padded length of an extended state at a node.
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

    /// Bound on the terms whose sums are the control points of any piece.
    #[inline(always)]
    pub(crate) fn size(&self, watched: usize, extended: &[B::Number]) -> RoundedNumber<B> {
        let mut sum = RoundedNumber::<B>::zero();
        for (&size, y) in self.control[watched].sizes.iter().zip(extended) {
            sum += size * y.rounded().abs();
        }
        sum
    }

    /// Node nearest to a time of the span, and the time of the node.
    #[inline(always)]
    pub(crate) fn node(&self, time: RoundedNumber<B>) -> (B::Node, B::Number) {
        let half = RoundedNumber::<B>::from_f64(0.5);
        let node = B::nearest_node(time * self.inverse_spacing + half);
        let number = B::Number::from_rounded(B::node_number(node));
        (node, self.spacing * number)
    }

    /// Moves the extended state to a node, in lanes where it is wanted and not known; `out` has the
    /// padded length.
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

    /// Taylor coefficients of a watched function about a node, from the extended state at the node.
    #[inline(always)]
    pub(crate) fn watched_series(
        &self,
        watched: usize,
        at_node: &[B::Number],
        out: &mut [B::Number],
    ) {
        self.watched[watched].combine(at_node, out);
    }

    /// The states at a time relative to a node, from the extended state at the node; `series` is
    /// memory for one series.
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
    /// Tables of all watched functions, and the number of control points of a piece; `None` if a
    /// series needs too many terms, or too many points.
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

    /// Tables from the points of the first piece and the flows to the starts of the other pieces.
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

/// Coefficients of a series in the time divided by `length`.
fn scaled(series: &Rows<f64>, length: f64) -> Rows<f64> {
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    let rows = series.iter().zip(powers);
    let values = rows.flat_map(|(row, power)| row.iter().map(move |value| value * power));
    Rows::new(series.columns(), values.collect())
}

/// Number of control points that are computed together.
const CONTROL_BLOCK: usize = 8;
/// Largest number of control points of a piece.
const MAX_POINTS: usize = 64;

/// Coefficients of shifted Chebyshev polynomials, column by column.
struct ChebyshevSeries {
    columns: usize,
    terms: usize,
    values: Vec<f64>,
}

impl ChebyshevSeries {
    /// Chebyshev series from the coefficients of powers on `[0, 1]`.
    pub(super) fn new(rows: &Rows<f64>) -> Self {
        let (columns, terms) = (rows.columns(), rows.len());
        let mut values = vec![0.0; columns * terms];
        for (row, shares) in rows.iter().zip(&*POWERS) {
            for (column, &coefficient) in row.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                let values = &mut values[column * terms..][..terms];
                for (value, &share) in values.iter_mut().zip(shares) {
                    *value += share * coefficient;
                }
            }
        }
        Self { columns, terms, values }
    }

    fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.terms..][..self.terms]
    }

    /// Number of terms that leave an error of at most `share` times the size of each column.
    pub(super) fn needed(&self, sizes: &[f64], share: f64) -> usize {
        let columns = sizes.iter().enumerate().map(|(column, size)| {
            let mut error = 0.0;
            let is_small = |value: &&f64| {
                error += value.abs();
                error <= share * size
            };
            self.terms - self.column(column).iter().rev().take_while(is_small).count()
        });
        columns.max().unwrap_or(0)
    }

    /// Control points on `[0, 1]` of the first `points` terms.
    pub(super) fn control_points(&self, points: usize) -> RowTable<f64, CONTROL_BLOCK> {
        let polynomials = control_points_of_polynomials(points);
        RowTable::from_blocks(points, self.columns, |block, column| {
            let mut sum = [0.0; CONTROL_BLOCK];
            for (&value, points) in self.column(column).iter().zip(polynomials) {
                accumulate(&mut sum, value, &points[block]);
            }
            sum
        })
    }
}

/// For each power its coefficients of Chebyshev polynomials.
static POWERS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let of_power = |power: usize| {
        let mut binomial = (1..=power).fold(2.0, |value, k| {
            // C(2k, k) from C(2k − 2, k − 1), over 4.
            value * (2 * k - 1) as f64 / (2 * k) as f64
        });
        let mut shares = vec![0.5 * binomial];
        for term in 1..=power {
            binomial *= (power + 1 - term) as f64 / (power + term) as f64;
            shares.push(binomial);
        }
        shares
    };
    (0..MAX_TERMS).map(of_power).collect()
});

/// For each of `points` polynomials its `points` control points, in blocks.
fn control_points_of_polynomials(points: usize) -> &'static [Vec<[f64; CONTROL_BLOCK]>] {
    static TABLES: [OnceLock<Vec<Vec<[f64; CONTROL_BLOCK]>>>; MAX_POINTS / CONTROL_BLOCK] =
        [const { OnceLock::new() }; MAX_POINTS / CONTROL_BLOCK];
    TABLES[points / CONTROL_BLOCK - 1].get_or_init(|| {
        let polynomials = (0..points).map(|term| elevated(polynomial(term), points));
        polynomials.map(|points| points.as_chunks().0.to_vec()).collect()
    })
}

/// Control points of the shifted Chebyshev polynomial of a degree, of that same degree.
fn polynomial(degree: usize) -> Vec<f64> {
    let last = degree as f64;
    let mut points = vec![if degree.is_multiple_of(2) { 1.0 } else { -1.0 }];
    for i in 0..degree {
        let i = i as f64;
        // C(2m, 2i + 2)/C(m, i + 1) from C(2m, 2i)/C(m, i).
        let ratio = (2.0 * (last - i) - 1.0) / (2.0 * i + 1.0);
        points.extend(points.last().map(|point| -point * ratio));
    }
    points
}

/// Degree elevation: `count` control points of the same polynomial.
fn elevated(mut points: Vec<f64>, count: usize) -> Vec<f64> {
    while points.len() < count {
        let degree = points.len() as f64;
        let before = [&points[..1], &points].concat();
        let after = [&points[..], &points[points.len() - 1..]].concat();
        let mean = |(i, (before, after)): (usize, (&f64, &f64))| {
            let share = i as f64 / degree;
            share * before + (1.0 - share) * after
        };
        points = before.iter().zip(&after).enumerate().map(mean).collect();
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value of a polynomial from its control points, by de Casteljau's repeated means.
    fn value(points: &[f64], x: f64) -> f64 {
        let mut points = points.to_vec();
        while points.len() > 1 {
            let mean = |pair: &[f64]| (1.0 - x) * pair[0] + x * pair[1];
            points = points.windows(2).map(mean).collect();
        }
        points[0]
    }

    /// Series of `e^{-x}` on `[0, 1]`; at 0 all its terms are positive.
    fn decay() -> ChebyshevSeries {
        let term = |k: i32| (-1f64).powi(k) / (1..=k).map(f64::from).product::<f64>();
        ChebyshevSeries::new(&Rows::new(1, (0..20).map(term).collect()))
    }

    #[test]
    fn an_exponential_is_within_the_share_by_the_terms_needed_and_by_no_fewer() {
        let series = decay();
        for share in [1e-2, 1e-4, 1e-7, 1e-10] {
            let needed = series.needed(&[1.0], share);
            let error = |terms: usize, x: f64| {
                let angle = (2.0 * x - 1.0).acos();
                let terms = series.column(0)[..terms].iter().enumerate();
                let sum: f64 = terms.map(|(m, value)| value * (m as f64 * angle).cos()).sum();
                (sum - (-x).exp()).abs()
            };
            for step in 0..=100 {
                let x = f64::from(step) / 100.0;
                assert!(error(needed, x) <= share, "{share} {x}");
            }
            assert!(error(needed - 1, 0.0) > share, "{share} {needed}");
        }
    }

    #[test]
    fn control_points_of_an_exponential_give_its_values() {
        let series = decay();
        // Eight terms leave out 1e-9.
        assert!(series.needed(&[1.0], 1e-8) <= CONTROL_BLOCK);
        let table = series.control_points(CONTROL_BLOCK);
        let points: Vec<f64> = table.column(0).collect();
        for step in 0..=100 {
            let x = f64::from(step) / 100.0;
            let error = value(&points, x) - (-x).exp();
            assert!(error.abs() <= 1e-8, "{x} {error:e}");
        }
    }

    #[test]
    fn control_points_of_a_polynomial_give_its_values_whatever_their_number() {
        for degree in 0..16 {
            for count in [degree + 1, degree + 2, 24] {
                let points = elevated(polynomial(degree), count);
                for step in 0..=40 {
                    let angle = std::f64::consts::PI * f64::from(step) / 40.0;
                    let error =
                        value(&points, 0.5 + 0.5 * angle.cos()) - (degree as f64 * angle).cos();
                    // Control points of degree 15 reach 2e4 in size.
                    assert!(error.abs() < 1e-11, "{degree} {count} {error:e}");
                }
            }
        }
    }

    #[test]
    fn powers_are_the_sums_of_their_polynomials() {
        for (power, shares) in POWERS.iter().enumerate().take(40) {
            for step in 0..=20 {
                let angle = std::f64::consts::PI * f64::from(step) / 20.0;
                let terms = shares.iter().enumerate();
                let sum: f64 = terms.map(|(m, share)| share * (m as f64 * angle).cos()).sum();
                let x = 0.5 + 0.5 * angle.cos();
                assert!((sum - x.powi(power as i32)).abs() < 1e-14, "{power}");
            }
        }
    }
}
