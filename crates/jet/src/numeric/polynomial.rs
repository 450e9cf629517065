//! All extrema and all real roots of a polynomial on an interval.
//!
//! The one idea: between neighbouring extrema a polynomial is monotone, so the signs of its values
//! at the extrema decide where its roots are, however close together; the extrema themselves are
//! sign changes of the derivative, isolated by subdivision in the Bernstein basis (Descartes' rule
//! of signs; Lane and Riesenfeld 1981, *Bounds on a polynomial*).
//!
//! Coefficients ascend in the power of the time `t`; the interval runs from `0` (excluded) to `end`
//! (included), so that steps laid end to end report each event once. `end` may be negative: then
//! "first", "before" and "after" follow the direction from `0` to `end`. Coefficients or ends that
//! are not finite give no extrema and no roots; callers check theirs.

mod bernstein;
mod control;
mod evaluation;

use std::cmp::Ordering;

use super::{Bracket, Real};
use bernstein::sign_changes;

pub use control::{TERMS, control_points};
pub use evaluation::{lower_bound, sizes};
pub use evaluation::{size, value, value_and_slope};

/// A local minimum or maximum of a polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum<S> {
    /// Where it lies.
    pub time: S,
    /// The polynomial there.
    pub value: S,
    /// Minimum or maximum.
    pub kind: ExtremumKind,
}

/// Which way a polynomial turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExtremumKind {
    /// From falling to rising.
    Minimum,
    /// From rising to falling.
    Maximum,
}

/// A root at which a polynomial changes its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<S> {
    /// Where it lies.
    pub time: S,
    /// From which side.
    pub direction: CrossingDirection,
}

/// Which way a polynomial changes its sign, on the way from `0` to the end of the interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossingDirection {
    /// From positive to negative: into contact, for an event function that is positive in free
    /// flight.
    Entering,
    /// From negative to positive.
    Leaving,
}

/// A real root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root<S> {
    /// Where it lies.
    pub time: S,
    /// Whether the polynomial changes its sign there.
    pub kind: RootKind,
}

/// What a polynomial does at a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RootKind {
    /// It changes its sign.
    Crossing(CrossingDirection),
    /// It turns there, at a value that is zero within rounding.
    Tangency(ExtremumKind),
    /// The interval starts there.
    Start,
}

impl<S: Real> Extremum<S> {
    /// Whether it lies on the far side of zero: a minimum below, a maximum above.
    fn overshoots(&self) -> bool {
        match self.kind {
            ExtremumKind::Minimum => self.value < S::zero(),
            ExtremumKind::Maximum => self.value > S::zero(),
        }
    }
}

/// The value and the derivative at `time` of the polynomial with these ascending coefficients.
///
/// ```
/// use grazemap_jet::numeric::polynomial::evaluate;
/// assert_eq!(evaluate(&[1.0, 0.0, 3.0], 2.0), (13.0, 12.0));
/// ```
pub fn evaluate<S: Real>(coefficients: &[S], time: S) -> (S, S) {
    let start = (S::zero(), S::zero());
    coefficients
        .iter()
        .rev()
        .fold(start, |(value, slope), &coefficient| {
            (value.mul_add(time, coefficient), slope.mul_add(time, value))
        })
}

