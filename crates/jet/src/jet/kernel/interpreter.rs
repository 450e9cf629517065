//! Running a kernel in process.

use std::cell::RefCell;
use std::sync::Arc;

use super::code::Code;
use super::{Dual, Kernel, Number};
use crate::numeric::{Lanes, Real};

/// Numbers in which kernels are interpreted one point at a time: `f64`, `f32` with the rounding of
/// emitted code in single precision, and [`Dual`] numbers.
pub trait Interpreted: Number {
    /// Lends the memory of the thread to `work`.
    fn with_memory<R>(work: impl FnOnce(&mut Vec<Self>) -> R) -> R;
}

macro_rules! interpreted {
    ($($number:ty),*) => {$(
        impl Interpreted for $number {
            fn with_memory<R>(work: impl FnOnce(&mut Vec<Self>) -> R) -> R {
                thread_local! {
                    static MEMORY: RefCell<Vec<$number>> = const { RefCell::new(Vec::new()) };
                }
                MEMORY.with_borrow_mut(work)
            }
        }
    )*};
}

interpreted!(f64, f32, Dual<f64>);

/// A kernel prepared for running.
///
/// Each thread has its own memory for runs, so that threads can share an interpreter and a run
/// allocates nothing.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    code: Arc<Code>,
    /// Known values that are looked up.
    kept: Vec<T>,
    /// Known values that are read in order.
    read: Vec<T>,
}

impl<T: Real> Interpreter<T> {
    /// Prepares a kernel; its constants are rounded to the type of the run.
    pub fn new(kernel: &Kernel) -> Self {
        let constants = kernel.constants.iter();
        let constants: Vec<T> = constants.map(|&value| T::from_f64(value)).collect();
        let code = Arc::new(Code::new(kernel, kernel.inputs));
        Self::with_known(code, &[], &constants)
    }

