//! One step of an affine flight.

use super::extended::Extended;
use super::polygon::{Polygon, ROUNDING};
use crate::flow::{AffineFlow, Single};
use crate::hybrid::flight::{Flight, Outlook};
use crate::hybrid::passage::Goal;
use crate::numeric::Real;

/// Polynomials of one watched function, and the extended state after a step.
#[derive(Clone, Debug)]
pub(super) struct FlightBuffers<S> {
    value: Vec<S>,
    slope: Vec<S>,
    next: Vec<S>,
    control: Vec<f64>,
    rounded: Vec<f64>,
}

impl<S: Real> FlightBuffers<S> {
    /// For extended states of a length.
    pub(super) fn new(columns: usize) -> Self {
        Self {
            value: Vec::new(),
            slope: Vec::new(),
            next: vec![S::zero(); columns],
            control: Vec::new(),
            rounded: vec![0.0; columns],
        }
    }
}

/// A step of the exact flow: polynomials of the watched functions are formed when they are asked
/// for.
pub(in crate::hybrid) struct AffineFlight<'t, S: Real> {
    flow: &'t AffineFlow<S>,
    extended: &'t mut Extended<Single<S>>,
    buffers: &'t mut FlightBuffers<S>,
    theta: Option<S>,
}

impl<'t, S: Real> AffineFlight<'t, S> {
    pub(super) fn new(
        flow: &'t AffineFlow<S>,
        extended: &'t mut Extended<Single<S>>,
        buffers: &'t mut FlightBuffers<S>,
        theta: Option<S>,
    ) -> Self {
        let len = flow.coefficients();
        buffers.value.resize(len, S::zero());
        buffers.slope.resize(len, S::zero());
        buffers.control.resize(len, 0.0);
        for (rounded, value) in buffers.rounded.iter_mut().zip(&extended.values) {
            *rounded = value.to_f64();
        }
        Self { flow, extended, buffers, theta }
    }
}

impl<S: Real> Flight<S> for AffineFlight<'_, S> {
    fn length(&self) -> S {
        self.flow.length()
    }

    fn time_scale(&self) -> S {
        S::from_f64(self.flow.time_scale())
    }

    fn outlook(&mut self, watch: usize, _length: S, goal: &Goal<S>) -> Outlook {
        if goal.minima {
            return Outlook::Undecided;
        }
        let FlightBuffers { control, rounded, .. } = &mut *self.buffers;
        self.flow.control_points(watch, rounded, control);
        let rounding = ROUNDING * self.flow.size(watch, rounded);
        let polygon = Polygon { points: control, rounding };
        match polygon.is_above(goal.near.to_f64().max(0.0), false) {
            true => Outlook::NoEvent,
            false => Outlook::Undecided,
        }
    }

    fn polynomials(&mut self, watch: usize) -> (&[S], &[S]) {
        let FlightBuffers { value, slope, .. } = &mut *self.buffers;
        self.flow.watched_series(watch, &self.extended.values, value);
        let mut power = S::zero();
        for (slope, &value) in slope.iter_mut().zip(&value[1..]) {
            power += S::one();
            *slope = value * power;
        }
        if let Some(last) = slope.last_mut() {
            *last = S::zero();
        }
        (value, slope)
    }

    fn land(&mut self, time: S, state: &mut [S]) -> bool {
        let whole = self.flow.length();
        let rounding = S::from_f64(8.0 * S::ROUNDOFF) * whole;
        let theta = self.theta.map(|theta| theta + self.flow.phase_rate() * time);
        let FlightBuffers { next, value, .. } = &mut *self.buffers;
        let states = state.len() - usize::from(theta.is_some());
        if (time - whole).abs() <= rounding {
            self.flow.advance(&self.extended.values, next);
            state[..states].copy_from_slice(&next[..states]);
            if let Some(one) = next.last_mut() {
                *one = S::one();
            }
            self.extended.put(next, theta);
        } else {
            let values = &self.extended.values;
            self.flow.states_at(time, values, value, &mut state[..states]);
        }
        if let (Some(theta), Some(phase)) = (theta, state.get_mut(states)) {
            *phase = theta;
        }
        state.iter().all(|value| value.is_finite())
    }
}
