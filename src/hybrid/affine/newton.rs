//! Zeros of a gap and of its slope along a span, by Newton's method on the series about the nearest node.

use crate::flow::AffineLeaps;
use crate::numeric::{Real, polynomial};

/// Where a gap turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn<S> {
    /// Time since the start of the span.
    pub(super) time: S,
    /// The gap there.
    pub(super) gap: S,
    /// Its second derivative there.
    pub(super) curvature: S,
}

/// The motion about the node visited last.
#[derive(Clone, Debug)]
pub(super) struct NodeVisit<S> {
    node: Option<usize>,
    /// The extended state there, padded.
    values: Vec<S>,
    pub(super) series: Vec<S>,
    slopes: Vec<S>,
    /// The series in `f64`.
    rounded: Vec<f64>,
}

impl<S: Real> NodeVisit<S> {
    pub(super) fn new(leaps: &AffineLeaps<S>, columns: usize) -> Self {
        Self {
            node: None,
            values: vec![S::zero(); AffineLeaps::<S>::padded_columns(columns)],
            series: vec![S::zero(); leaps.terms()],
            slopes: vec![S::zero(); leaps.terms()],
            rounded: vec![0.0; leaps.terms()],
        }
    }

    /// To be called where a span starts.
    pub(super) fn forget(&mut self) {
        self.node = None;
    }

    #[inline(always)]
    fn go_to(&mut self, node: usize, leaps: &AffineLeaps<S>, extended: &[S]) {
        if self.node != Some(node) {
            leaps.at_node(node, extended, &mut self.values);
            self.node = Some(node);
        }
    }

    /// The states at a time of the span.
    #[inline(always)]
    pub(super) fn states_at(
        &mut self,
        time: S,
        leaps: &AffineLeaps<S>,
        extended: &[S],
        states: &mut [S],
    ) {
        let (node, start) = leaps.node(time.to_f64());
        self.go_to(node, leaps, extended);
        leaps.states_at(time - start, &self.values, &mut self.series, states);
    }
}

/// The gap of one surface along a span.
pub(super) struct GapCourse<'t, S: Real> {
    pub(super) leaps: &'t AffineLeaps<S>,
    pub(super) extended: &'t [S],
    pub(super) surface: usize,
    pub(super) visit: &'t mut NodeVisit<S>,
}

/// Share of the reach of a node, and of a slope, within which a zero is known when it is to be polished.
const CLOSE: f64 = 1e-4;
/// Most steps of Newton's method, and most changes of the node.
const MAX_NEWTON: usize = 8;

impl<S: Real> GapCourse<'_, S> {
    /// The zero near a time at which the gap falls, from that of the parabola about the node.
    #[inline(always)]
    pub(super) fn fall(&mut self, near: f64) -> Option<S> {
        let mut guess = S::from_f64(near);
        for _ in 0..MAX_NEWTON {
            let (node, start) = self.leaps.node(guess.to_f64());
            match self.fall_about(node, guess - start) {
                Ok(time) => return Some(start + time),
                Err(left) => guess = start + left,
            }
            if !self.is_within(guess) {
                return None;
            }
        }
        None
    }

    /// The same about one node, from a guess for where there is no parabola; where the search left the node, if it did.
    #[inline(always)]
    pub(super) fn fall_about(&mut self, node: usize, guess: S) -> Result<S, S> {
        let reach = self.leaps.reach().to_f64();
        let NodeVisit {
            series, rounded, ..
        } = self.series_about(node);
        round(series, rounded);
        let near = falling_zero(rounded, guess.to_f64(), reach).map_err(S::from_f64)?;
        near.polished(series, reach)
    }

    /// The extremum near a time.
    #[inline(always)]
    pub(super) fn turn(&mut self, near: f64) -> Option<Turn<S>> {
        let mut guess = S::from_f64(near);
        for _ in 0..MAX_NEWTON {
            let (node, start) = self.leaps.node(guess.to_f64());
            match self.turn_about(node, guess - start) {
                Ok(turn) => {
                    return Some(Turn {
                        time: start + turn.time,
                        ..turn
                    });
                }
                Err(left) => guess = start + left,
            }
            if !self.is_within(guess) {
                return None;
            }
        }
        None
    }

    /// The same about one node, its time counted from there.
    #[inline(always)]
    pub(super) fn turn_about(&mut self, node: usize, guess: S) -> Result<Turn<S>, S> {
        let reach = self.leaps.reach();
        let NodeVisit { series, slopes, .. } = self.series_about(node);
        differentiate(series, slopes);
        let chord = -slopes[0] / slopes[1];
        let is_near = chord.abs() <= reach + reach;
        let (time, curvature) = newton(slopes, if is_near { chord } else { guess }, reach)?;
        Ok(Turn {
            time,
            gap: polynomial::value(series, time),
            curvature,
        })
    }

    /// The gap at a time.
    #[inline(always)]
    pub(super) fn value(&mut self, time: S) -> S {
        let (node, start) = self.leaps.node(time.to_f64());
        polynomial::value(&self.series_about(node).series, time - start)
    }

    /// The slope at a time.
    #[inline(always)]
    pub(super) fn slope(&mut self, time: S) -> S {
        let (node, start) = self.leaps.node(time.to_f64());
        polynomial::value_and_slope(&self.series_about(node).series, time - start).1
    }

    #[inline(always)]
    fn series_about(&mut self, node: usize) -> &mut NodeVisit<S> {
        let (leaps, visit) = (self.leaps, &mut *self.visit);
        visit.go_to(node, leaps, self.extended);
        leaps.watched_series(self.surface, &visit.values, &mut visit.series);
        visit
    }

    fn is_within(&self, time: S) -> bool {
        let reach = self.leaps.reach();
        time > -reach && time < self.leaps.span() + reach
    }
}

