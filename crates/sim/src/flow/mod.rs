//! One smooth vector field: Taylor steps, dense output, jets of its flow.
//!
//! Deliberately absent: impacts and contact.

mod affine;
mod error;
mod evaluation;
mod field;
mod integrator;
mod jet_transport;
mod local_series;
mod program;
#[cfg(test)]
mod samples;
mod series;
mod step_control;
mod time_expansion;
mod values;
mod variational;

pub use affine::{AffineExpressions, AffineFieldRows, AffineFlow, AffineRows, RowTable};
pub(crate) use affine::{Backend, Batch, NumberMask, RoundedNumber, Single, SpanTables};
pub use error::FlowError;
pub use evaluation::evaluate;
pub use field::{Field, bound_but};
pub use integrator::{Carried, Integrator, LaneIntegrator, LaneStep, Step, horner};
pub use jet_transport::{JetFlow, jet_transport, jet_transport_taylor};
pub use local_series::{LocalSeries, at_series_time, local_series, local_series_kept_to};
pub use program::{InputKind, Program};
pub use variational::{flow_with_jacobian, flow_with_jacobian_within};
