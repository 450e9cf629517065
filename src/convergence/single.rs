//! A map in single precision: its coefficients, its input and every operation.

use super::sample::SamplePoint;
use super::truth::{Truth, distance};
use crate::expansion::MapKernel;
use crate::jet::kernel::{Operation, Value};
use crate::numeric::Dd;

/// A map's operations, run in single precision.
#[derive(Debug)]
pub(super) struct SingleMap {
    map: MapKernel,
    constants: Vec<f32>,
}

impl SingleMap {
    pub(super) fn new(map: MapKernel) -> Self {
        let constants = map.kernel.constants.iter().map(|&value| value as f32);
        Self {
            constants: constants.collect(),
            map,
        }
    }

    /// The largest error of a coordinate over sample points; `None` where an image is not finite.
    pub(super) fn largest_error(&self, truth: &Truth) -> Option<f64> {
        let pairs = truth.points.iter().zip(&truth.images);
        let largest = pairs.fold(0.0, |worst: f64, (point, image)| {
            let error = distance(&self.image(point), image);
            if error <= worst { worst } else { error }
        });
        largest.is_finite().then_some(largest)
    }

    fn image(&self, point: &SamplePoint) -> Vec<Dd> {
        let inputs = point.state.iter().chain(&point.parameters);
        let inputs: Vec<f32> = inputs.map(|&offset| offset as f32).collect();
        let mut results: Vec<f32> = Vec::with_capacity(self.map.kernel.operations.len());
        let read = |results: &[f32], value: Value| match value {
            Value::Input(number) => inputs[number as usize],
            Value::Constant(number) => self.constants[number as usize],
            Value::Result(number) => results[number as usize],
        };
        for operation in &self.map.kernel.operations {
            let at = |value: Value| read(&results, value);
            let result = match *operation {
                Operation::Add(a, b) => at(a) + at(b),
                Operation::Multiply(a, b) => at(a) * at(b),
                Operation::MultiplyAdd(a, b, c) => at(a).mul_add(at(b), at(c)),
                Operation::RootOfPositivePart(a) => at(a).max(0.0).sqrt(),
                Operation::HalfReciprocal(a) if at(a) > 0.0 => 0.5 / at(a),
                Operation::HalfReciprocal(_) => 0.0,
                Operation::Held(a) => at(a),
            };
            results.push(result);
        }
        let outputs = self.map.kernel.outputs[..self.map.dimension].iter();
        outputs
            .map(|&value| Dd::from(f64::from(read(&results, value))))
            .collect()
    }
}
