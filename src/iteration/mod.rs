//! Maps that can be iterated.

mod discrete_map;

pub use discrete_map::{DiscreteMap, StepInfo};
