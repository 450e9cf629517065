//! Direct simulation: single orbits and lanes, exact flows and Taylor steps, stops of every kind.

#[path = "../support/mod.rs"]
mod support;

mod affine_flow;
mod composed_features;
mod contact_derivatives;
mod contact_laws;
mod contacts_that_pull;
mod corners;
mod direct_lanes;
mod direct_simulation;
mod hertz_law;
mod independent_simulator;
mod moving_surfaces;
mod narrow_features;
mod public_two_direct;
mod published;
mod quadrature;
mod random_oscillators;
mod rounding_at_grazes;
mod section_phases;
mod simulated_events;
mod simultaneous_hits;
mod soft_to_rigid;

/// A number from −1 to 1 for every pair of numbers.
fn scattered(number: usize, component: usize) -> f64 {
    let step = [0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122][component % 5];
    2.0 * (0.31 + (number + 1) as f64 * step).fract() - 1.0
}
