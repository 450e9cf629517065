//! Contacts whose field or release function is not analytic on the surface: a force that is a power
//! of the depth which is not whole (Hertz's), a root, a corner.
//!
//! Such a law has no Taylor series where the contact begins and where it ends, and series beside
//! the surface reach only as far as the surface is; very near to it their coefficients leave the
//! numbers. Hops of the midpoint rule lead away from the surface and to it, and the last one at a
//! constant rate onto it, so short that their errors are rounding:
//!
//! ```text
//! |f(x + τ f) − f(x)| τ ≤ ε |x|
//! ```
//!
//! In between the steps of Taylor's method grow, and shrink, with the depth. That is enough in
//! double precision; to twice the digits hops would be too many, and the simulation diverges.

use super::motion::Regime;
use super::passage::{Landing, Stop};
use super::simulator::Simulator;
use crate::numeric::Real;

/// Most times that a hop is halved.
const HALVINGS: usize = 200;

/// Most hops of a contact.
const MOST_HOPS: usize = 1000;

impl<S: Real> Simulator<'_, S> {
    /// Hops away from the surface where a contact begins that has no series there, or back onto it:
    /// why the flight stops, if it does. `None` where a step of Taylor's method is to be taken.
    pub(super) fn hop(&mut self, horizon: S) -> Option<Option<Stop<S>>> {
        let Regime::Contact { surface } = self.motion.regime else {
            return None;
        };
        self.surfaces[surface].rates.as_ref()?;
        if self.motion.time == self.motion.changed {
            return self.hop_away(surface, horizon).then_some(None);
        }
        self.hop_back(surface, horizon).then_some(Some(Stop::Release))
    }

    /// Hops on in a contact in which a step of Taylor's method failed; whether it did.
    pub(super) fn hop_on(&mut self, horizon: S) -> bool {
        let Regime::Contact { surface } = self.motion.regime else {
            return false;
        };
        self.creep(surface, self.motion.hop + self.motion.hop, horizon)
    }

    /// Away from the surface, where a series reaches no farther; whether it did.
    fn hop_away(&mut self, surface: usize, horizon: S) -> bool {
        let longest = self.motion.last_step * S::from_f64(S::ROUNDOFF.sqrt());
        let Self { motion, parameters, surfaces, .. } = &mut *self;
        let reach = surfaces[surface].held.as_mut().and_then(|held| {
            let step = held.step(&motion.state, parameters).ok()?;
            Some(step.length)
        });
        !reach.is_some_and(|reach| reach > longest) && self.creep(surface, longest, horizon)
    }

    /// One hop of the midpoint rule, as long as it may be; whether there is one.
    ///
    /// NOTE: the first half is flown freely: beside the surface, by rounding, the contact's force
    /// may not be defined.
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

    /// Back onto the zero of the release function, if that is no farther than the last hop led;
    /// whether it was.
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
        let half = S::from_f64(0.5);
        let (mut held, mut released) = (S::zero(), longest);
        for _ in 0..HALVINGS {
            let middle = held + (released - held) * half;
            if middle <= held || middle >= released {
                break;
            }
            match self.is_held(surface, &moved(&state, &rates, middle)) {
                true => held = middle,
                false => released = middle,
            }
        }
        self.motion.time += held;
        self.motion.state = moved(&state, &rates, held);
        self.motion.lose_headings();
        true
    }

    /// Rates of the contact field at a state.
    fn contact_rates(&mut self, surface: usize, state: &[S]) -> Vec<S> {
        let rates = self.surfaces[surface].rates.as_mut();
        rates.map_or_else(Vec::new, |rates| rates.evaluate(state, &self.parameters).to_vec())
    }

    /// Whether the release function has the sign at a state that it has in contact; a force that is
    /// not defined behind the surface has none.
    fn is_held(&mut self, surface: usize, state: &[S]) -> bool {
        let release = self.surfaces[surface].release.as_mut();
        let value = release.map(|release| release.first::<1>(state, &self.parameters)[0]);
        value.is_some_and(|value| value * self.motion.release_sign > S::zero())
    }
}

/// A state after a time at constant rates.
fn moved<S: Real>(state: &[S], rates: &[S], time: S) -> Vec<S> {
    state.iter().zip(rates).map(|(&state, &rate)| rate.mul_add(time, state)).collect()
}

/// Whether the rates change by no more over a time than moves the state by rounding.
fn is_rounding<S: Real>(state: &[S], before: &[S], after: &[S], time: S) -> bool {
    let size = state.iter().fold(S::one(), |size, x| size.max(x.abs()));
    let rounding = size * S::from_f64(S::ROUNDOFF);
    before.iter().zip(after).all(|(&before, &after)| (after - before).abs() * time <= rounding)
}
