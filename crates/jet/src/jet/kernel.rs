//! Straight-line kernels: a map as a list of operations on its inputs.
//!
//! One idea: a map is lowered once to a list of elementary operations; an interpreter runs the
//! list, the emitter prints it, differentiation and freezing rewrite it. All of them therefore
//! round alike. See docs/mathematics/evaluation.md.

mod code;
mod interpreter;
mod schemes;

use std::collections::HashMap;

use super::Jet;

pub use code::{Dual, Number};
pub use interpreter::{Interpreted, Interpreter, LaneInterpreter, Unset};

/// An operand: the origin of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Value {
    /// An input, by position.
    Input(u32),
    /// A constant, by its number in [`Kernel::constants`].
    Constant(u32),
    /// The result of an operation, by its number in [`Kernel::operations`].
    Result(u32),
}

/// One elementary operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// `a + b`.
    Add(Value, Value),
    /// `a b`.
    Multiply(Value, Value),
    /// `a b + c`, fused where the machine fuses.
    MultiplyAdd(Value, Value, Value),
    /// `√max(0, a)`: the depth variable `y`.
    RootOfPositivePart(Value),
    /// `1/(2a)`, and 0 at `a = 0`: the slope of the depth variable.
    HalfReciprocal(Value),
    /// `a`, constant under differentiation: a selection on which no result depends.
    Held(Value),
}

impl Operation {
    /// The operands, in order.
    pub fn operands(&self) -> impl Iterator<Item = Value> {
        let (a, b, c) = match *self {
            Self::Add(a, b) | Self::Multiply(a, b) => (a, Some(b), None),
            Self::MultiplyAdd(a, b, c) => (a, Some(b), Some(c)),
            Self::RootOfPositivePart(a) | Self::HalfReciprocal(a) | Self::Held(a) => {
                (a, None, None)
            }
        };
        [Some(a), b, c].into_iter().flatten()
    }

    /// The operation with other operands.
    pub fn with_operands(&self, mut map: impl FnMut(Value) -> Value) -> Self {
        match *self {
            Self::Add(a, b) => Self::Add(map(a), map(b)),
            Self::Multiply(a, b) => Self::Multiply(map(a), map(b)),
            Self::MultiplyAdd(a, b, c) => Self::MultiplyAdd(map(a), map(b), map(c)),
            Self::RootOfPositivePart(a) => Self::RootOfPositivePart(map(a)),
            Self::HalfReciprocal(a) => Self::HalfReciprocal(map(a)),
            Self::Held(a) => Self::Held(map(a)),
        }
    }
}

/// A straight-line program: every operation uses inputs, constants and earlier results only.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// Number of inputs.
    pub inputs: usize,
    /// Constants, each bit pattern once.
    pub constants: Vec<f64>,
    /// Operations in the order in which they run.
    pub operations: Vec<Operation>,
    /// The values that the kernel returns.
    pub outputs: Vec<Value>,
}

/// Number of operations of each kind in a kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCount {
    /// Multiply-adds.
    pub multiply_adds: usize,
    /// Products without a sum.
    pub products: usize,
    /// Sums without a product.
    pub sums: usize,
    /// Square roots and reciprocals.
    pub roots: usize,
}

impl OperationCount {
    /// Total number of operations.
    pub fn total(&self) -> usize {
        self.multiply_adds + self.products + self.sums + self.roots
    }
}

impl Kernel {
    /// Number of operations of each kind.
    pub fn count(&self) -> OperationCount {
        let mut count = OperationCount::default();
        for operation in &self.operations {
            match operation {
                Operation::MultiplyAdd(..) => count.multiply_adds += 1,
                Operation::Multiply(..) => count.products += 1,
                Operation::Add(..) => count.sums += 1,
                Operation::RootOfPositivePart(..) | Operation::HalfReciprocal(..) => {
                    count.roots += 1
                }
                Operation::Held(..) => {}
            }
        }
        count
    }

    /// Whether every constant is finite.
    pub fn is_finite(&self) -> bool {
        self.constants.iter().all(|value| value.is_finite())
    }

