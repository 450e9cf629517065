//! Zeros of a gap and of its slope along a span, on the series about the nearest node: falling
//! zeros by parabolas, refined in the number type of the flow; extrema by Newton's method.
//!
//! One idea: near a graze a gap is a parabola, whose zeros are known, while Newton's method from
//! far away is slow. All operations are masked, so that one orbit and several in lanes run the same
//! ones.

use num_traits::Zero as _;

use crate::flow::{Backend, NumberMask, RoundedNumber, SpanTables};
use crate::numeric::{Branched, Mask, Scalar, polynomial};

/// Largest number of Newton steps, and of changes of the node.
const MAX_NEWTON: usize = 8;
/// Accuracy at which refinement starts, as a share of the reach of a node, and of a slope.
const CLOSE: f64 = 1e-4;

/// Extremum of a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GapExtremum<S: Branched> {
    /// Time since the start of the span.
    pub(super) time: S,
    /// Gap at the extremum.
    pub(super) gap: S,
    /// Second derivative at the extremum.
    pub(super) curvature: S,
    /// Time for which the gap is known to rise after the extremum.
    pub(super) rises_for: S,
    /// Mask: there is an extremum.
    pub(super) found: S::Mask,
}

/// A zero of a gap or of its slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Zero<S: Branched> {
    /// Time of the zero, or the time at which the search left the node.
    pub(super) time: S,
    /// Slope at that time.
    slope: S,
    /// Mask: the time is a zero.
    pub(super) found: S::Mask,
}

/// Motion about the node visited last.
#[derive(Clone, Debug)]
pub(super) struct NodeVisit<B: Backend> {
    node: B::Node,
    /// Extended state at the node, padded.
    values: Vec<B::Number>,
    pub(super) series: Vec<B::Number>,
    slopes: Vec<B::Number>,
    /// Memory for the series in `f64`.
    rounded: Vec<RoundedNumber<B>>,
}

impl<B: Backend> NodeVisit<B> {
    pub(super) fn new(tables: &SpanTables<B>) -> Self {
        let zero = B::Number::zero();
        Self {
            node: B::NOWHERE,
            values: vec![zero; tables.padded_columns()],
            series: vec![zero; tables.terms()],
            slopes: vec![zero; tables.terms()],
            rounded: vec![RoundedNumber::<B>::zero(); tables.terms()],
        }
    }

    /// Forgets the node when a span starts.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        self.node = B::NOWHERE;
    }

    /// Computes the states at a time of the span.
    #[inline(always)]
    pub(super) fn states_at(
        &mut self,
        time: B::Number,
        wanted: NumberMask<B>,
        tables: &SpanTables<B>,
        extended: &[B::Number],
        states: &mut [B::Number],
    ) {
        let (node, start) = tables.node(time.rounded());
        tables.go_to(node, wanted, &mut self.node, extended, &mut self.values);
        tables.states_at(time - start, &self.values, &mut self.series, states);
    }
}

/// Gap of one surface along a span.
pub(super) struct GapCourse<'t, B: Backend> {
    pub(super) tables: &'t SpanTables<B>,
    pub(super) extended: &'t [B::Number],
    pub(super) surface: usize,
    pub(super) visit: &'t mut NodeVisit<B>,
}

