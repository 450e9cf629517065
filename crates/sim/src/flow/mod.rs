//! One smooth vector field: Taylor steps, dense output, jets of its flow.
//!
//! Deliberately absent: impacts and contact.

mod affine;
mod corners;
mod field;
mod integrator;
mod jet_transport;
mod program;
mod resolution;
#[cfg(test)]
mod samples;
mod series;
mod step_control;

pub use affine::{AffineExpressions, AffineFieldRows, AffineFlow, AffineRows, RowTable};
pub(crate) use affine::{Backend, Batch, NumberMask, RoundedNumber, Single, SpanTables};
pub use field::{Field, FlowError, bound_but};
pub use integrator::{Carried, Integrator, LaneIntegrator, LaneStep, Step, horner};
pub(crate) use integrator::{MOST_SLIDES, SLIDES};
pub use jet_transport::{
    JetFlow, LocalSeries, at_series_time, first_derivatives, flow_with_jacobian,
    flow_with_jacobian_within, jet_transport, jet_transport_taylor, jet_transport_taylor_within,
    local_series, local_series_kept_to, products_of_jet_step, watched_jet_transport_taylor,
};
pub use program::{InputKind, Program, evaluate};
