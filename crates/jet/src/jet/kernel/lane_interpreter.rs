//! Running a kernel on several points at once.

use std::sync::Arc;

use super::Number;
use super::code::Code;

/// A kernel prepared for running on several points in step, each with known inputs of its own, on
/// [`Lanes`](crate::numeric::Lanes) or [`Dual`](super::Dual) numbers of lanes.
///
/// One instruction is read for all of them, which is what an interpreter costs most for; the
/// operations of a lane are those of [`Interpreter`](super::Interpreter), to the last bit.
#[derive(Clone, Debug)]
pub struct LaneInterpreter<T: Number> {
    code: Arc<Code>,
    /// Inputs, results, known values that are looked up.
    memory: Vec<T>,
    /// Known values that are read in order.
    read: Vec<T::Known>,
}

impl<T: Number> LaneInterpreter<T> {
    pub(super) fn new(code: Arc<Code>, set: &[T::Known], constants: &[T::Known]) -> Self {
        let mut memory = vec![T::ZERO; code.inputs()];
        code.complete(&mut memory, &code.kept(set, constants));
        Self {
            memory,
            read: code.read(set, constants),
            code,
        }
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// The inputs of the next run.
    #[inline(always)]
    pub fn inputs(&self) -> &[T] {
        &self.memory[..self.code.inputs()]
    }

    /// The inputs of the next run, to be set.
    #[inline(always)]
    pub fn inputs_mut(&mut self) -> &mut [T] {
        &mut self.memory[..self.code.inputs()]
    }

    /// Makes the first outputs the first inputs.
    #[inline(always)]
    pub fn feed_back(&mut self, count: usize) {
        for number in 0..count {
            self.memory[number] = *self.code.output(number, &self.memory);
        }
    }

    /// Runs the kernel; [`output`](Self::output) then hands out its results.
    ///
    /// It is inlined so that a [`numeric::Kernel`](crate::numeric::Kernel) that calls it runs with
    /// the widest registers.
    #[inline(always)]
    pub fn run(&mut self) {
        self.code.run(&self.read, &mut self.memory);
    }

    /// A result of the last run.
    #[inline(always)]
    pub fn output(&self, number: usize) -> &T {
        self.code.output(number, &self.memory)
    }
}

#[cfg(test)]
mod tests {
    use crate::jet::kernel::{Interpreter, KernelBuilder, Unset};
    use crate::numeric::Lanes;

    #[test]
    fn every_lane_gives_the_bits_of_the_interpreter() {
        let mut builder = KernelBuilder::new(3);
        let [x, y, p] = [0, 1, 2].map(|input| builder.input(input));
        let constant = builder.constant(0.3);
        let sum = builder.multiply_add(x, y, constant);
        let root = builder.root_of_positive_part(sum);
        let slope = builder.half_reciprocal(root);
        let product = builder.multiply(slope, p);
        let total = builder.add(product, x);
        let kernel = builder.finish(vec![total, root, p, y]);
        let interpreter = Interpreter::new(&kernel);
        let parameters: Vec<Vec<f64>> = (0..3).map(|lane| vec![f64::from(lane) - 0.7]).collect();
        let mut lanes = Unset::new(&kernel, 2).set_lanes::<4, Lanes<4>>(&parameters);
        assert_eq!((lanes.inputs().len(), lanes.outputs()), (2, 4));
        // One lane of each sign of the root's argument; the last lane has no parameters of its own.
        let (x, y) = (Lanes([0.1, -2.0, 3.3, 1.0]), Lanes([0.7, 5.0, 1.1, 2.0]));
        lanes.inputs_mut().copy_from_slice(&[x, y]);
        lanes.run();
        for (lane, parameter) in parameters.iter().enumerate() {
            let alone = interpreter.evaluate(&[x[lane], y[lane], parameter[0]]);
            let found = [0, 1, 2, 3].map(|number| lanes.output(number)[lane]);
            assert_eq!(found.to_vec(), alone);
        }
        assert_eq!(lanes.output(1)[1], 0.0);
    }
}
