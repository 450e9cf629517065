//! The map lowered to nested Horner schemes and run in process.

use std::sync::OnceLock;

use super::{DiscreteMap, FrozenLanes, FrozenMap, StepInfo};
use crate::expansion::{ComposedMap, LocalMap, MapKernel};
use crate::jet::kernel::{Interpreter, Kernel, LaneInterpreter, OperationCount};
use crate::numeric::Lanes;

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
    /// The depth of the first passage alone, made when first asked for.
    depth: OnceLock<Freezer>,
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
            depth: OnceLock::new(),
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

    /// Depth `−h_min` of the first passage (negative without contact) at states of one parameter value: the very depths that
    /// steps from these states would find.
    ///
    /// # Panics
    ///
    /// If states or parameters have not the map's lengths, or the map has no passage.
    pub fn first_depths<'s>(
        &self,
        states: impl IntoIterator<Item = &'s [f64]>,
        parameters: &[f64],
    ) -> Vec<f64> {
        const LANES: usize = 16;
        let depth = || Freezer::new(&first_depth(&self.lowered), self.lowered.dimension);
        let depth = self.depth.get_or_init(depth);
        let mut depth = depth.freeze_lanes::<LANES>(&[parameters; LANES]);
        let states: Vec<&[f64]> = states.into_iter().collect();
        let blocks = states.chunks(LANES).flat_map(|block| {
            let lane = |number: usize| block.get(number).unwrap_or(&block[0]);
            let coordinates = 0..self.lowered.dimension;
            let point = coordinates.map(|i| Lanes::from_fn(|number| lane(number)[i]));
            depth.run(&point.collect::<Vec<_>>());
            depth.output(0).0.into_iter().take(block.len())
        });
        blocks.collect()
    }

    /// The map at other parameters in every lane.
    ///
    /// # Panics
    ///
    /// If there are none or more than `N`, or if their number is not the map's.
    pub fn freeze_lanes<const N: usize>(&self, parameters: &[&[f64]]) -> FrozenLanes<N> {
        FrozenLanes::new(
            self.lowered.dimension,
            parameters.len(),
            self.frozen_step.freeze_lanes(parameters),
            self.jacobian().1.freeze_lanes(parameters),
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

/// The depth of the first passage alone.
fn first_depth(map: &MapKernel) -> Kernel {
    let mut kernel = map.kernel.clone();
    kernel.outputs = kernel.outputs[map.dimension..].to_vec();
    kernel.outputs.truncate(1);
    kernel.without_dead_operations()
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

    fn freeze_lanes<const N: usize>(&self, parameters: &[&[f64]]) -> LaneInterpreter<N> {
        let prepared = parameters.iter().map(|own| self.prepare.evaluate(own));
        self.run.in_lanes(&prepared.collect::<Vec<_>>())
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
