//! Completion of a chatter: infinitely many impacts in finite time, summed.
//!
//! Nordmark and Piiroinen (2009). The normal motion between impacts is `h = v t − α t²/2 + j t³/6`
//! with `α = −h'' > 0` (pressing) and `j = h'''`, both along the free flow. One flight takes
//! `τ = 2v/α + 4 j v²/(3 α³)` and meets the surface at the speed `v − 2 j v²/(3 α²)`; with the
//! restitution `r` the next flight starts at `r` times that and `α − j τ`. Summing,
//!
//! ```text
//! T = T₀ (1 + j T₀ / (3 α)),   T₀ = 2 v / (α (1 − r)),
//! ```
//!
//! with an error of order `T₀³`.

use super::sensing::Sense;
use crate::numeric::{Branched, Mask, Real};

/// Normal motion just after an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rebound<S> {
    /// Speed at which the surface was met.
    pub(crate) speed: S,
    /// Speed at which it is left.
    pub(crate) rebound: S,
    /// `h''` along the free flow.
    pub(crate) acceleration: S,
    /// `h'''` along the free flow.
    pub(crate) jerk: S,
}

/// What follows an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AfterImpact<S> {
    /// A free flight.
    Flight,
    /// The remaining impacts are summed; contact is lasting after this duration.
    Complete {
        /// Sum of the remaining flights.
        duration: S,
    },
}

impl<S: Branched> Rebound<S> {
    /// Of an impact at this speed, from the normal motion after it.
    #[inline(always)]
    pub(crate) fn new(speed: S, after: &Sense<S>) -> Self {
        Self { speed, rebound: after.velocity, acceleration: after.acceleration, jerk: after.jerk }
    }

    /// Where a free flight follows: elsewhere the chatter's leading duration is below `ε^(1/4)` of
    /// the time scale on which the normal acceleration changes.
    ///
    /// The series' error, `T₀³`, and the error of the impacts' times from rounding of the position,
    /// about `ε/T₀`, are then equal.
    #[inline(always)]
    pub(crate) fn flies_on(&self, wanted: S::Mask, time_scale: S) -> S::Mask {
        let zero = S::zero();
        let pressed = wanted & !zero.is_at_most(self.acceleration);
        if !pressed.any() {
            return wanted;
        }
        let pressing = -self.acceleration;
        let change = self.jerk.abs() * time_scale;
        let changes = pressing.is_below(change);
        let time_scale = S::select(changes, time_scale * pressing / change, time_scale);
        let limit = time_scale * S::from_f64(S::ROUNDOFF.sqrt().sqrt());
        let lasts = self.speed.is_at_most(self.rebound) | limit.is_below(self.leading());
        wanted & (!pressed | (lasts & !self.rebound.is_at_most(zero)))
    }

    /// `T₀`.
    #[inline(always)]
    fn leading(&self) -> S {
        let restitution = self.rebound / self.speed;
        (self.rebound + self.rebound) / (-self.acceleration * (S::one() - restitution))
    }
}

impl<S: Real> Rebound<S> {
    /// Completes the chatter where no [free flight](Self::flies_on) follows.
    #[inline(always)]
    pub(crate) fn follow(&self, time_scale: S) -> AfterImpact<S> {
        if self.flies_on(true, time_scale) {
            return AfterImpact::Flight;
        }
        if self.rebound <= S::zero() {
            return AfterImpact::Complete { duration: S::zero() };
        }
        let leading = self.leading();
        let correction = self.jerk * leading / (S::from_f64(3.0) * -self.acceleration);
        AfterImpact::Complete { duration: leading * (S::one() + correction) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Impacts one by one, each flight's end found by Newton's method.
    fn summed(mut v: f64, mut alpha: f64, j: f64, r: f64) -> f64 {
        let mut total = 0.0;
        while v > 1e-18 {
            let mut t = 2.0 * v / alpha;
            for _ in 0..20 {
                t -= (v - alpha * t / 2.0 + j * t * t / 6.0) / (-alpha / 2.0 + j * t / 3.0);
            }
            let speed = -(v - alpha * t + j * t * t / 2.0);
            (v, alpha, total) = (r * speed, alpha - j * t, total + t);
        }
        total
    }

    #[test]
    fn completed_duration_agrees_with_impacts_one_by_one_to_third_order() {
        for (j, r) in [(0.0, 0.8), (1.5, 0.8), (-2.0, 0.5)] {
            let v = 1e-6;
            let rebound = Rebound { speed: v / r, rebound: v, acceleration: -3.0, jerk: j };
            let AfterImpact::Complete { duration } = rebound.follow(1.0) else {
                panic!("completes")
            };
            assert!((duration - summed(v, 3.0, j, r)).abs() < 1e-15, "{j} {r}");
        }
    }

    #[test]
    fn no_chatter_while_leaving_or_without_loss() {
        let flight = Rebound { speed: 1e-9, rebound: 1e-9, acceleration: -1.0, jerk: 0.0 };
        assert_eq!(flight.follow(1.0), AfterImpact::Flight);
        let leaving = Rebound { speed: 1e-9, rebound: 0.0, acceleration: 1.0, jerk: 0.0 };
        assert_eq!(leaving.follow(1.0), AfterImpact::Flight);
    }
}
