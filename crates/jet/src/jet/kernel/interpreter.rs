//! Running a kernel in process.

use std::cell::RefCell;
use std::sync::Arc;

use super::code::Code;
use super::{Dual, Kernel, LaneInterpreter, Number};
use crate::numeric::{Lanes, Real};

/// Numbers in which kernels are interpreted one point at a time: `f64`, `f32` as emitted code in
/// single precision rounds, and [`Dual`] numbers.
pub trait Interpreted: Number {
    /// Hands the memory of the thread to `work`.
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
/// What a run writes belongs to the thread, so that an interpreter can be shared by threads and a
/// run allocates nothing.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    code: Arc<Code>,
    /// Known values that are looked up.
    kept: Vec<T>,
    /// Known values that are read in order.
    read: Vec<T>,
}

impl<T: Real> Interpreter<T> {
    /// Prepares a kernel, its constants rounded to the numbers it is to run in.
    pub fn new(kernel: &Kernel) -> Self {
        let constants = kernel.constants.iter();
        let constants: Vec<T> = constants.map(|&value| T::from_f64(value)).collect();
        let code = Arc::new(Code::new(kernel, kernel.inputs));
        Self::with_known(code, &[], &constants)
    }

    fn with_known(code: Arc<Code>, set: &[T], constants: &[T]) -> Self {
        Self {
            kept: code.kept(set, constants),
            read: code.read(set, constants),
            code,
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.code.inputs()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// Runs the kernel and hands output after output to `receive` with its number.
    ///
    /// # Panics
    ///
    /// If the input slices together have not the kernel's number of inputs.
    pub fn run<N: Interpreted<Known = T>>(
        &self,
        inputs: &[&[N]],
        mut receive: impl FnMut(usize, N),
    ) {
        N::with_memory(|memory| {
            memory.clear();
            inputs
                .iter()
                .for_each(|slice| memory.extend_from_slice(slice));
            assert_eq!(
                memory.len(),
                self.inputs(),
                "a kernel runs on all its inputs"
            );
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

/// A kernel prepared for running once its last inputs, the coefficients of a frozen map, are set
/// for good.
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

    /// The interpreter with these values of the last inputs.
    ///
    /// # Panics
    ///
    /// If their number is not that of the inputs to be set.
    pub fn set(&self, values: &[f64]) -> Interpreter {
        assert_eq!(values.len(), self.unset, "a value for every input to set");
        Interpreter::with_known(self.code.clone(), values, &self.constants)
    }

    /// The interpreter for `N` points at once, with other values of the last inputs in every lane;
    /// lanes beyond those given have the values of the first.
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
