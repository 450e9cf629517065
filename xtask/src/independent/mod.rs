//! Oscillator with stops, simulated independently of the program.
//!
//! The text of a scene is parsed independently ([`Oscillator`]) and formulas are evaluated as
//! written. Flows are integrated by extrapolation of the midpoint rule, sampled so densely that no
//! event hides in between, and events are located by integrating a part of a step again. There is
//! no series, no expression graph, and no exact flow.

mod extrapolation;
mod formula;
mod number;
mod oscillator;
mod section;
mod simulator;

pub use number::Number;
pub use oscillator::Oscillator;
pub use section::{next_approach, speeds, tangency_return};
pub use simulator::{Failure, Happening, Kind, Mode, Simulator};
