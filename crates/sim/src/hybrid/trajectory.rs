//! Results of a simulation and of a return map: events in time, the final state, the outcome, the
//! expected passages of a return, and the errors of wrong input.

use crate::numeric::Real;

/// An event on a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<S> {
    /// Time since the start of the simulation.
    pub time: S,
    /// Surface of the event: an index into [`Model::surfaces`](crate::model::Model::surfaces).
    pub surface: usize,
    /// Kind of the event.
    pub kind: EventKind<S>,
}

/// Kinds of events. Speeds are `|h'|` in units of the event function per time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<S> {
    /// A rigid impact.
    Impact {
        /// Normal speed before the impact.
        speed: S,
        /// Normal speed after the impact.
        rebound: S,
    },
    /// A local minimum of the gap without contact.
    NearMiss {
        /// The gap at the minimum, at least 0.
        gap: S,
    },
    /// The end of a chatter: infinitely many impacts, summed by their geometric series.
    ChatterEnd {
        /// Duration of the summed impacts.
        duration: S,
    },
    /// The state sticks to a rigid surface from here on.
    Stick,
    /// The state leaves the rigid surface to which it stuck.
    Release,
    /// A compliant contact begins.
    ContactBegin {
        /// Normal speed at the beginning of the contact.
        speed: S,
    },
    /// A compliant contact ends.
    ContactEnd {
        /// Normal speed at the end of the contact.
        speed: S,
    },
}

/// Outcome of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<S> {
    /// The requested time was reached.
    Completed,
    /// The solution is no longer finite, or its steps became too short to advance time (a
    /// singularity).
    Diverged {
        /// Time reached.
        time: S,
    },
    /// The reset of a rigid surface leaves the state moving into the surface, as a restitution
    /// below zero does: the model has no impact there.
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
    /// Two surfaces hold the state at once: no field of the model describes both.
    HeldTwice {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time reached.
        time: S,
    },
    /// Two rigid surfaces are met at the same instant, and the state after both depends on which of
    /// them acts first.
    HitTogether {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time reached.
        time: S,
    },
    /// The state must stay on a rigid surface whose reset defines no direction of a contact force,
    /// or moves a state at rest there (a tangential restitution); or on a compliant surface,
    /// between the free flow, which presses it on, and a contact that pushes it off at once.
    NoStickingField {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
    },
    /// The field presses the state from both sides onto a corner (a zero of `sign`, as in dry
    /// friction): no field of the model describes the sliding along it.
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
    /// Simulated time.
    pub time: S,
    /// Outcome of the simulation.
    pub outcome: Outcome<S>,
}

impl<S: Real> Trajectory<S> {
    /// Number of contacts that began: impacts and compliant contacts.
    pub fn contacts(&self) -> usize {
        self.events.iter().filter(|event| event.kind.is_contact()).count()
    }

    /// Normal speeds of all contacts at their beginning, in order.
    pub fn contact_speeds(&self) -> impl Iterator<Item = S> + '_ {
        self.events.iter().filter_map(|event| event.kind.contact_speed())
    }
}

impl<S: Real> EventKind<S> {
    /// Whether the event is the beginning of a contact.
    pub fn is_contact(&self) -> bool {
        self.contact_speed().is_some()
    }

