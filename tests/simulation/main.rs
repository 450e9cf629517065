//! Direct simulation: single orbits and lanes, exact flows and Taylor steps, stops of every kind.

#[path = "../support/mod.rs"]
mod support;

mod affine_flow;
mod direct_lanes;
mod direct_simulation;
mod hertz_law;
mod lane_periods;
mod moving_surfaces;
mod public_two_direct;
mod rounding_at_grazes;
mod simulated_events;
mod soft_to_rigid;
