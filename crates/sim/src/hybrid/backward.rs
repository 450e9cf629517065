//! Free flight backward in time, to the minimum of a gap or to the surface itself.

use super::motion::{Motion, Regime};
use super::passage::{Back, Flight, Goal, Heading, Landing, NoLog, TaylorFlight};
use super::search::{Gap, search_scalar};
use super::simulator::{Simulator, Work};
use super::trajectory::Outcome;
use crate::numeric::{Branched, Mask, Real, Scalar};

/// Most backward steps.
const MAX_STEPS: usize = 10_000;

impl<S: Real> Simulator<'_, S> {
    /// Flies freely backward, at most until the time `earliest`; `false` if that came first.
    pub(super) fn back(
        &mut self,
        surface: usize,
        goal: Back,
        earliest: S,
    ) -> Result<bool, Outcome<S>> {
        if let Some(time) = self.retreat(surface, goal, self.motion.time - earliest) {
            self.motion.time -= time;
            self.arrive(surface, goal);
            return Ok(true);
        }
        let mut heading = Heading::Unknown;
        for _ in 0..MAX_STEPS {
            let remaining = self.motion.time - earliest;
            if remaining <= S::zero() {
                return Ok(false);
            }
            if self.step_back(surface, goal, remaining, &mut heading)? {
                self.arrive(surface, goal);
                return Ok(true);
            }
        }
        Err(Outcome::StepLimit { limit: MAX_STEPS, time: self.motion.time })
    }

    fn arrive(&mut self, surface: usize, goal: Back) {
        match goal {
            Back::ToMinimum => self.motion.set_at_minimum(surface),
            Back::ToSurface => self.settle_on(Landing::Contact { surface }),
        }
    }

    /// Takes the state back where the exact flow knows the way; the time it took.
    fn retreat(&mut self, surface: usize, goal: Back, longest: S) -> Option<S> {
        if self.motion.leaving[surface].is_some() {
            return None;
        }
        let tools = self.affine.as_mut()?;
        tools.retreat(surface, goal, &mut self.motion, &self.parameters, longest)
    }

    /// `heading`: which way the gap goes, backward in time, from one step to the next.
    fn step_back(
        &mut self,
        surface: usize,
        goal: Back,
        remaining: S,
        heading: &mut Heading,
    ) -> Result<bool, Outcome<S>> {
        let Self { motion, parameters, affine, free, work, reversed, .. } = self;
        let exact =
            affine.as_mut().and_then(|tools| tools.flight(Regime::Free, motion, parameters));
        let mut leg = BackwardLeg { motion, work, reversed, surface, goal, remaining, heading };
        match exact {
            Some(mut flight) => leg.fly(&mut flight),
            None => match free.step(&leg.motion.state, parameters) {
                Ok(step) => leg.fly(&mut TaylorFlight::new(step, self.surfaces.len())),
                Err(_) => Err(Outcome::Diverged { time: leg.motion.time }),
            },
        }
    }
}

/// One backward step to be flown.
struct BackwardLeg<'s, S: Real> {
    motion: &'s mut Motion<S>,
    work: &'s mut Work<S>,
    /// The gap and its slope in reversed time.
    reversed: &'s mut (Vec<S>, Vec<S>),
    surface: usize,
    goal: Back,
    remaining: S,
    /// Which way the gap goes, backward in time.
    heading: &'s mut Heading,
}

impl<S: Real> BackwardLeg<'_, S> {
    /// Flies to the goal, or to the end of the step; whether the goal was reached.
    fn fly<F: Flight<S>>(&mut self, flight: &mut F) -> Result<bool, Outcome<S>> {
        self.motion.last_step = flight.time_scale();
        let length = flight.length().min(self.remaining);
        let (value, slope) = flight.polynomials(self.surface);
        let (gap, goal) = reversed_gap(value, slope, self.goal, self.reversed);
        let Work { points, next, .. } = &mut *self.work;
        let start = self.motion.start_after(self.surface, *self.heading);
        let end = search_scalar(points, gap, length, start, goal, NoLog);
        *self.heading = Heading::falling(end.falls);
        if !flight.land(-end.time, next) {
            return Err(Outcome::Diverged { time: self.motion.time });
        }
        std::mem::swap(&mut self.motion.state, next);
        self.motion.time -= end.time;
        Ok(end.minimum || end.crossing)
    }
}

/// A gap in reversed time, and what is looked for.
///
/// In `s = −t` the gap is `Σ g_k (−s)^k`, its slope `−g'(−s)`; the surface is where `−gap` falls
/// through 0.
#[inline(always)]
pub(super) fn reversed_gap<'r, S: Branched>(
    value: &[S],
    slope: &[S],
    goal: Back,
    reversed: &'r mut (Vec<S>, Vec<S>),
) -> (Gap<'r, S>, Goal<S>) {
    let (none, one) = (S::Mask::NONE, S::one());
    let (minima, sign) = match goal {
        Back::ToMinimum => (!none, one),
        Back::ToSurface => (none, -one),
    };
    alternate(value, sign, &mut reversed.0);
    alternate(slope, -sign, &mut reversed.1);
    let gap = Gap { value: &reversed.0, slope: &reversed.1, sign: one, surface: 0 };
    let goal = Goal { minima, stopping: !none, near: -one };
    (gap, goal)
}

/// Coefficients of `sign · p(−s)`.
#[inline(always)]
fn alternate<S: Scalar>(coefficients: &[S], sign: S, out: &mut Vec<S>) {
    out.clear();
    let mut sign = sign;
    for &coefficient in coefficients {
        out.push(coefficient * sign);
        sign = -sign;
    }
}
