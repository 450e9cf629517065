//! One step of the simulator, forward or backward: expand, search every watched gap, move to the
//! first event. The backward step is a free flight, to the minimum of a gap or to the surface
//! itself.

use std::cmp::Ordering;

use super::motion::{Motion, Regime};
use super::passage::{
    Approach, Back, Flight, Goal, Heading, Landing, NoLog, Outlook, Start, Stop, TaylorFlight,
};
use super::search::{Gap, SearchEnd, search_scalar};
use super::simulator::{Simulator, SurfaceTools, Work};
use super::system::{HybridSystem, Law, RegimeField, Watch};
use super::trajectory::{Event, EventKind, Outcome};
use crate::flow::{Integrator, MOST_SLIDES, SLIDES};
use crate::numeric::{Branched, Mask, Real, Scalar};

impl<S: Real> Simulator<'_, S> {
    /// One step, cut at the first event.
    #[inline(never)]
    pub(super) fn step(
        &mut self,
        horizon: S,
        approach: Approach,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Option<Stop<S>>, Outcome<S>> {
        if let Some(stop) = self.hop(horizon) {
            self.tidy(stop);
            return Ok(stop);
        }
        let Self { system, parameters, motion, free, affine, work, surfaces, near_miss, .. } = self;
        let (integrator, regime) = present(system, motion.regime, free, surfaces);
        let exact =
            affine.as_mut().and_then(|tools| tools.flight(motion.regime, motion, parameters));
        let mut leg = Leg {
            motion,
            work,
            watches: &regime.watches,
            near_miss: *near_miss,
            horizon,
            approach,
        };
        let flown = match exact {
            Some(mut flight) => leg.fly(&mut flight, record),
            None => match integrator.step(&leg.motion.state, parameters) {
                Ok(step) => {
                    leg.fly(&mut TaylorFlight::new(step, regime.watches.len(), 1.0), record)
                }
                Err(_) => Err(Outcome::Diverged { time: leg.motion.time }),
            },
        };
        let stop = match flown {
            Err(Outcome::Diverged { .. }) if self.hop_on(horizon) => None,
            flown => flown?,
        };
        match stop {
            Some(Stop::Contact { surface }) => self.settle_on(Landing::Contact { surface }),
            Some(Stop::Release) => self.settle_on_release(),
            _ => {}
        }
        self.tidy(stop);
        Ok(stop)
    }

    /// Flies freely over many steps, up to the first event, if free flight is affine; `None` if a
    /// general step is needed from the state reached.
    pub(super) fn exact_step(
        &mut self,
        horizon: S,
        approach: Approach,
        record: &mut dyn FnMut(Event<S>),
    ) -> Option<Option<Stop<S>>> {
        let tools = self.affine.as_mut()?;
        if self.motion.regime != Regime::Free {
            return None;
        }
        let longest = horizon - self.motion.time;
        let near_miss = self.near_miss;
        let asked = |surface| goal(surface, approach, near_miss);
        let work = &mut self.work;
        let (time, end) = tools.exact_step(
            &mut self.motion,
            &self.parameters,
            longest,
            asked,
            &mut work.misses,
        )?;
        report(&mut work.misses, time, self.motion.time, record);
        self.motion.time = if time == longest { horizon } else { self.motion.time + time };
        let stop = end.flatten();
        if let Some(Stop::Contact { surface }) = stop {
            self.motion.set_at_contact(surface);
            self.settle_on(Landing::Contact { surface });
        }
        if time > S::zero() {
            self.tidy(stop);
        }
        end
    }

    /// Updates the memory after a step: surfaces that were left, except one that is met, and the
    /// phase.
    fn tidy(&mut self, stop: Option<Stop<S>>) {
        for surface in 0..self.surfaces.len() {
            if let Some(rounding) = self.motion.leaving[surface]
                && stop != Some(Stop::Contact { surface })
                && self.clearance(surface).gap.abs() > rounding
            {
                self.motion.leaving[surface] = None;
            }
        }
        if let Some(phase) = &self.system.phase {
            let period = S::from_dd(phase.period);
            self.motion.reduce_phase(phase.component, period);
        }
    }
}

/// One step to be flown: its start and its goals.
struct Leg<'s, S: Real> {
    motion: &'s mut Motion<S>,
    work: &'s mut Work<S>,
    watches: &'s [Watch],
    near_miss: S,
    horizon: S,
    approach: Approach,
}

