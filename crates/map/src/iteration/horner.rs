//! The map lowered to nested Horner schemes and run in process: in double precision, at fixed
//! parameters, in single precision, and at many independent points, sixteen in lockstep, on all
//! cores.

use std::sync::{Arc, OnceLock};

use super::discrete_map::{DifferentiableMap, DiscreteMap, StepInfo};
use super::frozen_lanes::{Forms, Freezer, FrozenLanes};
use crate::expansion::{ComposedMap, LocalMap, MapKernel};
use crate::iteration::parallel;
use crate::jet::kernel::{Dual, Interpreted, Interpreter, LaneInterpreter, OperationCount};
use crate::numeric::{FloatFormat, Lanes, Real, Vectorised, widest};

/// A local map as a straight-line kernel: the same operations as the emitted code, interpreted.
///
/// Use [`freeze`](Self::freeze) for many steps at the same parameters.
#[derive(Clone, Debug)]
pub struct HornerMap {
    forms: Arc<Forms>,
}

impl HornerMap {
    /// Lowers the map stage by stage.
    pub fn new(map: &LocalMap) -> Self {
        Self::of_kernel(MapKernel::factored(map))
    }

    /// Lowers the map in one polynomial pass.
    pub fn composed(map: &LocalMap, composed: &ComposedMap) -> Self {
        Self::of_kernel(MapKernel::composed(map, composed))
    }

    fn of_kernel(lowered: MapKernel) -> Self {
        Self { forms: Arc::new(Forms::new(lowered)) }
    }

    /// The map with every operation in single precision.
    pub fn in_single(&self) -> SingleMap {
        SingleMap {
            step: Interpreter::new(&self.forms.lowered.kernel),
            jacobian: OnceLock::new(),
            map: self.clone(),
        }
    }

    /// The map with every operation in a given floating-point format.
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
    /// If the number of parameters is not the map's.
    pub fn freeze(&self, parameters: &[f64]) -> FrozenMap {
        FrozenMap {
            step: self.forms.frozen_step.freeze(parameters),
            parameters: parameters.to_vec(),
            jacobian: OnceLock::new(),
            forms: self.forms.clone(),
        }
    }

    /// Depths `−h_min` of the first passage (negative without contact) at states of one parameter
    /// value, bit for bit those of a step.
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

    /// The map at different parameters in every lane.
    ///
    /// # Panics
    ///
    /// If there are no lanes or more than `N`, or if a number of parameters is not the map's.
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

/// Runs a map's kernel; its outputs are the image, the depths of the passages, and the derivatives.
fn run<T: Interpreted<Known = T> + Real>(
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
/// Operations on the coordinates are exactly those of the unfrozen map, so images agree bit for
/// bit.
#[derive(Clone, Debug)]
pub struct FrozenMap {
    forms: Arc<Forms>,
    parameters: Vec<f64>,
    step: Interpreter,
    jacobian: OnceLock<Interpreter>,
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

/// A local map in single precision, made by [`HornerMap::in_single`]: the same operations as the
/// code emitted in `f32`, interpreted.
///
/// State and parameters are rounded to `f32` first, as a caller of that code has to do.
/// Coefficients and every operation are in single precision; the image is returned unchanged.
#[derive(Clone, Debug)]
pub struct SingleMap {
    map: HornerMap,
    step: Interpreter<f32>,
    jacobian: OnceLock<Interpreter<f32>>,
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
        let make = || Interpreter::new(&self.map.forms.lowered.with_jacobian());
        let kernel = self.jacobian.get_or_init(make);
        rounded_run(kernel, state, parameters, image, jacobian)
    }
}

/// Runs a map's kernel on inputs rounded to single precision.
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

/// Points evaluated in lockstep.
const LANES: usize = 16;

/// Points per task: enough that the cost of handing it over is negligible.
const TASK: usize = 4096;

/// Images, depths and derivatives of a map at many points.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// One row per point: the image, the depths `−h_min` of the passages (negative without
    /// contact), and, on request, the derivatives of every coordinate of the image by the
    /// coordinates and then by the parameters.
    pub rows: Vec<f64>,
    /// Length of a row.
    pub width: usize,
}

impl HornerMap {
    /// Images of many states, with one row of parameters for all or one for each; equal to single
    /// steps to the last bit.
    ///
    /// ```
    /// use grazemap_map::expansion::{Expander, MapOrders};
    /// use grazemap_map::iteration::{DiscreteMap, HornerMap};
    /// use grazemap_map::model::Scene;
    /// use grazemap_map::orbit::locate;
    ///
    /// let scene = Scene::of_catalogue("linear")?;
    /// let orbit = locate(&scene)?.into_result()?;
    /// let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    /// let map = HornerMap::new(&Expander::new(&scene, &orbit)?.expand(orders)?);
    /// let batch = map.batch(&[1e-6, 0.0, 2e-6, 0.0], &[1e-7, 0.0], false);
    /// let mut single = [0.0; 2];
    /// map.step(&[2e-6, 0.0], &[1e-7, 0.0], &mut single);
    /// assert_eq!(batch.rows[batch.width..][..2], single);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    ///
    /// If the states are not whole rows of the map's dimension, or the parameters are neither one
    /// row nor one row for every state.
    pub fn batch(&self, states: &[f64], parameters: &[f64], derivatives: bool) -> Batch {
        let MapKernel { dimension, parameters: count, .. } = self.forms.lowered;
        let points = states.len() / dimension;
        assert_eq!(states.len(), points * dimension, "rows of {dimension} coordinates");
        let each = parameters.len() != count;
        assert!(!each || parameters.len() == points * count, "rows of {count} parameters");
        let freezer = self.forms.batch(derivatives, each);
        let coefficients = freezer.coefficients(if each { &[] } else { parameters });
        let width = freezer.outputs();
        let mut rows = vec![0.0; points * width];
        let tasks = rows.chunks_mut(TASK * width).zip(states.chunks(TASK * dimension));
        parallel::map(tasks.enumerate(), |(task, (rows, states))| {
            let own =
                |first: usize| &parameters[first * count..][..states.len() / dimension * count];
            let inputs = [(states, dimension), (if each { own(task * TASK) } else { &[] }, count)];
            fill(freezer, &coefficients, &inputs[..if each { 2 } else { 1 }], rows);
        });
        Batch { rows, width }
    }
}

/// Runs a kernel with one set of coefficients at many points. Each input is a list of rows, one for
/// each point, with their length; one row of outputs is written for each point.
pub(super) fn fill(
    freezer: &Freezer,
    coefficients: &[f64],
    inputs: &[(&[f64], usize)],
    rows: &mut [f64],
) {
    widest(Points { map: freezer.in_lanes(&[coefficients.to_vec()]), inputs, rows });
}

struct Points<'a> {
    map: LaneInterpreter<Lanes<LANES>>,
    inputs: &'a [(&'a [f64], usize)],
    rows: &'a mut [f64],
}

