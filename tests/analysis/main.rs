//! What is computed with maps: diagrams, charts, orbits by itinerary, convergence, the choice of a map.

#[path = "../support/mod.rs"]
mod support;

mod any_section;
mod charts;
mod choice;
mod choice_evidence;
mod convergence;
mod diagrams;
mod dynamics;
mod itineraries;
mod orbit_search;
mod two_sided;
