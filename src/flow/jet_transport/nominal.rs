//! The nominal orbit of one element: the state at its nodes and its end.

use super::gauss::{GAUSS, NODES, NodeValues};
use crate::flow::{FlowError, Integrator};
use crate::numeric::Lanes;

/// Most Taylor steps in one element.
const MAX_STEPS: usize = 1000;

/// Nominal orbit over an element of a length of either sign: fills `nodes` and moves `state` to the end.
///
/// Returns the length of the first Taylor step.
pub(super) fn nominal_orbit(
    integrator: &mut Integrator<'_, f64>,
    state: &mut [f64],
    parameters: &[f64],
    length: f64,
    nodes: &mut [NodeValues],
) -> Result<f64, FlowError> {
    let (mut time, mut next, mut first) = (0.0, 0, None);
    nodes.fill(Lanes([0.0; NODES]));
    for _ in 0..MAX_STEPS {
        let step = integrator.step(state, parameters)?;
        first.get_or_insert(step.length);
        let remaining = length - time;
        let advance = remaining.abs().min(step.length).copysign(length);
        let last = advance == remaining;
        while next < NODES && (last || (GAUSS.nodes[next] * length - time).abs() <= advance.abs()) {
            for (component, values) in nodes.iter_mut().enumerate() {
                values.0[next] = step.component_at(component, GAUSS.nodes[next] * length - time);
            }
            next += 1;
        }
        step.state_at(advance, state);
        if last {
            return Ok(first.unwrap_or(length.abs()));
        }
        time += advance;
    }
    Err(FlowError::TooManySteps {
        limit: MAX_STEPS,
        remaining: length - time,
    })
}
