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

mod bifurcation;
mod branch;
mod contact_itinerary;
mod depth_variable_map;
mod derivative;
mod itinerary_bifurcations;
mod itinerary_orbit;
mod itinerary_search;
mod newton;
mod orbit;
mod problem;
mod section_map;

pub use bifurcation::{Bifurcation, BifurcationKind, bifurcation};
pub use branch::branch;
pub use contact_itinerary::{ContactItinerary, ItineraryError};
pub use depth_variable_map::DepthVariableMap;
pub(super) use derivative::state_jacobian;
pub use derivative::{Linearisation, linearise};
pub use itinerary_bifurcations::ItineraryBifurcation;
pub use itinerary_orbit::ItineraryOrbit;
pub use itinerary_search::ItinerarySearch;
pub use newton::periodic_orbit;
pub use orbit::PeriodicOrbit;
pub(super) use problem::finite_or_one;
pub use problem::{Guess, Held, PeriodicOutcome, PeriodicProblem, window_scales};
pub use section_map::{SectionMap, SectionStep, Stepped};
