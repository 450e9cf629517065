//! A kernel prepared for running: operands are places in one memory, and Horner schemes are chains.
//!
//! The one idea: a multiply-add whose result goes nowhere but into the next one, with the same factor, needs no place in
//! memory. A chain of them is one instruction, whose sum stays in a register.

use super::{Kernel, Operation, Value};
use crate::numeric::{Lanes, Scalar};

/// Instructions on a memory of inputs, constants and results, one result each.
#[derive(Debug)]
pub(super) struct Code {
    instructions: Vec<Instruction>,
    /// Places of the addends of all chains.
    addends: Vec<u32>,
    outputs: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Instruction {
    Add(u32, u32),
    Multiply(u32, u32),
    /// `(…((start · factor + c₁) · factor + c₂) …) · factor + c_n`, the addends from `first` up to `end`.
    Chain {
        start: u32,
        factor: u32,
        first: u32,
        end: u32,
    },
    RootOfPositivePart(u32),
    HalfReciprocal(u32),
    Copy(u32),
}

/// Numbers on which instructions act.
pub trait Number: Scalar {
    /// `max(0, a)`; 0 for NaN.
    fn positive_part(self) -> Self;
    /// `1/(2a)`; 0 where `a` is not positive.
    fn half_reciprocal(self) -> Self;
}

macro_rules! number {
    ($($float:ident),*) => {$(
        impl Number for $float {
            #[inline(always)]
            fn positive_part(self) -> Self {
                if self > 0.0 { self } else { 0.0 }
            }

            #[inline(always)]
            fn half_reciprocal(self) -> Self {
                if self > 0.0 { 0.5 / self } else { 0.0 }
            }
        }
    )*};
}

number!(f64, f32);

impl<const N: usize> Number for Lanes<N> {
    #[inline(always)]
    fn positive_part(self) -> Self {
        self.map(f64::positive_part)
    }

    #[inline(always)]
    fn half_reciprocal(self) -> Self {
        self.map(f64::half_reciprocal)
    }
}

impl Code {
    pub(super) fn new(kernel: &Kernel) -> Self {
        let absorbed = absorbed(kernel);
        let mut code = Self {
            instructions: Vec::with_capacity(kernel.operations.len()),
            addends: Vec::new(),
            outputs: Vec::with_capacity(kernel.outputs.len()),
        };
        let mut places = Places {
            inputs: kernel.inputs,
            constants: kernel.constants.len(),
            results: vec![0; kernel.operations.len()],
        };
        for number in 0..kernel.operations.len() {
            if !absorbed[number] {
                places.results[number] = code.instructions.len();
                let instruction = code.instruction(kernel, &absorbed, number, &places);
                code.instructions.push(instruction);
            }
        }
        let outputs = kernel.outputs.iter();
        code.outputs.extend(outputs.map(|&value| places.of(value)));
        code
    }

    /// The instruction whose result is that of an operation.
    fn instruction(
        &mut self,
        kernel: &Kernel,
        absorbed: &[bool],
        number: usize,
        places: &Places,
    ) -> Instruction {
        let place = |value: Value| places.of(value);
        match kernel.operations[number] {
            Operation::Add(a, b) => Instruction::Add(place(a), place(b)),
            Operation::Multiply(a, b) => Instruction::Multiply(place(a), place(b)),
            Operation::MultiplyAdd(mut start, factor, addend) => {
                let first = self.addends.len();
                self.addends.push(place(addend));
                while let Some((before, addend)) = absorbed_sum(kernel, absorbed, start) {
                    self.addends.push(place(addend));
                    start = before;
                }
                self.addends[first..].reverse();
                Instruction::Chain {
                    start: place(start),
                    factor: place(factor),
                    first: first as u32,
                    end: self.addends.len() as u32,
                }
            }
            Operation::RootOfPositivePart(a) => Instruction::RootOfPositivePart(place(a)),
            Operation::HalfReciprocal(a) => Instruction::HalfReciprocal(place(a)),
            Operation::Held(a) => Instruction::Copy(place(a)),
        }
    }

    /// Number of instructions, and of results.
    pub(super) fn len(&self) -> usize {
        self.instructions.len()
    }

