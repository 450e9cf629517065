//! Contacts whose field or release function is not analytic on the surface: a force that is a
//! non-integer power of the depth (such as Hertz's), a root, a corner.
//!
//! Such a law has no Taylor series at the beginning and at the end of the contact. Near the surface
//! a series reaches only as far as the surface is, and very near to it the coefficients overflow.
//! Hops of the midpoint rule lead away from the surface and to it, and the last one at a constant
//! rate onto it. The hops are so short that their errors are rounding:
//!
//! ```text
//! |f(x + τ f) − f(x)| τ ≤ ε |x|
//! ```
//!
//! In between, Taylor steps grow and shrink with the depth. With twice the digits, or a stiff law,
//! hops are so short that the coefficients of a series overflow beside them: near the surface time
//! has a unit as long as the way to it.

use super::motion::Regime;
use super::passage::{Landing, Stop};
use super::simulator::{Simulator, SurfaceTools};
use crate::numeric::{Real, Scalar};

/// Largest number of halvings of a hop.
const HALVINGS: usize = 200;

/// Largest number of hops of a contact.
const MOST_HOPS: usize = 1000;

/// Natural logarithm of the largest coefficient of a series that is left to steps in whole units of
/// time.
const SAFE_EXPONENT: f64 = 640.0;

/// Whether a number has more digits than double precision.
fn is_extended<S: Scalar>() -> bool {
    S::ROUNDOFF < f64::ROUNDOFF
}

