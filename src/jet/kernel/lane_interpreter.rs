//! Running a kernel on several points at once.

use std::sync::Arc;

use super::code::Code;
use crate::numeric::Lanes;

/// A kernel prepared for running on `N` points in step, each with known inputs of its own.
///
/// One instruction is read for `N` points, which is what an interpreter costs most for; the operations of a lane are
/// those of [`Interpreter`](super::Interpreter), to the last bit.
#[derive(Clone, Debug)]
pub struct LaneInterpreter<const N: usize> {
    inputs: usize,
    code: Arc<Code>,
    /// Inputs, known inputs, constants, results.
    memory: Vec<Lanes<N>>,
}

impl<const N: usize> LaneInterpreter<N> {
    pub(super) fn new(
        inputs: usize,
        last_inputs: &[Vec<f64>],
        constants: &[f64],
        code: Arc<Code>,
    ) -> Self {
        assert!(last_inputs.len() <= N, "{} lanes of {N}", last_inputs.len());
        let set = last_inputs.first().map_or(0, Vec::len);
        let results = inputs + set + constants.len();
        let mut memory = vec![Lanes::splat(0.0); results + code.results()];
        for (lane, values) in last_inputs.iter().enumerate() {
            assert_eq!(values.len(), set, "lanes are of one length");
            for (place, &value) in memory[inputs..].iter_mut().zip(values) {
                place[lane] = value;
            }
        }
        for (place, &value) in memory[inputs + set..].iter_mut().zip(constants) {
            *place = Lanes::splat(value);
        }
        Self {
            inputs,
            code,
            memory,
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.code.outputs()
    }

    /// Runs the kernel; [`output`](Self::output) then hands out its results.
    ///
    /// It is inlined so that a [`numeric::Kernel`](crate::numeric::Kernel) that calls it runs with the widest registers.
    ///
    /// # Panics
    ///
    /// If the number of inputs is not the kernel's.
    #[inline(always)]
    pub fn run(&mut self, inputs: &[Lanes<N>]) {
        self.memory[..self.inputs].copy_from_slice(inputs);
        self.code.run(&mut self.memory);
    }

    /// A result of the last run.
    #[inline(always)]
    pub fn output(&self, number: usize) -> &Lanes<N> {
        self.code.output(number, &self.memory)
    }
}

#[cfg(test)]
mod tests {
    use crate::jet::kernel::{Interpreter, KernelBuilder};
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
        let interpreter = Interpreter::new(&builder.finish(vec![total, root, p]));
        let parameters: Vec<Vec<f64>> = (0..3).map(|lane| vec![f64::from(lane) - 0.7]).collect();
        let mut lanes = interpreter.in_lanes::<4>(&parameters);
        assert_eq!((lanes.inputs(), lanes.outputs()), (2, 3));
        // One lane of each sign of the root's argument; the last lane has no parameters of its own.
        let (x, y) = (Lanes([0.1, -2.0, 3.3, 1.0]), Lanes([0.7, 5.0, 1.1, 2.0]));
        lanes.run(&[x, y]);
        for (lane, parameter) in parameters.iter().enumerate() {
            let alone = interpreter.evaluate(&[x[lane], y[lane], parameter[0]]);
            let found = [0, 1, 2].map(|number| lanes.output(number)[lane]);
            assert_eq!(found.to_vec(), alone);
        }
        assert_eq!(lanes.output(1)[1], 0.0);
    }
}
