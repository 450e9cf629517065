//! Maps that can be iterated, and their orbits: periods, contacts, Lyapunov exponents.
//!
//! One contract, [`DiscreteMap`], for every way to evaluate a map. Deliberately absent: the origin
//! of a map.

#[cfg(feature = "compiled-maps")]
mod compiled;
mod device_map;
mod discrete_map;
mod frozen_lanes;
mod horner;
mod interpreted;
mod lyapunov;
mod orbit;
pub mod parallel;
mod phase_circle;

#[cfg(feature = "compiled-maps")]
pub use compiled::CompiledMap;
pub use device_map::{
    DeviceMap, DeviceOrbit, DeviceReport, KernelPiece, KernelPoints, PointKernel,
};
pub use discrete_map::{
    DifferentiableMap, DiscreteMap, Itinerary, OrbitName, PassageSet, StepInfo,
};
pub use frozen_lanes::{FrozenLanes, Substitute};
pub use horner::{Batch, FrozenMap, HornerMap, SingleMap};
pub use interpreted::InterpretedMap;
pub(crate) use interpreted::{Tangent, Tangents};
pub use lyapunov::{LyapunovExponent, largest_lyapunov_exponent, periodic_lyapunov_exponent};
pub use orbit::{ContactsPerPeriod, MapOrbit, OrbitEnd, OrbitRequest, Period};
pub use phase_circle::PhaseCircle;