impl<B: Backend> GapCourse<'_, B> {
    /// Falling zero of the gap near a time, starting from the zero of the parabola about the node.
    #[inline(always)]
    pub(super) fn fall(
        &mut self,
        near: RoundedNumber<B>,
        wanted: NumberMask<B>,
    ) -> (B::Number, NumberMask<B>) {
        let mut time = B::Number::from_rounded(near);
        let (mut going, mut found) = (wanted, NumberMask::<B>::NONE);
        for _ in 0..MAX_NEWTON {
            let (node, start) = self.tables.node(time.rounded());
            let zero = self.fall_about(node, time - start, going);
            time = B::Number::select(going, start + zero.time, time);
            found |= going & zero.found;
            going &= !zero.found & self.is_within(time);
            if !going.any() {
                break;
            }
            B::Number::carried(&mut time);
        }
        (time, found)
    }

    /// Falling zero about one node, starting from `guess` if the parabola has no zero near it.
    #[inline(always)]
    pub(super) fn fall_about(
        &mut self,
        node: B::Node,
        guess: B::Number,
        wanted: NumberMask<B>,
    ) -> Zero<B::Number> {
        let reach = self.tables.reach().rounded();
        let NodeVisit { series, rounded, .. } = self.series_about(node, wanted);
        let rounded = B::Number::all_rounded(series, rounded);
        let near = falling_zero(rounded, guess.rounded(), reach, wanted);
        near.polished(series, reach)
    }

    /// Extremum of the gap near a time.
    #[inline(always)]
    pub(super) fn turn(
        &mut self,
        near: RoundedNumber<B>,
        wanted: NumberMask<B>,
    ) -> GapExtremum<B::Number> {
        let time = B::Number::from_rounded(near);
        let mut turn = GapExtremum {
            time,
            gap: time,
            curvature: time,
            rises_for: time,
            found: NumberMask::<B>::NONE,
        };
        let mut going = wanted;
        for _ in 0..MAX_NEWTON {
            let (node, start) = self.tables.node(turn.time.rounded());
            let next = self.turn_about(node, turn.time - start, going);
            let select = |one, other| B::Number::select(going, one, other);
            turn = GapExtremum {
                time: select(start + next.time, turn.time),
                gap: select(next.gap, turn.gap),
                curvature: select(next.curvature, turn.curvature),
                rises_for: select(next.rises_for, turn.rises_for),
                found: turn.found | (going & next.found),
            };
            going &= !next.found & self.is_within(turn.time);
            if !going.any() {
                break;
            }
            B::Number::carried(&mut turn);
        }
        turn
    }

    /// Extremum about one node; times are counted from the node.
    #[inline(always)]
    pub(super) fn turn_about(
        &mut self,
        node: B::Node,
        guess: B::Number,
        wanted: NumberMask<B>,
    ) -> GapExtremum<B::Number> {
        let reach = self.tables.reach();
        let NodeVisit { series, slopes, .. } = self.series_about(node, wanted);
        turn(series, slopes, guess, reach, wanted)
    }

    /// Value of the gap at a time.
    #[inline(always)]
    pub(super) fn value(&mut self, time: B::Number, wanted: NumberMask<B>) -> B::Number {
        let (node, start) = self.tables.node(time.rounded());
        polynomial::value(&self.series_about(node, wanted).series, time - start)
    }

    /// Slope of the gap at a time.
    #[inline(always)]
    pub(super) fn slope(&mut self, time: B::Number, wanted: NumberMask<B>) -> B::Number {
        let (node, start) = self.tables.node(time.rounded());
        polynomial::value_and_slope(&self.series_about(node, wanted).series, time - start).1
    }

    #[inline(always)]
    fn series_about(&mut self, node: B::Node, wanted: NumberMask<B>) -> &mut NodeVisit<B> {
        let (tables, visit) = (self.tables, &mut *self.visit);
        let values = &mut visit.values;
        tables.go_to(node, wanted, &mut visit.node, self.extended, values);
        tables.watched_series(self.surface, &visit.values, &mut visit.series);
        visit
    }

    #[inline(always)]
    fn is_within(&self, time: B::Number) -> NumberMask<B> {
        let reach = self.tables.reach();
        (-reach).is_below(time) & time.is_below(self.tables.span() + reach)
    }
}