    /// The kernel without the operations that no output needs.
    pub fn without_dead_operations(&self) -> Self {
        let mut needed = vec![false; self.operations.len()];
        let mark = |value: Value, needed: &mut [bool]| {
            if let Value::Result(number) = value {
                needed[number as usize] = true;
            }
        };
        self.outputs.iter().for_each(|&output| mark(output, &mut needed));
        for number in (0..self.operations.len()).rev() {
            if needed[number] {
                self.operations[number].operands().for_each(|operand| mark(operand, &mut needed));
            }
        }
        let mut builder = KernelBuilder::new(self.inputs);
        let mut renamed = Vec::with_capacity(self.operations.len());
        for (operation, needed) in self.operations.iter().zip(needed) {
            renamed.push(if needed {
                let moved = operation.with_operands(|value| builder.import(self, value, &renamed));
                builder.push(moved)
            } else {
                builder.constant(0.0)
            });
        }
        let outputs =
            self.outputs.iter().map(|&output| builder.import(self, output, &renamed)).collect();
        builder.finish(outputs)
    }
}

/// Collects the operations of a [`Kernel`].
///
/// Products by 0 and 1 and sums with 0 are resolved while building; an operation that is already in
/// the kernel is not repeated.
///
/// ```
/// use grazemap_jet::jet::kernel::{Interpreter, KernelBuilder};
/// let mut builder = KernelBuilder::new(2);
/// let (x, y, three) = (builder.input(0), builder.input(1), builder.constant(3.0));
/// let value = builder.multiply_add(x, y, three);
/// let kernel = builder.finish(vec![value]);
/// assert_eq!(Interpreter::new(&kernel).evaluate(&[2.0, 5.0]), [13.0]);
/// ```
#[derive(Clone, Debug)]
pub struct KernelBuilder {
    inputs: usize,
    constants: Vec<f64>,
    constant_numbers: HashMap<u64, u32>,
    operations: Vec<Operation>,
    results: HashMap<Operation, u32>,
}

impl KernelBuilder {
    /// An empty kernel with this many inputs.
    pub fn new(inputs: usize) -> Self {
        Self {
            inputs,
            constants: Vec::new(),
            constant_numbers: HashMap::new(),
            operations: Vec::new(),
            results: HashMap::new(),
        }
    }

    /// An input.
    pub fn input(&self, position: usize) -> Value {
        assert!(position < self.inputs, "input {position} of {}", self.inputs);
        Value::Input(position as u32)
    }

    /// A constant.
    pub fn constant(&mut self, value: f64) -> Value {
        let value = if value == 0.0 { 0.0 } else { value };
        let next = self.constants.len() as u32;
        let number = *self.constant_numbers.entry(value.to_bits()).or_insert(next);
        if number == next {
            self.constants.push(value);
        }
        Value::Constant(number)
    }

    /// `a + b`.
    pub fn add(&mut self, a: Value, b: Value) -> Value {
        match (self.known(a), self.known(b)) {
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            (Some(a), Some(b)) => self.constant(a + b),
            _ => self.push(Operation::Add(a, b)),
        }
    }

    /// `a b`.
    pub fn multiply(&mut self, a: Value, b: Value) -> Value {
        match (self.known(a), self.known(b)) {
            (Some(0.0), _) | (_, Some(0.0)) => self.constant(0.0),
            (Some(1.0), _) => b,
            (_, Some(1.0)) => a,
            (Some(a), Some(b)) => self.constant(a * b),
            _ => self.push(Operation::Multiply(a, b)),
        }
    }

    /// `a b + c`.
    pub fn multiply_add(&mut self, a: Value, b: Value, c: Value) -> Value {
        match (self.known(a), self.known(b), self.known(c)) {
            (Some(0.0), ..) | (_, Some(0.0), _) => c,
            (.., Some(0.0)) => self.multiply(a, b),
            (Some(1.0), ..) => self.add(b, c),
            (_, Some(1.0), _) => self.add(a, c),
            _ => self.push(Operation::MultiplyAdd(a, b, c)),
        }
    }

    /// `√max(0, a)`.
    pub fn root_of_positive_part(&mut self, a: Value) -> Value {
        self.push(Operation::RootOfPositivePart(a))
    }

