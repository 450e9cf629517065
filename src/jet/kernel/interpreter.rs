//! Running a kernel in process.

use std::cell::RefCell;
use std::sync::Arc;

use super::code::{Code, Number};
use super::{Kernel, LaneInterpreter};
use crate::numeric::Real;

/// Numbers in which kernels are interpreted one point at a time: `f64`, and `f32` as emitted code in single precision rounds.
pub trait Interpreted: Number + Real {
    /// Hands the memory of the thread to `work`.
    fn with_memory<R>(work: impl FnOnce(&mut Vec<Self>) -> R) -> R;
}

macro_rules! interpreted {
    ($($float:ident),*) => {$(
        impl Interpreted for $float {
            fn with_memory<R>(work: impl FnOnce(&mut Vec<Self>) -> R) -> R {
                thread_local! {
                    static MEMORY: RefCell<Vec<$float>> = const { RefCell::new(Vec::new()) };
                }
                MEMORY.with_borrow_mut(work)
            }
        }
    )*};
}

interpreted!(f64, f32);

/// A kernel prepared for running: operands are places in one memory of inputs, constants and results.
///
/// The memory belongs to the thread, so that an interpreter can be shared by threads and a run allocates
/// nothing.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    inputs: usize,
    /// Inputs that were set for good, then constants.
    known: Vec<T>,
    code: Arc<Code>,
}

impl<T: Interpreted> Interpreter<T> {
    /// Prepares a kernel, its constants rounded to the numbers it is to run in.
    pub fn new(kernel: &Kernel) -> Self {
        let constants = kernel.constants.iter();
        Self {
            inputs: kernel.inputs,
            known: constants.map(|&value| T::from_f64(value)).collect(),
            code: Arc::new(Code::new(kernel)),
        }
    }

    /// The interpreter with its last inputs set to these values for good.
    ///
    /// # Panics
    ///
    /// If there are more values than inputs.
    pub fn with_last_inputs(&self, values: &[T]) -> Self {
        assert!(
            values.len() <= self.inputs,
            "{} values for {} inputs",
            values.len(),
            self.inputs
        );
        Self {
            inputs: self.inputs - values.len(),
            known: [values, &self.known].concat(),
            ..self.clone()
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
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
    pub fn run(&self, inputs: &[&[T]], mut receive: impl FnMut(usize, T)) {
        T::with_memory(|memory| {
            memory.clear();
            inputs
                .iter()
                .for_each(|slice| memory.extend_from_slice(slice));
            assert_eq!(memory.len(), self.inputs, "a kernel runs on all its inputs");
            memory.extend_from_slice(&self.known);
            memory.resize(memory.len() + self.code.results(), T::zero());
            self.code.run(memory);
            for number in 0..self.outputs() {
                receive(number, *self.code.output(number, memory));
            }
        });
    }

    /// The outputs at these inputs.
    pub fn evaluate(&self, inputs: &[T]) -> Vec<T> {
        let mut values = vec![T::zero(); self.outputs()];
        self.run(&[inputs], |number, value| values[number] = value);
        values
    }
}

impl Interpreter {
    /// The interpreter for `N` points at once, its last inputs set for good to other values in every lane.
    ///
    /// # Panics
    ///
    /// If there are more than `N` lanes, or more values than inputs, or lanes of different lengths.
    pub fn in_lanes<const N: usize>(&self, last_inputs: &[Vec<f64>]) -> LaneInterpreter<N> {
        let set = last_inputs.first().map_or(0, Vec::len);
        assert!(
            set <= self.inputs,
            "{set} values for {} inputs",
            self.inputs
        );
        LaneInterpreter::new(
            self.inputs - set,
            last_inputs,
            &self.known,
            self.code.clone(),
        )
    }
}
