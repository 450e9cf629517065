//! The map lowered to nested Horner schemes and run in single precision.

use std::sync::OnceLock;

use super::horner::run;
use super::{DiscreteMap, HornerMap, StepInfo};
use crate::jet::kernel::Interpreter;

/// A local map in single precision, made by [`HornerMap::in_single`]: the operations of the code
/// that is emitted in `f32`, interpreted.
///
/// State and parameters are rounded on the way in, as a caller of that code has to; coefficients
/// and every operation are in single precision, and the image is handed out as it is.
#[derive(Clone, Debug)]
pub struct SingleMap {
    map: HornerMap,
    step: Interpreter<f32>,
    jacobian: OnceLock<Interpreter<f32>>,
}

impl SingleMap {
    pub(super) fn new(map: HornerMap) -> Self {
        Self {
            step: Interpreter::new(&map.kernel().kernel),
            jacobian: OnceLock::new(),
            map,
        }
    }
}

impl DiscreteMap for SingleMap {
    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        rounded_run(&self.step, state, parameters, image, &mut [])
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let make = || Interpreter::new(&self.map.kernel().with_jacobian());
        let kernel = self.jacobian.get_or_init(make);
        rounded_run(kernel, state, parameters, image, jacobian)
    }
}

/// Runs a map's kernel on rounded inputs.
fn rounded_run(
    interpreter: &Interpreter<f32>,
    state: &[f64],
    parameters: &[f64],
    image: &mut [f64],
    derivatives: &mut [f64],
) -> StepInfo {
    let rounded = state.iter().chain(parameters);
    let inputs: Vec<f32> = rounded.map(|&offset| offset as f32).collect();
    run(interpreter, &[&inputs], image, derivatives)
}