/// All local minima and maxima in `(0, end]`, in order.
///
/// Each is a sign change of the derivative, located to the precision of the type relative to the
/// conditioning of the derivative's root. Points of inflection with a level tangent are none.
///
/// ```
/// use grazemap_jet::numeric::polynomial::{ExtremumKind, extrema};
/// let found = extrema(&[2.0, -2.0, 1.0], 3.0); // (t - 1)^2 + 1
/// assert_eq!((found[0].time, found[0].value, found[0].kind), (1.0, 1.0, ExtremumKind::Minimum));
/// ```
pub fn extrema<S: Real>(coefficients: &[S], end: S) -> Vec<Extremum<S>> {
    if derivative_has_one_sign(coefficients, end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    extrema_on_unit(&scaled)
        .into_iter()
        .map(|extremum| Extremum {
            time: extremum.time * end,
            ..extremum
        })
        .collect()
}

/// All roots with a change of sign in `(0, end]`, in order, each found inside the monotone piece
/// that holds it.
///
/// Two roots on either side of a shallow extremum are told apart as soon as the extremum's value is
/// computed with the right sign, that is down to about `Scalar::ROUNDOFF` times the largest term. A
/// start at a root is no crossing: set the constant coefficient to exactly zero there.
///
/// ```
/// use grazemap_jet::numeric::polynomial::{CrossingDirection, crossings};
/// let found = crossings(&[0.75_f64, -2.0, 1.0], 1.0); // roots 0.5 and 1.5
/// assert_eq!(found.len(), 1);
/// assert!((found[0].time - 0.5).abs() < 1e-15);
/// assert_eq!(found[0].direction, CrossingDirection::Entering);
/// ```
pub fn crossings<S: Real>(coefficients: &[S], end: S) -> Vec<Crossing<S>> {
    if has_one_sign(coefficients, end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    let mut crossings = crossings_on_unit(&scaled, &extrema_on_unit(&scaled));
    for crossing in &mut crossings {
        crossing.time *= end;
    }
    crossings
}

/// All real roots in `[0, end]`, in order: crossings, tangencies, and the start if it is an exact
/// root.
///
/// An extremum counts as a tangency if its value is within `4 n` roundings of the sum of the terms'
/// magnitudes, for `n` coefficients, unless a crossing next to it already stands for it. The zero
/// polynomial has no roots here.
pub fn roots_on_interval<S: Real>(coefficients: &[S], end: S) -> Vec<Root<S>> {
    if has_one_sign(coefficients, end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    if scaled.iter().all(|&coefficient| coefficient == S::zero()) {
        return Vec::new();
    }
    let extrema = extrema_on_unit(&scaled);
    let crossings = crossings_on_unit(&scaled, &extrema);
    let mut roots = tangencies(&scaled, &extrema, &crossings);
    roots.extend(crossings.iter().map(|crossing| Root {
        time: crossing.time,
        kind: RootKind::Crossing(crossing.direction),
    }));
    if scaled.first() == Some(&S::zero()) {
        roots.push(Root {
            time: S::zero(),
            kind: RootKind::Start,
        });
    }
    roots.sort_by(|a, b| a.time.partial_cmp(&b.time).unwrap_or(Ordering::Equal));
    for root in &mut roots {
        root.time *= end;
    }
    roots
}

/// Whether `|c_0| > sum_{k>0} |c_k end^k|`, so that there is no root; also for what is not finite.
fn has_one_sign<S: Real>(coefficients: &[S], end: S) -> bool {
    let Some((first, rest)) = coefficients.split_first() else {
        return true;
    };
    let end = end.abs();
    let bound = rest.iter().rev().fold(S::zero(), |bound, &coefficient| {
        (bound + coefficient.abs()) * end
    });
    !(first.is_finite() && bound.is_finite()) || first.abs() > bound
}

/// The same for the derivative.
fn derivative_has_one_sign<S: Real>(coefficients: &[S], end: S) -> bool {
    if coefficients.len() < 3 {
        return true;
    }
    let end = end.abs();
    let bound = (2..coefficients.len())
        .rev()
        .fold(S::zero(), |bound, power| {
            (bound + coefficients[power].abs() * S::from_f64(power as f64)) * end
        });
    !(coefficients[1].is_finite() && bound.is_finite()) || coefficients[1].abs() > bound
}

/// `c_k end^k`: the polynomial in `t / end` on `[0, 1]`.
fn scaled_to_unit<S: Real>(coefficients: &[S], end: S) -> Vec<S> {
    let mut power = S::one();
    let scaled = coefficients.iter().map(|&coefficient| {
        let value = coefficient * power;
        power *= end;
        value
    });
    scaled.collect()
}

fn derivative<S: Real>(coefficients: &[S]) -> Vec<S> {
    let terms = coefficients.iter().enumerate().skip(1);
    terms
        .map(|(power, &coefficient)| coefficient * S::from_f64(power as f64))
        .collect()
}

fn extrema_on_unit<S: Real>(scaled: &[S]) -> Vec<Extremum<S>> {
    let slope = derivative(scaled);
    let turns = sign_changes(&slope).into_iter().map(|change| Extremum {
        time: change.time,
        value: evaluate(scaled, change.time).0,
        kind: match change.direction {
            CrossingDirection::Leaving => ExtremumKind::Minimum,
            CrossingDirection::Entering => ExtremumKind::Maximum,
        },
    });
    turns.collect()
}

/// The crossings of each monotone piece between `0`, the extrema and `1`.
fn crossings_on_unit<S: Real>(scaled: &[S], extrema: &[Extremum<S>]) -> Vec<Crossing<S>> {
    let start = (S::zero(), scaled.first().copied().unwrap_or(S::zero()));
    let end = (S::one(), evaluate(scaled, S::one()).0);
    let mut crossings = Vec::new();
    let mut before = start;
    let turns = extrema
        .iter()
        .map(|extremum| (extremum.time, extremum.value));
    for after in turns.chain([end]) {
        if let Some(crossing) = crossing_between(scaled, before, after) {
            crossings.push(crossing);
        }
        before = after;
    }
    crossings.extend(crossing_at_end(scaled, extrema, end.1));
    crossings
}

/// The crossing of a monotone piece, if the signs at its ends differ.
fn crossing_between<S: Real>(scaled: &[S], before: (S, S), after: (S, S)) -> Option<Crossing<S>> {
    let zero = S::zero();
    let direction = if before.1 > zero && after.1 < zero {
        CrossingDirection::Entering
    } else if before.1 < zero && after.1 > zero {
        CrossingDirection::Leaving
    } else {
        return None;
    };
    let bracket = Bracket::new(before.0, after.0, before.1, after.1).ok()?;
    let time = bracket.newton(zero, |time| evaluate(scaled, time)).root()?;
    Some(Crossing { time, direction })
}

/// A root exactly at the end, entered from a side that is not zero.
fn crossing_at_end<S: Real>(
    scaled: &[S],
    extrema: &[Extremum<S>],
    value: S,
) -> Option<Crossing<S>> {
    let turns_there = extrema
        .last()
        .is_some_and(|extremum| extremum.time == S::one());
    if value != S::zero() || turns_there {
        return None;
    }
    let before = extrema
        .last()
        .map_or(scaled.first().copied()?, |extremum| extremum.value);
    let direction = if before > S::zero() {
        CrossingDirection::Entering
    } else if before < S::zero() {
        CrossingDirection::Leaving
    } else {
        return None;
    };
    Some(Crossing {
        time: S::one(),
        direction,
    })
}

/// Extrema whose value is zero within rounding and that have no crossing in the pieces next to them
/// on the far side.
fn tangencies<S: Real>(
    scaled: &[S],
    extrema: &[Extremum<S>],
    crossings: &[Crossing<S>],
) -> Vec<Root<S>> {
    let terms: S = scaled.iter().map(|coefficient| coefficient.abs()).sum();
    let rounding = terms * S::from_f64(4.0 * scaled.len() as f64 * S::ROUNDOFF);
    let crossed = |index: usize| {
        let before = index
            .checked_sub(1)
            .map_or(S::zero(), |previous| extrema[previous].time);
        let after = extrema.get(index + 1).map_or(S::one(), |next| next.time);
        extrema[index].overshoots()
            && crossings
                .iter()
                .any(|crossing| before <= crossing.time && crossing.time <= after)
    };
    let touching = extrema
        .iter()
        .enumerate()
        .filter(|(index, extremum)| extremum.value.abs() <= rounding && !crossed(*index));
    touching
        .map(|(_, extremum)| Root {
            time: extremum.time,
            kind: RootKind::Tangency(extremum.kind),
        })
        .collect()
}

#[cfg(test)]
mod tests;
