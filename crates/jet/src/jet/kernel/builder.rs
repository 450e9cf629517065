//! Building a kernel: equal operations share one result, trivial ones vanish.

use std::collections::HashMap;

use super::{Kernel, Operation, Value};

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
        assert!(
            position < self.inputs,
            "input {position} of {}",
            self.inputs
        );
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