    fn with_known(code: Arc<Code>, set: &[T], constants: &[T]) -> Self {
        Self { kept: code.kept(set, constants), read: code.read(set, constants), code }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.code.inputs()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// Runs the kernel and passes every output to `receive` with its number.
    ///
    /// # Panics
    ///
    /// If the lengths of the input slices do not sum to the kernel's number of inputs.
    pub fn run<N: Interpreted<Known = T>>(
        &self,
        inputs: &[&[N]],
        mut receive: impl FnMut(usize, N),
    ) {
        N::with_memory(|memory| {
            memory.clear();
            inputs.iter().for_each(|slice| memory.extend_from_slice(slice));
            assert_eq!(memory.len(), self.inputs(), "a kernel runs on all its inputs");
            self.code.complete(memory, &self.kept);
            self.code.run(&self.read, memory);
            for number in 0..self.outputs() {
                receive(number, *self.code.output(number, memory));
            }
        });
    }

    /// The outputs at these inputs.
    pub fn evaluate<N: Interpreted<Known = T>>(&self, inputs: &[N]) -> Vec<N> {
        let mut values = Vec::with_capacity(self.outputs());
        self.run(&[inputs], |_, value| values.push(value));
        values
    }
}

/// A kernel prepared for running whose last inputs, the coefficients of a frozen map, are still to
/// be set.
#[derive(Clone, Debug)]
pub struct Unset {
    code: Arc<Code>,
    /// Number of inputs to be set.
    unset: usize,
    constants: Vec<f64>,
}

impl Unset {
    /// Prepares a kernel, its inputs from number `free` on to be set.
    pub fn new(kernel: &Kernel, free: usize) -> Self {
        Self {
            code: Arc::new(Code::new(kernel, free)),
            unset: kernel.inputs - free,
            constants: kernel.constants.clone(),
        }
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// The interpreter with fixed values of the last inputs.
    ///
    /// # Panics
    ///
    /// If there is not one value for every input to be set.
    pub fn set(&self, values: &[f64]) -> Interpreter {
        assert_eq!(values.len(), self.unset, "a value for every input to set");
        Interpreter::with_known(self.code.clone(), values, &self.constants)
    }

    /// The interpreter for `N` points at once, with its own values of the last inputs in every
    /// lane. Lanes beyond those given have the values of the first.
    ///
    /// # Panics
    ///
    /// If there are no lanes or more than `N`, or not one value for every input to be set.
    pub fn set_lanes<const N: usize, T: Number<Known = Lanes<N>>>(
        &self,
        values: &[Vec<f64>],
    ) -> LaneInterpreter<T> {
        let lanes = values.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let all = values.iter().all(|values| values.len() == self.unset);
        assert!(all, "a value for every input to set");
        let lane = |lane: usize| values.get(lane).unwrap_or(&values[0]);
        let set = (0..self.unset).map(|input| Lanes::from_fn(|number| lane(number)[input]));
        let set: Vec<Lanes<N>> = set.collect();
        let constants = self.constants.iter();
        let constants: Vec<Lanes<N>> = constants.map(|&value| Lanes::splat(value)).collect();
        LaneInterpreter::new(self.code.clone(), &set, &constants)
    }
}

/// A kernel prepared for running on several points in step, each with known inputs of its own, on
/// [`Lanes`] or [`Dual`] numbers of lanes.
///
/// Each instruction is read once for all points, since reading takes most of the time. The
/// operations of a lane are those of [`Interpreter`], to the last bit.
#[derive(Clone, Debug)]
pub struct LaneInterpreter<T: Number> {
    code: Arc<Code>,
    /// Inputs, results, known values that are looked up.
    memory: Vec<T>,
    /// Known values that are read in order.
    read: Vec<T::Known>,
}

impl<T: Number> LaneInterpreter<T> {
    pub(super) fn new(code: Arc<Code>, set: &[T::Known], constants: &[T::Known]) -> Self {
        let mut memory = vec![T::ZERO; code.inputs()];
        code.complete(&mut memory, &code.kept(set, constants));
        Self { memory, read: code.read(set, constants), code }
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// The inputs of the next run.
    #[inline(always)]
    pub fn inputs(&self) -> &[T] {
        &self.memory[..self.code.inputs()]
    }

    /// Mutable inputs of the next run.
    #[inline(always)]
    pub fn inputs_mut(&mut self) -> &mut [T] {
        &mut self.memory[..self.code.inputs()]
    }

    /// Copies the first `count` outputs to the first inputs.
    #[inline(always)]
    pub fn feed_back(&mut self, count: usize) {
        for number in 0..count {
            self.memory[number] = *self.code.output(number, &self.memory);
        }
    }

    /// Runs the kernel; [`output`](Self::output) then returns its results.
    ///
    /// The function is inlined so that [`Vectorised`](crate::numeric::Vectorised) work that
    /// calls it runs with the widest registers.
    #[inline(always)]
    pub fn run(&mut self) {
        self.code.run(&self.read, &mut self.memory);
    }

    /// A result of the last run.
    #[inline(always)]
    pub fn output(&self, number: usize) -> &T {
        self.code.output(number, &self.memory)
    }
}

#[cfg(test)]
mod tests {
    use crate::jet::kernel::{Interpreter, KernelBuilder, Unset};
    use crate::numeric::Lanes;

    #[test]
    fn every_lane_gives_the_bits_of_the_interpreter() {
        let mut builder = KernelBuilder::new(3);
        let [x, y, p] = [0, 1, 2].map(|input| builder.input(input));
        let constant = builder.constant(0.3);
        let sum = builder.multiply_add(x, y, constant);
        let root = builder.root_of_positive_part(sum);
        let slope = builder.half_reciprocal(root);
        let product = builder.multiply(slope, p);
        let total = builder.add(product, x);
        let kernel = builder.finish(vec![total, root, p, y]);
        let interpreter = Interpreter::new(&kernel);
        let parameters: Vec<Vec<f64>> = (0..3).map(|lane| vec![f64::from(lane) - 0.7]).collect();
        let mut lanes = Unset::new(&kernel, 2).set_lanes::<4, Lanes<4>>(&parameters);
        assert_eq!((lanes.inputs().len(), lanes.outputs()), (2, 4));
        // Arguments of the root of both signs; the last lane has no parameters of its own.
        let (x, y) = (Lanes([0.1, -2.0, 3.3, 1.0]), Lanes([0.7, 5.0, 1.1, 2.0]));
        lanes.inputs_mut().copy_from_slice(&[x, y]);
        lanes.run();
        for (lane, parameter) in parameters.iter().enumerate() {
            let alone = interpreter.evaluate(&[x[lane], y[lane], parameter[0]]);
            let found = [0, 1, 2, 3].map(|number| lanes.output(number)[lane]);
            assert_eq!(found.to_vec(), alone);
        }
        assert_eq!(lanes.output(1)[1], 0.0);
    }
}