/// A zero of a series within reach of its node and the slope there, by Newton's method from a time; where it went
/// otherwise.
///
/// After a step `Δ` the error is about `Δ² |p''/2p'|`; `p''` is taken from the last two slopes, and twice as large.
#[inline(always)]
fn newton<S: Real>(series: &[S], start: S, reach: S) -> Result<(S, S), S> {
    let rounding = S::from_f64(0.25 * S::ROUNDOFF) * reach;
    let least = S::from_f64(4.0) / reach;
    let mut time = start;
    let mut before = None;
    for _ in 0..MAX_NEWTON {
        let (value, slope) = polynomial::value_and_slope(series, time);
        let change = -value / slope;
        let is_last = |(last, last_slope): (S, S)| {
            let run = ((time - last) * slope).abs();
            ((slope - last_slope).abs() + least * run) * change * change <= rounding * run
        };
        let settled = change == S::zero() || before.is_some_and(is_last);
        before = Some((time, slope));
        time += change;
        let is_near = time.abs() <= reach;
        if settled && is_near {
            return Ok((time, slope));
        }
        if !is_near {
            break;
        }
    }
    Err(time)
}

/// Rounds a series of whole blocks.
///
/// NOTE: block by block, as it was written: a wider load would wait until two stores have reached the cache.
#[inline(always)]
fn round<S: Real>(series: &[S], rounded: &mut [f64]) {
    let blocks = rounded.as_chunks_mut::<4>().0.iter_mut();
    for (rounded, block) in blocks.zip(series.as_chunks::<4>().0) {
        *rounded = block.map(Real::to_f64);
    }
}

/// Coefficients of the derivative, padded with a zero.
#[inline(always)]
fn differentiate<S: Real>(series: &[S], slopes: &mut [S]) {
    let mut power = S::zero();
    for (slope, &value) in slopes.iter_mut().zip(&series[1..]) {
        power += S::one();
        *slope = value * power;
    }
    if let Some(last) = slopes.last_mut() {
        *last = S::zero();
    }
}

/// A zero at which a series falls, to `f64`.
#[derive(Clone, Copy, Debug)]
struct NearZero {
    time: f64,
    slope: f64,
    curvature: f64,
    /// A bound of the third derivative.
    third: f64,
    /// A bound of the error of the time.
    error: f64,
}

/// The zero within reach of a node at which a series falls, by parabolas about one point after another, first about the
/// node; from a guess where that one has no zero near. Where the search left the node, if it did.
///
/// With `g`, `g'`, `g''` at a point the next is `s = 2 g / (√(g'² − 2 g g'') − g')` further, with an error of
/// `g''' s³ / 6` over the speed there: near a graze, where the gap is a parabola, no more than elsewhere.
#[inline(always)]
fn falling_zero(series: &[f64], guess: f64, reach: f64) -> Result<NearZero, f64> {
    let [c0, c1, c2, c3, c4, c5] = std::array::from_fn(|k| series.get(k).copied().unwrap_or(0.0));
    let third = 6.0 * c3.abs() + reach * (24.0 * c4.abs() + reach * 60.0 * c5.abs());
    let size = c0.abs() + reach * (c1.abs() + reach * c2.abs());
    let (start, _) = parabola(c0, c1, 2.0 * c2);
    let mut time = if start.abs() <= 2.0 * reach {
        start
    } else {
        guess
    };
    for _ in 0..MAX_NEWTON {
        let (value, slope) = polynomial::value_and_slope(series, time);
        let curvature = 2.0 * c2 + time * (6.0 * c3 + time * (12.0 * c4 + time * 20.0 * c5));
        let (step, speed) = parabola(value, slope, curvature);
        time += step;
        let is_near = time.abs() <= reach;
        if !is_near {
            break;
        }
        let error = (third * step.abs().powi(3) / 6.0 + 4.0 * f64::EPSILON * size) / speed;
        if error <= CLOSE * reach && (curvature.abs() + third * reach) * error <= CLOSE * speed {
            return Ok(NearZero {
                time,
                slope: -speed,
                curvature,
                third,
                error,
            });
        }
    }
    Err(time)
}

impl NearZero {
    /// The same to the rounding of other numbers, by Newton's method: a step takes one value, for the slope is known.
    #[inline(always)]
    fn polished<S: Real>(self, series: &[S], reach: f64) -> Result<S, S> {
        let (mut time, mut error) = (S::from_f64(self.time), self.error);
        for _ in 0..MAX_NEWTON {
            if error <= 0.25 * S::ROUNDOFF * reach {
                return Ok(time);
            }
            time -= polynomial::value(series, time) / S::from_f64(self.slope);
            let bend = (self.curvature.abs() + self.third * self.error) * self.error;
            error *= bend / self.slope.abs() + f64::EPSILON;
        }
        Err(time)
    }
}

/// From a point to where the parabola with this value, slope and curvature falls through zero, and its speed there.
#[inline(always)]
fn parabola(value: f64, slope: f64, curvature: f64) -> (f64, f64) {
    let speed = (slope * slope - 2.0 * value * curvature).sqrt();
    (2.0 * value / (speed - slope), speed)
}
