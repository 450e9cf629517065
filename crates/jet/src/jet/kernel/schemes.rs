//! Horner schemes in a kernel, and the order in which they run.
//!
//! The one idea: a multiply-add whose result is used only by the next one needs no place in memory.
//! Multiply-adds with one factor make a chain; a chain whose addends are chains in another factor,
//! all of known values, is a polynomial in two variables. Its values are read in sequence, in the
//! order in which they are needed. The longest chain of dependent operations runs first, and
//! schemes of one shape run together: two schemes of one shape run at once, and the processor's
//! branch prediction is right.

use std::cmp::Reverse;

use super::{Kernel, KernelBuilder, Operation, Value};

/// `(…((r₀ · factor + r₁) · factor + r₂) …) · factor + r_n`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scheme {
    pub(super) factor: Value,
    pub(super) rows: Rows,
}

/// The addends of the multiply-adds of a scheme.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Rows {
    /// Any values.
    Values(Vec<Value>),
    /// Chains of known values in another factor: the start of each chain, then its addends.
    Known(Value, Vec<Vec<Value>>),
}

/// Operations that run at once.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// An operation that is not a multiply-add, and its number.
    Operation(usize, Operation),
    /// A scheme and the operation whose result it gives; or two such pairs with the same factors
    /// and lengths, neither of which needs the result of the other.
    Schemes(Vec<(usize, Scheme)>),
}

/// All steps of a kernel, each after the steps whose results it needs.
///
/// Inputs from number `free` on are known, as constants are.
pub(super) fn schedule(kernel: &Kernel, free: usize) -> Vec<Step> {
    let parts = Parts::of(kernel, free);
    let heights = parts.heights();
    let parts = parts.0.into_iter().enumerate();
    let mut parts: Vec<(usize, Part)> =
        parts.filter_map(|(number, part)| Some((number, part?))).collect();
    parts.sort_by_cached_key(|(number, part)| (Reverse(heights[*number]), part.shape()));
    let mut steps: Vec<Step> = Vec::new();
    for (number, part) in parts {
        let scheme = match part {
            Part::Operation(operation) => {
                steps.push(Step::Operation(number, operation));
                continue;
            }
            Part::Scheme(scheme) => scheme,
        };
        match steps.last_mut() {
            // Two parts of the same height do not depend on each other.
            Some(Step::Schemes(last))
                if last.len() == 1
                    && heights[last[0].0] == heights[number]
                    && last[0].1.shape() == scheme.shape() =>
            {
                last.push((number, scheme));
            }
            _ => steps.push(Step::Schemes(vec![(number, scheme)])),
        }
    }
    steps
}

impl Step {
    /// Numbers of the operations whose results the step gives.
    pub(super) fn numbers(&self) -> Vec<usize> {
        match self {
            Self::Operation(number, _) => vec![*number],
            Self::Schemes(schemes) => schemes.iter().map(|(number, _)| *number).collect(),
        }
    }
}

/// The operation or scheme that computes a result.
#[derive(Clone, Debug)]
enum Part {
    Operation(Operation),
    Scheme(Scheme),
}

impl Part {
    fn operands(&self) -> Vec<Value> {
        match self {
            Self::Operation(operation) => operation.operands().collect(),
            Self::Scheme(scheme) => scheme.operands(),
        }
    }

    /// Shape of a scheme; `None` for an operation.
    fn shape(&self) -> Option<Shape> {
        match self {
            Self::Operation(_) => None,
            Self::Scheme(scheme) => Some(scheme.shape()),
        }
    }

    /// Approximate duration, in multiply-adds.
    fn latency(&self) -> usize {
        match self {
            Self::Operation(Operation::RootOfPositivePart(_) | Operation::HalfReciprocal(_)) => 4,
            Self::Operation(_) => 1,
            Self::Scheme(scheme) => scheme.len(),
        }
    }
}

impl Scheme {
    fn len(&self) -> usize {
        match &self.rows {
            Rows::Values(values) => values.len(),
            Rows::Known(_, rows) => rows.len(),
        }
    }

