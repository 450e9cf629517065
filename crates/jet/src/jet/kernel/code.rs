//! A kernel prepared for running: operands are places in one memory, and Horner schemes are single
//! instructions.
//!
//! The one idea: values known before a run that schemes only add, the coefficients of polynomials,
//! are not looked up in memory but read in sequence, in the order in which they are needed.

use std::collections::HashMap;

use super::schemes::{Rows, Scheme, Step, schedule};
use super::{Kernel, Operation, Value};
use crate::numeric::{Lanes, Scalar};

/// Instructions on a memory of inputs, known values and results.
#[derive(Debug)]
pub(super) struct Code {
    instructions: Vec<Instruction>,
    /// Lengths of the rows of all schemes of known values.
    rows: Vec<u32>,
    /// Places of the values of all other schemes.
    places: Vec<u32>,
    /// Known values that are looked up, stored at the end of memory.
    pub(super) kept: Vec<Known>,
    /// Known values in the order in which schemes read them.
    pub(super) read: Vec<Known>,
    /// Number of inputs.
    inputs: usize,
    /// Number of results, stored after the inputs.
    results: usize,
    outputs: Vec<u32>,
}

/// The instruction that computes the next result, or the next two.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Instruction {
    Add(u32, u32),
    Multiply(u32, u32),
    /// A scheme of values at places from `first` up to `end`.
    Chain {
        factor: u32,
        first: u32,
        end: u32,
    },
    /// Two schemes, their values interleaved.
    TwoChains {
        factor: u32,
        first: u32,
        end: u32,
    },
    /// A scheme of known values, its rows from `first` up to `end`.
    Polynomial {
        factors: [u32; 2],
        first: u32,
        end: u32,
    },
    /// Two polynomials, their values interleaved.
    TwoPolynomials {
        factors: [u32; 2],
        first: u32,
        end: u32,
    },
    RootOfPositivePart(u32),
    HalfReciprocal(u32),
    Hold(u32),
    /// An input that is also an output: copied, so that an output may become an input.
    Copy(u32),
}

impl Code {
    /// Prepares a kernel whose inputs from number `free` on are known before a run.
    pub(super) fn new(kernel: &Kernel, free: usize) -> Self {
        let steps = schedule(kernel, free);
        let mut places = Places::new(kernel, free, &steps);
        let mut code = Self {
            instructions: Vec::with_capacity(steps.len()),
            rows: Vec::new(),
            places: Vec::new(),
            kept: Vec::new(),
            read: Vec::new(),
            inputs: free,
            results: places.results(),
            outputs: Vec::new(),
        };
        for step in &steps {
            let instruction = match step {
                Step::Operation(_, operation) => instruction(*operation, &mut places),
                Step::Schemes(schemes) => code.schemes(schemes, &mut places),
            };
            code.instructions.push(instruction);
        }
        for &value in &kernel.outputs {
            if places.is_input(value) {
                code.instructions.push(Instruction::Copy(places.of(value)));
            }
        }
        code.outputs = places.of_outputs(&kernel.outputs);
        code.kept = places.kept;
        code
    }

    /// The instruction for a scheme, or for two of one shape.
    fn schemes(&mut self, schemes: &[(usize, Scheme)], places: &mut Places) -> Instruction {
        let Scheme { factor, rows } = &schemes[0].1;
        let factor = places.of(*factor);
        match rows {
            Rows::Values(values) => self.chains(schemes, factor, values.len(), places),
            Rows::Known(inner, rows) => {
                let factors = [factor, places.of(*inner)];
                self.polynomials(schemes, factors, rows, places)
            }
        }
    }

    fn chains(
        &mut self,
        schemes: &[(usize, Scheme)],
        factor: u32,
        len: usize,
        places: &mut Places,
    ) -> Instruction {
        let first = self.places.len() as u32;
        for number in 0..len {
            let values = schemes.iter().map(|(_, scheme)| scheme.values()[number]);
            self.places.extend(values.map(|value| places.of(value)));
        }
        let end = self.places.len() as u32;
        match schemes.len() {
            1 => Instruction::Chain { factor, first, end },
            _ => Instruction::TwoChains { factor, first, end },
        }
    }