impl Vectorised for Points<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let outputs = self.map.outputs();
        for (block, rows) in self.rows.chunks_mut(LANES * outputs).enumerate() {
            let lanes = rows.len() / outputs;
            let mut places = self.map.inputs_mut().iter_mut();
            for &(values, width) in self.inputs {
                let values = &values[block * LANES * width..];
                for (number, place) in (0..width).zip(&mut places) {
                    for lane in 0..lanes {
                        place[lane] = values[lane * width + number];
                    }
                }
            }
            self.map.run();
            for number in 0..outputs {
                let values = self.map.output(number);
                for lane in 0..lanes {
                    rows[lane * outputs + number] = values[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::expansion::{Expander, MapOrders};
    use crate::iteration::{DiscreteMap, HornerMap};
    use crate::model::Scene;
    use crate::orbit::locate;

    #[test]
    fn a_batch_is_its_steps() {
        let scene = Scene::of_catalogue("linear").expect("a scene");
        let orbit = locate(&scene).expect("a search").into_result().expect("a simple graze");
        let orders = MapOrders { smooth_order: 5, contact_weight: 6 };
        let map = Expander::new(&scene, &orbit).and_then(|it| it.expand(orders)).expect("a map");
        let map = HornerMap::new(&map);
        // More than one task, and a block that is not full.
        let points = super::TASK + 21;
        let offset = |n: usize| 1e-5 * ((n * 7919 % 1000) as f64 / 500.0 - 1.0);
        let states: Vec<f64> = (0..2 * points).map(offset).collect();
        let each: Vec<f64> = (0..2 * points).map(|n| 0.01 * offset(n + 5)).collect();
        for parameters in [&each[..], &each[..2]] {
            let batch = map.batch(&states, parameters, true);
            assert_eq!(map.batch(&states, parameters, false).rows[..3], batch.rows[..3]);
            for point in 0..points {
                let own = if parameters.len() == 2 { parameters } else { &each[2 * point..][..2] };
                let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
                map.step_jacobian(&states[2 * point..][..2], own, &mut image, &mut jacobian);
                let row = &batch.rows[point * batch.width..][..batch.width];
                assert_eq!(row[..2], image);
                // Derivatives by the coordinates only.
                assert_eq!([row[3], row[4], row[7], row[8]], jacobian);
            }
        }
    }
}