    /// Values that the scheme computes; empty if its values are known beforehand.
    pub(super) fn values(&self) -> &[Value] {
        match &self.rows {
            Rows::Values(values) => values,
            Rows::Known(..) => &[],
        }
    }

    /// Rows of known values; empty for a scheme of other values.
    pub(super) fn rows(&self) -> &[Vec<Value>] {
        match &self.rows {
            Rows::Values(_) => &[],
            Rows::Known(_, rows) => rows,
        }
    }

    fn operands(&self) -> Vec<Value> {
        match &self.rows {
            Rows::Values(values) => [&[self.factor], &values[..]].concat(),
            Rows::Known(inner, _) => vec![self.factor, *inner],
        }
    }

    /// Known values of the scheme as one chain, if every row has one value.
    fn row(&self) -> Option<Vec<Value>> {
        match &self.rows {
            Rows::Known(_, rows) if rows.iter().all(|row| row.len() == 1) => Some(rows.concat()),
            _ => None,
        }
    }

    fn shape(&self) -> Shape {
        let (lengths, inner) = match &self.rows {
            Rows::Values(values) => (vec![values.len()], None),
            Rows::Known(inner, rows) => (rows.iter().map(Vec::len).collect(), Some(*inner)),
        };
        Shape { lengths, factor: self.factor, inner }
    }
}

/// The factors and lengths that two schemes must share to run at once.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Shape {
    /// Number of values, or lengths of the rows.
    lengths: Vec<usize>,
    factor: Value,
    /// Factor of the rows.
    inner: Option<Value>,
}

/// The part that computes each result of a kernel; `None` for a result inside a scheme.
struct Parts(Vec<Option<Part>>);

impl Parts {
    fn of(kernel: &Kernel, free: usize) -> Self {
        let uses = uses(kernel);
        let links = links(kernel, &uses);
        let absorbed = absorbed(&links, &uses);
        let mut parts = Self(Vec::with_capacity(kernel.operations.len()));
        for (number, &operation) in kernel.operations.iter().enumerate() {
            let part = match chain(&links, &absorbed, number) {
                _ if absorbed[number] => None,
                None => Some(Part::Operation(operation)),
                Some((factor, values)) => {
                    let rows = parts.nested(factor, &values, &uses, free);
                    let rows = rows.unwrap_or(Rows::Values(values));
                    Some(Part::Scheme(Scheme { factor, rows }))
                }
            };
            parts.0.push(part);
        }
        parts
    }

    /// Rows of known values, if each value is known or is the result of a scheme of known values in
    /// one factor that is used by this chain only.
    fn nested(
        &mut self,
        factor: Value,
        values: &[Value],
        uses: &[usize],
        free: usize,
    ) -> Option<Rows> {
        let is_known = |value: &Value| match *value {
            Value::Input(number) => number as usize >= free,
            Value::Constant(_) => true,
            Value::Result(_) => false,
        };
        let mut inner = None;
        let mut rows = Vec::with_capacity(values.len());
        for value in values {
            rows.push(match *value {
                Value::Result(number) => match &self.0[number as usize] {
                    Some(Part::Scheme(scheme))
                        if uses[number as usize] == 1
                            && inner.is_none_or(|inner| inner == scheme.factor) =>
                    {
                        inner = Some(scheme.factor);
                        scheme.row()?
                    }
                    _ => return None,
                },
                value if is_known(&value) => vec![value],
                _ => return None,
            });
        }
        for value in values {
            if let Value::Result(number) = *value {
                self.0[number as usize] = None;
            }
        }
        Some(Rows::Known(inner.unwrap_or(factor), rows))
    }

    /// Length of the longest chain of dependent operations from each result on, in multiply-adds.
    fn heights(&self) -> Vec<usize> {
        let mut heights = vec![0; self.0.len()];
        for (number, part) in self.0.iter().enumerate().rev() {
            let Some(part) = part else { continue };
            let height = heights[number] + part.latency();
            heights[number] = height;
            for operand in part.operands() {
                if let Value::Result(operand) = operand {
                    let before = &mut heights[operand as usize];
                    *before = height.max(*before);
                }
            }
        }
        heights
    }
}