impl<S: Real> Leg<'_, S> {
    /// Searches every watched gap and moves to the first event, or to the end of the step.
    #[inline(never)]
    fn fly<F: Flight<S>>(
        &mut self,
        flight: &mut F,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Option<Stop<S>>, Outcome<S>> {
        let (motion, work) = (&mut *self.motion, &mut *self.work);
        let admissible = flight.length();
        motion.last_step = flight.time_scale();
        let remaining = self.horizon - motion.time;
        let slack = S::from_f64(8.0 * S::ROUNDOFF) * admissible;
        let mut first = First {
            length: if remaining <= admissible + slack { remaining } else { admissible },
            stop: None,
        };
        work.misses.clear();
        for (index, &watch) in self.watches.iter().enumerate() {
            let (sign, surface, start, goal, outlook) = match watch {
                Watch::Gap { surface } => {
                    let Some(goal) = goal(surface, self.approach, self.near_miss) else {
                        motion.headings[surface] = Heading::Unknown;
                        continue;
                    };
                    let outlook = flight.outlook(index, first.length, &goal);
                    (S::one(), surface, motion.start(surface), goal, outlook)
                }
                Watch::Release => {
                    let (value, slope) = flight.polynomials(index);
                    let Some(start) = release_start(motion, value, slope, first.length) else {
                        motion.lose_headings();
                        return Ok(Some(Stop::Release));
                    };
                    let goal = Goal { minima: false, stopping: false, near: S::from_f64(-1.0) };
                    (motion.release_sign, 0, start, goal, Outlook::Undecided)
                }
            };
            let mut heading = Heading::Unknown;
            if outlook == Outlook::Undecided {
                let (value, slope) = flight.polynomials(index);
                let gap = Gap { value, slope, sign, surface };
                let Work { points, misses, .. } = &mut *work;
                let end = search_scalar(points, gap, first.length, start, goal, misses);
                heading = Heading::falling(end.falls);
                first.take(watch, &end);
            }
            if let Watch::Gap { surface } = watch {
                motion.headings[surface] = heading;
            }
        }
        let First { length, mut stop } = first;
        match &mut stop {
            Some(Stop::Minimum { rises_for, .. }) => *rises_for = self.turn_at(flight, length),
            Some(Stop::Contact { surface }) => self.motion.set_at_contact(*surface),
            Some(_) => self.motion.lose_headings(),
            None => {}
        }
        let (motion, work) = (&mut *self.motion, &mut *self.work);
        if stop.is_none() && flight.ends_at_corner() {
            let slow = length <= flight.time_scale() * S::from_f64(SLIDES);
            motion.slides = if slow { motion.slides + 1 } else { 0 };
            if motion.slides > MOST_SLIDES {
                return Err(Outcome::Slides { time: motion.time });
            }
        }
        let stuck = stop.is_none()
            && length < remaining
            && motion.time + length == motion.time
            && !flight.ends_at_corner();
        if stuck || !flight.land(length, &mut work.next) {
            return Err(Outcome::Diverged { time: motion.time });
        }
        std::mem::swap(&mut motion.state, &mut work.next);
        report(&mut work.misses, length, motion.time, record);
        motion.time = if length == remaining { self.horizon } else { motion.time + length };
        Ok(stop)
    }

    /// Sets the headings of the gaps at a minimum at which the flight stops, before the end up to
    /// which they were searched. Returns the time for which the gap with the minimum is known to
    /// rise, if no other event can come between.
    fn turn_at<F: Flight<S>>(&mut self, flight: &mut F, time: S) -> S {
        let length = flight.length();
        let mut rises_for = S::zero();
        for (index, &watch) in self.watches.iter().enumerate() {
            let Watch::Gap { surface } = watch else {
                continue;
            };
            let heading = &mut self.motion.headings[surface];
            if self.approach.stop_at == Some(surface) {
                *heading = Heading::Rising;
                if self.watches.len() == 1 {
                    rises_for = gap(flight, index, surface).rises_for(time, length);
                }
            } else if *heading != Heading::Unknown {
                *heading = gap(flight, index, surface).heading(time);
            }
        }
        rises_for
    }
}

/// Reports the minima without contact up to a time, in order; `start` is the time from which they
/// are counted.
fn report<S: Real>(
    misses: &mut [(S, usize, S)],
    until: S,
    from: S,
    record: &mut dyn FnMut(Event<S>),
) {
    if misses.is_empty() {
        return;
    }
    misses.sort_unstable_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(Ordering::Equal));
    for &(time, surface, gap) in misses.iter().filter(|miss| miss.0 <= until) {
        record(Event { time: from + time, surface, kind: EventKind::NearMiss { gap } });
    }
}

/// First event of a step so far.
struct First<S> {
    /// Time of the event; the end of the step if there is none.
    length: S,
    stop: Option<Stop<S>>,
}

impl<S: Real> First<S> {
    /// Takes the event of one watch, if it has one before `length`.
    fn take(&mut self, watch: Watch, end: &SearchEnd<S>) {
        let stop = match watch {
            Watch::Gap { surface } if end.crossing => Stop::Contact { surface },
            Watch::Gap { .. } if end.minimum => {
                Stop::Minimum { gap: end.gap, rises_for: S::zero() }
            }
            Watch::Release if end.crossing => Stop::Release,
            _ => return,
        };
        self.length = end.time;
        self.stop = Some(stop);
    }
}

