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
}

impl<S: Real> NodeVisit<S> {
    pub(super) fn new(leaps: &AffineLeaps<S>, columns: usize) -> Self {
        Self {
            node: None,
            values: vec![S::zero(); AffineLeaps::<S>::padded_columns(columns)],
            series: vec![S::zero(); leaps.terms()],
            slopes: vec![S::zero(); leaps.terms()],
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
                Ok((time, slope)) => return (slope < S::zero()).then_some(start + time),
                Err(left) => guess = start + left,
            }
            if !self.is_within(guess) {
                return None;
            }
        }
        None
    }

    /// The same about one node, from a guess for where there is no parabola: the zero and the slope there, or where the
    /// search left the node.
    #[inline(always)]
    pub(super) fn fall_about(&mut self, node: usize, guess: S) -> Result<(S, S), S> {
        let reach = self.leaps.reach();
        let series = &self.series_about(node).series;
        let parabola = falling_root(series).filter(|time| time.abs() <= reach + reach);
        newton(series, parabola.unwrap_or(guess), reach)
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

/// Where the parabola of a series' first terms falls through zero, to `f64`.
#[inline(always)]
fn falling_root<S: Real>(series: &[S]) -> Option<S> {
    let [value, slope, curvature] = series.first_chunk()?.map(Real::to_f64);
    let root = (slope * slope - 4.0 * value * curvature).sqrt();
    let time = 2.0 * value / (root - slope);
    time.is_finite().then(|| S::from_f64(time))
}