/// Sum, factor and addend of every multiply-add. The sum is the first operand of the product,
/// unless only the second is used nowhere else.
fn links(kernel: &Kernel, uses: &[usize]) -> Vec<Option<[Value; 3]>> {
    let once = |value: Value| matches!(value, Value::Result(number) if uses[number as usize] == 1);
    kernel.operations.iter().map(|operation| link(operation, once)).collect()
}

/// Sum, factor and addend of a multiply-add; `once` tells whether a value is used nowhere else.
fn link(operation: &Operation, once: impl Fn(Value) -> bool) -> Option<[Value; 3]> {
    match *operation {
        Operation::MultiplyAdd(a, b, c) if once(b) && !once(a) => Some([b, a, c]),
        Operation::MultiplyAdd(a, b, c) => Some([a, b, c]),
        _ => None,
    }
}

/// Factor and values of the chain that gives the result of a multiply-add, the start first.
fn chain(
    links: &[Option<[Value; 3]>],
    absorbed: &[bool],
    number: usize,
) -> Option<(Value, Vec<Value>)> {
    let [mut start, factor, addend] = links[number]?;
    let mut values = vec![addend];
    while let Value::Result(sum) = start
        && absorbed[sum as usize]
        && let Some([before, _, addend]) = links[sum as usize]
    {
        values.push(addend);
        start = before;
    }
    values.push(start);
    values.reverse();
    Some((factor, values))
}

/// Number of uses of each result, as an operand or an output.
pub(super) fn uses(kernel: &Kernel) -> Vec<usize> {
    let mut uses = vec![0; kernel.operations.len()];
    let operands = kernel.operations.iter().flat_map(Operation::operands);
    for value in operands.chain(kernel.outputs.iter().copied()) {
        if let Value::Result(number) = value {
            uses[number as usize] += 1;
        }
    }
    uses
}

/// Marks multiply-adds whose result is used once, as the sum of a multiply-add with the same
/// factor.
fn absorbed(links: &[Option<[Value; 3]>], uses: &[usize]) -> Vec<bool> {
    let mut absorbed = vec![false; links.len()];
    for link in links.iter().flatten() {
        if let [Value::Result(sum), factor, _] = *link
            && let Some([_, own, _]) = links[sum as usize]
        {
            absorbed[sum as usize] = own == factor && uses[sum as usize] == 1;
        }
    }
    absorbed
}

/// Derivatives of an input in every direction.
type Seed<'a> = &'a dyn Fn(&mut KernelBuilder, u32) -> Vec<Value>;

/// Tells, by index of an operation and of a direction, whether the derivative of the multiply-add
/// `a b + c` in that direction is formed as that of `b a + c`, which rounds in another order.
type Turned<'a> = &'a dyn Fn(usize, usize) -> bool;

impl Kernel {
    /// The kernel that returns this kernel's outputs, and then the derivative of each of the first
    /// `rows` outputs by each of the first `columns` inputs, row by row.
    ///
    /// The rules, with `a'` the derivative of `a`:
    ///
    /// ```text
    /// (a b + c)' = a' b + a b' + c',
    /// (√max(0, a))' = a' / (2 √max(0, a)), 0 where the root is 0,
    /// (1/(2a))' = −2 (1/(2a))² a'
    /// ```
    ///
    /// Held values have no derivative, and the new kernel has no operations for them.
    ///
    /// Derivatives that are 0 or 1 for all inputs cost nothing.
    pub fn with_jacobian(&self, rows: usize, columns: usize) -> Self {
        let seed = |builder: &mut KernelBuilder, input| {
            let one = |column| builder.constant(f64::from(u8::from(input as usize == column)));
            (0..columns).map(one).collect()
        };
        self.differentiated(rows, &seed, &|_, _| false)
    }