    /// `1/(2a)`, 0 at `a = 0`.
    pub fn half_reciprocal(&mut self, a: Value) -> Value {
        self.push(Operation::HalfReciprocal(a))
    }

    /// `a`, constant under differentiation.
    pub fn held(&mut self, a: Value) -> Value {
        match a {
            Value::Constant(_) => a,
            Value::Input(_) | Value::Result(_) => self.push(Operation::Held(a)),
        }
    }

    /// The finished kernel.
    pub fn finish(self, outputs: Vec<Value>) -> Kernel {
        Kernel {
            inputs: self.inputs,
            constants: self.constants,
            operations: self.operations,
            outputs,
        }
    }

    /// Value of a constant operand; `None` for other operands.
    fn known(&self, value: Value) -> Option<f64> {
        match value {
            Value::Constant(number) => Some(self.constants[number as usize]),
            Value::Input(_) | Value::Result(_) => None,
        }
    }

    /// Appends an operation unchanged, unless the kernel has it already.
    pub(super) fn push(&mut self, operation: Operation) -> Value {
        let next = self.operations.len() as u32;
        let number = *self.results.entry(operation).or_insert(next);
        if number == next {
            self.operations.push(operation);
        }
        Value::Result(number)
    }

    /// Translates a value of another kernel with the same inputs; `renamed` holds the new places of
    /// that kernel's results.
    pub(super) fn import(&mut self, kernel: &Kernel, value: Value, renamed: &[Value]) -> Value {
        match value {
            Value::Input(_) => value,
            Value::Constant(number) => self.constant(kernel.constants[number as usize]),
            Value::Result(number) => renamed[number as usize],
        }
    }
}

/// A polynomial as nested Horner schemes: in the first variable, with coefficients that are Horner
/// schemes in the second, and so on.
///
/// A polynomial with `M` terms that fill a simplex costs `M − 1` multiply-adds; gaps between powers
/// are bridged by powers of the variable, which all polynomials of a kernel share. Variables that
/// are to be frozen come last: then every expression in them alone is a coefficient of the others.
#[derive(Clone, Debug, PartialEq)]
pub struct HornerPlan {
    variables: usize,
    root: HornerScheme,
}

#[derive(Clone, Debug, PartialEq)]
enum HornerScheme {
    Constant(f64),
    /// Coefficients of powers of one variable, highest power first.
    Powers {
        variable: usize,
        coefficients: Vec<(u8, HornerScheme)>,
    },
}

impl HornerPlan {
    /// Plans a polynomial given by its non-zero terms, exponents and coefficient, in any order.
    pub fn new<'a>(variables: usize, terms: impl IntoIterator<Item = (&'a [u8], f64)>) -> Self {
        let mut terms: Vec<(&[u8], f64)> =
            terms.into_iter().filter(|&(_, coefficient)| coefficient != 0.0).collect();
        terms.sort_by(|(left, _), (right, _)| right.cmp(left));
        Self { variables, root: scheme(&terms, 0, variables) }
    }

    /// Plans a jet, read as a polynomial.
    pub fn of_jet(jet: &Jet<f64>) -> Self {
        Self::new(jet.space().variables(), jet.terms())
    }

    /// Appends the evaluation at `point` (one value per variable) to a kernel.
    pub fn lower(&self, builder: &mut KernelBuilder, point: &[Value]) -> Value {
        assert_eq!(point.len(), self.variables, "a point has one value per variable");
        lower(&self.root, builder, point)
    }
}

/// The scheme of terms that agree in the exponents before `variable`, sorted by descending
/// exponents.
fn scheme(terms: &[(&[u8], f64)], variable: usize, variables: usize) -> HornerScheme {
    if variable == variables || terms.is_empty() {
        return HornerScheme::Constant(terms.iter().map(|&(_, coefficient)| coefficient).sum());
    }
    let groups = terms.chunk_by(|(left, _), (right, _)| left[variable] == right[variable]);
    let coefficients: Vec<(u8, HornerScheme)> = groups
        .map(|group| (group[0].0[variable], scheme(group, variable + 1, variables)))
        .collect();
    match <[(u8, HornerScheme); 1]>::try_from(coefficients) {
        Ok([(0, only)]) => only,
        Ok(single) => HornerScheme::Powers { variable, coefficients: single.into() },
        Err(coefficients) => HornerScheme::Powers { variable, coefficients },
    }
}