    /// Normal speed at the beginning of a contact; `None` for other events.
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
    /// A state whose length is not that of the model's full state.
    #[error("the full state has {expected} components, {found} were given")]
    StateLength {
        /// Components of the full state.
        expected: usize,
        /// Components given.
        found: usize,
    },
    /// A parameter vector whose length is not that of the model's.
    #[error("the model has {expected} parameters, {found} were given")]
    ParameterLength {
        /// Parameters of the model.
        expected: usize,
        /// Parameters given.
        found: usize,
    },
    /// A component of the state, a parameter or a duration that is not finite.
    #[error("component {component} of the input is not a finite number")]
    NotFinite {
        /// Position in the input: the full state, then the parameters.
        component: usize,
    },
    /// An index that is not a surface of the model.
    #[error("surface {surface} does not exist: the model has {surfaces}")]
    NoSuchSurface {
        /// Requested index.
        surface: usize,
        /// Number of surfaces of the model.
        surfaces: usize,
    },
    /// The first passage of a return that starts at a passage is not that passage.
    #[error("the first passage must be that of the section: at surface {surface}, at time 0")]
    FirstPassage {
        /// Surface of the section.
        surface: usize,
    },
    /// A passage outside of the return.
    #[error("passage {passage} at time {time:e} is not within a return that takes {duration:e}")]
    PassageTime {
        /// Number of the passage, from 0.
        passage: usize,
        /// Nominal time of the passage.
        time: f64,
        /// Nominal return time.
        duration: f64,
    },
    /// A system without a forcing phase, and therefore without a forcing period.
    #[error("the model has no forcing phase, so no forcing period")]
    NoPhase,
    /// A phase that does not advance.
    #[error("the phase advances at the rate {rate:e}; a positive rate is needed")]
    PhaseRate {
        /// Rate of the phase.
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
    /// The forcing phase of a graze: the passage nearest to the start comes first, and on the
    /// passage nearest to the end the surface is ignored.
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
    /// Full state at the next section point, with the nominal advance of the phase removed.
    pub state: Vec<S>,
    /// Time from one section point to the next.
    pub elapsed: S,
    /// Normal speed of each grazing passage of the itinerary at contact, in the order of the
    /// passages; `None` without contact.
    pub passages: Vec<Option<S>>,
    /// Number of grazing passages that made contact.
    pub contacts: usize,
    /// Number of contacts beyond one per passage and expected hit, of expected hits without
    /// contact, and of those that end in a rest against the stop where none is expected, or in
    /// none. The rebounds that lead to an expected rest count as one contact.
    pub extra_contacts: usize,
    /// Number of all contacts per surface of the model.
    pub hits: Vec<usize>,
    /// Normal speeds at contact, in order of time.
    pub impact_speeds: Vec<S>,
    /// Normal speed of the first contact that is no expected hit; `None` without one.
    pub first_speed: Option<S>,
    /// Largest share of an impact's speed with which the state still moves into a rigid surface
    /// after its reset, as for a restitution below zero; 0 if it never does.
    pub passed: S,
    /// Gaps at local minima without contact on the way, in order.
    pub near_misses: Vec<S>,
    /// Outcome of the return.
    pub outcome: ReturnOutcome<S>,
}

/// Outcome of a return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReturnOutcome<S> {
    /// The section was reached.
    Returned,
    /// There is no section point within sixteen nominal return times.
    NoReturn {
        /// Time reached.
        time: S,
    },
    /// The section lies inside a contact with a surface, or on the way through it, and the
    /// coordinates of the section cannot represent this: the return has no image.
    Ambiguous {
        /// The surface.
        surface: usize,
    },
    /// The simulation ended otherwise.
    Ended(Outcome<S>),
}

impl ReturnSection {
    /// Surface of the section's own passage; `None` for a phase between passages.
    pub fn surface(self) -> Option<usize> {
        match self {
            ReturnSection::Tangency { surface } | ReturnSection::GrazingPhase { surface } => {
                Some(surface)
            }
            ReturnSection::OtherPhase => None,
        }
    }
}

/// A contact of the nominal return: a grazing passage or a hit.
///
/// The time only identifies which event is the passage, so that double precision is enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalPassage {
    /// The surface.
    pub surface: usize,
    /// Time after the section point, at least 0 and below the nominal return time: of the graze, or
    /// of the minimum that the approach of a hit would have had.
    pub time: f64,
    /// Whether the surface is hit; otherwise it is grazed.
    pub hit: bool,
    /// Whether the hit ends in a rest against the surface, at once or by ever smaller rebounds.
    pub rests: bool,
}

/// Passages of one return, in the order of their numbers.
#[derive(Clone, Debug)]
pub(super) struct Itinerary {
    passages: Vec<ExpectedPassage>,
    /// Whether the first passage is that of the section.
    starts_at_passage: bool,
}

/// A surface, and the expected time of its passage: a share of the return time in `[0, 1)`.
#[derive(Clone, Copy, Debug)]
struct ExpectedPassage {
    surface: usize,
    share: f64,
    hit: bool,
    rests: bool,
}

impl Itinerary {
    /// The section's own passage, if it has one.
    pub(super) fn of_section(section: ReturnSection) -> Self {
        let own = section.surface();
        let passage = |surface| ExpectedPassage { surface, share: 0.0, hit: false, rests: false };
        Self { passages: own.map(passage).into_iter().collect(), starts_at_passage: own.is_some() }
    }

