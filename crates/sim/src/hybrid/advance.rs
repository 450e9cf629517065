//! The simulator's way through time: by durations, by forcing periods, from stop to stop.
//!
//! One idea: a caller asks for a time and gets what happens up to it; responses and releases on the
//! way are applied.

use super::HybridError;
use super::motion::Regime;
use super::passage::{Approach, Stop};
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
}