fn lower(scheme: &HornerScheme, builder: &mut KernelBuilder, point: &[Value]) -> Value {
    let (variable, coefficients) = match scheme {
        HornerScheme::Constant(value) => return builder.constant(*value),
        HornerScheme::Powers { variable, coefficients } => (*variable, coefficients),
    };
    let (mut power, first) = (coefficients[0].0, &coefficients[0].1);
    let mut sum = lower(first, builder, point);
    for (lower_power, coefficient) in &coefficients[1..] {
        let coefficient = lower(coefficient, builder, point);
        let gap = lower_gap(builder, point[variable], power - lower_power);
        sum = builder.multiply_add(sum, gap, coefficient);
        power = *lower_power;
    }
    let rest = lower_gap(builder, point[variable], power);
    builder.multiply(sum, rest)
}

/// `base^exponent` by repeated squaring: at most `2 log₂ exponent` products.
fn lower_gap(builder: &mut KernelBuilder, base: Value, exponent: u8) -> Value {
    match exponent {
        0 => builder.constant(1.0),
        1 => base,
        even if even % 2 == 0 => {
            let root = lower_gap(builder, base, even / 2);
            builder.multiply(root, root)
        }
        odd => {
            let rest = lower_gap(builder, base, odd - 1);
            builder.multiply(rest, base)
        }
    }
}

/// A kernel in two steps: results that depend on the frozen inputs only are computed once and
/// reused.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitKernel {
    /// Kernel from the frozen inputs to the coefficients.
    pub prepare: Kernel,
    /// Kernel from the free inputs, followed by the coefficients, to the outputs.
    pub run: Kernel,
    /// Number of coefficients.
    pub coefficients: usize,
}

impl Kernel {
    /// Splits into the operations that depend only on the inputs from number `free` on (*frozen*),
    /// and the others.
    ///
    /// Running the two kernels in turn does exactly the operations of this kernel.
    pub fn split(&self, free: usize) -> SplitKernel {
        let frozen = self.frozen_results(free);
        let is_frozen = |value: Value| match value {
            Value::Input(number) => number as usize >= free,
            Value::Constant(_) => false,
            Value::Result(number) => frozen[number as usize],
        };
        let mut hoisted: Vec<Value> = Vec::new();
        let users = (0..self.operations.len()).filter(|&number| !frozen[number]);
        let used = users
            .flat_map(|number| self.operations[number].operands())
            .chain(self.outputs.iter().copied());
        for value in used.filter(|&value| is_frozen(value)) {
            if !hoisted.contains(&value) {
                hoisted.push(value);
            }
        }
        hoisted.sort_unstable();
        SplitKernel {
            prepare: self.prepare(free, &hoisted),
            run: self.rest(free, &hoisted, &frozen),
            coefficients: hoisted.len(),
        }
    }

