//! The map evaluated from its jets, term by term: the reference for every other form.

use nalgebra::DMatrix;

use super::discrete_map::{DiscreteMap, StepInfo};
use super::tangents::Tangents;
use crate::expansion::{Contact, FlownContact, Leg, LocalMap, Stage};
use crate::jet::Jet;

/// A local map read off its jets, stage by stage, without lowering: slow and plainly right.
#[derive(Clone, Debug)]
pub struct InterpretedMap {
    dimension: usize,
    parameters: usize,
    stages: Vec<Stage>,
}

impl InterpretedMap {
    /// The map of these stages.
    pub fn new(map: &LocalMap) -> Self {
        Self {
            dimension: map.dimension(),
            parameters: map.parameters.len(),
            stages: map.stages.clone(),
        }
    }

    /// Runs all stages on `point` (coordinates; parameters); with a tangent (`∂x_i/∂x_j`), that
    /// too.
    fn run(&self, point: &mut [f64], mut tangent: Option<&mut DMatrix<f64>>) -> StepInfo {
        let mut info = StepInfo::default();
        let mut passages = 0;
        for stage in &self.stages {
            let (next, jacobian) = match stage {
                Stage::Leg(leg) => leg_step(leg, point, self.dimension),
                Stage::Contact(contact) => {
                    let (depth, next, jacobian) = contact_step(contact, point, self.dimension);
                    info.add_passage(passages, depth);
                    passages += 1;
                    (next, jacobian)
                }
                Stage::Flown(flown) => {
                    let (depth, next, jacobian) = flown_step(flown, point, self.dimension);
                    info.add_passage(passages, depth);
                    passages += 1;
                    (next, jacobian)
                }
            };
            if let Some(tangent) = tangent.as_deref_mut() {
                let jacobian = DMatrix::from_row_slice(self.dimension, self.dimension, &jacobian);
                *tangent = jacobian * &*tangent;
            }
            point[..self.dimension].copy_from_slice(&next);
        }
        info
    }

    fn point(&self, state: &[f64], parameters: &[f64]) -> Vec<f64> {
        assert_eq!(
            (state.len(), parameters.len()),
            (self.dimension, self.parameters),
            "lengths of state and parameters"
        );
        [state, parameters].concat()
    }
}

impl DiscreteMap for InterpretedMap {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> usize {
        self.parameters
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let mut point = self.point(state, parameters);
        let info = self.run(&mut point, None);
        image.copy_from_slice(&point[..self.dimension]);
        info.checked(image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let mut point = self.point(state, parameters);
        let mut tangent = DMatrix::identity(self.dimension, self.dimension);
        let info = self.run(&mut point, Some(&mut tangent));
        image.copy_from_slice(&point[..self.dimension]);
        jacobian.copy_from_slice(tangent.transpose().as_slice());
        info.checked(image)
    }
}

/// Value and gradient of a jet.
fn expand(jet: &Jet<f64>, point: &[f64]) -> (f64, Vec<f64>) {
    let mut gradient = vec![0.0; point.len()];
    let value = jet.evaluate_with_gradient(point, &mut gradient);
    (value, gradient)
}

fn leg_step(leg: &Leg, point: &[f64], dimension: usize) -> (Vec<f64>, Vec<f64>) {
    let mut jacobian = Vec::with_capacity(dimension * dimension);
    let mut next = Vec::with_capacity(dimension);
    for jet in &leg.image {
        let (value, gradient) = expand(jet, point);
        next.push(value);
        jacobian.extend_from_slice(&gradient[..dimension]);
    }
    (next, jacobian)
}

/// The depth, `x_i + y l_i + y² q_i` and its rows `δ_ij + y' (l_i + 2 y q_i) + y l_i' + y² q_i'`,
/// `y' = depth'/(2y)`.
fn contact_step(contact: &Contact, point: &[f64], dimension: usize) -> (f64, Vec<f64>, Vec<f64>) {
    let (depth, depth_gradient) = expand(&contact.depth, point);
    let y = depth.max(0.0).sqrt();
    let slope = if y > 0.0 { 0.5 / y } else { 0.0 };
    let mut jacobian = Vec::with_capacity(dimension * dimension);
    let mut next = Vec::with_capacity(dimension);
    for (i, (linear, quadratic)) in contact.linear.iter().zip(&contact.quadratic).enumerate() {
        let ((l, l_gradient), (q, q_gradient)) = (expand(linear, point), expand(quadratic, point));
        next.push(point[i] + y * (l + y * q));
        for j in 0..dimension {
            let identity = f64::from(u8::from(i == j));
            let through_y = depth_gradient[j] * slope * (l + 2.0 * y * q);
            jacobian.push(identity + through_y + y * (l_gradient[j] + y * q_gradient[j]));
        }
    }
    (depth, next, jacobian)
}

/// The image and its rows of derivatives, carried along operation by operation.
fn flown_step(flown: &FlownContact, point: &[f64], dimension: usize) -> (f64, Vec<f64>, Vec<f64>) {
    let mut tangents = Tangents::new(dimension);
    let point = tangents.variables(point);
    let (image, depth) = flown.act(&mut tangents, &point);
    let jacobian = image.iter().flat_map(|value| &value.tangent).copied();
    (depth.value, image.iter().map(|value| value.value).collect(), jacobian.collect())
}