    fn polynomials(
        &mut self,
        schemes: &[(usize, Scheme)],
        factors: [u32; 2],
        rows: &[Vec<Value>],
        places: &Places,
    ) -> Instruction {
        let first = self.rows.len() as u32;
        for (number, row) in rows.iter().enumerate() {
            self.rows.push(row.len() as u32);
            for place in 0..row.len() {
                let values = schemes.iter().map(|(_, own)| own.rows()[number][place]);
                let known = values.filter_map(|value| places.known(value));
                self.read.extend(known);
            }
        }
        let end = self.rows.len() as u32;
        match schemes.len() {
            1 => Instruction::Polynomial { factors, first, end },
            _ => Instruction::TwoPolynomials { factors, first, end },
        }
    }

    /// Number of inputs.
    pub(super) fn inputs(&self) -> usize {
        self.inputs
    }

    /// Extends a memory of inputs by room for results and by the known values that are looked up.
    pub(super) fn complete<T: Number>(&self, memory: &mut Vec<T>, kept: &[T::Known]) {
        memory.resize(self.inputs + self.results, T::ZERO);
        memory.extend(kept.iter().map(|&known| T::of(known)));
    }

    /// Values of the known operands that are looked up.
    pub(super) fn kept<T: Copy>(&self, set: &[T], constants: &[T]) -> Vec<T> {
        self.kept.iter().map(|known| known.of(set, constants)).collect()
    }

