//! The map lowered to nested Horner schemes and run in process.

use std::sync::Arc;

use super::forms::Forms;
use super::{DiscreteMap, FrozenLanes, FrozenMap, SingleMap, StepInfo};
use crate::expansion::{ComposedMap, LocalMap, MapKernel};
use crate::jet::kernel::{Interpreted, Interpreter, LaneInterpreter, OperationCount};
use crate::numeric::{self, FloatFormat, Lanes, Real, widest};

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
        Self {
            forms: Arc::new(Forms::new(lowered)),
        }
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
        let states = states.into_iter().collect();
        let depth = self.forms.frozen_depth();
        let map = depth.in_lanes(&[depth.coefficients(parameters)]);
        widest(Depths { map, states })
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

/// Depths at states, sixteen at a time.
struct Depths<'s> {
    map: LaneInterpreter<Lanes<16>>,
    states: Vec<&'s [f64]>,
}

impl numeric::Kernel for Depths<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run(mut self) -> Vec<f64> {
        let mut depths = Vec::with_capacity(self.states.len());
        for block in self.states.chunks(16) {
            for (coordinate, input) in self.map.inputs_mut().iter_mut().enumerate() {
                for (lane, state) in block.iter().enumerate() {
                    input[lane] = state[coordinate];
                }
            }
            self.map.run();
            depths.extend_from_slice(&self.map.output(0).as_slice()[..block.len()]);
        }
        depths
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
