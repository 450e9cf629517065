//! What a simulation and a return map hand up: events in time, the final state, how it ended, what
//! was expected of a return, passage by passage, and what can be wrong with what is asked.

use crate::numeric::Real;

/// Something that happened on a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<S> {
    /// Time since the start of the simulation.
    pub time: S,
    /// The surface it happened at: an index into
    /// [`Model::surfaces`](crate::model::Model::surfaces).
    pub surface: usize,
    /// What happened.
    pub kind: EventKind<S>,
}

/// Kinds of events. Speeds are `|h'|` in units of the event function per time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<S> {
    /// A rigid impact.
    Impact {
        /// Normal speed at which the surface was met.
        speed: S,
        /// Normal speed at which it was left.
        rebound: S,
    },
    /// A local minimum of the gap without contact.
    NearMiss {
        /// The gap there, at least 0.
        gap: S,
    },
    /// Infinitely many impacts were completed by their geometric series.
    ChatterEnd {
        /// Time the completed impacts took.
        duration: S,
    },
    /// The state stays on a rigid surface from here.
    Stick,
    /// It leaves the rigid surface it stuck to.
    Release,
    /// A compliant contact begins.
    ContactBegin {
        /// Normal speed at which the surface was met.
        speed: S,
    },
    /// A compliant contact ends.
    ContactEnd {
        /// Normal speed at which it was left.
        speed: S,
    },
}

/// How a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<S> {
    /// The time asked for was reached.
    Completed,
    /// The solution left the finite numbers, or its steps became too short to advance time (a
    /// singularity).
    Diverged {
        /// Time reached.
        time: S,
    },
    /// The reset of a rigid surface leaves the state moving into it, as a restitution below zero
    /// does: the model has no impact there.
    GoesThrough {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
    },
    /// The state is beyond a rigid surface: the initial state was, or another surface's reset put
    /// it there.
    Penetrating {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
        /// The gap, negative.
        gap: S,
    },
    /// Two surfaces hold the state at once: no field of the model stands for both.
    HeldTwice {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time reached.
        time: S,
    },
    /// Two rigid surfaces are met at the same instant, and the state behind depends on which of
    /// them acts first.
    HitTogether {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time reached.
        time: S,
    },
    /// The state must stay on a rigid surface whose reset defines no direction of a contact force,
    /// or moves a state at rest there (a tangential restitution); or on a compliant one, between
    /// the free flow, which presses it on, and a contact that pushes it off at once.
    NoStickingField {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
    },
    /// The field presses the state from both sides onto a corner (a zero of `sign`, as of dry
    /// friction): no field of the model stands for the sliding along it.
    Slides {
        /// Time reached.
        time: S,
    },
    /// The limit on steps was reached.
    StepLimit {
        /// The limit.
        limit: usize,
        /// Time reached.
        time: S,
    },
}

/// A simulated trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<S> {
    /// Events in order of time.
    pub events: Vec<Event<S>>,
    /// The full state at the end; the phase is reduced modulo its period.
    pub state: Vec<S>,
    /// Time simulated.
    pub time: S,
    /// How it ended.
    pub outcome: Outcome<S>,
}

impl<S: Real> Trajectory<S> {
    /// Number of contacts that began: impacts and compliant contacts.
    pub fn contacts(&self) -> usize {
        self.events.iter().filter(|event| event.kind.is_contact()).count()
    }

    /// Speeds at which surfaces were met, in order.
    pub fn contact_speeds(&self) -> impl Iterator<Item = S> + '_ {
        self.events.iter().filter_map(|event| event.kind.contact_speed())
    }
}

impl<S: Real> EventKind<S> {
    /// Whether a contact begins here.
    pub fn is_contact(&self) -> bool {
        self.contact_speed().is_some()
    }

    /// The speed at which the surface is met, where a contact begins here.
    pub fn contact_speed(&self) -> Option<S> {
        match *self {
            EventKind::Impact { speed, .. } | EventKind::ContactBegin { speed } => Some(speed),
            _ => None,
        }
    }
}

