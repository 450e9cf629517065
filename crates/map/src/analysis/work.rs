//! Bounds on the work of searches by direct simulation.
//!
//! One idea: work is counted in products of series, the same on every machine and for any number of
//! cores. A search that reaches its bound returns the results so far and names the unfinished
//! itineraries.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::periodic::ContactItinerary;
use crate::iteration::parallel::locked;

/// Most work for the branches of one itinerary in a search, in products of series: about 20 s.
pub const MOST_WORK: u64 = 60_000_000;

/// Itineraries whose branches were not all followed within the bound.
#[derive(Debug, Default)]
pub(super) struct Unfinished(Mutex<BTreeMap<String, ContactItinerary>>);

impl Unfinished {
    /// Adds itineraries.
    pub(super) fn extend<'i>(&self, itineraries: impl IntoIterator<Item = &'i ContactItinerary>) {
        let named = itineraries.into_iter().map(|one| (one.to_string(), one.clone()));
        locked(&self.0).extend(named);
    }

    /// The itineraries, each once, sorted by their digits.
    pub(super) fn listed(&self) -> Vec<ContactItinerary> {
        locked(&self.0).values().cloned().collect()
    }
}