/// The present integrator and its watches.
fn present<'s, 'a, S: Real>(
    system: &'a HybridSystem,
    regime: Regime,
    free: &'s mut Integrator<'a, S>,
    surfaces: &'s mut [SurfaceTools<'a, S>],
) -> (&'s mut Integrator<'a, S>, &'a RegimeField) {
    let Some(surface) = regime.surface() else { return (free, &system.free) };
    let field = match &system.surfaces[surface].law {
        Law::Rigid { stick, .. } => stick.as_ref(),
        Law::Compliant { contact, .. } => Some(contact),
    };
    match (surfaces[surface].held.as_mut(), field) {
        (Some(held), Some(field)) => (held, field),
        _ => (free, &system.free),
    }
}

/// The gap of a surface along a flight.
fn gap<S: Real, F: Flight<S>>(flight: &mut F, watch: usize, surface: usize) -> Gap<'_, S> {
    let (value, slope) = flight.polynomials(watch);
    Gap { value, slope, sign: S::one(), surface }
}

/// Goal of the search at a surface; `None` if nothing is sought.
fn goal<S: Real>(surface: usize, approach: Approach, near_miss: S) -> Option<Goal<S>> {
    let stopping = approach.stop_at == Some(surface);
    let minima = approach.ignored.holds(surface);
    let near = match (stopping, approach.unrecorded) {
        (true, _) => S::from_f64(f64::INFINITY),
        (false, true) => S::from_f64(-1.0),
        (false, false) => near_miss,
    };
    (stopping || !minima).then_some(Goal { minima, stopping, near })
}

/// Start of the search for a zero of the release function, whose sign is found on the regime's
/// first step. `None` for a contact whose depth is within rounding, which is over at once.
///
/// The sign is that of the first known of these: the value at the beginning of the contact; its
/// slope with respect to the speed of approach, if the value is within rounding; the slope along
/// the contact flow.
///
/// NOTE: a value within rounding whose sign by the speed differs from that of its slope falls to
/// zero at once: a damper lets go of an approach that its spring does not yet resist.
fn release_start<S: Real>(
    motion: &mut Motion<S>,
    value: &[S],
    slope: &[S],
    length: S,
) -> Option<Start<S>> {
    if motion.release_sign != S::zero() {
        return Some(motion.inside(Heading::Unknown));
    }
    let (turn, uncertainty) = (motion.entry_turn, motion.entry_uncertainty);
    if turn + turn <= uncertainty {
        return None;
    }
    let size = value.iter().rev().fold(S::zero(), |size, c| (size * length).max(c.abs()));
    let rounding = motion
        .release_rounding
        .max(S::from_f64(64.0 * S::ROUNDOFF) * size)
        .max(slope[0].abs() * uncertainty);
    if value[0].abs() > rounding {
        motion.release_sign = value[0].signum();
        return Some(motion.inside(Heading::Unknown));
    }
    let known = [motion.entry_sign].into_iter().chain(slope.iter().copied());
    let known = known.into_iter().find(|&known| known != S::zero());
    motion.release_sign = known.map_or(S::one(), S::signum);
    Some(Start::leaving(rounding))
}

/// Largest number of backward steps.
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

    /// Moves the state back if the exact flow knows the way; returns the time.
    fn retreat(&mut self, surface: usize, goal: Back, longest: S) -> Option<S> {
        if self.motion.leaving[surface].is_some() {
            return None;
        }
        let tools = self.affine.as_mut()?;
        tools.retreat(surface, goal, &mut self.motion, &self.parameters, longest)
    }

    /// `heading` is the direction of the gap, backward in time, from one step to the next.
    #[inline(never)]
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
                Ok(step) => leg.fly(&mut TaylorFlight::new(step, self.surfaces.len(), -1.0)),
                Err(_) => Err(Outcome::Diverged { time: leg.motion.time }),
            },
        }
    }
}

/// One backward step to be flown.
struct BackwardLeg<'s, S: Real> {
    motion: &'s mut Motion<S>,
    work: &'s mut Work<S>,
    /// The gap and its slope, in reversed time.
    reversed: &'s mut (Vec<S>, Vec<S>),
    surface: usize,
    goal: Back,
    remaining: S,
    /// Direction of the gap, backward in time.
    heading: &'s mut Heading,
}

impl<S: Real> BackwardLeg<'_, S> {
    /// Flies to the goal, or to the end of the step; returns whether the goal was reached.
    #[inline(never)]
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

/// A gap in reversed time, and the goal of its search.
///
/// In `s = −t` the gap is `Σ g_k (−s)^k`, its slope `−g'(−s)`; at the surface `−gap` falls through
/// 0.
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
