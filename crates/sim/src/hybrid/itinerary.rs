//! What is expected of a return, passage by passage, and what became of it.

use super::HybridError;
use super::returned::ReturnSection;
use super::trajectory::{Event, EventKind};
use crate::numeric::Real;

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
        let kinds = self.events.iter().map(|event| event.kind);
        kinds.filter_map(|kind| kind.contact_speed()).collect()
    }

    /// Gaps of all near misses, in order.
    pub(super) fn near_misses(&self) -> Vec<S> {
        let kinds = self.events.iter().map(|event| event.kind);
        kinds
            .filter_map(|kind| match kind {
                EventKind::NearMiss { gap } => Some(gap),
                _ => None,
            })
            .collect()
    }
}
