//! Jet transport by Taylor's method: series in time whose coefficients are jets.
//!
//! Slow and general: any scalar, so also double-double. The step is controlled on the parts of
//! every degree of every component.

use crate::flow::step_control::{component_step, margin_at, order_for};
use crate::flow::time_expansion::expand;
use crate::flow::{Field, FlowError};
use crate::jet::{Graded, Jet, JetSeries};
use crate::numeric::Real;

/// Most steps one flow may take.
pub(crate) const MAX_STEPS: usize = 100_000;

/// Jets of the state after a duration of either sign, from jets of the state and of all parameters.
///
/// All jets live in one space and may have any content; jets of bound parameters are ignored.
///
/// # Errors
///
/// [`FlowError::NotFinite`] if a coefficient is not finite, [`FlowError::TooManySteps`] after 100
/// 000 steps.
///
/// # Panics
///
/// If the jets' spaces differ.
pub fn jet_transport_taylor<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    duration: S,
) -> Result<Vec<Jet<S>>, FlowError> {
    jet_transport_within(field, initial, parameters, duration, &mut { MAX_STEPS })
}

/// As [`jet_transport_taylor`], in a number of steps, which those taken lower.
pub(crate) fn jet_transport_within<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    duration: S,
    steps_left: &mut usize,
) -> Result<Vec<Jet<S>>, FlowError> {
    let mut state = initial.to_vec();
    let mut remaining = duration;
    if state.is_empty() {
        return Ok(state);
    }
    let algebra = JetSeries::new(state[0].space(), order_for(S::ROUNDOFF));
    let (mut expansion, limit) = (JetExpansion::new(field, algebra), *steps_left);
    while remaining != S::zero() {
        if *steps_left == 0 {
            return Err(FlowError::TooManySteps { limit, remaining: remaining.to_f64() });
        }
        *steps_left -= 1;
        expansion.expand(&state, parameters);
        let longest = S::from_f64(expansion.step_length(remaining.magnitude())?);
        let length =
            if remaining.abs() <= longest { remaining } else { longest * remaining.signum() };
        for (component, jet) in state.iter_mut().enumerate() {
            expansion.sum_at(component, length, jet.coefficients_mut());
        }
        remaining -= length;
    }
    Ok(state)
}

/// The tape of one field over series in time of jets.
pub(crate) struct JetExpansion<'a, S: Real> {
    field: &'a Field,
    algebra: JetSeries,
    tape: Vec<S>,
    scratch: Vec<S>,
}

impl<'a, S: Real> JetExpansion<'a, S> {
    pub(crate) fn new(field: &'a Field, algebra: JetSeries) -> Self {
        let len = Graded::<S>::element_len(&algebra);
        Self {
            field,
            tape: vec![S::zero(); field.time_program().slots() * len],
            scratch: vec![S::zero(); algebra.space().len()],
            algebra,
        }
    }

    /// Expands the solution about a jet-valued state.
    pub(crate) fn expand(&mut self, state: &[Jet<S>], parameters: &[Jet<S>]) {
        let len = Graded::<S>::element_len(&self.algebra);
        for (input, jet) in state.iter().chain(parameters).enumerate() {
            let head = input * len..input * len + jet.coefficients().len();
            self.tape[head].copy_from_slice(jet.coefficients());
        }
        expand(self.field, &self.algebra, &mut self.tape, &mut self.scratch);
    }

    /// Coefficients of one power of time of a slot.
    pub(crate) fn coefficients(&self, slot: usize, power: usize) -> &[S] {
        let (len, part) =
            (Graded::<S>::element_len(&self.algebra), Graded::<S>::part(&self.algebra, power));
        &self.tape[slot * len + part.start..slot * len + part.end]
    }

    /// Longest step, at most `limit`, that every part of every component admits.
    fn step_length(&self, limit: f64) -> Result<f64, FlowError> {
        let order = Graded::<S>::order(&self.algebra);
        let mut step = limit;
        for component in 0..self.field.dimension() {
            for power in 0..=order {
                if self.coefficients(component, power).iter().any(|value| !value.is_finite()) {
                    return Err(FlowError::NotFinite { degree: power });
                }
            }
            for degree in 0..=self.algebra.space().order() {
                let magnitude = |power| self.magnitude(component, power, degree);
                let magnitudes: Vec<f64> = (0..=order).map(magnitude).collect();
                step = step.min(component_step(&magnitudes, margin_at(order)));
            }
        }
        if step > 0.0 || limit == 0.0 {
            Ok(step)
        } else {
            Err(FlowError::NotFinite { degree: order })
        }
    }

    /// Largest coefficient of a power of time among the monomials of a degree.
    fn magnitude(&self, component: usize, power: usize, degree: usize) -> f64 {
        let part = &self.coefficients(component, power)[self.algebra.space().degree_range(degree)];
        part.iter().map(|value| value.magnitude()).fold(0.0, f64::max)
    }

    /// Horner's sum of the series of a component at a time.
    fn sum_at(&self, component: usize, time: S, out: &mut [S]) {
        out.fill(S::zero());
        for power in (0..=Graded::<S>::order(&self.algebra)).rev() {
            for (value, &coefficient) in out.iter_mut().zip(self.coefficients(component, power)) {
                *value = value.mul_add(time, coefficient);
            }
        }
    }
}
