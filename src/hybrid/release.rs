//! The function that ends a contact or a sticking, made positive while that lasts.
//!
//! A contact begins where the surface is met to rounding: a release function that is zero on the surface is then
//! of either sign, while the motion is inward. What the surface was missed by says how much of the function is
//! such a residue.

use super::motion::Motion;
use super::passage::{Gap, Goal, Start};
use super::sensing::Sense;
use crate::numeric::Real;

/// Sign of a release function while its regime lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inside {
    /// Positive: the force on a state that rests on a rigid surface.
    Positive,
    /// Negative: the event function itself.
    Negative,
    /// That of its first values: a function of the user.
    AsItStarts,
}

impl<S: Real> Motion<S> {
    /// The release function on a step of a length, and how it is searched.
    pub(super) fn release_gap<'p>(
        &mut self,
        inside: Inside,
        value: &'p [S],
        slope: &'p [S],
        length: S,
    ) -> (Gap<'p, S>, Start<S>, Goal<S>) {
        let mut start = Start::Inside;
        if self.release_sign == S::zero() {
            let met_within = self.met_within.take().unwrap_or(S::zero());
            let residue = slope[0].abs() * met_within * S::from_f64(2.0);
            let rounding = residue + rounding(value, length);
            let on_zero = value[0].abs() <= rounding;
            self.release_sign = match inside {
                Inside::Positive => S::one(),
                Inside::Negative => -S::one(),
                Inside::AsItStarts if on_zero => slope[0].signum(),
                Inside::AsItStarts => value[0].signum(),
            };
            if on_zero {
                start = Start::Leaving { rounding };
            }
        }
        let gap = Gap {
            value,
            slope,
            sign: self.release_sign,
        };
        let near = S::from_f64(-1.0);
        (gap, start, Goal::Crossing { near })
    }
}

/// A few units in the last place of a polynomial's largest term on a step.
fn rounding<S: Real>(value: &[S], length: S) -> S {
    let largest = value
        .iter()
        .rev()
        .fold(S::zero(), |size, c| (size * length).max(c.abs()));
    S::from_f64(64.0 * S::ROUNDOFF) * largest
}

impl<S: Real> Sense<S> {
    /// Time within which the surface is met: the gap over the speed, at most an eighth of the time to the
    /// turning point of the free flight, for that must not be taken for the surface.
    pub(super) fn met_within(&self) -> S {
        let speed = self.velocity.abs();
        if speed == S::zero() {
            return S::zero();
        }
        let time = (self.gap.abs() + self.rounding) / speed;
        let (turn, curvature) = (speed * S::from_f64(0.125), self.acceleration.abs());
        if time * curvature > turn {
            turn / curvature
        } else {
            time
        }
    }
}
