//! The map lowered to nested Horner schemes and run in process: in double precision, at fixed
//! parameters, and in single precision.

use std::sync::{Arc, OnceLock};

use super::batch::fill;
use super::discrete_map::{DifferentiableMap, DiscreteMap, StepInfo};
use super::forms::Forms;
use super::frozen_lanes::FrozenLanes;
use crate::expansion::{ComposedMap, LocalMap, MapKernel};
use crate::jet::kernel::{Dual, Interpreted, Interpreter, OperationCount};
use crate::numeric::{FloatFormat, Real};

/// A local map as a straight-line kernel: the operations of the emitted code, interpreted.
///
/// [`freeze`](Self::freeze) it where many steps are made at the same parameters.
#[derive(Clone, Debug)]
pub struct HornerMap {
    forms: Arc<Forms>,
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
        Self { forms: Arc::new(Forms::new(lowered)) }
    }

    /// What the map was lowered to.
    pub(super) fn forms(&self) -> &Forms {
        &self.forms
    }

    /// The map's operations.
    pub(super) fn kernel(&self) -> &MapKernel {
        &self.forms.lowered
    }

    /// The same operations in single precision.
    pub fn in_single(&self) -> SingleMap {
        SingleMap::new(self.clone())
    }

    /// The same operations in the numbers in which they are to be run.
    pub fn in_format(&self, format: FloatFormat) -> Box<dyn DiscreteMap> {
        match format {
            FloatFormat::F32 => Box::new(self.in_single()),
            FloatFormat::F64 => Box::new(self.clone()),
        }
    }

    /// Operations of one step.
    pub fn count(&self) -> OperationCount {
        self.forms.lowered.kernel.count()
    }

    /// Operations of one step of the frozen map.
    pub fn frozen_count(&self) -> OperationCount {
        self.forms.frozen_step.count
    }

    /// The map at fixed parameters.
    ///
    /// # Panics
    ///
    /// If their number is not the map's.
    pub fn freeze(&self, parameters: &[f64]) -> FrozenMap {
        FrozenMap::new(self.forms.clone(), parameters)
    }

    /// Depth `−h_min` of the first passage (negative without contact) at states of one parameter
    /// value: the very depths that steps from these states would find.
    ///
    /// # Panics
    ///
    /// If states or parameters have not the map's lengths, or the map has no passage.
    pub fn first_depths<'s>(
        &self,
        states: impl IntoIterator<Item = &'s [f64]>,
        parameters: &[f64],
    ) -> Vec<f64> {
        let states: Vec<f64> = states.into_iter().flatten().copied().collect();
        let dimension = self.dimension();
        let depth = self.forms.frozen_depth();
        let mut depths = vec![0.0; states.len() / dimension];
        fill(depth, &depth.coefficients(parameters), &[(&states, dimension)], &mut depths);
        depths
    }

    /// The map at other parameters in every lane.
    ///
    /// # Panics
    ///
    /// If there are none or more than `N`, or if their number is not the map's.
    pub fn freeze_lanes<const N: usize>(&self, parameters: &[&[f64]]) -> FrozenLanes<N> {
        FrozenLanes::new(self.forms.clone(), parameters)
    }
}

impl DiscreteMap for HornerMap {
    fn dimension(&self) -> usize {
        self.forms.lowered.dimension
    }

    fn parameters(&self) -> usize {
        self.forms.lowered.parameters
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        run(self.forms.step(), &[state, parameters], image, &mut [])
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        run(self.forms.jacobian(), &[state, parameters], image, jacobian)
    }
}

impl DifferentiableMap for HornerMap {
    fn step_derivatives(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        derivatives: &mut [f64],
    ) -> StepInfo {
        run(self.forms.derivatives(), &[state, parameters], image, derivatives)
    }
}

/// Runs a map's kernel: the image, the depths of the passages, and then the derivatives asked for.
pub(super) fn run<T: Interpreted<Known = T> + Real>(
    interpreter: &Interpreter<T>,
    inputs: &[&[T]],
    image: &mut [f64],
    derivatives: &mut [f64],
) -> StepInfo {
    let mut info = StepInfo::default();
    let (dimension, first) = (image.len(), interpreter.outputs() - derivatives.len());
    interpreter.run(inputs, |number, value: T| match number {
        number if number < dimension => image[number] = value.to_f64(),
        number if number < first => info.add_passage(number - dimension, value.to_f64()),
        number => derivatives[number - first] = value.to_f64(),
    });
    info.checked(image)
}

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
        Self { step: Interpreter::new(&map.kernel().kernel), jacobian: OnceLock::new(), map }
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
