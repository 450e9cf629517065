//! The map at fixed parameters.

use std::sync::{Arc, OnceLock};

use super::forms::Forms;
use super::horner::run;
use super::{DiscreteMap, StepInfo};
use crate::jet::kernel::{Dual, Interpreter};

/// A local map with its parameters folded in, made by
/// [`HornerMap::freeze`](super::HornerMap::freeze): a map without parameters that evaluates
/// polynomials in the coordinates alone.
///
/// It does the very operations that the unfrozen map does on the coordinates, so the images agree
/// bit for bit.
#[derive(Clone, Debug)]
pub struct FrozenMap {
    forms: Arc<Forms>,
    parameters: Vec<f64>,
    step: Interpreter,
    jacobian: OnceLock<Interpreter>,
}

impl FrozenMap {
    pub(super) fn new(forms: Arc<Forms>, parameters: &[f64]) -> Self {
        Self {
            step: forms.frozen_step.freeze(parameters),
            parameters: parameters.to_vec(),
            jacobian: OnceLock::new(),
            forms,
        }
    }
}

impl DiscreteMap for FrozenMap {
    fn dimension(&self) -> usize {
        self.forms.lowered.dimension
    }

    fn parameters(&self) -> usize {
        0
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        run(&self.step, &[state, parameters], image, &mut [])
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let freeze = || self.forms.frozen_jacobian().freeze(&self.parameters);
        let kernel = self.jacobian.get_or_init(freeze);
        run(kernel, &[state, parameters], image, jacobian)
    }

    fn step_tangent(
        &self,
        [state, tangent]: [&[f64]; 2],
        parameters: &[f64],
        [image, carried]: [&mut [f64]; 2],
    ) -> StepInfo {
        assert!(parameters.is_empty(), "the parameters are folded in");
        let inputs = state.iter().zip(tangent);
        let inputs = inputs.map(|(&value, &slope)| Dual { value, slope });
        let inputs: Vec<Dual<f64>> = inputs.collect();
        let mut info = StepInfo::default();
        let dimension = image.len();
        self.step.run(&[&inputs], |number, dual: Dual<f64>| {
            if number < dimension {
                (image[number], carried[number]) = (dual.value, dual.slope);
            } else {
                info.add_passage(number - dimension, dual.value);
            }
        });
        info.checked(image)
    }
}
