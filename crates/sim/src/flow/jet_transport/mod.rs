//! Jets of a flow over a time: two methods that share nothing but the field's program.

mod block;
mod cache_key;
mod coefficients;
mod collocation;
mod element;
mod elimination;
mod first_order;
mod gauss;
mod nominal;
mod orbit;
mod pairs;
mod plan;
mod remainders;
mod resolution;
mod solver;
mod spare;
mod sparse;
mod taylor;

pub use collocation::{JetFlow, jet_transport};
pub use taylor::jet_transport_taylor;
pub(crate) use taylor::{JetExpansion, MAX_STEPS, jet_transport_within};

#[cfg(test)]
mod tests;
