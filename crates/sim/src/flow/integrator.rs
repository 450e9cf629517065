//! Taylor's method: the integrator of every scalar, with dense output.
//!
//! Order and step follow Jorba and Zou (2005); see [`step_control`](super::step_control).

use super::FlowError;
use super::field::Field;
use super::series::Series;
use super::step_control::{log2_step, margin_for, order_for_numbers};
use crate::numeric::{Real, polynomial};

/// Taylor integrator of one field over `f64` or double-double.
///
/// ```text
/// x(t + s) = Σ_{k=0}^{n} x_k s^k,   x_{k+1} = f_k / (k + 1)
/// ```
#[derive(Clone, Debug)]
pub struct Integrator<'a, S: Real> {
    field: &'a Field,
    max_step: f64,
    /// Margin of the step per degree.
    margin: f64,
    series: Series<'a, S>,
}

/// One Taylor step: polynomials in the time since its start, valid on `[0, length]`
/// (and, backwards, on `[-length, 0]`).
#[derive(Clone, Copy, Debug)]
pub struct Step<'s, S: Real> {
    field: &'s Field,
    series: &'s Series<'s, S>,
    margin: f64,
    log2_length: f64,
    /// Length of the interval on which the polynomials meet the tolerance, positive and finite.
    pub length: S,
}

/// Most steps one flow may take.
pub(super) const MAX_STEPS: usize = 1_000_000;

/// Longest step where nothing was asked: reached only where the solution is a polynomial in time.
pub(super) const DEFAULT_MAX_STEP: f64 = 1e3;

impl<'a, S: Real> Integrator<'a, S> {
    /// An integrator with the tolerance of the scalar's own roundoff.
    pub fn new(field: &'a Field) -> Self {
        Self::with_tolerance(field, S::ROUNDOFF)
    }

    /// An integrator with a relative local tolerance, at least the scalar's roundoff.
    pub fn with_tolerance(field: &'a Field, tolerance: f64) -> Self {
        let tolerance = tolerance.max(S::ROUNDOFF);
        let series = Series::new(field.series(), order_for_numbers::<S>(tolerance));
        Self {
            field,
            max_step: DEFAULT_MAX_STEP,
            margin: margin_for::<S>(tolerance, series.order()),
            series,
        }
    }

    /// The integrator with another longest step, a positive number.
    pub fn with_max_step(self, max_step: f64) -> Self {
        Self { max_step, ..self }
    }

    /// Order of the method.
    pub fn order(&self) -> usize {
        self.series.order()
    }

    /// Expands the solution about a state.
    ///
    /// `parameters` holds one value per parameter of the field; those of bound ones are ignored.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] if a coefficient of the solution is not finite, or no step is long
    /// enough to be a number.
    pub fn step(&mut self, state: &[S], parameters: &[S]) -> Result<Step<'_, S>, FlowError> {
        self.series.expand(state, parameters);
        let log2_length = self.log2_length()?;
        let length = log2_length.exp2().min(self.max_step);
        if length.is_nan() || length <= 0.0 {
            let degree = self.order();
            return Err(FlowError::NotFinite { degree });
        }
        Ok(Step {
            field: self.field,
            series: &self.series,
            margin: self.margin,
            log2_length,
            length: S::from_f64(length),
        })
    }

    /// Binary logarithm of the length of the step, infinite where the solution is a polynomial in
    /// time.
    fn log2_length(&self) -> Result<f64, FlowError> {
        for component in 0..self.field.dimension() {
            let coefficients = self.series.coefficients(component);
            if !are_finite(coefficients) {
                let found = coefficients.iter().position(|value| !value.is_finite());
                let degree = found.unwrap_or(self.order());
                return Err(FlowError::NotFinite { degree });
            }
        }
        let length =
            |&component: &usize| log2_step_of(self.series.coefficients(component), self.margin);
        let limits = self.field.series().limiting().iter().map(length);
        Ok(limits.fold(f64::INFINITY, f64::min))
    }

    /// The state after a duration of either sign.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] as [`step`](Self::step), [`FlowError::TooManySteps`] after a
    /// million steps.
    pub fn flow(
        &mut self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<Vec<S>, FlowError> {
        let mut state = state.to_vec();
        let mut remaining = duration;
        for _ in 0..MAX_STEPS {
            if remaining == S::zero() {
                return Ok(state);
            }
            let step = self.step(&state, parameters)?;
            let last = remaining.abs() <= step.length;
            let length = if last {
                remaining
            } else {
                step.length * remaining.signum()
            };
            step.state_at(length, &mut state);
            remaining -= length;
        }
        Err(FlowError::TooManySteps {
            limit: MAX_STEPS,
            remaining: remaining.to_f64(),
        })
    }
}

impl<S: Real> Step<'_, S> {
    /// Taylor coefficients of a state component.
    pub fn state_coefficients(&self, component: usize) -> &[S] {
        self.slot(component)
    }

    /// Taylor coefficients of a watched function.
    pub fn watched_coefficients(&self, watched: usize) -> &[S] {
        self.slot(
            self.field
                .time_program()
                .output(self.field.dimension() + watched),
        )
    }

    /// Length on which a watched function's polynomial meets the tolerance as the states' do,
    /// infinite where it is not shorter than the step.
    pub(crate) fn watched_length(&self, watched: usize) -> f64 {
        let output = self.field.dimension() + watched;
        let slot = self.field.time_program().output(output);
        if self.field.series().is_combination(slot) {
            return f64::INFINITY;
        }
        let length = log2_step_of(self.watched_coefficients(watched), self.margin);
        if length < self.log2_length {
            length.exp2()
        } else {
            f64::INFINITY
        }
    }

    /// A lower bound of a watched function on `[0, length]`.
    pub(crate) fn watched_lower_bound(&self, watched: usize, length: f64) -> f64 {
        polynomial::lower_bound(self.watched_coefficients(watched), length)
    }

    /// The state at a time since the start of the step.
    pub fn state_at(&self, time: S, state: &mut [S]) {
        for (component, value) in state.iter_mut().enumerate() {
            *value = self.component_at(component, time);
        }
    }

    /// A state component at a time since the start of the step.
    pub fn component_at(&self, component: usize, time: S) -> S {
        polynomial::value(self.state_coefficients(component), time)
    }

    fn slot(&self, slot: usize) -> &[S] {
        self.series.coefficients(slot)
    }
}

fn log2_step_of<S: Real>(coefficients: &[S], margin: f64) -> f64 {
    let magnitude = |degree: usize| coefficients[degree].magnitude();
    log2_step(magnitude, coefficients.len() - 1, margin)
}

/// Whether all coefficients are finite.
pub(super) fn are_finite<S: Real>(coefficients: &[S]) -> bool {
    let mut zeros = [0.0; 4];
    let (chunks, rest) = coefficients.as_chunks::<4>();
    for chunk in chunks {
        for (zero, value) in zeros.iter_mut().zip(chunk) {
            *zero += value.magnitude() * 0.0;
        }
    }
    zeros == [0.0; 4] && rest.iter().all(|value| value.is_finite())
}

/// Value of a polynomial, coefficients in ascending powers.
pub fn horner<S: Real>(coefficients: &[S], at: S) -> S {
    coefficients
        .iter()
        .rev()
        .fold(S::zero(), |sum, &coefficient| sum.mul_add(at, coefficient))
}

#[cfg(test)]
mod tests;