/// Extremum of a series within reach of its node. The search starts at the extremum of the parabola
/// about the node, or at a guess if the parabola has none nearby; `slopes` is overwritten by the
/// derivative.
#[inline(always)]
fn turn<S: Branched>(
    series: &[S],
    slopes: &mut [S],
    guess: S,
    reach: S,
    wanted: S::Mask,
) -> GapExtremum<S> {
    differentiate(series, slopes);
    let chord = -slopes[0] / slopes[1];
    let is_near = chord.abs().is_at_most(reach + reach);
    let guess = S::select(is_near, chord, guess);
    let zero = newton(slopes, guess, reach, wanted);
    let convex = is_convex(series, reach.rounded());
    let rises_for = S::select(convex, reach - zero.time, S::zero());
    GapExtremum {
        time: zero.time,
        gap: polynomial::value(series, zero.time),
        curvature: zero.slope,
        rises_for,
        found: zero.found,
    }
}

/// Zero of a series within reach of its node, and the slope there, by Newton's method from `start`;
/// otherwise the time at which the search left the node.
///
/// After a step `Δ` the error is about `Δ² |p''/2p'|`; `p''` is estimated from the last two slopes
/// and doubled.
#[inline(always)]
fn newton<S: Branched>(series: &[S], start: S, reach: S, wanted: S::Mask) -> Zero<S> {
    let rounding = S::from_f64(0.25 * S::ROUNDOFF) * reach;
    let least = S::from_f64(4.0) / reach;
    let mut zero = Zero { time: start, slope: start, found: S::Mask::NONE };
    let mut going = wanted;
    let mut before = (start, start);
    for step in 0..MAX_NEWTON {
        let (value, slope) = polynomial::value_and_slope(series, zero.time);
        let change = -value / slope;
        let mut settled = change.is_equal(S::zero());
        if step > 0 {
            let (last, last_slope) = before;
            let run = ((zero.time - last) * slope).abs();
            let error = ((slope - last_slope).abs() + least * run) * change * change;
            settled |= error.is_at_most(rounding * run);
        }
        before = (zero.time, slope);
        zero.time = S::select(going, zero.time + change, zero.time);
        zero.slope = S::select(going, slope, zero.slope);
        let is_near = zero.time.abs().is_at_most(reach);
        zero.found |= going & settled & is_near;
        going &= !settled & is_near;
        if !going.any() {
            break;
        }
        S::carried(&mut zero);
        S::carried(&mut before);
    }
    zero
}

/// Whether the second derivative is positive up to a distance from the start of a series: it
/// exceeds the sum of all amounts by which further terms can reduce it.
#[inline(always)]
pub(super) fn is_convex<S: Branched>(series: &[S], reach: S::Rounded) -> S::Mask {
    let number = S::Rounded::from_f64;
    let mut bound = number(0.0);
    for (degree, coefficient) in series.iter().enumerate().skip(3).rev() {
        let factor = number((degree * (degree - 1)) as f64);
        bound = (bound + factor * coefficient.abs().rounded()) * reach;
    }
    bound.is_below(number(2.0) * series[2].rounded())
}

/// Coefficients of the derivative, padded with a zero.
#[inline(always)]
fn differentiate<S: Scalar>(series: &[S], slopes: &mut [S]) {
    let mut power = S::zero();
    for (slope, &value) in slopes.iter_mut().zip(&series[1..]) {
        power += S::one();
        *slope = value * power;
    }
    if let Some(last) = slopes.last_mut() {
        *last = S::zero();
    }
}

/// A falling zero of a series, to `f64`.
#[derive(Clone, Copy, Debug)]
struct NearZero<S: Branched> {
    /// Time of the zero, or the time at which the search left the node.
    time: S,
    slope: S,
    curvature: S,
    /// Bound on the third derivative.
    third: S,
    /// Bound on the error of the time.
    error: S,
    /// Mask: the time is a zero.
    found: S::Mask,
}

