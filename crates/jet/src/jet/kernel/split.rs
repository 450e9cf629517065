//! Freezing: splitting a kernel by which of its inputs are known first.

use super::{Kernel, KernelBuilder, Value};

/// A kernel in two steps: results that depend on the frozen inputs only are computed once and
/// reused.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitKernel {
    /// From the frozen inputs to the coefficients.
    pub prepare: Kernel,
    /// From the free inputs, and then the coefficients, to the outputs.
    pub run: Kernel,
    /// Number of coefficients.
    pub coefficients: usize,
}

impl Kernel {
    /// Splits into the operations that depend only on the inputs from number `free` on (*frozen*),
    /// and the others.
    ///
    /// Running the two kernels one after the other does the very same operations as the kernel
    /// itself.
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

    /// Which results depend on frozen inputs (and constants) only.
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
    use crate::jet::kernel::{Dual, Interpreter, Number, Unset};

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
        // The same by one kernel: the gradient of every output, then its slope.
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
