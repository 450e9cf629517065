//! Periodic orbits near a graze, their multipliers, and where they fold and flip: the same code on
//! a local map and on direct simulation.
//!
//! A [`SectionMap`] is all that is asked of a map, so what differs between two results is the map
//! and nothing else. Near a graze a state depends on the parameter through a root, while the
//! parameter is a smooth function of the states on the orbit; so branches are followed in a
//! coordinate that is [`Held`], not in the parameter (`Foale1994`, whose `alpha(y)²` is that branch
//! for the linear oscillator). With the depth variables themselves as coordinates an itinerary's
//! orbits are fixed points of a map without a root ([`DepthVariableMap`]). See
//! docs/mathematics/dynamics.md.

mod branch;
mod contact_itinerary;
mod depth_variable_map;
mod direct_equations;
mod itinerary_bifurcations;
mod itinerary_search;
mod map_equations;
mod orbit;
mod section_map;

pub use branch::{Bifurcation, BifurcationKind, bifurcation, branch};
pub use contact_itinerary::{ContactItinerary, ItineraryError};
pub use depth_variable_map::{DepthVariableMap, ItineraryOrbit};
pub use direct_equations::{DirectOrbit, DirectOrbitEquations, DirectUnits};
pub use itinerary_bifurcations::ItineraryBifurcation;
pub use itinerary_search::ItinerarySearch;
pub(super) use itinerary_search::Settled;
pub use map_equations::{MapOrbitEquations, PassagesOfOrbit};
pub(super) use orbit::finite_or_one;
pub use orbit::{
    Guess, Held, PeriodicOrbit, PeriodicOutcome, PeriodicProblem, periodic_orbit, window_scales,
};
pub(super) use section_map::state_jacobian;
pub use section_map::{Linearisation, SectionMap, SectionStep, Stepped, linearise};
