//! Jets of a flow over a time: two methods that have only the field's program in common.

mod coefficients;
mod collocation;
mod element;
mod first_order;
mod gauss;
mod plan;
mod remainders;
mod solver;
mod sparse;
mod taylor;

pub use collocation::{JetFlow, jet_transport};
#[cfg(test)]
pub(super) use taylor::expand;
pub use taylor::{
    LocalSeries, at_series_time, first_derivatives, flow_with_jacobian, flow_with_jacobian_within,
    jet_transport_taylor, jet_transport_taylor_within, local_series, local_series_kept_to,
    products_of_jet_step, watched_jet_transport_taylor,
};

#[cfg(test)]
mod tests;
