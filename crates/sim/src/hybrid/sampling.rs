//! A trajectory moment by moment: its state at evenly spaced times, before and after impacts, at
//! the beginning and end of contacts, and at minima of the gaps.
//!
//! One idea: flights are cut only at the requested times. Events on the way that do not stop the
//! flight are flown to afterwards, from the start of that piece.

use super::HybridError;
use super::motion::Motion;
use super::passage::{Approach, Stop};
use super::return_map::DirectReturn;
use super::simulator::{Simulator, check_finite};
use super::trajectory::{Event, EventKind, Outcome};
use crate::numeric::Real;

/// The state at one moment of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment<'m, S> {
    /// Time since the start; negative before a section point beyond the surface.
    pub time: S,
    /// The full state.
    pub state: &'m [S],
    /// Event at this moment, and its surface; the state is the one before the event.
    pub event: Option<(MomentEvent, usize)>,
}

/// Event at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MomentEvent {
    /// A rigid impact; the next moment, at the same time, has the state after it.
    Impact,
    /// A compliant contact begins, or the state sticks to a rigid surface from here.
    Contact,
    /// The contact ends.
    Release,
    /// A local minimum of the gap without contact.
    Minimum,
}

/// Function that is called with the moments of a trajectory in order of time.
pub type Recorder<'r, S> = &'r mut dyn FnMut(Moment<'_, S>);

impl<S: Real> Simulator<'_, S> {
    /// Simulates for a duration. Calls `record` with the state at the start, at evenly spaced
    /// times, the last of which is the end, and at every event.
    ///
    /// # Errors
    ///
    /// [`HybridError::NotFinite`] if the duration is not finite.
    pub fn sample(
        &mut self,
        duration: S,
        samples: usize,
        record: Recorder<'_, S>,
    ) -> Result<Outcome<S>, HybridError> {
        check_finite(&[duration], 0)?;
        let checked = self.check_penetration(None);
        let sampled =
            checked.and_then(|()| Sampling::new(self).run(None, duration, samples, record));
        Ok(sampled.err().unwrap_or(Outcome::Completed))
    }
}

impl<S: Real> DirectReturn<'_, S> {
    /// Simulates for a duration from a full state at the section, as [`Simulator::sample`] does.
    ///
    /// A section point beyond the surface is moved back along the free flow to the surface, where
    /// the trajectory starts, at a negative time; everything is simulated from there.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn sample(
        &mut self,
        state: &[S],
        duration: S,
        samples: usize,
        record: Recorder<'_, S>,
    ) -> Result<Outcome<S>, HybridError> {
        check_finite(&[duration], 0)?;
        self.simulator.set_state(state)?;
        let sampled = self.physical_start().and_then(|contact| {
            Sampling::new(&mut self.simulator).run(contact, duration, samples, record)
        });
        Ok(sampled.err().unwrap_or(Outcome::Completed))
    }
}

/// A simulator with the memory of the piece that is flown.
struct Sampling<'s, 'a, S: Real> {
    simulator: &'s mut Simulator<'a, S>,
    /// Motions at the start of the piece, and at its end.
    before: Motion<S>,
    after: Motion<S>,
    /// Events of the piece.
    events: Vec<Event<S>>,
    /// Time at which a chatter ends, whose last impacts are not simulated, and its surface.
    resting: Option<(S, usize)>,
}

impl<'s, 'a, S: Real> Sampling<'s, 'a, S> {
    fn new(simulator: &'s mut Simulator<'a, S>) -> Self {
        let motion = simulator.motion.clone();
        Self { simulator, before: motion.clone(), after: motion, events: Vec::new(), resting: None }
    }

