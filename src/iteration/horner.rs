//! The map lowered to nested Horner schemes and run in process.

use std::sync::OnceLock;

use super::{DiscreteMap, FrozenMap, StepInfo};
use crate::expansion::{ComposedMap, LocalMap, MapKernel};
use crate::jet::kernel::{Interpreter, Kernel, OperationCount};

/// A local map as a straight-line kernel: the operations of the emitted code, interpreted.
///
/// [`freeze`](Self::freeze) it where many steps are made at the same parameters.
#[derive(Clone, Debug)]
pub struct HornerMap {
    lowered: MapKernel,
    step: Interpreter,
    frozen_step: Freezer,
    /// With the Jacobian, made when first asked for: whole, and split for freezing.
    jacobian: OnceLock<(Interpreter, Freezer)>,
}

impl HornerMap {
    /// The map stage by stage.
    pub fn new(map: &LocalMap) -> Self {
        Self::of_kernel(MapKernel::factored(map))
    }

    /// The map in one polynomial pass.
    pub fn composed(map: &LocalMap, composed: &ComposedMap) -> Self {
        Self::of_kernel(MapKernel::composed(map, composed))
    }

    fn of_kernel(lowered: MapKernel) -> Self {
        Self {
            step: Interpreter::new(&lowered.kernel),
            frozen_step: Freezer::new(&lowered.kernel, lowered.dimension),
            jacobian: OnceLock::new(),
            lowered,
        }
    }

    fn jacobian(&self) -> &(Interpreter, Freezer) {
        self.jacobian.get_or_init(|| {
            let kernel = self.lowered.with_jacobian();
            let freezer = Freezer::new(&kernel, self.lowered.dimension);
            (Interpreter::new(&kernel), freezer)
        })
    }

    /// Operations of one step.
    pub fn count(&self) -> OperationCount {
        self.lowered.kernel.count()
    }

    /// Operations of one step of the frozen map.
    pub fn frozen_count(&self) -> OperationCount {
        self.frozen_step.count
    }

    /// The map at fixed parameters.
    ///
    /// # Panics
    ///
    /// If their number is not the map's.
    pub fn freeze(&self, parameters: &[f64]) -> FrozenMap {
        FrozenMap::new(
            self.lowered.dimension,
            self.frozen_step.freeze(parameters),
            self.jacobian().1.freeze(parameters),
        )
    }
}

impl DiscreteMap for HornerMap {
    fn dimension(&self) -> usize {
        self.lowered.dimension
    }

    fn parameters(&self) -> usize {
        self.lowered.parameters
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
        run(&self.jacobian().0, &[state, parameters], image, jacobian)
    }
}

/// A kernel split into what is computed when freezing and what is left to each step.
#[derive(Clone, Debug)]
struct Freezer {
    prepare: Interpreter,
    run: Interpreter,
    count: OperationCount,
}

impl Freezer {
    fn new(kernel: &Kernel, free: usize) -> Self {
        let split = kernel.split(free);
        Self {
            prepare: Interpreter::new(&split.prepare),
            run: Interpreter::new(&split.run),
            count: split.run.count(),
        }
    }

    fn freeze(&self, parameters: &[f64]) -> Interpreter {
        self.run
            .with_last_inputs(&self.prepare.evaluate(parameters))
    }
}

/// Runs a map's kernel: the image, the depths of the passages, and then the Jacobian.
pub(super) fn run(
    interpreter: &Interpreter,
    inputs: &[&[f64]],
    image: &mut [f64],
    jacobian: &mut [f64],
) -> StepInfo {
    let mut info = StepInfo::default();
    let (dimension, first) = (image.len(), interpreter.outputs() - jacobian.len());
    interpreter.run(inputs, |number, value| match number {
        number if number < dimension => image[number] = value,
        number if number < first => info.add_passage(number - dimension, value),
        number => jacobian[number - first] = value,
    });
    info.checked(image)
}