    /// Values of the known operands that are read in sequence.
    pub(super) fn read<T: Copy>(&self, set: &[T], constants: &[T]) -> Vec<T> {
        self.read.iter().map(|known| known.of(set, constants)).collect()
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

    /// Runs on a memory of inputs, results and known values; `read` holds the known values that are
    /// read in sequence.
    ///
    /// The function is inlined so that [`Vectorised`](crate::numeric::Vectorised) work that
    /// calls it runs with the widest registers.
    #[inline(always)]
    pub(super) fn run<T: Number>(&self, mut read: &[T::Known], memory: &mut [T]) {
        let mut place = self.inputs;
        for &instruction in &self.instructions {
            let at = |place: u32| memory[place as usize];
            let result = match instruction {
                Instruction::Add(a, b) => at(a).plus(at(b)),
                Instruction::Multiply(a, b) => at(a).times(at(b)),
                Instruction::Chain { factor, first, end } => {
                    let places = &self.places[first as usize..end as usize];
                    chain(at(factor), places, memory)
                }
                Instruction::TwoChains { factor, first, end } => {
                    let places = &self.places[first as usize..end as usize];
                    let sums = two_chains(at(factor), places, memory);
                    memory[place] = sums[0];
                    place += 1;
                    sums[1]
                }
                Instruction::Polynomial { factors: [factor, inner], first, end } => {
                    let rows = &self.rows[first as usize..end as usize];
                    polynomial([at(factor), at(inner)], rows, &mut read)
                }
                Instruction::TwoPolynomials { factors: [factor, inner], first, end } => {
                    let rows = &self.rows[first as usize..end as usize];
                    let sums = two_polynomials([at(factor), at(inner)], rows, &mut read);
                    memory[place] = sums[0];
                    place += 1;
                    sums[1]
                }
                Instruction::RootOfPositivePart(a) => at(a).root_of_positive_part(),
                Instruction::HalfReciprocal(a) => at(a).half_reciprocal(),
                Instruction::Hold(a) => at(a).held(),
                Instruction::Copy(a) => at(a),
            };
            memory[place] = result;
            place += 1;
        }
    }
}

fn instruction(operation: Operation, places: &mut Places) -> Instruction {
    let mut place = |value| places.of(value);
    match operation {
        Operation::Add(a, b) => Instruction::Add(place(a), place(b)),
        Operation::Multiply(a, b) => Instruction::Multiply(place(a), place(b)),
        Operation::MultiplyAdd(..) => unreachable!("every multiply-add is part of a scheme"),
        Operation::RootOfPositivePart(a) => Instruction::RootOfPositivePart(place(a)),
        Operation::HalfReciprocal(a) => Instruction::HalfReciprocal(place(a)),
        Operation::Held(a) => Instruction::Hold(place(a)),
    }
}

/// Value of a scheme of values at these places.
#[inline(always)]
fn chain<T: Number>(factor: T, places: &[u32], memory: &[T]) -> T {
    let mut sum = memory[places[0] as usize];
    for &place in &places[1..] {
        sum = sum.times_plus(factor, memory[place as usize]);
    }
    sum
}

/// Values of two schemes whose places are interleaved.
#[inline(always)]
fn two_chains<T: Number>(factor: T, places: &[u32], memory: &[T]) -> [T; 2] {
    let (pairs, _) = places.as_chunks::<2>();
    let [mut one, mut two] = pairs[0].map(|place| memory[place as usize]);
    for &[a, b] in &pairs[1..] {
        one = one.times_plus(factor, memory[a as usize]);
        two = two.times_plus(factor, memory[b as usize]);
    }
    [one, two]
}

/// Value of a scheme with rows of these lengths.
#[inline(always)]
fn polynomial<T: Number>([factor, inner]: [T; 2], rows: &[u32], read: &mut &[T::Known]) -> T {
    let mut sum = row(inner, rows[0], read);
    for &len in &rows[1..] {
        sum = sum.times_plus(factor, row(inner, len, read));
    }
    sum
}

#[inline(always)]
fn row<T: Number>(factor: T, len: u32, read: &mut &[T::Known]) -> T {
    let (own, rest) = read.split_at(len as usize);
    *read = rest;
    let mut sum = T::of(own[0]);
    for &value in &own[1..] {
        sum = sum.times_plus_known(factor, value);
    }
    sum
}

/// Values of two schemes of known values that are interleaved.
#[inline(always)]
fn two_polynomials<T: Number>(
    [factor, inner]: [T; 2],
    rows: &[u32],
    read: &mut &[T::Known],
) -> [T; 2] {
    let [mut one, mut two] = two_rows(inner, rows[0], read);
    for &len in &rows[1..] {
        let [a, b] = two_rows(inner, len, read);
        one = one.times_plus(factor, a);
        two = two.times_plus(factor, b);
    }
    [one, two]
}

#[inline(always)]
fn two_rows<T: Number>(factor: T, len: u32, read: &mut &[T::Known]) -> [T; 2] {
    let (own, rest) = read.split_at(2 * len as usize);
    *read = rest;
    let (pairs, _) = own.as_chunks::<2>();
    let [mut one, mut two] = pairs[0].map(T::of);
    for &[a, b] in &pairs[1..] {
        one = one.times_plus_known(factor, a);
        two = two.times_plus_known(factor, b);
    }
    [one, two]
}

/// An operand that is known before a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Known {
    /// An input with a fixed value, by its number among the fixed inputs.
    Input(u32),
    /// A constant of the kernel.
    Constant(u32),
}

impl Known {
    /// Value of the operand, from the values of all fixed inputs and all constants.
    pub(super) fn of<T: Copy>(self, set: &[T], constants: &[T]) -> T {
        match self {
            Self::Input(number) => set[number as usize],
            Self::Constant(number) => constants[number as usize],
        }
    }
}

/// Places in a memory of inputs, results and known values. Only known values that are looked up
/// have a place.
#[derive(Debug)]
struct Places {
    free: usize,
    /// Position among the results, by the number of the operation.
    of_operations: HashMap<usize, usize>,
    /// Number of results that are copies of inputs; they come after the others.
    copies: usize,
    known: HashMap<Known, u32>,
    /// Known values in the order of their places.
    pub(super) kept: Vec<Known>,
}

impl Places {
    /// Places of the results of these steps, with inputs from number `free` on known.
    pub(super) fn new(kernel: &Kernel, free: usize, steps: &[Step]) -> Self {
        let numbers = steps.iter().flat_map(Step::numbers).enumerate();
        let mut places = Self {
            free,
            of_operations: numbers.map(|(place, number)| (number, place)).collect(),
            copies: 0,
            known: HashMap::new(),
            kept: Vec::new(),
        };
        let outputs = kernel.outputs.iter();
        places.copies = outputs.filter(|&&value| places.is_input(value)).count();
        places
    }

