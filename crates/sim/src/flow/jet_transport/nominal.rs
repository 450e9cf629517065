//! A first guess of the nominal orbit of one element.

use super::gauss::{GAUSS, NODES, NodeValues};
use crate::flow::{FlowError, Integrator};
use crate::numeric::Lanes;

/// Most Taylor steps in one guess.
const MAX_STEPS: usize = 1000;

/// How far beyond its own step an expansion is used: a few digits are left there, and Newton's
/// method does the rest.
const STRETCH: f64 = 3.0;

/// Fills the nodes of an element with a guess, good to a few digits, of the orbit from a state.
///
/// The element's length, of either sign, is chosen from the length of the first Taylor step, and
/// returned.
pub(super) fn guess_orbit(
    integrator: &mut Integrator<'_, f64>,
    state: &[f64],
    parameters: &[f64],
    length: impl FnOnce(f64) -> f64,
    nodes: &mut [NodeValues],
) -> Result<f64, FlowError> {
    let mut state = state.to_vec();
    let mut step = integrator.step(&state, parameters)?;
    let length = length(step.length);
    nodes.fill(Lanes([0.0; NODES]));
    let (mut time, mut next) = (0.0, 0);
    for _ in 0..MAX_STEPS {
        let remaining = length - time;
        let reach = (STRETCH * step.length).min(remaining.abs());
        while next < NODES && (GAUSS.nodes[next] * length - time).abs() <= reach {
            for (component, values) in nodes.iter_mut().enumerate() {
                values.0[next] = step.component_at(component, GAUSS.nodes[next] * length - time);
            }
            next += 1;
        }
        if next == NODES {
            return Ok(length);
        }
        let advance = reach.copysign(length);
        step.state_at(advance, &mut state);
        time += advance;
        step = integrator.step(&state, parameters)?;
    }
    Err(FlowError::TooManySteps { limit: MAX_STEPS, remaining: length - time })
}
