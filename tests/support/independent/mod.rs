//! An oscillator with stops, simulated in another way than the program does it.
//!
//! The text of a scene is read anew ([`Oscillator`]) and formulas are evaluated as they stand.
//! Flows are integrated by extrapolation of the midpoint rule, looked at so often that nothing
//! hides in between, and events are found by integrating a part of a step once more. No series, no
//! expression graph, no exact flow.
#![allow(dead_code, unused_imports, reason = "tests and the example use a part of it each")]

mod extrapolation;
mod formula;
mod number;
mod oscillator;
mod section;
mod simulator;

pub(crate) use number::Number;
pub(crate) use oscillator::Oscillator;
pub(crate) use section::{next_approach, speeds, tangency_return};
pub(crate) use simulator::{Failure, Happening, Kind, Mode, Simulator};