    /// Number of results.
    pub(super) fn results(&self) -> usize {
        self.of_operations.len() + self.copies
    }

    /// Whether a value is an input that is not known before a run.
    fn is_input(&self, value: Value) -> bool {
        matches!(value, Value::Input(number) if (number as usize) < self.free)
    }

    /// Places of outputs; an output that is an input has the place of its copy.
    fn of_outputs(&mut self, outputs: &[Value]) -> Vec<u32> {
        let mut copy = self.free + self.of_operations.len();
        let mut place = |&value: &Value| {
            if !self.is_input(value) {
                return self.of(value);
            }
            copy += 1;
            copy as u32 - 1
        };
        outputs.iter().map(&mut place).collect()
    }

    /// Place of a value; a known value gets its place when it is first looked up.
    pub(super) fn of(&mut self, value: Value) -> u32 {
        let first_known = self.free + self.results();
        match (value, self.known(value)) {
            (Value::Result(number), _) => {
                (self.free + self.of_operations[&(number as usize)]) as u32
            }
            (_, Some(known)) => *self.known.entry(known).or_insert_with(|| {
                self.kept.push(known);
                (first_known + self.kept.len() - 1) as u32
            }),
            (Value::Input(number) | Value::Constant(number), None) => number,
        }
    }

    /// Known operand of a value, if the value is known before a run.
    pub(super) fn known(&self, value: Value) -> Option<Known> {
        match value {
            Value::Input(number) => number.checked_sub(self.free as u32).map(Known::Input),
            Value::Constant(number) => Some(Known::Constant(number)),
            Value::Result(_) => None,
        }
    }
}

/// Numbers on which the operations of a kernel act.
pub trait Number: Copy {
    /// Type of numbers that are known before a run; they have no derivative.
    type Known: Copy;

    /// 0.
    const ZERO: Self;

    /// Conversion of a known number.
    fn of(known: Self::Known) -> Self;
    /// `a + b`.
    fn plus(self, b: Self) -> Self;
    /// `a b`.
    fn times(self, b: Self) -> Self;
    /// `a b + c`.
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// `a b + c` with a known `c`.
    fn times_plus_known(self, b: Self, c: Self::Known) -> Self;
    /// `√max(0, a)`, where `max(0, a)` is 0 for NaN.
    fn root_of_positive_part(self) -> Self;
    /// `1/(2a)`; 0 where `a` is not positive.
    fn half_reciprocal(self) -> Self;
    /// `a`, without derivative.
    fn held(self) -> Self;
}

macro_rules! number {
    ($($type:ty [$($generic:tt)*] $zero:expr, $positive_part:expr, $half_reciprocal:expr;)*) => {$(
        impl<$($generic)*> Number for $type {
            type Known = Self;
            const ZERO: Self = $zero;

            #[inline(always)]
            fn of(known: Self) -> Self {
                known
            }

            #[inline(always)]
            fn plus(self, b: Self) -> Self {
                self + b
            }

            #[inline(always)]
            fn times(self, b: Self) -> Self {
                self * b
            }

            #[inline(always)]
            fn times_plus(self, b: Self, c: Self) -> Self {
                Scalar::mul_add(self, b, c)
            }

            #[inline(always)]
            fn times_plus_known(self, b: Self, c: Self) -> Self {
                Scalar::mul_add(self, b, c)
            }

            #[inline(always)]
            fn root_of_positive_part(self) -> Self {
                Scalar::sqrt($positive_part(self))
            }

            #[inline(always)]
            fn half_reciprocal(self) -> Self {
                $half_reciprocal(self)
            }

            #[inline(always)]
            fn held(self) -> Self {
                self
            }
        }
    )*};
}

number! {
    f64 [] 0.0, |a| if a > 0.0 { a } else { 0.0 }, |a| if a > 0.0 { 0.5 / a } else { 0.0 };
    f32 [] 0.0, |a| if a > 0.0 { a } else { 0.0 }, |a| if a > 0.0 { 0.5 / a } else { 0.0 };
    Lanes<N> [const N: usize] Self::splat(0.0),
        |a: Self| a.map(|a| if a > 0.0 { a } else { 0.0 }),
        |a: Self| a.map(|a| if a > 0.0 { 0.5 / a } else { 0.0 });
}