    /// Runs from the present time, with a contact at a surface that is met there, to the end.
    fn run(
        &mut self,
        contact: Option<usize>,
        end: S,
        samples: usize,
        record: Recorder<'_, S>,
    ) -> Result<(), Outcome<S>> {
        let start = self.simulator.motion.time;
        match contact {
            Some(surface) => self.respond(surface, record)?,
            None => self.hand_on(None, record),
        }
        let step = (end - start) / S::from_f64(samples.max(1) as f64);
        for number in 1..=samples.max(1) {
            let last = number >= samples;
            let time = if last { end } else { start + step * S::from_f64(number as f64) };
            self.fly(time, record)?;
            self.hand_on(None, record);
        }
        Ok(())
    }

    /// Flies to a time.
    fn fly(&mut self, time: S, record: Recorder<'_, S>) -> Result<(), Outcome<S>> {
        loop {
            self.before.copy_from(&self.simulator.motion);
            let resting = self.resting.filter(|(at, _)| *at <= time);
            let horizon = resting.map_or(time, |(at, _)| at);
            let events = &mut self.events;
            events.clear();
            let stop = self.simulator.next_stop(horizon, Approach::default(), &mut |event| {
                events.push(event);
            })?;
            self.visit_events(record);
            match (stop, resting) {
                (Stop::Contact { surface }, _) => self.respond(surface, record)?,
                (Stop::Horizon, Some((_, surface))) => {
                    self.resting = None;
                    self.hand_on(Some((MomentEvent::Contact, surface)), record);
                }
                (Stop::Horizon, None) => return Ok(()),
                (Stop::Minimum { .. } | Stop::Release, _) => {}
            }
        }
    }

    /// Records the states at the events of the last piece.
    fn visit_events(&mut self, record: Recorder<'_, S>) {
        if self.events.is_empty() {
            return;
        }
        self.after.copy_from(&self.simulator.motion);
        for event in std::mem::take(&mut self.events) {
            self.simulator.motion.copy_from(&self.before);
            let flown =
                self.simulator.next_stop(event.time, Approach::default(), &mut |_| {}).is_ok();
            if flown && let Some(kind) = MomentEvent::of(event.kind) {
                self.hand_on(Some((kind, event.surface)), record);
            }
        }
        self.simulator.motion.copy_from(&self.after);
    }

    /// Applies a surface's response.
    fn respond(&mut self, surface: usize, record: Recorder<'_, S>) -> Result<(), Outcome<S>> {
        let before = self.simulator.motion.state.clone();
        let (time, events) = (self.simulator.motion.time, &mut self.events);
        events.clear();
        let outcome = self.simulator.respond(surface, &mut |event| events.push(event));
        for event in &self.events {
            let Some(kind) = MomentEvent::of(event.kind) else { continue };
            match kind {
                MomentEvent::Contact if event.time > time => {
                    self.resting = Some((event.time, surface));
                }
                MomentEvent::Contact if self.events.len() > 1 => {
                    let state = &self.simulator.motion.state;
                    record(Moment { time, state, event: Some((kind, surface)) });
                }
                kind => {
                    record(Moment { time, state: &before, event: Some((kind, surface)) });
                    if kind == MomentEvent::Impact {
                        record(Moment { time, state: &self.simulator.motion.state, event: None });
                    }
                }
            }
        }
        outcome
    }

    fn hand_on(&self, event: Option<(MomentEvent, usize)>, record: Recorder<'_, S>) {
        let motion = &self.simulator.motion;
        record(Moment { time: motion.time, state: &motion.state, event });
    }
}

impl MomentEvent {
    /// Word for the event: `impact`, `contact`, `release` or `minimum`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Impact => "impact",
            Self::Contact => "contact",
            Self::Release => "release",
            Self::Minimum => "minimum",
        }
    }

    /// Moment of an event; `None` for the end of a chatter, whose impacts are not simulated.
    fn of<S>(kind: EventKind<S>) -> Option<Self> {
        match kind {
            EventKind::Impact { .. } => Some(Self::Impact),
            EventKind::NearMiss { .. } => Some(Self::Minimum),
            EventKind::ContactBegin { .. } | EventKind::Stick => Some(Self::Contact),
            EventKind::ContactEnd { .. } | EventKind::Release => Some(Self::Release),
            EventKind::ChatterEnd { .. } => None,
        }
    }
}
