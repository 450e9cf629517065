//! Running a kernel in process.

use std::cell::RefCell;
use std::sync::Arc;

use super::{Kernel, LaneInterpreter, Operation, Value};

thread_local! {
    static MEMORY: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// A kernel prepared for running: operands are places in one memory of inputs, constants and results.
///
/// The memory belongs to the thread, so that an interpreter can be shared by threads and a run allocates
/// nothing.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: usize,
    /// Inputs that were set for good, then constants.
    known: Vec<f64>,
    code: Arc<[Instruction]>,
    outputs: Arc<[u32]>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Instruction {
    Add(u32, u32),
    Multiply(u32, u32),
    MultiplyAdd(u32, u32, u32),
    RootOfPositivePart(u32),
    HalfReciprocal(u32),
    Copy(u32),
}

impl Interpreter {
    /// Prepares a kernel.
    pub fn new(kernel: &Kernel) -> Self {
        let (inputs, constants) = (kernel.inputs as u32, kernel.constants.len() as u32);
        let place = |value: Value| match value {
            Value::Input(number) => number,
            Value::Constant(number) => inputs + number,
            Value::Result(number) => inputs + constants + number,
        };
        let code = kernel.operations.iter().map(|operation| match *operation {
            Operation::Add(a, b) => Instruction::Add(place(a), place(b)),
            Operation::Multiply(a, b) => Instruction::Multiply(place(a), place(b)),
            Operation::MultiplyAdd(a, b, c) => {
                Instruction::MultiplyAdd(place(a), place(b), place(c))
            }
            Operation::RootOfPositivePart(a) => Instruction::RootOfPositivePart(place(a)),
            Operation::HalfReciprocal(a) => Instruction::HalfReciprocal(place(a)),
            Operation::Held(a) => Instruction::Copy(place(a)),
        });
        Self {
            inputs: kernel.inputs,
            known: kernel.constants.clone(),
            code: code.collect(),
            outputs: kernel.outputs.iter().map(|&output| place(output)).collect(),
        }
    }

    /// The interpreter with its last inputs set to these values for good.
    ///
    /// # Panics
    ///
    /// If there are more values than inputs.
    pub fn with_last_inputs(&self, values: &[f64]) -> Self {
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
            self.outputs.clone(),
        )
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Runs the kernel and hands output after output to `receive` with its number.
    ///
    /// # Panics
    ///
    /// If the input slices together have not the kernel's number of inputs.
    pub fn run(&self, inputs: &[&[f64]], mut receive: impl FnMut(usize, f64)) {
        MEMORY.with_borrow_mut(|memory| {
            memory.clear();
            inputs
                .iter()
                .for_each(|slice| memory.extend_from_slice(slice));
            assert_eq!(memory.len(), self.inputs, "a kernel runs on all its inputs");
            memory.extend_from_slice(&self.known);
            for &instruction in self.code.iter() {
                let value = execute(instruction, memory);
                memory.push(value);
            }
            for (number, &place) in self.outputs.iter().enumerate() {
                receive(number, memory[place as usize]);
            }
        });
    }

    /// The outputs at these inputs.
    pub fn evaluate(&self, inputs: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.outputs.len()];
        self.run(&[inputs], |number, value| values[number] = value);
        values
    }
}

#[inline(always)]
fn execute(instruction: Instruction, memory: &[f64]) -> f64 {
    use crate::numeric::Scalar;
    let at = |place: u32| memory[place as usize];
    match instruction {
        Instruction::Add(a, b) => at(a) + at(b),
        Instruction::Multiply(a, b) => at(a) * at(b),
        Instruction::MultiplyAdd(a, b, c) => Scalar::mul_add(at(a), at(b), at(c)),
        Instruction::RootOfPositivePart(a) => positive_part(at(a)).sqrt(),
        Instruction::HalfReciprocal(a) => half_reciprocal(at(a)),
        Instruction::Copy(a) => at(a),
    }
}

/// `max(0, a)`; 0 for NaN.
#[inline(always)]
pub(super) fn positive_part(a: f64) -> f64 {
    if a > 0.0 { a } else { 0.0 }
}

/// `1/(2a)`; 0 where `a` is not positive.
#[inline(always)]
pub(super) fn half_reciprocal(a: f64) -> f64 {
    if a > 0.0 { 0.5 / a } else { 0.0 }
}
