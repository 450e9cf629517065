//! What is computed with maps: diagrams, charts, orbits by itinerary, convergence, the choice of a
//! map.

#[path = "../support/mod.rs"]
mod support;

mod any_section;
mod charts;
mod choice;
mod choice_evidence;
mod convergence;
mod diagrams;
mod dynamics;
mod guarded;
mod itineraries;
mod orbit_search;
mod record;
mod resuming;
mod trajectories;
mod two_sided;
mod windows;

use grazemap::numeric::Dd;

/// Number in the sequence of the first point of the checks: beyond all that anything is chosen or
/// measured by.
const UNUSED: usize = 100_000;

fn exact(values: &[f64]) -> Vec<Dd> {
    values.iter().map(|&value| Dd::from(value)).collect()
}