    /// Number of outputs.
    pub(super) fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Output `number` of the last run.
    #[inline(always)]
    pub(super) fn output<'m, T: Number>(&self, number: usize, memory: &'m [T]) -> &'m T {
        &memory[self.outputs[number] as usize]
    }

    /// Runs on inputs and constants at the head of a memory; the results fill the rest of it.
    ///
    /// It is inlined so that a [`numeric::Kernel`](crate::numeric::Kernel) that calls it runs with the widest registers.
    #[inline(always)]
    pub(super) fn run<T: Number>(&self, memory: &mut [T]) {
        let results = memory.len() - self.instructions.len();
        for (number, &instruction) in self.instructions.iter().enumerate() {
            memory[results + number] = self.execute(instruction, memory);
        }
    }

    #[inline(always)]
    fn execute<T: Number>(&self, instruction: Instruction, memory: &[T]) -> T {
        let at = |place: u32| memory[place as usize];
        match instruction {
            Instruction::Add(a, b) => at(a) + at(b),
            Instruction::Multiply(a, b) => at(a) * at(b),
            Instruction::Chain {
                start,
                factor,
                first,
                end,
            } => {
                let (mut sum, factor) = (at(start), at(factor));
                for &addend in &self.addends[first as usize..end as usize] {
                    sum = sum.mul_add(factor, at(addend));
                }
                sum
            }
            Instruction::RootOfPositivePart(a) => at(a).positive_part().sqrt(),
            Instruction::HalfReciprocal(a) => at(a).half_reciprocal(),
            Instruction::Copy(a) => at(a),
        }
    }
}

/// Where values stand: inputs, constants, results.
struct Places {
    inputs: usize,
    constants: usize,
    /// Number of the instruction that gives an operation's result.
    results: Vec<usize>,
}

impl Places {
    fn of(&self, value: Value) -> u32 {
        match value {
            Value::Input(number) => number,
            Value::Constant(number) => self.inputs as u32 + number,
            Value::Result(number) => {
                (self.inputs + self.constants + self.results[number as usize]) as u32
            }
        }
    }
}

/// Which operations are multiply-adds whose result is used once, as the sum that a multiply-add with the same factor goes on from.
fn absorbed(kernel: &Kernel) -> Vec<bool> {
    let mut uses = vec![0; kernel.operations.len()];
    let operands = kernel.operations.iter().flat_map(Operation::operands);
    for value in operands.chain(kernel.outputs.iter().copied()) {
        if let Value::Result(number) = value {
            uses[number as usize] += 1;
        }
    }
    let mut absorbed = vec![false; kernel.operations.len()];
    for operation in &kernel.operations {
        if let Operation::MultiplyAdd(Value::Result(sum), factor, _) = *operation {
            let before = kernel.operations[sum as usize];
            let goes_on = matches!(before, Operation::MultiplyAdd(_, own, _) if own == factor);
            absorbed[sum as usize] = goes_on && uses[sum as usize] == 1;
        }
    }
    absorbed
}

/// Start and addend of a multiply-add that has no place of its own.
fn absorbed_sum(kernel: &Kernel, absorbed: &[bool], value: Value) -> Option<(Value, Value)> {
    match value {
        Value::Result(number) if absorbed[number as usize] => {
            match kernel.operations[number as usize] {
                Operation::MultiplyAdd(start, _, addend) => Some((start, addend)),
                _ => None,
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::kernel::KernelBuilder;

    #[test]
    fn a_horner_scheme_is_one_chain_with_an_addend_for_each_coefficient() {
        let mut builder = KernelBuilder::new(2);
        let (x, y) = (builder.input(0), builder.input(1));
        let coefficients = [2.0, 3.0, 5.0, 7.0].map(|value| builder.constant(value));
        let mut sum = coefficients[0];
        for coefficient in &coefficients[1..] {
            sum = builder.multiply_add(sum, x, *coefficient);
        }
        let whole = builder.multiply_add(sum, y, coefficients[1]);
        let code = Code::new(&builder.finish(vec![whole]));
        // In x with three addends, then in y with one.
        assert_eq!((code.len(), code.addends.len()), (2, 4));
        let mut memory = [10.0, 2.0, 2.0, 3.0, 5.0, 7.0, 0.0, 0.0];
        code.run(&mut memory);
        assert_eq!(memory[6..], [2357.0, 4717.0]);
    }

    #[test]
    fn a_sum_that_is_used_twice_keeps_its_place() {
        let mut builder = KernelBuilder::new(2);
        let (x, c) = (builder.input(0), builder.input(1));
        let inner = builder.multiply_add(c, x, c);
        let outer = builder.multiply_add(inner, x, c);
        let twice = builder.multiply(outer, inner);
        let code = Code::new(&builder.finish(vec![twice]));
        assert_eq!(code.len(), 3);
        let mut memory = [2.0, 3.0, 0.0, 0.0, 0.0];
        code.run(&mut memory);
        assert_eq!(memory[2..], [9.0, 21.0, 189.0]);
    }
}
