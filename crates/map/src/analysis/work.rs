//! Bounds on the work of searches by direct simulation.
//!
//! One idea: work is counted in products of series, the same on every machine and whatever the
//! number of cores. A search ends where its share is used up, with what it has, and what is
//! unfinished is named.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::periodic::ContactItinerary;
use crate::iteration::parallel::locked;

/// Most work for the branches of an itinerary in a search, in products of series: some 20 s.
pub const MOST_WORK: u64 = 60_000_000;

/// Itineraries of which not all was followed within the bound.
#[derive(Debug, Default)]
pub(super) struct Unfinished(Mutex<BTreeMap<String, ContactItinerary>>);

impl Unfinished {
    /// Takes note of itineraries.
    pub(super) fn extend<'i>(&self, itineraries: impl IntoIterator<Item = &'i ContactItinerary>) {
        let named = itineraries.into_iter().map(|one| (one.to_string(), one.clone()));
        locked(&self.0).extend(named);
    }

    /// Each of them once, by its digits.
    pub(super) fn listed(&self) -> Vec<ContactItinerary> {
        locked(&self.0).values().cloned().collect()
    }
}
