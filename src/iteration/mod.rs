//! Maps that can be iterated, and what their orbits do: periods, contacts, Lyapunov exponents.

mod discrete_map;
mod interpreted;
mod lyapunov;
mod orbit;
mod period;

pub use discrete_map::{DiscreteMap, StepInfo};
pub use interpreted::InterpretedMap;
pub use lyapunov::largest_lyapunov_exponent;
pub use orbit::{MapOrbit, OrbitEnd, OrbitRequest};
pub use period::{ContactsPerPeriod, Period};
