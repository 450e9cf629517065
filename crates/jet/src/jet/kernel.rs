//! Straight-line kernels: what a map does to its inputs, one multiply-add after another.
//!
//! One idea: a map is lowered once to a list of elementary operations; an interpreter runs the
//! list, the emitter prints it, differentiation and freezing rewrite it. All of them therefore
//! round alike. See docs/mathematics/evaluation.md.

mod builder;
mod code;
mod derivative;
mod horner;
mod interpreter;
mod lane_interpreter;
mod number;
mod places;
mod schemes;
mod split;

pub use builder::KernelBuilder;
pub use horner::HornerPlan;
pub use interpreter::{Interpreted, Interpreter, Unset};
pub use lane_interpreter::LaneInterpreter;
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
    /// What the kernel hands back.
    pub outputs: Vec<Value>,
}

/// How many operations of each kind a kernel runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCount {
    /// Multiply-adds.
    pub multiply_adds: usize,
    /// Products alone.
    pub products: usize,
    /// Sums alone.
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
        self.outputs
            .iter()
            .for_each(|&output| mark(output, &mut needed));
        for number in (0..self.operations.len()).rev() {
            if needed[number] {
                self.operations[number]
                    .operands()
                    .for_each(|operand| mark(operand, &mut needed));
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
        let outputs = self
            .outputs
            .iter()
            .map(|&output| builder.import(self, output, &renamed))
            .collect();
        builder.finish(outputs)
    }
}
