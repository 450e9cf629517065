//! One smooth vector field: Taylor steps, dense output, jets of its flow.
//!
//! Deliberately absent: impacts and contact.

mod error;
mod evaluation;
mod field;
mod integrator;
mod program;
#[cfg(test)]
mod samples;

pub use error::FlowError;
pub use evaluation::evaluate;
pub use field::Field;
pub use integrator::{Integrator, Step, horner};
pub use program::{InputKind, Program};
