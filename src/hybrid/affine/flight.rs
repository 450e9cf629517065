//! One step of an affine flight.

use super::extended::Extended;
use super::tools::Buffers;
use crate::flow::AffineFlow;
use crate::hybrid::flight::{Flight, Outlook};
use crate::hybrid::passage::Goal;
use crate::numeric::{Real, polynomial};

/// A step of the exact flow: polynomials of the watched functions are formed when they are asked for.
pub(in crate::hybrid) struct AffineFlight<'t, S: Real> {
    flow: &'t AffineFlow<S>,
    extended: &'t mut Extended<S>,
    buffers: &'t mut Buffers<S>,
    theta: Option<S>,
}

/// Share of the size of its terms within which a control point has no sign.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl<'t, S: Real> AffineFlight<'t, S> {
    pub(super) fn new(
        flow: &'t AffineFlow<S>,
        extended: &'t mut Extended<S>,
        buffers: &'t mut Buffers<S>,
        theta: Option<S>,
    ) -> Self {
        let len = flow.coefficients();
        buffers.value.resize(len, S::zero());
        buffers.slope.resize(len, S::zero());
        buffers.control.resize(len, 0.0);
        for (rounded, value) in buffers.rounded.iter_mut().zip(&extended.values) {
            *rounded = value.to_f64();
        }
        Self {
            flow,
            extended,
            buffers,
            theta,
        }
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
        let Buffers {
            control, rounded, ..
        } = &mut *self.buffers;
        self.flow.control_points(watch, rounded, control);
        let rounding = ROUNDING * self.flow.size(watch, rounded);
        let near = match *goal {
            Goal::Crossing { near } => near.to_f64().max(0.0),
            Goal::Minima => f64::INFINITY,
        };
        outlook(control, near, rounding).in_time(self.flow.length().to_f64())
    }

    fn polynomials(&mut self, watch: usize) -> (&[S], &[S]) {
        let Buffers { value, slope, .. } = &mut *self.buffers;
        self.flow
            .watched_series(watch, &self.extended.values, value);
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
        let rounding = S::from_f64(64.0 * S::ROUNDOFF) * whole;
        let theta = self.theta.map(|theta| theta + self.flow.phase_rate() * time);
        let Buffers { next, value, .. } = &mut *self.buffers;
        let states = state.len() - usize::from(theta.is_some());
        if (time - whole).abs() <= rounding {
            self.flow.advance(&self.extended.values, next);
            state[..states].copy_from_slice(&next[..states]);
            if let Some(one) = next.last_mut() {
                *one = S::one();
            }
            self.extended.put(next, theta);
        } else {
            for (component, state) in state[..states].iter_mut().enumerate() {
                self.flow
                    .state_series(component, &self.extended.values, value);
                *state = polynomial::value(value, time);
            }
        }
        if let (Some(theta), Some(phase)) = (theta, state.get_mut(states)) {
            *phase = theta;
        }
        state.iter().all(|value| value.is_finite())
    }
}

/// What the control points of a function tell of it on the step.
///
/// A polynomial has no more extrema than its control points, and as many if they have one at most; it lies
/// between the least and the greatest of them, and starts and ends with the first and the last.
fn outlook(control: &[f64], near: f64, rounding: f64) -> Outlook {
    let lowest = control.iter().fold(f64::INFINITY, |low, &b| if b < low { b } else { low });
    if lowest > near + rounding {
        return Outlook::Quiet;
    }
    let (mut falls, mut rises) = (0usize, 0usize);
    for pair in control.windows(2) {
        falls += usize::from(pair[1] < pair[0] - rounding);
        rises += usize::from(pair[1] > pair[0] + rounding);
    }
    let steps = control.len() - 1;
    if falls + rises != steps {
        return Outlook::Open;
    }
    let last = control[steps];
    match (falls, rises) {
        (0, _) => return Outlook::Quiet,
        (_, 0) if last > rounding => return Outlook::Quiet,
        (_, 0) => return Outlook::Monotone,
        _ => {}
    }
    if control[1] < control[0] {
        let turns = control[..=falls].windows(2).all(|pair| pair[1] < pair[0]);
        turn(control, falls, turns)
    } else {
        let turns = control[..=rises].windows(2).all(|pair| pair[1] > pair[0]);
        if turns && last > rounding {
            return Outlook::Quiet;
        }
        turn(control, rises, turns)
    }
}

/// One extremum, near the control point `place`, where the points turn once.
fn turn(control: &[f64], place: usize, once: bool) -> Outlook {
    if !once {
        return Outlook::Open;
    }
    let [before, at, after] = [control[place - 1], control[place], control[place + 1]];
    let offset = 0.5 * (before - after) / (before - 2.0 * at + after);
    let share = (place as f64 + offset) / (control.len() - 1) as f64;
    Outlook::OneExtremum { near: share }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_points_tell_quiet_steps_from_those_that_must_be_searched() {
        let quiet = [[3.0, 2.0, 1.0, 0.5], [0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 1.0]];
        for control in quiet {
            assert_eq!(outlook(&control, f64::INFINITY, 1e-9), Outlook::Quiet);
        }
        let dip = [3.0, 1.0, 0.5, 2.0, 4.0];
        assert_eq!(outlook(&dip, 0.0, 1e-9), Outlook::Quiet);
        assert!(matches!(
            outlook(&dip, 1.0, 1e-9),
            Outlook::OneExtremum { near } if near > 0.25 && near < 0.75
        ));
        assert_eq!(outlook(&[3.0, 1.0, -1.0], 0.0, 1e-9), Outlook::Monotone);
        assert_eq!(outlook(&[1.0, 0.0, 1.0, 0.0, 1.0], 0.0, 1e-9), Outlook::Open);
        assert_eq!(outlook(&[1.0, 1.0 + 1e-12, 2.0], 2.0, 1e-9), Outlook::Open);
    }
}
