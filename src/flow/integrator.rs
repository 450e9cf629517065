//! Taylor's method: the integrator of every scalar, with dense output.
//!
//! Order and step follow Jorba and Zou (2005).

use super::FlowError;
use super::field::Field;
use crate::jet::TimeSeries;
use crate::numeric::Real;

/// Taylor integrator of one field over `f64` or double-double.
#[derive(Clone, Debug)]
pub struct Integrator<'a, S: Real> {
    field: &'a Field,
    series: TimeSeries,
    tolerance: f64,
    tape: Vec<S>,
}

/// One Taylor step: polynomials in the time since its start, valid on `[0, length]`
/// (and, backwards, on `[-length, 0]`).
#[derive(Clone, Copy, Debug)]
pub struct Step<'s, S: Real> {
    field: &'s Field,
    tape: &'s [S],
    order: usize,
    /// Length of the interval on which the polynomials meet the tolerance.
    pub length: S,
}

impl<'a, S: Real> Integrator<'a, S> {
    /// An integrator with the tolerance of the scalar's own roundoff.
    pub fn new(field: &'a Field) -> Self {
        Self::with_tolerance(field, S::ROUNDOFF)
    }

    /// An integrator with a relative local tolerance, at least the scalar's roundoff.
    pub fn with_tolerance(field: &'a Field, tolerance: f64) -> Self {
        let tolerance = tolerance.max(S::ROUNDOFF);
        let order = (-0.5 * tolerance.ln()).ceil() as usize + 2;
        let series = TimeSeries { order };
        let tape = vec![S::zero(); field.program().slots() * (order + 1)];
        Self { field, series, tolerance, tape }
    }

    /// Order of the method.
    pub fn order(&self) -> usize {
        self.series.order
    }

    /// Expands the solution about a state.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] if a coefficient of the solution is not finite.
    pub fn step(&mut self, state: &[S], parameters: &[S]) -> Result<Step<'_, S>, FlowError> {
        let len = self.series.order + 1;
        let program = self.field.program();
        for (input, &value) in state.iter().chain(parameters).enumerate() {
            self.tape[input * len..(input + 1) * len].fill(S::zero());
            self.tape[input * len] = value;
        }
        let mut scratch = [S::zero()];
        for degree in 0..=self.series.order {
            program.advance(&self.series, degree, &mut self.tape, &mut scratch);
            if degree < self.series.order {
                let factor = S::one() / S::from_f64((degree + 1) as f64);
                for component in 0..self.field.dimension() {
                    self.tape[component * len + degree + 1] =
                        self.tape[program.output(component) * len + degree] * factor;
                }
            }
        }
        let length = self.step_length()?;
        Ok(Step { field: self.field, tape: &self.tape, order: self.series.order, length: S::from_f64(length) })
    }

    /// Jorba and Zou's step: the radius of convergence estimated from the last two coefficients, over e².
    fn step_length(&self) -> Result<f64, FlowError> {
        let order = self.series.order;
        let norm = |degree: usize| self.state_norm(degree);
        let scale = norm(0).max(norm(1)).max(1e-300);
        let (last, before) = (norm(order), norm(order - 1));
        if !(last.is_finite() && before.is_finite() && scale.is_finite()) {
            return Err(FlowError::NotFinite { degree: order });
        }
        let radius = |coefficient: f64, degree: usize| (scale / coefficient.max(1e-300)).powf(1.0 / degree as f64);
        let radius = radius(last, order).min(radius(before, order - 1));
        Ok(radius * (self.tolerance.ln() / (order as f64)).exp().max((-2.0f64).exp() * 0.9).min(0.9))
    }

    fn state_norm(&self, degree: usize) -> f64 {
        let len = self.series.order + 1;
        (0..self.field.dimension()).map(|component| self.tape[component * len + degree].magnitude()).fold(0.0, f64::max)
    }

    /// The state after a duration of either sign.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] as [`step`](Self::step), [`FlowError::TooManySteps`] after a million steps.
    pub fn flow(&mut self, state: &[S], parameters: &[S], duration: S) -> Result<Vec<S>, FlowError> {
        let mut state = state.to_vec();
        let mut remaining = duration;
        for _ in 0..MAX_STEPS {
            if remaining == S::zero() {
                return Ok(state);
            }
            let step = self.step(&state, parameters)?;
            let length = if remaining.abs() <= step.length { remaining } else { step.length * remaining.signum() };
            let mut next = state.clone();
            step.state_at(length, &mut next);
            remaining -= length;
            state = next;
        }
        Err(FlowError::TooManySteps { limit: MAX_STEPS, remaining: remaining.to_f64() })
    }
}

/// Most steps one flow may take.
const MAX_STEPS: usize = 1_000_000;

impl<S: Real> Step<'_, S> {
    /// Taylor coefficients of a state component.
    pub fn state_coefficients(&self, component: usize) -> &[S] {
        self.slot(component)
    }

    /// Taylor coefficients of a watched function.
    pub fn watched_coefficients(&self, watched: usize) -> &[S] {
        self.slot(self.field.program().output(self.field.dimension() + watched))
    }

    /// The state at a time since the start of the step.
    pub fn state_at(&self, time: S, state: &mut [S]) {
        for (component, value) in state.iter_mut().enumerate() {
            *value = horner(self.state_coefficients(component), time);
        }
    }

    fn slot(&self, slot: usize) -> &[S] {
        let len = self.order + 1;
        &self.tape[slot * len..(slot + 1) * len]
    }
}

/// Value of a polynomial, coefficients in ascending powers.
pub fn horner<S: Real>(coefficients: &[S], at: S) -> S {
    coefficients.iter().rev().fold(S::zero(), |sum, &coefficient| sum.mul_add(at, coefficient))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::InputKind;
    use crate::flow::samples;
    use crate::numeric::Dd;

    /// Undamped linear oscillator off resonance: `x = A cos ωt + B cos t + C sin t`.
    fn one_period_error<S: Real>() -> f64 {
        let field = samples::linear(&[InputKind::HeadOnly; 3]);
        let omega = S::from_f64(1.5);
        let amplitude = S::from_f64(0.7);
        let state = [S::from_f64(0.3), S::from_f64(-0.2), S::zero()];
        let period = S::from_dd(Dd::TWO_PI) / omega;
        let end = Integrator::new(&field).flow(&state, &[S::zero(), amplitude, omega], period).unwrap();
        let forced = amplitude / (S::one() - omega * omega);
        let (sine, cosine) = period.sin_cos();
        let (b, c) = (state[0] - forced, state[1]);
        let expected = [forced + b * cosine + c * sine, c * cosine - b * sine];
        (0..2).map(|i| (end[i] - expected[i]).magnitude()).fold(0.0, f64::max)
    }

    #[test]
    fn linear_oscillator_returns_to_roundoff_after_one_period() {
        assert!(one_period_error::<f64>() < 4e-15, "{:e}", one_period_error::<f64>());
        assert!(one_period_error::<Dd>() < 1e-29, "{:e}", one_period_error::<Dd>());
    }
}
