//! Maps that can be iterated, and what their orbits do: periods, contacts, Lyapunov exponents.
//!
//! One contract, [`DiscreteMap`], for every way to evaluate a map. Deliberately absent: where a map
//! came from.

mod batch;
#[cfg(feature = "compiled-maps")]
mod compiled;
mod device_map;
mod discrete_map;
mod forms;
mod frozen_lanes;
mod horner;
mod interpreted;
mod itinerary;
mod orbit;
mod tangents;

pub use batch::Batch;
#[cfg(feature = "compiled-maps")]
pub use compiled::{CompiledMap, compiled};
pub use device_map::{
    DeviceMap, DeviceOrbit, DeviceReport, KernelPiece, KernelPoints, PointKernel,
};
pub use discrete_map::{DifferentiableMap, DiscreteMap, PassageSet, StepInfo};
pub use frozen_lanes::{FrozenLanes, Substitute};
pub use horner::{FrozenMap, HornerMap, SingleMap};
pub use interpreted::InterpretedMap;
pub use itinerary::{Itinerary, OrbitName};
pub use orbit::{
    ContactsPerPeriod, MapOrbit, OrbitEnd, OrbitRequest, Period, largest_lyapunov_exponent,
};
pub(crate) use tangents::{Tangent, Tangents};