/// Falling zero of a series within reach of its node, by parabolas about successive points, first
/// about the node, or about a guess if the first parabola has no zero nearby; otherwise the time at
/// which the search left the node.
///
/// With `g`, `g'`, `g''` at a point, the next point is `s = 2 g / (√(g'² − 2 g g'') − g')` further,
/// with an error of `g''' s³ / 6` divided by the speed there: near a graze, where the gap is a
/// parabola, the error is no larger than elsewhere.
#[inline(always)]
fn falling_zero<S: Branched>(series: &[S], guess: S, reach: S, wanted: S::Mask) -> NearZero<S> {
    let number = S::from_f64;
    let [c0, c1, c2, c3, c4, c5] =
        std::array::from_fn(|k| series.get(k).copied().unwrap_or(S::zero()));
    let third = number(6.0) * c3.abs()
        + reach * (number(24.0) * c4.abs() + reach * number(60.0) * c5.abs());
    let size = c0.abs() + reach * (c1.abs() + reach * c2.abs());
    let rounding = number(4.0 * f64::EPSILON) * size;
    let close = number(CLOSE) * reach;
    let (start, _) = parabola(c0, c1, number(2.0) * c2);
    let is_near = start.abs().is_at_most(number(2.0) * reach);
    let mut zero = NearZero {
        time: S::select(is_near, start, guess),
        slope: c1,
        curvature: c2,
        third,
        error: size,
        found: S::Mask::NONE,
    };
    let mut going = wanted;
    for _ in 0..MAX_NEWTON {
        let time = zero.time;
        let (value, slope) = polynomial::value_and_slope(series, time);
        let bend = number(6.0) * c3 + time * (number(12.0) * c4 + time * number(20.0) * c5);
        let curvature = number(2.0) * c2 + time * bend;
        let (step, speed) = parabola(value, slope, curvature);
        let size = step.abs();
        let error = (third * (size * size * size) / number(6.0) + rounding) / speed;
        let select = |one, other| S::select(going, one, other);
        zero.time = select(time + step, time);
        zero.slope = select(-speed, zero.slope);
        zero.curvature = select(curvature, zero.curvature);
        zero.error = select(error, zero.error);
        let is_near = zero.time.abs().is_at_most(reach);
        let bent = (curvature.abs() + third * reach) * error;
        let is_close = error.is_at_most(close) & bent.is_at_most(number(CLOSE) * speed);
        zero.found |= going & is_near & is_close;
        going &= is_near & !is_close;
        if !going.any() {
            break;
        }
        S::carried(&mut zero);
    }
    zero
}

impl<R: Branched<Rounded = R>> NearZero<R> {
    /// Refines the zero to the rounding of another number type, by Newton's method. A step takes
    /// one value, because the slope is known.
    #[inline(always)]
    fn polished<S>(self, series: &[S], reach: R) -> Zero<S>
    where
        S: Branched<Rounded = R, Mask = R::Mask>,
    {
        let slope = S::from_rounded(self.slope);
        let limit = R::from_f64(0.25 * S::ROUNDOFF) * reach;
        let bend = self.curvature.abs() + self.third * self.error;
        let bend = bend * self.error / self.slope.abs() + R::from_f64(f64::EPSILON);
        let (mut time, mut error) = (S::from_rounded(self.time), self.error);
        let (mut going, mut found) = (self.found, R::Mask::NONE);
        for _ in 0..MAX_NEWTON {
            let done = error.is_at_most(limit);
            found |= going & done;
            going &= !done;
            if !going.any() {
                break;
            }
            let next = time - polynomial::value(series, time) / slope;
            time = S::select(going, next, time);
            error = R::select(going, error * bend, error);
            R::carried(&mut time);
            R::carried(&mut error);
        }
        Zero { time, slope, found }
    }
}

/// Distance from a point to the zero at which the parabola with this value, slope and curvature
/// falls, and its speed there.
#[inline(always)]
fn parabola<S: Scalar>(value: S, slope: S, curvature: S) -> (S, S) {
    let two = S::from_f64(2.0);
    let speed = (slope * slope - two * value * curvature).sqrt();
    (two * value / (speed - slope), speed)
}
