//! What a return map is asked and what it answers: the section, the image, how it ended.

use super::trajectory::{Event, EventKind, Outcome};
use crate::numeric::Real;

/// The section of a return map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReturnSection<S> {
    /// Local minima of the gap of a surface along the free flow: `h' = 0`, `h'' > 0`.
    Tangency {
        /// The surface.
        surface: usize,
    },
    /// The forcing phase of the graze: the passage nearest to the start comes first, that nearest to
    /// the end is flown with the surface ignored.
    GrazingPhase {
        /// The surface.
        surface: usize,
    },
    /// Any other forcing phase: everything in between is simulated.
    OtherPhase {
        /// The surface.
        surface: usize,
        /// Nominal time from the section to the graze.
        graze_time: S,
    },
}

/// One image of a section point.
#[derive(Clone, Debug, PartialEq)]
pub struct Return<S> {
    /// The full state at the next section point, the nominal advance of the phase removed.
    pub state: Vec<S>,
    /// Time from one section point to the next.
    pub elapsed: S,
    /// Contacts of the passage that the section is about: 0 or 1.
    pub contacts: usize,
    /// Contacts elsewhere in the period.
    pub extra_contacts: usize,
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
    /// No section point within three nominal return times.
    NoReturn {
        /// Time reached.
        time: S,
    },
    /// The simulation ended otherwise.
    Ended(Outcome<S>),
}

impl<S> ReturnSection<S> {
    /// The surface the section is about.
    pub fn surface(&self) -> usize {
        match *self {
            ReturnSection::Tangency { surface }
            | ReturnSection::GrazingPhase { surface }
            | ReturnSection::OtherPhase { surface, .. } => surface,
        }
    }
}

/// What is counted on the way.
pub(super) struct Log<S> {
    /// Times, surfaces and kinds of contacts and near misses.
    pub(super) events: Vec<Event<S>>,
}

impl<S: Real> Log<S> {
    pub(super) fn recorder(&mut self) -> impl FnMut(Event<S>) + '_ {
        |event| {
            if event.kind.is_contact() || matches!(event.kind, EventKind::NearMiss { .. }) {
                self.events.push(event);
            }
        }
    }
}

impl<S: Real> Log<S> {
    /// 1 if the passage nearest in time to the nominal graze made contact.
    pub(super) fn nominal_contacts(&self, surface: usize, graze_time: S) -> usize {
        let distance = |event: &&Event<S>| (event.time - graze_time).abs();
        let passages = self.events.iter().filter(|event| event.surface == surface);
        let nearest = passages.reduce(|a, b| if distance(&b) < distance(&a) { b } else { a });
        usize::from(nearest.is_some_and(|event| event.kind.is_contact()))
    }
}
