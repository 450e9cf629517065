//! A kernel prepared for running: operands are places in one memory, and Horner schemes are chains.
//!
//! The one idea: a multiply-add whose result goes nowhere but into the next one, with the same factor, needs no place in
//! memory. A chain of them is one instruction, whose sum stays in a register; two chains with one factor are one instruction, too.

use super::chains::{Chain, Step, schedule};
use super::{Kernel, Operation, Value};
use crate::numeric::{Lanes, Scalar};

/// Instructions on a memory of inputs, constants and results.
#[derive(Debug)]
pub(super) struct Code {
    instructions: Vec<Instruction>,
    /// Places of the addends of all chains.
    addends: Vec<u32>,
    /// Number of results.
    results: usize,
    outputs: Vec<u32>,
}

/// What gives the next result, or the next two.
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
    /// Two chains. What the longer one has more comes from `first` up to `both`; from there on up to `end` addends are in
    /// turn of the one and of the other.
    TwoChains {
        starts: [u32; 2],
        factor: u32,
        first: u32,
        both: u32,
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
        let mut places = Places {
            first_constant: kernel.inputs,
            first_result: kernel.inputs + kernel.constants.len(),
            results: vec![0; kernel.operations.len()],
        };
        let mut code = Self {
            instructions: Vec::new(),
            addends: Vec::new(),
            results: 0,
            outputs: Vec::with_capacity(kernel.outputs.len()),
        };
        for step in schedule(kernel) {
            code.push(kernel, &step, &mut places);
        }
        let outputs = kernel.outputs.iter();
        code.outputs.extend(outputs.map(|&value| places.of(value)));
        code
    }

    fn push(&mut self, kernel: &Kernel, step: &Step, places: &mut Places) {
        let instruction = match step {
            Step::Operation(number) => self.instruction(kernel.operations[*number], places),
            Step::Chain(_, chain) => self.chain(chain, places),
            Step::Chains(_, chains) => self.two_chains(chains, places),
        };
        self.instructions.push(instruction);
        let numbers = match step {
            Step::Operation(number) | Step::Chain(number, _) => std::slice::from_ref(number),
            Step::Chains(numbers, _) => numbers,
        };
        for &number in numbers {
            places.results[number] = self.results;
            self.results += 1;
        }
    }

    fn instruction(&mut self, operation: Operation, places: &Places) -> Instruction {
        let place = |value: Value| places.of(value);
        match operation {
            Operation::Add(a, b) => Instruction::Add(place(a), place(b)),
            Operation::Multiply(a, b) => Instruction::Multiply(place(a), place(b)),
            Operation::MultiplyAdd(..) => unreachable!("every multiply-add is part of a chain"),
            Operation::RootOfPositivePart(a) => Instruction::RootOfPositivePart(place(a)),
            Operation::HalfReciprocal(a) => Instruction::HalfReciprocal(place(a)),
            Operation::Held(a) => Instruction::Copy(place(a)),
        }
    }

    fn chain(&mut self, chain: &Chain, places: &Places) -> Instruction {
        let first = self.addends.len() as u32;
        let addends = chain.addends.iter();
        self.addends.extend(addends.map(|&value| places.of(value)));
        Instruction::Chain {
            start: places.of(chain.start),
            factor: places.of(chain.factor),
            first,
            end: self.addends.len() as u32,
        }
    }

    fn two_chains(&mut self, [longer, other]: &[Chain; 2], places: &Places) -> Instruction {
        let first = self.addends.len() as u32;
        let place = |&value: &Value| places.of(value);
        let more = longer.addends.len() - other.addends.len();
        let (more, rest) = longer.addends.split_at(more);
        self.addends.extend(more.iter().map(place));
        let both = self.addends.len() as u32;
        let pairs = rest.iter().zip(&other.addends);
        let pairs = pairs.flat_map(|(one, two)| [place(one), place(two)]);
        self.addends.extend(pairs);
        Instruction::TwoChains {
            starts: [place(&longer.start), place(&other.start)],
            factor: place(&longer.factor),
            first,
            both,
            end: self.addends.len() as u32,
        }
    }

    /// Number of results.
    pub(super) fn results(&self) -> usize {
        self.results
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
        let mut place = memory.len() - self.results;
        for &instruction in &self.instructions {
            let at = |place: u32| memory[place as usize];
            let result = match instruction {
                Instruction::Add(a, b) => at(a) + at(b),
                Instruction::Multiply(a, b) => at(a) * at(b),
                Instruction::Chain {
                    start,
                    factor,
                    first,
                    end,
                } => self.sum(at(start), at(factor), [first, end], memory),
                Instruction::TwoChains {
                    starts: [longer, other],
                    factor,
                    first,
                    both,
                    end,
                } => {
                    let longer = self.sum(at(longer), at(factor), [first, both], memory);
                    let sums = [longer, at(other)];
                    let sums = self.two_sums(sums, at(factor), [both, end], memory);
                    memory[place] = sums[0];
                    place += 1;
                    sums[1]
                }
                Instruction::RootOfPositivePart(a) => at(a).positive_part().sqrt(),
                Instruction::HalfReciprocal(a) => at(a).half_reciprocal(),
                Instruction::Copy(a) => at(a),
            };
            memory[place] = result;
            place += 1;
        }
    }

    /// A chain from `sum` on.
    #[inline(always)]
    fn sum<T: Number>(&self, mut sum: T, factor: T, [first, end]: [u32; 2], memory: &[T]) -> T {
        for &addend in &self.addends[first as usize..end as usize] {
            sum = sum.mul_add(factor, memory[addend as usize]);
        }
        sum
    }

    /// Two chains, their addends in turn.
    #[inline(always)]
    fn two_sums<T: Number>(
        &self,
        [mut one, mut two]: [T; 2],
        factor: T,
        [first, end]: [u32; 2],
        memory: &[T],
    ) -> [T; 2] {
        let (pairs, _) = self.addends[first as usize..end as usize].as_chunks::<2>();
        for &[a, b] in pairs {
            one = one.mul_add(factor, memory[a as usize]);
            two = two.mul_add(factor, memory[b as usize]);
        }
        [one, two]
    }
}

/// Where values stand: inputs, constants, results.
struct Places {
    first_constant: usize,
    first_result: usize,
    /// Which of the results is an operation's.
    results: Vec<usize>,
}

impl Places {
    fn of(&self, value: Value) -> u32 {
        match value {
            Value::Input(number) => number,
            Value::Constant(number) => self.first_constant as u32 + number,
            Value::Result(number) => (self.first_result + self.results[number as usize]) as u32,
        }
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
        assert_eq!((code.results(), code.addends.len()), (2, 4));
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
        assert_eq!(code.results(), 3);
        let mut memory = [2.0, 3.0, 0.0, 0.0, 0.0];
        code.run(&mut memory);
        assert_eq!(memory[2..], [9.0, 21.0, 189.0]);
    }
}
