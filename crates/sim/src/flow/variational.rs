//! The flow with its first derivatives: variational equations as jets of order 1.

use nalgebra::DMatrix;

use super::jet_transport::{MAX_STEPS, jet_transport_within};
use super::{Field, FlowError};
use crate::jet::{Jet, JetSpace};
use crate::numeric::Real;

/// The state after a duration of either sign, and its derivative by chosen inputs.
///
/// `directions` lists inputs of the field: `0..dimension` are the initial state's components,
/// `dimension + i` is parameter `i`. The matrix has one row per state component and one column per
/// direction. Derivatives by bound parameters are zero.
///
/// # Errors
///
/// As [`jet_transport_taylor`](super::jet_transport_taylor); [`FlowError::Jet`] if the jets of the
/// directions do not fit in memory.
pub fn flow_with_jacobian<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    duration: S,
    directions: &[usize],
) -> Result<(Vec<S>, DMatrix<S>), FlowError> {
    flow_with_jacobian_within(field, state, parameters, duration, directions, &mut { MAX_STEPS })
}

/// As [`flow_with_jacobian`], in a number of Taylor steps, which those taken lower.
///
/// The derivatives may need shorter steps than the state: those of `x^n` grow as `n`.
///
/// # Errors
///
/// As [`flow_with_jacobian`], [`FlowError::TooManySteps`] after the steps given.
pub fn flow_with_jacobian_within<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    duration: S,
    directions: &[usize],
    steps_left: &mut usize,
) -> Result<(Vec<S>, DMatrix<S>), FlowError> {
    let space = JetSpace::uniform(directions.len(), 1)?;
    let jet = |(input, &value): (usize, &S)| match directions.iter().position(|&d| d == input) {
        Some(variable) => Jet::variable(&space, variable, value),
        None => Jet::constant(&space, value),
    };
    let inputs: Vec<_> = state.iter().chain(parameters).enumerate().map(jet).collect();
    let (initial, parameters) = inputs.split_at(state.len());
    let image = jet_transport_within(field, initial, parameters, duration, steps_left)?;
    let slope = |row: usize, column: usize| {
        space
            .linear_monomial(column)
            .map_or(S::zero(), |monomial| image[row].coefficients()[monomial])
    };
    let matrix = DMatrix::from_fn(image.len(), directions.len(), slope);
    Ok((image.iter().map(Jet::head).collect(), matrix))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::{InputKind, Integrator, samples};
    use crate::numeric::Dd;

    #[test]
    fn derivatives_agree_with_differences_of_flows() {
        let field = samples::electrostatic(&[InputKind::Variable; 3]);
        let point = [0.2, 0.1, 0.3, 0.02, 0.3, 0.6].map(Dd::from);
        let duration = Dd::PI / point[5];
        let (image, matrix) =
            flow_with_jacobian(&field, &point[..3], &point[3..], duration, &[0, 1, 2, 4, 5])
                .unwrap();
        let step = Dd::from(1e-8);
        for (column, input) in [0, 1, 2, 4, 5].into_iter().enumerate() {
            let shifted = |offset: Dd| {
                let mut at = point;
                at[input] += offset;
                Integrator::new(&field).flow(&at[..3], &at[3..], duration).unwrap()
            };
            let (up, down, middle) = (shifted(step), shifted(-step), shifted(Dd::ZERO));
            for row in 0..3 {
                let difference = (up[row] - down[row]) / (step + step);
                // The difference quotient errs by step² times a third derivative.
                assert!((difference - matrix[(row, column)]).to_f64().abs() < 1e-12);
                assert!((middle[row] - image[row]).to_f64().abs() < 1e-28);
            }
        }
    }
}
