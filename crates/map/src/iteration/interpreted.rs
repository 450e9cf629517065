//! The map evaluated from its jets, term by term: the reference for every other form. [`Tangents`]
//! is the arithmetic that carries derivatives through flown contacts.

use std::marker::PhantomData;

use nalgebra::DMatrix;

use super::discrete_map::{DiscreteMap, StepInfo};
use crate::expansion::{Arithmetic, Contact, FlownContact, Leg, LocalMap, Stage};
use crate::jet::Jet;
use crate::numeric::Real;

/// A local map evaluated from its jets, stage by stage, without lowering: slow and simple.
#[derive(Clone, Debug)]
pub struct InterpretedMap {
    dimension: usize,
    parameters: usize,
    stages: Vec<Stage>,
}

impl InterpretedMap {
    /// The map of all stages of `map`.
    pub fn new(map: &LocalMap) -> Self {
        Self {
            dimension: map.dimension(),
            parameters: map.parameters.len(),
            stages: map.stages.clone(),
        }
    }

    /// Runs all stages on `point` (coordinates, then parameters), and on the tangent (`∂x_i/∂x_j`)
    /// if there is one.
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

/// Depth, image `x_i + y l_i + y² q_i` and Jacobian rows
/// `δ_ij + y' (l_i + 2 y q_i) + y l_i' + y² q_i'`, with `y' = depth'/(2y)`; the terms with powers
/// of `y` that are not whole carry their derivatives along.
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
    if !contact.powers.is_empty() {
        let mut tangents = Tangents::new(dimension);
        let variables = tangents.variables(point);
        let along = depth_gradient[..dimension].iter().map(|rate| rate * slope);
        let y = Tangent { value: y, tangent: along.collect() };
        let rows = jacobian.chunks(dimension).zip(&next);
        let mut image: Vec<Tangent> =
            rows.map(|(row, &value)| Tangent { value, tangent: row.to_vec() }).collect();
        contact.powers.add_to(&mut tangents, &y, &variables, &mut image);
        next = image.iter().map(|value| value.value).collect();
        jacobian = image.iter().flat_map(|value| &value.tangent).copied().collect();
    }
    (depth, next, jacobian)
}

/// Depth, image and Jacobian rows, with derivatives carried along operation by operation.
fn flown_step(flown: &FlownContact, point: &[f64], dimension: usize) -> (f64, Vec<f64>, Vec<f64>) {
    let mut tangents = Tangents::new(dimension);
    let point = tangents.variables(point);
    let (image, depth) = flown.act(&mut tangents, &point);
    let jacobian = image.iter().flat_map(|value| &value.tangent).copied();
    (depth.value, image.iter().map(|value| value.value).collect(), jacobian.collect())
}

/// Arithmetic of values with derivatives by a number of variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangents<S = f64> {
    directions: usize,
    scalar: PhantomData<S>,
}

/// A value and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tangent<S = f64> {
    /// The value.
    pub(crate) value: S,
    /// Derivatives of the value by each variable.
    pub(crate) tangent: Vec<S>,
}

impl<S: Real> Tangents<S> {
    /// Derivatives by this many variables.
    pub(crate) fn new(directions: usize) -> Self {
        Self { directions, scalar: PhantomData }
    }

    /// A point whose first components are the variables; the others are constants.
    pub(crate) fn variables(&self, point: &[S]) -> Vec<Tangent<S>> {
        point.iter().enumerate().map(|(number, &value)| self.variable(number, value)).collect()
    }

    /// The variable of a number; a constant if the number is beyond the variables.
    pub(crate) fn variable(&self, number: usize, value: S) -> Tangent<S> {
        let unit = |direction: usize| if direction == number { S::one() } else { S::zero() };
        Tangent { value, tangent: (0..self.directions).map(unit).collect() }
    }

    fn combined(&self, value: S, parts: &[(S, &Tangent<S>)]) -> Tangent<S> {
        let along = |direction: usize| {
            let parts = parts.iter();
            parts.map(|(factor, part)| *factor * part.tangent[direction]).sum()
        };
        let tangent = (0..self.directions).map(along).collect();
        Tangent { value, tangent }
    }
}

impl<S: Real> Arithmetic for Tangents<S> {
    type Scalar = S;
    type Value = Tangent<S>;

    fn constant(&mut self, value: S) -> Tangent<S> {
        self.combined(value, &[])
    }

    fn add(&mut self, a: &Tangent<S>, b: &Tangent<S>) -> Tangent<S> {
        self.combined(a.value + b.value, &[(S::one(), a), (S::one(), b)])
    }

    fn multiply(&mut self, a: &Tangent<S>, b: &Tangent<S>) -> Tangent<S> {
        self.combined(a.value * b.value, &[(b.value, a), (a.value, b)])
    }

    fn multiply_add(&mut self, a: &Tangent<S>, b: &Tangent<S>, c: &Tangent<S>) -> Tangent<S> {
        let value = a.value * b.value + c.value;
        self.combined(value, &[(b.value, a), (a.value, b), (S::one(), c)])
    }

    fn root_of_positive_part(&mut self, a: &Tangent<S>) -> Tangent<S> {
        let value = a.value.max(S::zero()).sqrt();
        let slope = if value > S::zero() { S::from_f64(0.5) / value } else { S::zero() };
        self.combined(value, &[(slope, a)])
    }

    fn half_reciprocal(&mut self, a: &Tangent<S>) -> Tangent<S> {
        let half = S::from_f64(0.5);
        let value = if a.value > S::zero() { half / a.value } else { S::zero() };
        self.combined(value, &[(S::from_f64(-2.0) * value * value, a)])
    }

    fn held(&mut self, a: &Tangent<S>) -> Tangent<S> {
        self.constant(a.value)
    }

    fn polynomial(&mut self, jet: &Jet<S>, point: &[Tangent<S>]) -> Tangent<S> {
        let values: Vec<S> = point.iter().map(|value| value.value).collect();
        let mut gradient = vec![S::zero(); values.len()];
        let value = jet.evaluate_with_gradient(&values, &mut gradient);
        let parts: Vec<_> = gradient.into_iter().zip(point).collect();
        self.combined(value, &parts)
    }
}