impl<S: Real> Simulator<'_, S> {
    /// Hops away from the surface at the beginning of a contact that has no series there, or back
    /// onto it. Returns the stop of the flight, if any; `None` if a Taylor step is to be taken.
    pub(super) fn hop(&mut self, horizon: S) -> Option<Option<Stop<S>>> {
        let Regime::Contact { surface } = self.motion.regime else {
            return None;
        };
        self.surfaces[surface].rough.as_ref()?;
        if self.motion.time == self.motion.changed {
            return self.hop_away(surface, horizon).then_some(None);
        }
        if self.hop_back(surface, horizon) {
            return Some(Some(Stop::Release));
        }
        self.scaled_step(surface, horizon)
    }

    /// Makes another hop in a contact in which a Taylor step failed; returns whether it succeeded.
    pub(super) fn hop_on(&mut self, horizon: S) -> bool {
        let Regime::Contact { surface } = self.motion.regime else {
            return false;
        };
        self.creep(surface, self.motion.hop + self.motion.hop, horizon)
    }

    /// Hops away from the surface, if a series is not longer than the hop; returns whether it did.
    fn hop_away(&mut self, surface: usize, horizon: S) -> bool {
        let share = if is_extended::<S>() { S::ROUNDOFF.powf(0.25) } else { S::ROUNDOFF.sqrt() };
        let longest = self.motion.last_step * S::from_f64(share);
        let Self { motion, parameters, surfaces, .. } = &mut *self;
        let reach = surfaces[surface].held.as_mut().and_then(|held| {
            let step = held.step(&motion.state, parameters).ok()?;
            Some(step.length)
        });
        !reach.is_some_and(|reach| reach > longest) && self.creep(surface, longest, horizon)
    }

    /// Makes one hop of the midpoint rule, as long as the error is rounding; returns whether there
    /// is one.
    ///
    /// NOTE: the first half is flown freely: near the surface, because of rounding, the contact's
    /// force may not be defined.
    fn creep(&mut self, surface: usize, longest: S, horizon: S) -> bool {
        let mut time = longest.min(horizon - self.motion.time);
        if time <= S::zero() || self.motion.hops >= MOST_HOPS {
            return false;
        }
        let Some(_) = self.read_landing(Landing::Contact { surface }) else {
            return false;
        };
        let free = self.work.landing[2..].to_vec();
        let half = S::from_f64(0.5);
        for _ in 0..HALVINGS {
            let middle = moved(&self.motion.state, &free, time * half);
            let rates = self.contact_rates(surface, &middle);
            let end = moved(&self.motion.state, &rates, time);
            let after = self.contact_rates(surface, &end);
            if is_rounding(&self.motion.state, &rates, &after, time) {
                (self.motion.hop, self.motion.hops) = (time, self.motion.hops + 1);
                self.motion.time += time;
                self.motion.state.copy_from_slice(&end);
                self.motion.lose_headings();
                return true;
            }
            time *= half;
        }
        false
    }

    /// Takes a step by a series in a unit of time in which its coefficients do not overflow, up to
    /// the release, if the surface is near. Returns the stop of the flight, if any; `None` if the
    /// surface is not near.
    fn scaled_step(&mut self, surface: usize, horizon: S) -> Option<Option<Stop<S>>> {
        let (gap, rate) = self.read_landing(Landing::Contact { surface })?;
        let reach = (gap / rate).abs();
        let Self { motion, parameters, surfaces, .. } = self;
        let SurfaceTools { rough, release, .. } = &mut surfaces[surface];
        let (scaled, release) = (&mut rough.as_mut()?.scaled, release.as_mut()?);
        let nearest = S::from_f64(SAFE_EXPONENT / scaled.order() as f64).exp();
        if !(reach > S::zero() && reach * nearest < S::one()) {
            return None;
        }
        let with_unit: Vec<S> = parameters.iter().copied().chain([reach]).collect();
        let step = scaled.step(&motion.state, &with_unit).ok()?;
        let mut end = motion.state.clone();
        let mut released = |time: S| {
            step.state_at(time, &mut end);
            release.first::<1>(&end, parameters)[0]
        };
        let longest = (step.length * reach).min(horizon - motion.time) / reach;
        let value = released(longest);
        if motion.release_sign == S::zero() {
            motion.release_sign = value.signum();
        }
        let sign = motion.release_sign;
        let is_over = value * sign <= S::zero();
        let time = match is_over {
            true => last_held(longest, |time| released(time) * sign > S::zero()),
            false => longest,
        };
        step.state_at(time, &mut motion.state);
        motion.time += time * reach;
        motion.lose_headings();
        Some(is_over.then_some(Stop::Release))
    }

    /// Hops back onto the zero of the release function, if it is not farther than the last hop;
    /// returns whether it did.
    fn hop_back(&mut self, surface: usize, horizon: S) -> bool {
        let longest = self.motion.hop.min(horizon - self.motion.time);
        if longest <= S::zero() || self.motion.release_sign == S::zero() {
            return false;
        }
        let state = self.motion.state.clone();
        let rates = self.contact_rates(surface, &state);
        if self.is_held(surface, &moved(&state, &rates, longest)) {
            return false;
        }
        let held = last_held(longest, |time| self.is_held(surface, &moved(&state, &rates, time)));
        self.motion.time += held;
        self.motion.state = moved(&state, &rates, held);
        self.motion.lose_headings();
        true
    }

    /// Rates of the contact field at a state.
    fn contact_rates(&mut self, surface: usize, state: &[S]) -> Vec<S> {
        let rough = self.surfaces[surface].rough.as_mut();
        rough.map_or_else(Vec::new, |rough| rough.rates.evaluate(state, &self.parameters).to_vec())
    }

    /// Whether the release function at a state has the sign that it has in contact; false for a
    /// force that is not defined behind the surface.
    fn is_held(&mut self, surface: usize, state: &[S]) -> bool {
        let release = self.surfaces[surface].release.as_mut();
        let value = release.map(|release| release.first::<1>(state, &self.parameters)[0]);
        value.is_some_and(|value| value * self.motion.release_sign > S::zero())
    }
}

/// Last time up to `longest` at which a contact lasts that is over then.
fn last_held<S: Real>(longest: S, mut is_held: impl FnMut(S) -> bool) -> S {
    let half = S::from_f64(0.5);
    let (mut held, mut released) = (S::zero(), longest);
    for _ in 0..HALVINGS {
        let middle = held + (released - held) * half;
        if middle <= held || middle >= released {
            break;
        }
        match is_held(middle) {
            true => held = middle,
            false => released = middle,
        }
    }
    held
}

/// State after a time at constant rates.
pub(super) fn moved<S: Real>(state: &[S], rates: &[S], time: S) -> Vec<S> {
    state.iter().zip(rates).map(|(&state, &rate)| rate.mul_add(time, state)).collect()
}

/// Whether the change of the rates over a time moves the state by no more than rounding.
fn is_rounding<S: Real>(state: &[S], before: &[S], after: &[S], time: S) -> bool {
    let size = state.iter().fold(S::one(), |size, x| size.max(x.abs()));
    let rounding = size * S::from_f64(S::ROUNDOFF);
    before.iter().zip(after).all(|(&before, &after)| (after - before).abs() * time <= rounding)
}