/// Wrong input to a direct simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HybridError {
    /// The state has another length than the model's full state.
    #[error("the full state has {expected} components, {found} were given")]
    StateLength {
        /// Components of the full state.
        expected: usize,
        /// Components given.
        found: usize,
    },
    /// The parameter vector has another length than the model's.
    #[error("the model has {expected} parameters, {found} were given")]
    ParameterLength {
        /// Parameters of the model.
        expected: usize,
        /// Parameters given.
        found: usize,
    },
    /// A component of the state, a parameter or a duration is not finite.
    #[error("component {component} of the input is not a finite number")]
    NotFinite {
        /// Position in the input: the full state, then the parameters.
        component: usize,
    },
    /// No such surface.
    #[error("surface {surface} does not exist: the model has {surfaces}")]
    NoSuchSurface {
        /// Index asked for.
        surface: usize,
        /// Surfaces of the model.
        surfaces: usize,
    },
    /// The first passage of a return from a passage is not the one it starts at.
    #[error("the first passage must be that of the section: at surface {surface}, at time 0")]
    FirstPassage {
        /// Surface of the section.
        surface: usize,
    },
    /// A passage is not within the return.
    #[error("passage {passage} at time {time:e} is not within a return that takes {duration:e}")]
    PassageTime {
        /// Number of the passage, from 0.
        passage: usize,
        /// Its nominal time.
        time: f64,
        /// Nominal return time.
        duration: f64,
    },
    /// The system has no forcing phase, so it has no forcing period.
    #[error("the model has no forcing phase, so no forcing period")]
    NoPhase,
    /// The phase does not advance.
    #[error("the phase advances at the rate {rate:e}; a positive rate is needed")]
    PhaseRate {
        /// Its rate.
        rate: f64,
    },
}

/// The section of a return map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnSection {
    /// Local minima of the gap of a surface along the free flow: `h' = 0`, `h'' > 0`.
    Tangency {
        /// The surface.
        surface: usize,
    },
    /// The forcing phase of a graze: the passage nearest to the start comes first, that nearest to
    /// the end is flown with the surface ignored.
    GrazingPhase {
        /// The surface.
        surface: usize,
    },
    /// Any other forcing phase: everything in between is simulated.
    OtherPhase,
}

/// One image of a section point.
#[derive(Clone, Debug, PartialEq)]
pub struct Return<S> {
    /// The full state at the next section point, the nominal advance of the phase removed.
    pub state: Vec<S>,
    /// Time from one section point to the next.
    pub elapsed: S,
    /// Speed at which each passage of the itinerary met its surface, in their order; `None`
    /// without contact.
    pub passages: Vec<Option<S>>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Contacts beyond one per passage, and those at surfaces without a passage.
    pub extra_contacts: usize,
    /// All contacts per surface of the model.
    pub hits: Vec<usize>,
    /// Normal speeds at which surfaces were met, in order.
    pub impact_speeds: Vec<S>,
    /// Gaps of local minima without contact on the way, in order.
    pub near_misses: Vec<S>,
    /// How it ended.
    pub outcome: ReturnOutcome<S>,
}

/// How a return ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReturnOutcome<S> {
    /// At the section.
    Returned,
    /// No section point within sixteen nominal return times.
    NoReturn {
        /// Time reached.
        time: S,
    },
    /// The section falls inside a contact with a surface, or on the way through it, that the
    /// coordinates of the section do not tell: the return has no image that they could hold.
    Ambiguous {
        /// The surface.
        surface: usize,
    },
    /// The simulation ended otherwise.
    Ended(Outcome<S>),
}

impl ReturnSection {
    /// The surface whose passage the section itself is; none for a phase between passages.
    pub fn surface(self) -> Option<usize> {
        match self {
            ReturnSection::Tangency { surface } | ReturnSection::GrazingPhase { surface } => {
                Some(surface)
            }
            ReturnSection::OtherPhase => None,
        }
    }
}

/// A grazing passage of the nominal return.
///
/// Its time says which event is that passage and nothing more, so double precision is enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalPassage {
    /// The surface.
    pub surface: usize,
    /// Time after the section point, at least 0 and below the nominal return time.
    pub time: f64,
}

/// The passages of one return, in the order of their numbers.
#[derive(Clone, Debug)]
pub(super) struct Itinerary {
    passages: Vec<ExpectedPassage>,
    /// Whether the first passage is that of the section.
    starts_at_passage: bool,
}

/// A surface, and when it is expected: a share of the return time in `[0, 1)`.
#[derive(Clone, Copy, Debug)]
struct ExpectedPassage {
    surface: usize,
    share: f64,
}

impl Itinerary {
    /// The section's own passage, where it has one.
    pub(super) fn of_section(section: ReturnSection) -> Self {
        let own = section.surface();
        let passage = |surface| ExpectedPassage { surface, share: 0.0 };
        Self { passages: own.map(passage).into_iter().collect(), starts_at_passage: own.is_some() }
    }

