//! Straight-line kernels: a map as a list of operations on its inputs.
//!
//! One idea: a map is lowered once to a list of elementary operations; an interpreter runs the
//! list, the emitter prints it, differentiation and freezing rewrite it. All of them therefore
//! round alike. See docs/mathematics/evaluation.md.

mod code;
mod derivative;
mod horner;
mod interpreter;
mod number;
mod schemes;
mod split;

use std::collections::HashMap;

pub use horner::HornerPlan;
pub use interpreter::{Interpreted, Interpreter, LaneInterpreter, Unset};
pub use number::{Dual, Number};
pub use split::SplitKernel;

/// An operand: where a number comes from.
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
    /// `a`, a constant to differentiation: a choice on which no result depends.
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

    /// The same operation on other operands.
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

/// How many operations of each kind a kernel runs.
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
    /// All of them.
    pub fn total(&self) -> usize {
        self.multiply_adds + self.products + self.sums + self.roots
    }
}

impl Kernel {
    /// How many operations of each kind run.
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
/// Products by 0 and 1 and sums with 0 are resolved while building; an operation that already
/// stands in the kernel is not repeated.
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

    /// `a`, a constant to differentiation.
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

    /// Number a value of a constant operand.
    fn known(&self, value: Value) -> Option<f64> {
        match value {
            Value::Constant(number) => Some(self.constants[number as usize]),
            Value::Input(_) | Value::Result(_) => None,
        }
    }

    /// Appends an operation as it stands, unless it is there already.
    pub(super) fn push(&mut self, operation: Operation) -> Value {
        let next = self.operations.len() as u32;
        let number = *self.results.entry(operation).or_insert(next);
        if number == next {
            self.operations.push(operation);
        }
        Value::Result(number)
    }

    /// A value of another kernel with the same inputs, whose results have been given new places.
    pub(super) fn import(&mut self, kernel: &Kernel, value: Value, renamed: &[Value]) -> Value {
        match value {
            Value::Input(_) => value,
            Value::Constant(number) => self.constant(kernel.constants[number as usize]),
            Value::Result(number) => renamed[number as usize],
        }
    }
}
