//! Taylor's method: the integrator of every scalar, with dense output.
//!
//! Order and step follow Jorba and Zou (2005); see [`step_control`](super::step_control).

use super::FlowError;
use super::field::Field;
use super::series::Series;
use super::step_control::{component_step, margin_for, order_for_numbers};
use crate::numeric::Real;

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
    /// Length of the interval on which the polynomials meet the tolerance, positive and finite.
    pub length: S,
}

/// Most steps one flow may take.
const MAX_STEPS: usize = 1_000_000;

/// Longest step where nothing was asked: reached only where the solution is a polynomial in time.
const DEFAULT_MAX_STEP: f64 = 1e3;

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
            margin: margin_for(tolerance, series.order()),
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
        let length = S::from_f64(self.step_length()?);
        Ok(Step {
            field: self.field,
            series: &self.series,
            margin: self.margin,
            length,
        })
    }

    fn step_length(&self) -> Result<f64, FlowError> {
        let order = self.order();
        let mut step = self.max_step;
        for component in 0..self.field.dimension() {
            let coefficients = self.series.coefficients(component);
            if let Some(degree) = coefficients.iter().position(|value| !value.is_finite()) {
                return Err(FlowError::NotFinite { degree });
            }
            step = step.min(component_step(
                |degree| coefficients[degree].magnitude(),
                order,
                self.margin,
            ));
        }
        if step > 0.0 {
            Ok(step)
        } else {
            Err(FlowError::NotFinite { degree: order })
        }
    }

    /// The state after a duration of either sign.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] as [`step`](Self::step), [`FlowError::TooManySteps`] after a million steps.
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

    /// Length on which a watched function's polynomial meets the tolerance as the states' do.
    pub(crate) fn watched_length(&self, watched: usize) -> f64 {
        let value = self.watched_coefficients(watched);
        component_step(|degree| value[degree].magnitude(), value.len() - 1, self.margin)
    }

    /// The state at a time since the start of the step.
    pub fn state_at(&self, time: S, state: &mut [S]) {
        for (component, value) in state.iter_mut().enumerate() {
            *value = horner(self.state_coefficients(component), time);
        }
    }

    /// A state component at a time since the start of the step.
    pub fn component_at(&self, component: usize, time: S) -> S {
        horner(self.state_coefficients(component), time)
    }

    fn slot(&self, slot: usize) -> &[S] {
        self.series.coefficients(slot)
    }
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
