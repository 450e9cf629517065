//! Periodic orbits by itinerary, and their folds and flips in two parameters: what is asked, and
//! what was found.
//!
//! One idea: a local map is searched, for with the contacts prescribed it is a polynomial; direct
//! simulation, which goes its own way, is asked for the orbit next to each one found.

mod by_map;
mod data;
mod direct;
mod engine;

pub use data::{
    FoundOrbit, LociRequest, Locus, LostOrbit, LostReason, OrbitContact, Orbits, OrbitsRequest,
    SteppedParameter,
};
pub use engine::orbits;
