//! Forward differentiation of a kernel: the kernel of values and partial derivatives.

use super::schemes::{link, uses};
use super::{Kernel, KernelBuilder, Operation, Value};

/// The derivatives of an input by every direction.
type Seed<'a> = &'a dyn Fn(&mut KernelBuilder, u32) -> Vec<Value>;

impl Kernel {
    /// The kernel that returns this kernel's outputs, and then the derivative of each of the
    /// first `rows` outputs by each of the first `columns` inputs, row by row.
    ///
    /// The rules, with `a'` the derivative of `a`:
    ///
    /// ```text
    /// (a b + c)' = a' b + a b' + c',
    /// (√max(0, a))' = a' / (2 √max(0, a)), 0 where the root is 0,
    /// (1/(2a))' = −2 (1/(2a))² a'
    /// ```
    ///
    /// Held values have no derivative, and are no operations of their own any more.
    ///
    /// Derivatives that are 0 or 1 whatever the inputs cost nothing.
    pub fn with_jacobian(&self, rows: usize, columns: usize) -> Self {
        self.differentiated(rows, &|builder, input| {
            let one = |column| builder.constant(f64::from(u8::from(input as usize == column)));
            (0..columns).map(one).collect()
        })
    }

    /// The same, and after the derivatives of each of the first `rows` outputs that along a tangent
    /// vector, whose components are `columns` further inputs after the first `columns`.
    ///
    /// It rounds as a kernel does that runs on [`Dual`](super::Dual) numbers.
    pub fn with_tangent(&self, rows: usize, columns: usize) -> Self {
        let first = columns as u32;
        let shift = |value: Value| match value {
            Value::Input(number) if number >= first => Value::Input(number + first),
            other => other,
        };
        let mut spread = self.without_dead_operations();
        let (frozen, uses) = (spread.frozen_results(columns), uses(&spread));
        // NOTE: schemes multiply the sum by the factor, and a slope is rounded in that order.
        let once = |value: Value| match value {
            Value::Result(number) => !frozen[number as usize] && uses[number as usize] == 1,
            Value::Input(_) | Value::Constant(_) => false,
        };
        for operation in &mut spread.operations {
            if let Some([sum, factor, addend]) = link(operation, once) {
                *operation = Operation::MultiplyAdd(sum, factor, addend);
            }
        }
        spread.inputs += columns;
        for operation in &mut spread.operations {
            *operation = operation.with_operands(shift);
        }
        spread.outputs.iter_mut().for_each(|output| *output = shift(*output));
        spread.differentiated(rows, &|builder, input| {
            let one = |column| builder.constant(f64::from(u8::from(input as usize == column)));
            let mut row: Vec<Value> = (0..columns).map(one).collect();
            row.push(match input < first {
                true => builder.input((input + first) as usize),
                false => builder.constant(0.0),
            });
            row
        })
    }

    /// The kernel with the derivatives of the first `rows` outputs by every direction of the seeds.
    fn differentiated(&self, rows: usize, seed: Seed<'_>) -> Self {
        let mut builder = KernelBuilder::new(self.inputs);
        let seeds: Vec<Vec<Value>> =
            (0..self.inputs as u32).map(|input| seed(&mut builder, input)).collect();
        let directions = seeds.first().map_or(0, Vec::len);
        let none = vec![builder.constant(0.0); directions];
        let mut values: Vec<Value> = Vec::with_capacity(self.operations.len());
        let mut slopes: Vec<Vec<Value>> = Vec::with_capacity(self.operations.len());
        let slope = |value: Value, direction: usize, slopes: &[Vec<Value>]| match value {
            Value::Result(number) => slopes[number as usize][direction],
            Value::Input(number) => seeds[number as usize][direction],
            Value::Constant(_) => none[direction],
        };
        for operation in &self.operations {
            let moved = operation.with_operands(|value| builder.import(self, value, &values));
            if let Operation::Held(value) = moved {
                values.push(value);
                slopes.push(none.clone());
                continue;
            }
            let result = builder.push(moved);
            let operands: Vec<Value> = operation.operands().collect();
            let row =
                differentiate(&mut builder, moved, result, directions, |operand, direction| {
                    slope(operands[operand], direction, &slopes)
                });
            values.push(result);
            slopes.push(row);
        }
        let outputs = self.outputs.iter();
        let mut outputs: Vec<Value> =
            outputs.map(|&output| builder.import(self, output, &values)).collect();
        for &output in &self.outputs[..rows] {
            outputs.extend((0..directions).map(|direction| slope(output, direction, &slopes)));
        }
        builder.finish(outputs).without_dead_operations()
    }
}

/// Derivatives of one operation's result by every direction; `slope(operand, direction)` gives its
/// operands'.
fn differentiate(
    builder: &mut KernelBuilder,
    operation: Operation,
    result: Value,
    directions: usize,
    slope: impl Fn(usize, usize) -> Value,
) -> Vec<Value> {
    let one = |builder: &mut KernelBuilder, direction: usize| match operation {
        Operation::Add(..) => {
            let (a, b) = (slope(0, direction), slope(1, direction));
            builder.add(a, b)
        }
        Operation::Multiply(a, b) => {
            let (slope_a, slope_b) = (slope(0, direction), slope(1, direction));
            let second = builder.multiply(a, slope_b);
            builder.multiply_add(slope_a, b, second)
        }
        Operation::MultiplyAdd(a, b, _) => {
            let (slope_a, slope_b) = (slope(0, direction), slope(1, direction));
            let constant = slope(2, direction);
            let second = builder.multiply_add(a, slope_b, constant);
            builder.multiply_add(slope_a, b, second)
        }
        Operation::RootOfPositivePart(_) => {
            let (inner, outer) = (slope(0, direction), builder.half_reciprocal(result));
            builder.multiply(inner, outer)
        }
        Operation::HalfReciprocal(_) => {
            let (inner, minus_two) = (slope(0, direction), builder.constant(-2.0));
            let square = builder.multiply(result, result);
            let outer = builder.multiply(minus_two, square);
            builder.multiply(inner, outer)
        }
        Operation::Held(_) => builder.constant(0.0),
    };
    (0..directions).map(|direction| one(builder, direction)).collect()
}