    /// The kernel of [`with_jacobian`](Self::with_jacobian), which then returns the derivative of
    /// each of the first `rows` outputs along a tangent vector. The components of the vector are
    /// `columns` further inputs after the first `columns`.
    ///
    /// The kernel rounds exactly as one that runs on [`Dual`](super::Dual) numbers.
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

    /// The kernel with the derivatives of the first `rows` outputs in every direction of the seeds;
    /// `turned` tells for which multiply-adds a direction exchanges the factors.
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

/// Derivative of one operation's result; `slope(operand)` gives the derivatives of the operands.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::kernel::KernelBuilder;

    /// Two polynomials in x and y with rows of one to three constants.
    fn polynomials(count: usize) -> Kernel {
        let mut builder = KernelBuilder::new(2);
        let (x, y) = (builder.input(0), builder.input(1));
        let mut next = 2..;
        let mut sums = Vec::new();
        for _ in 0..count {
            let mut row = |len: usize| {
                let values = next.by_ref().take(len).map(f64::from);
                let values: Vec<Value> = values.map(|value| builder.constant(value)).collect();
                let links = values[1..].iter();
                links.fold(values[0], |sum, &value| builder.multiply_add(sum, x, value))
            };
            let rows = [row(1), row(2), row(3)];
            let sum = builder.multiply_add(rows[0], y, rows[1]);
            sums.push(builder.multiply_add(sum, y, rows[2]));
        }
        builder.finish(sums)
    }

    #[test]
    fn a_polynomial_in_two_variables_is_one_scheme_and_two_of_one_shape_run_at_once() {
        let lengths =
            |scheme: &Scheme| -> Vec<usize> { scheme.rows().iter().map(Vec::len).collect() };
        let steps = schedule(&polynomials(3), 2);
        let numbers: Vec<usize> = steps.iter().map(|step| step.numbers().len()).collect();
        assert_eq!(numbers, [2, 1]);
        for step in &steps {
            let Step::Schemes(schemes) = step else {
                panic!("{step:?}");
            };
            for (_, scheme) in schemes {
                assert_eq!(lengths(scheme), [1, 2, 3]);
            }
        }
    }

    #[test]
    fn schemes_of_one_shape_run_at_once_wherever_they_stand() {
        let mut builder = KernelBuilder::new(4);
        let [x, y, c, d] = [0, 1, 2, 3].map(|input| builder.input(input));
        let sums = [(c, x), (c, y), (d, x)].map(|(a, b)| builder.multiply_add(a, b, a));
        let steps = schedule(&builder.finish(sums.to_vec()), 4);
        let numbers: Vec<Vec<usize>> = steps.iter().map(Step::numbers).collect();
        assert_eq!(numbers, [vec![0, 2], vec![1]]);
    }

    #[test]
    fn schemes_that_need_each_other_are_apart() {
        let mut builder = KernelBuilder::new(2);
        let (x, c) = (builder.input(0), builder.input(1));
        let inner = builder.multiply_add(c, x, c);
        let outer = builder.multiply_add(c, x, inner);
        let twice = builder.multiply(outer, inner);
        let steps = schedule(&builder.finish(vec![twice]), 2);
        let numbers: Vec<Vec<usize>> = steps.iter().map(Step::numbers).collect();
        assert_eq!(numbers, [[0], [1], [2]]);
    }

    #[test]
    fn what_most_waits_for_runs_first() {
        let mut builder = KernelBuilder::new(1);
        let x = builder.input(0);
        let square = builder.multiply(x, x);
        let aside = builder.add(x, square);
        let root = builder.root_of_positive_part(square);
        let sum = builder.add(root, aside);
        let steps = schedule(&builder.finish(vec![sum]), 1);
        let numbers: Vec<usize> = steps.iter().flat_map(Step::numbers).collect();
        // The square, the root, an operation lowered before it, the sum.
        assert_eq!(numbers, [0, 2, 1, 3]);
    }
}