/// A value with its derivative along a tangent vector.
///
/// A kernel that runs on dual numbers propagates the vector by the rules of
/// [`Kernel::with_jacobian`](super::Kernel::with_jacobian).
///
/// ```
/// use grazemap_jet::jet::kernel::{Dual, Number};
/// let x = Dual { value: 4.0, slope: 1.0 };
/// let root = x.root_of_positive_part();
/// assert_eq!((root.value, root.slope), (2.0, 0.25));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T> {
    /// The value.
    pub value: T,
    /// Derivative along the tangent vector.
    pub slope: T,
}

impl<T: Number<Known = T> + Scalar> Number for Dual<T> {
    type Known = T;
    const ZERO: Self = Self { value: T::ZERO, slope: T::ZERO };

    #[inline(always)]
    fn of(value: T) -> Self {
        let slope = T::ZERO;
        Self { value, slope }
    }

    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        Self { value: self.value + b.value, slope: self.slope + b.slope }
    }

    #[inline(always)]
    fn times(self, b: Self) -> Self {
        let second = self.value * b.slope;
        Self { value: self.value * b.value, slope: self.slope.times_plus(b.value, second) }
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        let second = self.value.times_plus(b.slope, c.slope);
        Self {
            value: self.value.times_plus(b.value, c.value),
            slope: self.slope.times_plus(b.value, second),
        }
    }

    #[inline(always)]
    fn times_plus_known(self, b: Self, c: T) -> Self {
        let second = self.value * b.slope;
        Self {
            value: self.value.times_plus(b.value, c),
            slope: self.slope.times_plus(b.value, second),
        }
    }

    #[inline(always)]
    fn root_of_positive_part(self) -> Self {
        let value = self.value.root_of_positive_part();
        let slope = self.slope * value.half_reciprocal();
        Self { value, slope }
    }

    #[inline(always)]
    fn half_reciprocal(self) -> Self {
        let value = self.value.half_reciprocal();
        let outer = T::from_f64(-2.0) * (value * value);
        let slope = self.slope * outer;
        Self { value, slope }
    }

    #[inline(always)]
    fn held(self) -> Self {
        Self::of(self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::kernel::KernelBuilder;

    /// Code of a kernel, and its memory after a run.
    fn run(kernel: &Kernel, inputs: &[f64]) -> (Code, Vec<f64>) {
        let code = Code::new(kernel, kernel.inputs);
        let mut memory = inputs.to_vec();
        code.complete(&mut memory, &code.kept(&[], &kernel.constants));
        code.run(&code.read(&[], &kernel.constants), &mut memory);
        (code, memory)
    }

    #[test]
    fn a_polynomial_is_one_instruction_that_reads_its_coefficients() {
        let mut builder = KernelBuilder::new(2);
        let (x, y) = (builder.input(0), builder.input(1));
        let coefficients = [2.0, 3.0, 5.0, 7.0].map(|value| builder.constant(value));
        let mut sum = coefficients[0];
        for coefficient in &coefficients[1..] {
            sum = builder.multiply_add(sum, x, *coefficient);
        }
        let whole = builder.multiply_add(sum, y, coefficients[1]);
        let (code, memory) = run(&builder.finish(vec![whole]), &[10.0, 2.0]);
        assert_eq!((code.instructions.len(), code.read.len(), memory.len()), (1, 5, 3));
        assert_eq!(memory[2], 4717.0);
    }

    #[test]
    fn a_sum_that_is_used_twice_keeps_its_place() {
        let mut builder = KernelBuilder::new(2);
        let (x, c) = (builder.input(0), builder.input(1));
        let inner = builder.multiply_add(c, x, c);
        let outer = builder.multiply_add(inner, x, c);
        let twice = builder.multiply(outer, inner);
        let (_, memory) = run(&builder.finish(vec![twice]), &[2.0, 3.0]);
        assert_eq!(memory[2..], [9.0, 21.0, 189.0]);
    }
}