    /// Itinerary with these passages, for a return of nominal duration `duration`.
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
        for (passage, &NominalPassage { surface, time, .. }) in passages.iter().enumerate() {
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
            hit: passage.hit,
            rests: passage.rests,
        });
        Ok(Self { passages: expected.collect(), starts_at_passage: own.is_some() })
    }

    /// Whether hits are expected.
    pub(super) fn has_hits(&self) -> bool {
        self.passages.iter().any(|passage| passage.hit)
    }

    /// Whether each contact is an expected hit.
    pub(super) fn hits(&self) -> impl Iterator<Item = bool> {
        self.passages.iter().map(|passage| passage.hit)
    }

    /// Number of passages.
    pub(super) fn len(&self) -> usize {
        self.passages.len()
    }

    /// Surface of the first passage, and the expected share of the return time.
    pub(super) fn first(&self) -> Option<(usize, f64)> {
        self.passages.first().map(|first| (first.surface, first.share))
    }

    /// Expected share of the return time of a passage.
    pub(super) fn share(&self, passage: usize) -> f64 {
        self.passages[passage].share
    }

    /// Speed of each passage at contact; `None` without contact.
    ///
    /// An event belongs to the passage of its surface with the nearest nominal time around the
    /// return. Among the events of a passage, contacts and near misses alike, the nearest one
    /// decides whether it made contact. The flight itself determines the section's own passage.
    pub(super) fn speeds<S: Real>(&self, log: &Log<S>, duration: f64) -> Vec<Option<S>> {
        if self.starts_at_passage && self.passages.len() == 1 {
            return vec![log.own];
        }
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

    /// Number of contacts that lead to expected rests, one for each of them left out, and of hits
    /// that end in a rest or in none against the expectation.
    pub(super) fn rests<S: Real>(&self, log: &Log<S>, duration: f64) -> [usize; 2] {
        let share = |time: S| time.to_f64() / duration;
        let is_at = |number: usize, surface: usize, time: S| {
            self.nearest(surface, share(time)).is_some_and(|(nearest, _)| nearest == number)
        };
        let (mut rebounds, mut others) = (0, 0);
        for (number, passage) in self.passages.iter().enumerate().filter(|(_, one)| one.hit) {
            let rests = log.rests.iter().any(|&(surface, time)| is_at(number, surface, time));
            if rests != passage.rests {
                others += 1;
            } else if rests {
                let contacts = log.events.iter().filter(|event| event.kind.is_contact());
                let own = contacts.filter(|event| is_at(number, event.surface, event.time));
                rebounds += own.count().saturating_sub(1);
            }
        }
        [rebounds, others]
    }

    /// Speed of the first contact that is no expected hit.
    pub(super) fn first_speed<S: Real>(&self, log: &Log<S>, duration: f64) -> Option<S> {
        let is_expected =
            |event: &Event<S>| self.expects_hit(event.surface, event.time.to_f64() / duration);
        let mut others = log.events.iter().filter(|event| !is_expected(event));
        others.find_map(|event| event.kind.contact_speed())
    }

    /// Whether the contact of a surface expected nearest to a share of the return is a hit.
    pub(super) fn expects_hit(&self, surface: usize, share: f64) -> bool {
        self.nearest(surface, share).is_some_and(|(number, _)| self.passages[number].hit)
    }

    /// Passage of a surface nearest to a share of the return, and its distance.
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

/// Events counted during a return.
#[derive(Clone, Debug)]
pub(super) struct Log<S> {
    /// Near misses, and contacts at the times of the minima that their approaches would have had.
    pub(super) events: Vec<Event<S>>,
    /// Surfaces and times at which the state comes to rest against a stop.
    pub(super) rests: Vec<(usize, S)>,
    /// Normal speed of the section's own passage at contact.
    pub(super) own: Option<S>,
    /// Whether nobody reads the log, so that nothing is recorded.
    pub(super) is_unread: bool,
}

impl<S: Real> Log<S> {
    pub(super) fn new() -> Self {
        Self { events: Vec::new(), rests: Vec::new(), own: None, is_unread: false }
    }

    /// Log that nobody reads: it stays empty.
    pub(super) fn unread() -> Self {
        Self { is_unread: true, ..Self::new() }
    }

    /// Forgets all events.
    pub(super) fn clear(&mut self) {
        self.events.clear();
        self.rests.clear();
        self.own = None;
    }

    pub(super) fn recorder(&mut self) -> impl FnMut(Event<S>) + '_ {
        |event| {
            if self.is_unread {
                return;
            }
            if event.kind == EventKind::Stick {
                self.rests.push((event.surface, event.time));
            } else if event.kind.is_contact() || matches!(event.kind, EventKind::NearMiss { .. }) {
                self.events.push(event);
            }
        }
    }

    /// Number of contacts per surface.
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

    /// Largest share of an impact's speed with which the state still moves inwards after it.
    pub(super) fn passed(&self) -> S {
        let share = |event: &Event<S>| match event.kind {
            EventKind::Impact { speed, rebound } if speed > S::zero() => Some(-rebound / speed),
            _ => None,
        };
        self.events.iter().filter_map(share).fold(S::zero(), S::max)
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
