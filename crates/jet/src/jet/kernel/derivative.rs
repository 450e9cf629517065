//! Forward differentiation of a kernel: the kernel of values and partial derivatives.

use super::schemes::{link, uses};
use super::{Kernel, KernelBuilder, Operation, Value};

/// The derivatives of an input by every direction.
type Seed<'a> = &'a dyn Fn(&mut KernelBuilder, u32) -> Vec<Value>;

/// Whether a direction takes the factors of a multiply-add in turn.
type Turned<'a> = &'a dyn Fn(usize, usize) -> bool;

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
        let seed = |builder: &mut KernelBuilder, input| {
            let one = |column| builder.constant(f64::from(u8::from(input as usize == column)));
            (0..columns).map(one).collect()
        };
        self.differentiated(rows, &seed, &|_, _| false)
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
        let turned = spread.operations.iter().map(|operation| {
            let sum = link(operation, once).map(|[sum, ..]| sum);
            sum.is_some() && sum != operation.operands().next()
        });
        let turned: Vec<bool> = turned.collect();
        spread.inputs += columns;
        for operation in &mut spread.operations {
            *operation = operation.with_operands(shift);
        }
        spread.outputs.iter_mut().for_each(|output| *output = shift(*output));
        let seed = |builder: &mut KernelBuilder, input: u32| {
            let one = |column| builder.constant(f64::from(u8::from(input as usize == column)));
            let mut row: Vec<Value> = (0..columns).map(one).collect();
            row.push(match input < first {
                true => builder.input((input + first) as usize),
                false => builder.constant(0.0),
            });
            row
        };
        spread.differentiated(rows, &seed, &|number, direction| {
            direction == columns && turned[number]
        })
    }

    /// The kernel with the derivatives of the first `rows` outputs by every direction of the seeds;
    /// `turned` says of which multiply-adds a direction takes the factors in turn.
    fn differentiated(&self, rows: usize, seed: Seed<'_>, turned: Turned<'_>) -> Self {
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
        for (number, operation) in self.operations.iter().enumerate() {
            let moved = operation.with_operands(|value| builder.import(self, value, &values));
            if let Operation::Held(value) = moved {
                values.push(value);
                slopes.push(none.clone());
                continue;
            }
            let result = builder.push(moved);
            let operands: Vec<Value> = operation.operands().collect();
            let along = |direction| {
                let mut order = [0, 1, 2];
                let mut moved = moved;
                if let (Operation::MultiplyAdd(a, b, c), true) = (moved, turned(number, direction))
                {
                    (moved, order) = (Operation::MultiplyAdd(b, a, c), [1, 0, 2]);
                }
                let operand = |operand: usize| operands[order[operand]];
                let slope = |place| slope(operand(place), direction, &slopes);
                differentiate(&mut builder, moved, result, slope)
            };
            let row = (0..directions).map(along).collect();
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

/// The derivative of one operation's result; `slope(operand)` gives its operands'.
fn differentiate(
    builder: &mut KernelBuilder,
    operation: Operation,
    result: Value,
    slope: impl Fn(usize) -> Value,
) -> Value {
    match operation {
        Operation::Add(..) => builder.add(slope(0), slope(1)),
        Operation::Multiply(a, b) => {
            let second = builder.multiply(a, slope(1));
            builder.multiply_add(slope(0), b, second)
        }
        Operation::MultiplyAdd(a, b, _) => {
            let second = builder.multiply_add(a, slope(1), slope(2));
            builder.multiply_add(slope(0), b, second)
        }
        Operation::RootOfPositivePart(_) => {
            let outer = builder.half_reciprocal(result);
            builder.multiply(slope(0), outer)
        }
        Operation::HalfReciprocal(_) => {
            let minus_two = builder.constant(-2.0);
            let square = builder.multiply(result, result);
            let outer = builder.multiply(minus_two, square);
            builder.multiply(slope(0), outer)
        }
        Operation::Held(_) => builder.constant(0.0),
    }
}
