//! The simulator's way through time: by durations, by forcing periods, from stop to stop.
//!
//! One idea: a caller asks for a time and gets what happens up to it; responses and releases on the
//! way are applied.
//!
//! A state is brought onto the surface it was flown to. The time of an event is a root of a
//! polynomial and the state there the value of others: it lies beside the surface by the rounding
//! of its largest component, and a stiff contact multiplies that distance by its acceleration. One
//! step of Newton's method along the *free* flow,
//!
//! ```text
//! x += f s,   t += s,   s = −g(x) / L_f g(x),
//! ```
//!
//! leaves the rounding of `g` alone. `g` is the gap where a contact begins, the release function
//! where one ends; see docs/mathematics/direct-simulation.md for why the free flow serves both.

use super::HybridError;
use super::motion::Regime;
use super::passage::{Approach, Landing, REDUCED, Stop, ends_before_turn};
use super::simulator::{Simulator, check_finite};
use super::trajectory::{Event, Outcome, Trajectory};
use crate::numeric::Real;

impl<S: Real> Simulator<'_, S> {
    /// Simulates for a duration and collects what happens.
    ///
    /// # Errors
    ///
    /// [`HybridError::NotFinite`] if the duration is not finite.
    pub fn run(&mut self, duration: S) -> Result<Trajectory<S>, HybridError> {
        let mut events = Vec::new();
        let outcome = self.advance(duration, &mut |event| events.push(event))?;
        Ok(Trajectory { events, state: self.motion.state.clone(), time: self.motion.time, outcome })
    }

    /// Simulates for a duration, handing every event to `record`; allocates nothing.
    ///
    /// # Errors
    ///
    /// [`HybridError::NotFinite`] if the duration is not finite.
    pub fn advance(
        &mut self,
        duration: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Outcome<S>, HybridError> {
        check_finite(&[duration], 0)?;
        let horizon = self.motion.time + duration;
        Ok(self.advance_to(horizon, record).err().unwrap_or(Outcome::Completed))
    }

    /// Simulates one forcing period; the phase is exactly where it was.
    ///
    /// `period` is [`forcing_period`](Self::forcing_period), computed once per parameter vector.
    /// Time is measured from the start of the period.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoPhase`] for an autonomous system.
    pub fn advance_period(
        &mut self,
        period: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Outcome<S>, HybridError> {
        let component = self.system.phase.as_ref().ok_or(HybridError::NoPhase)?.component;
        self.motion.reference_phase = self.motion.state[component];
        (self.motion.time, self.motion.turns) = (S::zero(), 0);
        if let Err(outcome) = self.advance_to(period, record) {
            return Ok(outcome);
        }
        self.motion.state[component] = self.motion.reference_phase;
        Ok(Outcome::Completed)
    }

    fn advance_to(
        &mut self,
        horizon: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<(), Outcome<S>> {
        self.steps = 0;
        self.check_placed()?;
        self.check_penetration(None)?;
        loop {
            match self.next_stop(horizon, Approach::default(), record)? {
                Stop::Horizon => return Ok(()),
                Stop::Contact { surface } => self.respond(surface, record)?,
                Stop::Minimum { .. } | Stop::Release => {}
            }
        }
    }

    /// Flies to the next stop at or before a time; releases on the way are applied.
    pub(super) fn next_stop(
        &mut self,
        horizon: S,
        approach: Approach,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Stop<S>, Outcome<S>> {
        while self.steps < self.step_limit {
            if self.motion.time >= horizon {
                return Ok(Stop::Horizon);
            }
            self.steps += 1;
            let flown = match self.exact_step(horizon, approach, record) {
                Some(flown) => flown,
                None => self.step(horizon, approach, record)?,
            };
            match flown {
                None => {}
                Some(Stop::Release) => self.release(record),
                Some(stop) => return Ok(stop),
            }
        }
        Err(Outcome::StepLimit { limit: self.step_limit, time: self.motion.time })
    }

    /// Flies the contact with a compliant surface from a full state on it: the state at the release
    /// and the time since. A rigid surface applies its reset, in no time.
    ///
    /// `None` where the contact has not ended after `longest`, where another surface is met before,
    /// or where the simulation ends otherwise.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoSuchSurface`], [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn contact_phase(
        &mut self,
        surface: usize,
        state: &[S],
        longest: S,
    ) -> Result<Option<(Vec<S>, S)>, HybridError> {
        let surfaces = self.surfaces.len();
        if surface >= surfaces {
            return Err(HybridError::NoSuchSurface { surface, surfaces });
        }
        check_finite(&[longest], 0)?;
        self.set_state(state)?;
        let released = self.fly_to_release(surface, longest).unwrap_or(false);
        Ok(released.then(|| (self.motion.state.clone(), self.motion.time)))
    }

    /// Applies the response and flies on until it is over; whether it was before `horizon`.
    fn fly_to_release(&mut self, surface: usize, horizon: S) -> Result<bool, Outcome<S>> {
        self.respond(surface, &mut |_| {})?;
        while self.steps < self.step_limit {
            self.steps += 1;
            if self.regime() == Regime::Free {
                return Ok(true);
            }
            if self.motion.time >= horizon {
                return Ok(false);
            }
            match self.step(horizon, Approach::default(), &mut |_| {})? {
                None => {}
                Some(Stop::Release) => self.release(&mut |_| {}),
                Some(_) => return Ok(false),
            }
        }
        Ok(false)
    }

    /// Brings the state onto the zero it has landed beside, where it meets it transversally.
    ///
    /// NOTE: where the step does not halve the distance or leads to where `g` turns, `|g g''| ≥
    /// g'²`, the depth of the approach is itself within the rounding of `g`: nothing is known
    /// that a correction could restore, and the state stays where it is.
    pub(super) fn settle_on(&mut self, landing: Landing) {
        let falling = match landing {
            Landing::Contact { .. } => S::one(),
            Landing::Release { .. } => self.motion.release_sign,
        };
        let Some((value, slope)) = self.read_landing(landing) else {
            return;
        };
        if value == S::zero() || slope * falling >= S::zero() {
            return;
        }
        if let Landing::Contact { surface } = landing
            && !ends_before_turn(value, slope, self.sense(surface).acceleration)
        {
            return;
        }
        let shift = -value / slope;
        self.work.next.copy_from_slice(&self.motion.state);
        for (state, &rate) in self.motion.state.iter_mut().zip(&self.work.landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        let after = match landing {
            Landing::Contact { surface } => Some(self.clearance(surface).gap),
            Landing::Release { .. } => self
                .read_landing(landing)
                .filter(|after| (after.1 - slope).abs() < slope.abs())
                .map(|after| after.0),
        };
        if after.is_some_and(|after| after.abs() <= value.abs() * S::from_f64(REDUCED)) {
            self.motion.time += shift;
        } else {
            self.motion.state.copy_from_slice(&self.work.next);
        }
    }

    /// The same at the end of a compliant contact; a resting contact ends where nothing jumps.
    pub(super) fn settle_on_release(&mut self) {
        if let Regime::Contact { surface } = self.motion.regime {
            self.settle_on(Landing::Release { surface });
        }
    }

    /// Value and slope of the function at the present state, put to the working memory with the
    /// rates of the free flow; `None` for a surface that has none.
    fn read_landing(&mut self, landing: Landing) -> Option<(S, S)> {
        let Self { affine, motion, parameters, work, surfaces, .. } = self;
        let values = &mut work.landing;
        let is_read = affine
            .as_mut()
            .is_some_and(|tools| tools.read_landing(landing, motion, parameters, values));
        if !is_read {
            let evaluator = match landing {
                Landing::Contact { surface } => Some(&mut surfaces[surface].contact),
                Landing::Release { surface } => surfaces[surface].release.as_mut(),
            }?;
            let found = evaluator.evaluate(&motion.state, parameters);
            let count = values.len();
            values.copy_from_slice(&found[..count]);
        }
        Some((values[0], values[1]))
    }
}
