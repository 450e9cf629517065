//! The return map by simulation: the section map that local maps are measured against.
//!
//! A point of a tangency section is a local minimum of the gap along the *free* flow, whatever its
//! depth. A point beyond the surface is virtual: it is taken back along the free flow to the surface,
//! goes through the contact and all that follows, and the last approach to the section is again flown
//! with the surface ignored. A stroboscopic section at the grazing phase is treated alike, with the
//! passage nearest to the section in place of the section point.

use super::HybridError;
use super::backward::Back;
use super::motion::Motion;
use super::returned::{Log, Return, ReturnOutcome, ReturnSection};
use super::simulator::{Approach, Simulator, Stop, check_finite};
use super::system::HybridSystem;
use super::trajectory::{Event, EventKind, Outcome};
use crate::numeric::Real;

/// The return map of a section by direct simulation.
///
/// ```text
/// P = P_smooth ∘ D,  evaluated with the contact as it is: no expansion
/// ```
#[derive(Clone, Debug)]
pub struct DirectReturn<'a, S: Real> {
    simulator: Simulator<'a, S>,
    section: ReturnSection<S>,
    duration: S,
    periods: i64,
    entry: Motion<S>,
    passage: Motion<S>,
}

impl<'a, S: Real> DirectReturn<'a, S> {
    /// The return map of a section; `duration` is the nominal return time, `periods` the whole periods
    /// by which the phase advances in it (0 for an autonomous system).
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`], [`HybridError::NoSuchSurface`].
    pub fn new(
        system: &'a HybridSystem,
        parameters: &[S],
        section: ReturnSection<S>,
        duration: S,
        periods: usize,
    ) -> Result<Self, HybridError> {
        let (surface, surfaces) = (section.surface(), system.surfaces());
        if surface >= surfaces {
            return Err(HybridError::NoSuchSurface { surface, surfaces });
        }
        check_finite(&[duration], 0)?;
        let motion = Motion::new(system.dimension(), surfaces);
        Ok(Self {
            simulator: Simulator::new(system, parameters)?,
            section,
            duration,
            periods: periods as i64,
            entry: motion.clone(),
            passage: motion,
        })
    }

    /// The return map over whole forcing periods: duration `periods · period / rate`.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`HybridError::NoPhase`], [`HybridError::PhaseRate`].
    pub fn over_periods(
        system: &'a HybridSystem,
        parameters: &[S],
        section: ReturnSection<S>,
        periods: usize,
    ) -> Result<Self, HybridError> {
        let period = Simulator::new(system, parameters)?.forcing_period()?;
        Self::new(
            system,
            parameters,
            section,
            period * S::from_f64(periods as f64),
            periods,
        )
    }

    /// Changes the parameters and the nominal return time.
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`].
    pub fn set_parameters(&mut self, parameters: &[S], duration: S) -> Result<(), HybridError> {
        check_finite(&[duration], 0)?;
        self.duration = duration;
        self.simulator.set_parameters(parameters)
    }

    /// The next section point from a full state at the section.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn image(&mut self, state: &[S]) -> Result<Return<S>, HybridError> {
        self.simulator.set_state(state)?;
        let mut log = Log { events: Vec::new() };
        let flown = match self.section {
            ReturnSection::Tangency { surface } => self.tangency(surface, &mut log),
            ReturnSection::GrazingPhase { surface } => self.grazing_phase(surface, state, &mut log),
            ReturnSection::OtherPhase { .. } => self
                .whole_period(&mut log)
                .map(|()| (0, ReturnOutcome::Returned)),
        };
        let (contacts, outcome) = match flown {
            Ok((contacts, outcome)) => (contacts, outcome),
            Err(outcome) => (0, ReturnOutcome::Ended(outcome)),
        };
        let contacts = match self.section {
            ReturnSection::OtherPhase {
                surface,
                graze_time,
            } => log.nominal_contacts(surface, graze_time),
            _ => contacts,
        };
        Ok(self.report(log, contacts, outcome))
    }

    /// The tangency section: from one local minimum of the gap to the one nearest in time to the nominal return.
    fn tangency(
        &mut self,
        surface: usize,
        log: &mut Log<S>,
    ) -> Result<(usize, ReturnOutcome<S>), Outcome<S>> {
        let start = self.simulator.sense(surface);
        self.simulator.motion.leaving[surface] = None;
        let contacts = usize::from(start.gap < S::zero());
        if contacts == 1 {
            self.enter(surface, log)?;
        } else {
            self.simulator.motion.at_minimum = Some(surface);
        }
        let horizon = self.duration * S::from_f64(3.0);
        let outcome = loop {
            let approach = Approach {
                ignored: None,
                stop_at: Some(surface),
            };
            match self.next_stop(horizon, approach, log)? {
                Stop::Minimum { gap } => {
                    if self.is_final(surface) {
                        break ReturnOutcome::Returned;
                    }
                    let time = self.simulator.time();
                    log.events.push(Event {
                        time,
                        surface,
                        kind: EventKind::NearMiss { gap },
                    });
                }
                Stop::Contact { surface: met } if met == surface => {
                    self.entry.copy_from(&self.simulator.motion);
                    // NOTE: a deep approach may meet a singularity behind the surface; then its contact is real.
                    let minimum = self.reach_minimum(surface, horizon).unwrap_or(false);
                    if minimum && self.is_final(surface) {
                        break ReturnOutcome::Returned;
                    }
                    self.simulator.motion.copy_from(&self.entry);
                    self.respond(surface, log)?;
                }
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon | Stop::Release => {
                    break ReturnOutcome::NoReturn {
                        time: self.simulator.time(),
                    };
                }
            }
        };
        Ok((contacts, outcome))
    }

    /// The grazing phase: from the section to the same phase, exactly the nominal duration later.
    fn grazing_phase(
        &mut self,
        surface: usize,
        state: &[S],
        log: &mut Log<S>,
    ) -> Result<(usize, ReturnOutcome<S>), Outcome<S>> {
        self.simulator.motion.leaving[surface] = None;
        let contacts = usize::from(self.reach_first_passage(surface)?);
        if contacts == 1 {
            self.enter(surface, log)?;
        } else {
            self.restart(state);
        }
        loop {
            match self.next_stop(self.duration, Approach::default(), log)? {
                Stop::Contact { surface: met } if met == surface => {
                    self.entry.copy_from(&self.simulator.motion);
                    let last = match self.reach_minimum(surface, self.duration) {
                        Ok(false) => break,
                        Ok(true) => self.is_final(surface),
                        Err(_) => false,
                    };
                    self.simulator.motion.copy_from(&self.entry);
                    if last {
                        self.fly_ignoring(surface, log)?;
                        break;
                    }
                    self.respond(surface, log)?;
                }
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon | Stop::Minimum { .. } | Stop::Release => break,
            }
        }
        Ok((contacts, ReturnOutcome::Returned))
    }

    /// Everything simulated for the nominal duration.
    fn whole_period(&mut self, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        self.simulator
            .advance_to(self.duration, &mut log.recorder())
    }

    /// From a virtual section point back to the surface, and through the contact.
    fn enter(&mut self, surface: usize, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        let earliest = self.simulator.time() - self.duration;
        self.simulator.motion.at_minimum = None;
        if !self.simulator.back(surface, Back::ToSurface, earliest)? {
            let gap = self.simulator.sense(surface).gap;
            return Err(Outcome::Penetrating {
                surface,
                time: self.simulator.time(),
                gap,
            });
        }
        self.respond(surface, log)
    }

    /// Flies to the local minimum of the gap nearest to the start, forward or backward, at most a
    /// quarter of the return time, and stays at the start where there is none; whether it lies beyond
    /// the surface.
    fn reach_first_passage(&mut self, surface: usize) -> Result<bool, Outcome<S>> {
        let start = self.simulator.sense(surface);
        let limit = self.duration * S::from_f64(0.25);
        // A minimum nearer than the rounding of the time cannot be flown to, and need not be.
        let unresolved = start.acceleration * self.duration * S::from_f64(S::ROUNDOFF);
        self.entry.copy_from(&self.simulator.motion);
        let found = if start.velocity.abs() <= unresolved {
            true
        } else if start.velocity > S::zero() {
            self.simulator.back(surface, Back::ToMinimum, -limit)?
        } else {
            self.reach_minimum(surface, limit)?
        };
        if !found {
            self.simulator.motion.copy_from(&self.entry);
        }
        Ok(self.simulator.sense(surface).gap < S::zero())
    }

    fn restart(&mut self, state: &[S]) {
        let motion = &mut self.simulator.motion;
        motion.state.copy_from_slice(state);
        (motion.time, motion.turns, motion.at_minimum) = (S::zero(), 0, None);
    }

    /// Flies with the surface ignored to the next minimum of its gap; `false` if the horizon came first.
    fn reach_minimum(&mut self, surface: usize, horizon: S) -> Result<bool, Outcome<S>> {
        let approach = Approach {
            ignored: Some(surface),
            stop_at: Some(surface),
        };
        loop {
            match self.simulator.next_stop(horizon, approach, &mut |_| {})? {
                Stop::Minimum { .. } => return Ok(true),
                Stop::Contact { surface } => self.simulator.respond(surface, &mut |_| {})?,
                Stop::Horizon | Stop::Release => return Ok(false),
            }
        }
    }

    /// Flies with the surface ignored to the end.
    fn fly_ignoring(&mut self, surface: usize, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        let approach = Approach {
            ignored: Some(surface),
            stop_at: None,
        };
        while let Stop::Contact { surface } = self.next_stop(self.duration, approach, log)? {
            self.respond(surface, log)?;
        }
        Ok(())
    }

    /// Whether the minimum the simulator stands at is nearer to the nominal return than the next one would be.
    ///
    /// The next one, along the free flow, is looked for as far beyond the nominal return as the present
    /// one lies before it. The simulator stands where it stood afterwards.
    fn is_final(&mut self, surface: usize) -> bool {
        let early = self.duration - self.simulator.time();
        if early <= S::zero() {
            return true;
        }
        self.passage.copy_from(&self.simulator.motion);
        let nearer = self
            .reach_minimum(surface, self.duration + early)
            .unwrap_or(false);
        self.simulator.motion.copy_from(&self.passage);
        !nearer
    }

    fn next_stop(
        &mut self,
        horizon: S,
        approach: Approach,
        log: &mut Log<S>,
    ) -> Result<Stop<S>, Outcome<S>> {
        self.simulator
            .next_stop(horizon, approach, &mut log.recorder())
    }

    fn respond(&mut self, surface: usize, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        self.simulator.respond(surface, &mut log.recorder())
    }

    fn report(&self, log: Log<S>, contacts: usize, outcome: ReturnOutcome<S>) -> Return<S> {
        let all = log
            .events
            .iter()
            .filter(|event| event.kind.is_contact())
            .count();
        let near_misses = log.events.iter().filter_map(|event| match event.kind {
            EventKind::NearMiss { gap } => Some(gap),
            _ => None,
        });
        Return {
            state: self.simulator.state_after_advance(self.periods),
            elapsed: self.simulator.time(),
            contacts,
            extra_contacts: all - contacts.min(all),
            impact_speeds: log
                .events
                .iter()
                .filter_map(|event| event.kind.contact_speed())
                .collect(),
            near_misses: near_misses.collect(),
            outcome,
        }
    }
}
