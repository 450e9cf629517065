//! Forward differentiation of a kernel: the kernel of values and partial derivatives.

use super::{Kernel, KernelBuilder, Operation, Value};

impl Kernel {
    /// The kernel that hands back this kernel's outputs, and then the derivative of each of the first
    /// `rows` outputs by each of the first `columns` inputs, row by row.
    ///
    /// The rules, with `a'` the derivative of `a`:
    ///
    /// ```text
    /// (a b + c)' = a' b + a b' + c',     (√max(0, a))' = a' / (2 √max(0, a)), 0 where the root is 0,
    /// (1/(2a))' = −2 (1/(2a))² a'
    /// ```
    ///
    /// Held values have no derivative, and are no operations of their own any more.
    ///
    /// Derivatives that are 0 or 1 whatever the inputs cost nothing.
    pub fn with_jacobian(&self, rows: usize, columns: usize) -> Self {
        let mut builder = KernelBuilder::new(self.inputs);
        let mut values: Vec<Value> = Vec::with_capacity(self.operations.len());
        let mut slopes: Vec<Vec<Value>> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let moved = operation.with_operands(|value| builder.import(self, value, &values));
            if let Operation::Held(value) = moved {
                values.push(value);
                slopes.push(vec![builder.constant(0.0); columns]);
                continue;
            }
            let result = builder.push(moved);
            let operands: Vec<Value> = operation.operands().collect();
            let row = differentiate(
                &mut builder,
                moved,
                result,
                columns,
                |builder, operand, column| slope(builder, operands[operand], column, &slopes),
            );
            values.push(result);
            slopes.push(row);
        }
        let mut outputs: Vec<Value> = self
            .outputs
            .iter()
            .map(|&output| builder.import(self, output, &values))
            .collect();
        for &output in &self.outputs[..rows] {
            outputs.extend((0..columns).map(|column| slope(&mut builder, output, column, &slopes)));
        }
        builder.finish(outputs).without_dead_operations()
    }
}

/// Derivative of a value by input `column`.
fn slope(builder: &mut KernelBuilder, value: Value, column: usize, slopes: &[Vec<Value>]) -> Value {
    match value {
        Value::Result(number) => slopes[number as usize][column],
        Value::Input(number) if number as usize == column => builder.constant(1.0),
        Value::Input(_) | Value::Constant(_) => builder.constant(0.0),
    }
}

/// Derivatives of one operation's result by every column; `slope(operand, column)` gives its operands'.
fn differentiate(
    builder: &mut KernelBuilder,
    operation: Operation,
    result: Value,
    columns: usize,
    slope: impl Fn(&mut KernelBuilder, usize, usize) -> Value,
) -> Vec<Value> {
    let one = |builder: &mut KernelBuilder, column: usize| match operation {
        Operation::Add(..) => {
            let (a, b) = (slope(builder, 0, column), slope(builder, 1, column));
            builder.add(a, b)
        }
        Operation::Multiply(a, b) => {
            let (slope_a, slope_b) = (slope(builder, 0, column), slope(builder, 1, column));
            let second = builder.multiply(a, slope_b);
            builder.multiply_add(slope_a, b, second)
        }
        Operation::MultiplyAdd(a, b, _) => {
            let (slope_a, slope_b) = (slope(builder, 0, column), slope(builder, 1, column));
            let constant = slope(builder, 2, column);
            let second = builder.multiply_add(a, slope_b, constant);
            builder.multiply_add(slope_a, b, second)
        }
        Operation::RootOfPositivePart(_) => {
            let (inner, outer) = (slope(builder, 0, column), builder.half_reciprocal(result));
            builder.multiply(inner, outer)
        }
        Operation::HalfReciprocal(_) => {
            let (inner, minus_two) = (slope(builder, 0, column), builder.constant(-2.0));
            let square = builder.multiply(result, result);
            let outer = builder.multiply(minus_two, square);
            builder.multiply(inner, outer)
        }
        Operation::Held(_) => builder.constant(0.0),
    };
    (0..columns).map(|column| one(builder, column)).collect()
}
