//! The free flow together with its first variations in the state and in chosen parameters.
//!
//! One idea: a first-order jet carries the variations, so the field's own program integrates the variational
//! equations, in `f64` and in double-double alike.

use std::sync::Arc;

use crate::flow::{Field, FlowError, horner};
use crate::jet::{JetSeries, JetSpace};
use crate::numeric::Real;

use super::OrbitError;

/// A state of the flow and its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Variation<S> {
    /// The state after the duration.
    pub(super) state: Vec<S>,
    /// One row per component; columns are the initial full state, then the chosen parameters.
    pub(super) jacobian: Vec<Vec<S>>,
}

/// Most steps one flow may take.
const MAX_STEPS: usize = 100_000;

/// The flow over a duration of either sign, with its first variations in the state and in `chosen` parameters.
pub(super) fn flow_with_variations<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    chosen: &[usize],
    duration: S,
) -> Result<Variation<S>, OrbitError> {
    let (dimension, variables) = (state.len(), state.len() + chosen.len());
    let space = JetSpace::uniform(variables, 1)?;
    let order = (-0.5 * S::ROUNDOFF.ln()).ceil() as usize + 2;
    let mut transport = Transport::new(field, &space, order, parameters, chosen);
    let width = variables + 1;
    let mut jets = vec![S::zero(); dimension * width];
    for (component, &value) in state.iter().enumerate() {
        jets[component * width] = value;
        jets[component * width + 1 + component] = S::one();
    }
    let mut remaining = duration;
    for _ in 0..MAX_STEPS {
        if remaining == S::zero() {
            let rows = || jets.chunks_exact(width);
            return Ok(Variation {
                state: rows().map(|row| row[0]).collect(),
                jacobian: rows().map(|row| row[1..].to_vec()).collect(),
            });
        }
        let longest = transport.expand(&jets)?;
        let length = if remaining.abs() <= longest {
            remaining
        } else {
            longest * remaining.signum()
        };
        transport.evaluate(length, &mut jets);
        remaining -= length;
    }
    Err(FlowError::TooManySteps {
        limit: MAX_STEPS,
        remaining: remaining.to_f64(),
    }
    .into())
}

/// Taylor steps over first-order jets.
struct Transport<'a, S> {
    field: &'a Field,
    series: JetSeries,
    width: usize,
    tape: Vec<S>,
    scratch: Vec<S>,
}

impl<'a, S: Real> Transport<'a, S> {
    fn new(
        field: &'a Field,
        space: &Arc<JetSpace>,
        order: usize,
        parameters: &[S],
        chosen: &[usize],
    ) -> Self {
        let width = space.len();
        let element = (order + 1) * width;
        let mut tape = vec![S::zero(); field.program().slots() * element];
        for (parameter, &value) in parameters.iter().enumerate() {
            tape[(field.dimension() + parameter) * element] = value;
        }
        for (column, &parameter) in chosen.iter().enumerate() {
            tape[(field.dimension() + parameter) * element + 1 + field.dimension() + column] =
                S::one();
        }
        let series = JetSeries {
            space: Arc::clone(space),
            order,
        };
        Self {
            field,
            series,
            width,
            tape,
            scratch: vec![S::zero(); width],
        }
    }

    /// Taylor coefficients about the jets; returns the step on which they meet the roundoff of the scalar.
    fn expand(&mut self, jets: &[S]) -> Result<S, OrbitError> {
        let (width, order) = (self.width, self.series.order);
        let element = (order + 1) * width;
        for (component, jet) in jets.chunks_exact(width).enumerate() {
            self.tape[component * element..component * element + width].copy_from_slice(jet);
        }
        for degree in 0..=order {
            self.field
                .program()
                .advance(&self.series, degree, &mut self.tape, &mut self.scratch);
            if degree < order {
                self.integrate(degree, element);
            }
        }
        self.longest_step(element)
    }

    /// Coefficient `degree + 1` of the state from coefficient `degree` of the field.
    fn integrate(&mut self, degree: usize, element: usize) {
        let factor = S::one() / S::from_f64((degree + 1) as f64);
        for component in 0..self.field.dimension() {
            let from = self.field.program().output(component) * element + degree * self.width;
            let to = component * element + (degree + 1) * self.width;
            for offset in 0..self.width {
                self.tape[to + offset] = self.tape[from + offset] * factor;
            }
        }
    }

    /// The step of Jorba and Zou (2005), on the state and its variations column by column.
    fn longest_step(&self, element: usize) -> Result<S, OrbitError> {
        let order = self.series.order;
        let mut radius = f64::INFINITY;
        for column in 0..self.width {
            let norm = |degree: usize| self.column_norm(column, degree, element);
            let scale = norm(0).max(norm(1)).max(1e-300);
            for degree in [order - 1, order] {
                let last = norm(degree);
                if !last.is_finite() {
                    return Err(FlowError::NotFinite { degree }.into());
                }
                radius = radius.min((scale / last.max(1e-300)).powf(1.0 / degree as f64));
            }
        }
        Ok(S::from_f64((radius * (-2.0_f64).exp()).min(1e3)))
    }

    fn column_norm(&self, column: usize, degree: usize, element: usize) -> f64 {
        let values = (0..self.field.dimension())
            .map(|component| component * element + degree * self.width + column);
        values
            .map(|index| self.tape[index].magnitude())
            .fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) })
    }

    /// The jets at a time since the start of the step.
    fn evaluate(&self, time: S, jets: &mut [S]) {
        let (width, terms) = (self.width, self.series.order + 1);
        let mut coefficients = vec![S::zero(); terms];
        for (index, value) in jets.iter_mut().enumerate() {
            let (component, column) = (index / width, index % width);
            for (degree, coefficient) in coefficients.iter_mut().enumerate() {
                *coefficient = self.tape[(component * terms + degree) * width + column];
            }
            *value = horner(&coefficients, time);
        }
    }
}
