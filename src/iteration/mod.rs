//! Maps that can be iterated, and what their orbits do: periods, contacts, Lyapunov exponents.
//!
//! One contract, [`DiscreteMap`], whatever evaluates the map. Deliberately absent: where a map came
//! from.

#[cfg(feature = "compiled-maps")]
mod compiled;
mod discrete_map;
mod forms;
mod frozen;
mod frozen_lanes;
mod horner;
mod interpreted;
mod itinerary;
mod lyapunov;
mod orbit;
mod passage_set;
mod period;
mod single;
mod tangents;

#[cfg(feature = "compiled-maps")]
pub use compiled::{CompiledMap, compiled};
pub use discrete_map::{DiscreteMap, StepInfo};
pub use frozen::FrozenMap;
pub use frozen_lanes::FrozenLanes;
pub use horner::HornerMap;
pub use interpreted::InterpretedMap;
pub use itinerary::{Itinerary, OrbitName};
pub use lyapunov::largest_lyapunov_exponent;
pub use orbit::{MapOrbit, OrbitEnd, OrbitRequest};
pub use passage_set::PassageSet;
pub use period::{ContactsPerPeriod, Period};
pub use single::SingleMap;