    /// Marks the results that depend on frozen inputs and constants only.
    pub(super) fn frozen_results(&self, free: usize) -> Vec<bool> {
        let mut frozen: Vec<bool> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let all = operation.operands().all(|operand| match operand {
                Value::Input(number) => number as usize >= free,
                Value::Constant(_) => true,
                Value::Result(number) => frozen[number as usize],
            });
            frozen.push(all);
        }
        frozen
    }

    fn prepare(&self, free: usize, hoisted: &[Value]) -> Kernel {
        let shift = |value: Value| match value {
            Value::Input(number) => Value::Input(number.saturating_sub(free as u32)),
            other => other,
        };
        let mut whole = self.clone();
        whole.outputs = hoisted.to_vec();
        let mut kernel = whole.without_dead_operations();
        kernel.inputs = self.inputs - free;
        kernel
            .operations
            .iter_mut()
            .for_each(|operation| *operation = operation.with_operands(shift));
        kernel.outputs.iter_mut().for_each(|output| *output = shift(*output));
        kernel
    }

    fn rest(&self, free: usize, hoisted: &[Value], frozen: &[bool]) -> Kernel {
        let mut builder = KernelBuilder::new(free + hoisted.len());
        let mut renamed: Vec<Value> = Vec::with_capacity(self.operations.len());
        let place = |value: Value, builder: &mut KernelBuilder, renamed: &[Value]| match hoisted
            .binary_search(&value)
        {
            Ok(position) => builder.input(free + position),
            Err(_) => builder.import(self, value, renamed),
        };
        for (operation, &frozen) in self.operations.iter().zip(frozen) {
            renamed.push(if frozen {
                builder.constant(0.0)
            } else {
                let moved = operation.with_operands(|value| place(value, &mut builder, &renamed));
                builder.push(moved)
            });
        }
        let outputs =
            self.outputs.iter().map(|&output| place(output, &mut builder, &renamed)).collect();
        builder.finish(outputs).without_dead_operations()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    fn kernel_of(plan: &HornerPlan) -> super::Kernel {
        let mut builder = KernelBuilder::new(plan.variables);
        let point: Vec<Value> =
            (0..plan.variables).map(|position| builder.input(position)).collect();
        let value = plan.lower(&mut builder, &point);
        builder.finish(vec![value])
    }

    #[test]
    fn integer_polynomials_are_exact() {
        let terms: [(&[u8], f64); 4] =
            [(&[3, 1], 2.0), (&[1, 0], -1.0), (&[0, 4], 5.0), (&[0, 0], 7.0)];
        let kernel = kernel_of(&HornerPlan::new(2, terms));
        let (x, y) = (3.0f64, -2.0f64);
        let expected = 2.0 * x.powi(3) * y - x + 5.0 * y.powi(4) + 7.0;
        assert_eq!(Interpreter::new(&kernel).evaluate(&[x, y]), [expected]);
    }

    #[test]
    fn a_full_polynomial_costs_a_multiply_add_per_term_but_one() {
        let space = JetSpace::uniform(3, 5).unwrap();
        let coefficients = (0..space.len()).map(|number| 2.0 + number as f64).collect();
        let kernel = kernel_of(&HornerPlan::of_jet(&Jet::from_coefficients(&space, coefficients)));
        assert_eq!(kernel.count().multiply_adds, space.len() - 1);
        assert_eq!(kernel.count().total(), space.len() - 1);
    }

    #[test]
    fn the_empty_polynomial_is_zero() {
        let kernel = kernel_of(&HornerPlan::new(2, []));
        assert_eq!(Interpreter::new(&kernel).evaluate(&[1.0, 1.0]), [0.0]);
    }

    #[test]
    fn the_two_halves_do_what_the_whole_does() {
        let mut builder = KernelBuilder::new(3);
        let (x, p, q) = (builder.input(0), builder.input(1), builder.input(2));
        let five = builder.constant(5.0);
        let frozen = builder.multiply_add(p, q, five);
        let free = builder.multiply_add(x, frozen, q);
        let kernel = builder.finish(vec![free, frozen, x]);
        let split = kernel.split(1);
        assert_eq!(split.coefficients, 2);
        assert_eq!(split.run.count().total(), 1);
        let coefficients = Interpreter::new(&split.prepare).evaluate(&[3.0, 4.0]);
        let bound = Unset::new(&split.run, 1).set(&coefficients);
        assert_eq!(bound.evaluate(&[2.0]), Interpreter::new(&kernel).evaluate(&[2.0, 3.0, 4.0]));
    }

    #[test]
    fn derivatives_follow_the_rules() {
        let mut builder = KernelBuilder::new(2);
        let (x, p) = (builder.input(0), builder.input(1));
        let square = builder.multiply(x, x);
        let cubic = builder.multiply_add(square, x, p);
        let root = builder.root_of_positive_part(cubic);
        let jacobian = builder.finish(vec![cubic, root]).with_jacobian(2, 1);
        let values = Interpreter::new(&jacobian).evaluate(&[2.0, 1.0]);
        assert_eq!(values, [9.0, 3.0, 12.0, 2.0]);
        let below = Interpreter::new(&jacobian).evaluate(&[-2.0, 1.0]);
        assert_eq!(below, [-7.0, 0.0, 12.0, 0.0]);
    }

    #[test]
    fn a_tangent_is_the_jacobian_times_the_vector() {
        let mut builder = KernelBuilder::new(3);
        let (x, y, p) = (builder.input(0), builder.input(1), builder.input(2));
        let product = builder.multiply(x, y);
        let sum = builder.multiply_add(product, x, p);
        let root = builder.root_of_positive_part(sum);
        let kernel = builder.finish(vec![sum, root, y]);
        let (point, vector, parameter) = ([2.0, 3.0], [0.5, -1.0], 4.0);
        let dual = |input: usize| Dual { value: point[input], slope: vector[input] };
        let found = Interpreter::new(&kernel).evaluate(&[dual(0), dual(1), Dual::of(parameter)]);
        let found: Vec<[f64; 2]> = found.iter().map(|dual| [dual.value, dual.slope]).collect();
        // x²y + p = 16, its derivative 2xy/2 − x² = 2; that of the root 2/(2·4).
        assert_eq!(found, [[16.0, 2.0], [4.0, 0.25], [3.0, -1.0]]);
        // The same numbers from one kernel: the gradient of every output, then its slope.
        let inputs = [point, vector].concat();
        let whole = kernel.with_tangent(3, 2);
        let values = Interpreter::new(&whole).evaluate(&[&inputs[..], &[parameter]].concat());
        let rows = [12.0, 4.0, 2.0, 1.5, 0.5, 0.25, 0.0, 1.0, -1.0];
        assert_eq!(values, [&[16.0, 4.0, 3.0][..], &rows].concat());
    }

    #[test]
    fn a_tangent_beside_the_jacobian_rounds_as_dual_numbers_do() {
        let mut builder = KernelBuilder::new(3);
        let (x, y, p) = (builder.input(0), builder.input(1), builder.input(2));
        let inner = builder.multiply_add(x, p, y);
        let held = builder.held(inner);
        let square = builder.multiply_add(inner, inner, p);
        let root = builder.root_of_positive_part(square);
        let share = builder.half_reciprocal(root);
        let first = builder.multiply_add(share, x, held);
        let second = builder.multiply(root, y);
        let kernel = builder.finish(vec![first, second, root]);
        let split = kernel.with_tangent(2, 2).split(4);
        for n in 1..50 {
            let at = |shift: f64| (f64::from(n) * 0.731 + shift).sin();
            let (point, vector, parameter) = ([at(0.1), at(0.7)], [at(1.3), at(2.9)], at(0.4));
            let dual = |input: usize| Dual { value: point[input], slope: vector[input] };
            let interpreter = Interpreter::new(&kernel);
            let expected = interpreter.evaluate(&[dual(0), dual(1), Dual::of(parameter)]);
            let coefficients = Interpreter::new(&split.prepare).evaluate(&[parameter]);
            let bound = Unset::new(&split.run, 4).set(&coefficients);
            let found = bound.evaluate(&[point, vector].concat());
            let slopes = [found[5], found[8]];
            assert_eq!(found[..3], [0, 1, 2].map(|output| expected[output].value));
            assert_eq!(slopes, [0, 1].map(|output| expected[output].slope));
        }
    }

    #[test]
    fn a_held_value_is_a_constant_to_the_jacobian_and_costs_nothing() {
        let mut builder = KernelBuilder::new(1);
        let x = builder.input(0);
        let square = builder.multiply(x, x);
        let held = builder.held(square);
        let product = builder.multiply(held, x);
        let kernel = builder.finish(vec![product]);
        assert_eq!(Interpreter::new(&kernel).evaluate(&[3.0]), [27.0]);
        let jacobian = kernel.with_jacobian(1, 1);
        assert_eq!(Interpreter::new(&jacobian).evaluate(&[3.0]), [27.0, 9.0]);
        assert_eq!(kernel.count().total(), 2);
        assert_eq!(jacobian.operations.len(), 2);
    }
}
