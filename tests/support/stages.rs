//! A local map evaluated stage by stage, straight from its jets.

use grazemap::expansion::{Contact, Leg, LocalMap, Stage};

/// Flies a leg.
pub(crate) fn fly(leg: &Leg, state: &mut [f64], parameters: &[f64]) {
    let point: Vec<f64> = state.iter().chain(parameters).copied().collect();
    for (value, jet) in state.iter_mut().zip(&leg.image) {
        *value = jet.evaluate(&point);
    }
}

/// Applies the contact and returns `y`.
fn touch(contact: &Contact, state: &mut [f64], parameters: &[f64]) -> f64 {
    let point: Vec<f64> = state.iter().chain(parameters).copied().collect();
    let y = contact.depth.evaluate(&point).max(0.0).sqrt();
    let corrections = contact.linear.iter().zip(&contact.quadratic);
    for (value, (linear, quadratic)) in state.iter_mut().zip(corrections) {
        *value += y * (linear.evaluate(&point) + y * quadratic.evaluate(&point));
    }
    y
}

/// Image of a state under all stages, and `y` of the contact.
pub(crate) fn image(map: &LocalMap, state: &[f64], parameters: &[f64]) -> (Vec<f64>, f64) {
    let (mut state, mut depth) = (state.to_vec(), 0.0);
    for stage in &map.stages {
        match stage {
            Stage::Leg(leg) => fly(leg, &mut state, parameters),
            Stage::Contact(contact) => depth = touch(contact, &mut state, parameters),
            Stage::Flown(_) => unreachable!("maps of series alone come here"),
        }
    }
    (state, depth)
}
