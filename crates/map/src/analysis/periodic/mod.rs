//! Periodic orbits near a graze and their multipliers, with the same code for a local map and for
//! direct simulation.
//!
//! Maps are used only through [`SectionMap`], so that two results differ by the map alone. Near a
//! graze a state depends on the parameter through a root, while the parameter is a smooth function
//! of the states on the orbit; orbits are therefore solved for with either the parameter or a
//! coordinate [`Held`] (`Foale1994`, whose `alpha(y)²` is a branch in the speed for the linear
//! oscillator). With the depth variables as additional coordinates, an itinerary's orbits are fixed
//! points of a map without a root ([`DepthVariableMap`]). See docs/mathematics/dynamics.md.

mod contact_itinerary;
mod direct_equations;
mod found_orbit;
mod itinerary_search;
mod kept_orbit;
mod map_equations;
mod orbit;
mod returns;
mod section_map;

pub use contact_itinerary::{ContactItinerary, ItineraryError};
pub use direct_equations::{DirectOrbit, DirectOrbitEquations, DirectUnits, SectionPoints};
pub(super) use found_orbit::ByMap;
pub use found_orbit::{FoundOrbit, OrbitContact};
pub(super) use itinerary_search::SettledCycle;
pub use itinerary_search::{DepthVariableMap, ItineraryOrbit, ItinerarySearch};
pub(super) use kept_orbit::KeptOrbit;
pub use map_equations::{MapOrbitEquations, PassagesOfOrbit, TestKind};
pub(super) use orbit::finite_or_one;
pub use orbit::{
    Guess, Held, PeriodicOrbit, PeriodicOutcome, PeriodicProblem, periodic_orbit, window_scales,
};
pub(super) use returns::{MapReturns, PrescribedReturn, PrescribedReturns};
pub(super) use section_map::derivatives;
pub use section_map::{Linearisation, SectionMap, SectionStep, Stepped, linearise};
