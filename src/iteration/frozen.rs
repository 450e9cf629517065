//! The map at fixed parameters.

use super::horner::run;
use super::{DiscreteMap, StepInfo};
use crate::jet::kernel::Interpreter;

/// A local map with its parameters folded in, made by [`HornerMap::freeze`](super::HornerMap::freeze): a map without parameters that evaluates polynomials in the
/// coordinates alone.
///
/// It does the very operations that the unfrozen map does on the coordinates, so the images agree bit for
/// bit.
#[derive(Clone, Debug)]
pub struct FrozenMap {
    dimension: usize,
    step: Interpreter,
    jacobian: Interpreter,
}

impl FrozenMap {
    pub(super) fn new(dimension: usize, step: Interpreter, jacobian: Interpreter) -> Self {
        Self {
            dimension,
            step,
            jacobian,
        }
    }
}

impl DiscreteMap for FrozenMap {
    fn dimension(&self) -> usize {
        self.dimension
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
        run(&self.jacobian, &[state, parameters], image, jacobian)
    }
}