    /// These passages of a return that nominally takes `duration`.
    pub(super) fn new(
        section: ReturnSection,
        passages: &[NominalPassage],
        duration: f64,
        surfaces: usize,
    ) -> Result<Self, HybridError> {
        let own = section.surface();
        let first = passages.first().copied();
        if let Some(expected) = own
            && first.is_none_or(|first| first.surface != expected || first.time != 0.0)
        {
            return Err(HybridError::FirstPassage { surface: expected });
        }
        for (passage, &NominalPassage { surface, time }) in passages.iter().enumerate() {
            if surface >= surfaces {
                return Err(HybridError::NoSuchSurface { surface, surfaces });
            }
            if !(0.0..duration).contains(&time) {
                return Err(HybridError::PassageTime { passage, time, duration });
            }
        }
        let expected = passages.iter().map(|passage| ExpectedPassage {
            surface: passage.surface,
            share: passage.time / duration,
        });
        Ok(Self { passages: expected.collect(), starts_at_passage: own.is_some() })
    }

    /// Number of passages.
    pub(super) fn len(&self) -> usize {
        self.passages.len()
    }

    /// The surface of the first passage, and the share of the return time at which it is expected.
    pub(super) fn first(&self) -> Option<(usize, f64)> {
        self.passages.first().map(|first| (first.surface, first.share))
    }

    /// The share of the return time at which a passage is expected.
    pub(super) fn share(&self, passage: usize) -> f64 {
        self.passages[passage].share
    }

    /// Per passage the speed at which its surface was met; `None` without contact.
    ///
    /// An event belongs to the passage of its surface whose nominal time is nearest around the
    /// return; of the events of a passage, contacts and near misses alike, the nearest says
    /// whether it made contact. The section's own passage is known from the flight.
    pub(super) fn speeds<S: Real>(&self, log: &Log<S>, duration: f64) -> Vec<Option<S>> {
        let mut nearest: Vec<Option<(f64, Option<S>)>> = vec![None; self.passages.len()];
        for event in &log.events {
            let share = event.time.to_f64() / duration;
            if let Some((number, distance)) = self.nearest(event.surface, share)
                && nearest[number].is_none_or(|(known, _)| distance < known)
            {
                nearest[number] = Some((distance, event.kind.contact_speed()));
            }
        }
        let mut speeds: Vec<_> =
            nearest.into_iter().map(|nearest| nearest.and_then(|(_, speed)| speed)).collect();
        if let (true, Some(own)) = (self.starts_at_passage, speeds.first_mut()) {
            *own = log.own;
        }
        speeds
    }

    /// The passage of a surface nearest to a share of the return, and how far it is.
    fn nearest(&self, surface: usize, share: f64) -> Option<(usize, f64)> {
        let of_surface = self.passages.iter().enumerate();
        let distances = of_surface.filter(|(_, passage)| passage.surface == surface).map(
            |(number, passage)| {
                let difference = share - passage.share;
                (number, (difference - difference.round()).abs())
            },
        );
        distances.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// What is counted on the way.
#[derive(Clone, Debug)]
pub(super) struct Log<S> {
    /// Near misses, and contacts at the time of the minimum that their approach would have had.
    pub(super) events: Vec<Event<S>>,
    /// Speed at which the section's own passage met its surface.
    pub(super) own: Option<S>,
}

impl<S: Real> Log<S> {
    pub(super) fn new() -> Self {
        Self { events: Vec::new(), own: None }
    }

    pub(super) fn recorder(&mut self) -> impl FnMut(Event<S>) + '_ {
        |event| {
            if event.kind.is_contact() || matches!(event.kind, EventKind::NearMiss { .. }) {
                self.events.push(event);
            }
        }
    }

    /// Contacts per surface.
    pub(super) fn hits(&self, surfaces: usize) -> Vec<usize> {
        let mut hits = vec![0; surfaces];
        for event in self.events.iter().filter(|event| event.kind.is_contact()) {
            hits[event.surface] += 1;
        }
        hits
    }

    /// Speeds of all contacts, in order.
    pub(super) fn contact_speeds(&self) -> Vec<S> {
        self.events.iter().filter_map(|event| event.kind.contact_speed()).collect()
    }

    /// Gaps of all near misses, in order.
    pub(super) fn near_misses(&self) -> Vec<S> {
        let gap = |event: &Event<S>| match event.kind {
            EventKind::NearMiss { gap } => Some(gap),
            _ => None,
        };
        self.events.iter().filter_map(gap).collect()
    }
}
