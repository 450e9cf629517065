//! One step of an affine flight.

use super::extended::Extended;
use super::tools::Buffers;
use crate::flow::AffineFlow;
use crate::hybrid::flight::{Flight, Outlook};
use crate::hybrid::passage::{Goal, Heading, Start};
use crate::numeric::Real;

/// A step of the exact flow: polynomials of the watched functions are formed when they are asked for.
pub(in crate::hybrid) struct AffineFlight<'t, S: Real> {
    flow: &'t AffineFlow<S>,
    extended: &'t mut Extended<S>,
    buffers: &'t mut Buffers<S>,
    theta: Option<S>,
}

/// Share of the size of its terms within which a control point has no sign.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;

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

    fn outlook(&mut self, watch: usize, length: S, start: &Start<S>, goal: &Goal<S>) -> Outlook {
        let Buffers {
            control, rounded, ..
        } = &mut *self.buffers;
        self.flow.control_points(watch, rounded, control);
        let rounding = ROUNDING * self.flow.size(watch, rounded);
        let near = match *goal {
            Goal::Crossing { near } => near.to_f64().max(0.0),
            Goal::Minima => f64::INFINITY,
        };
        let seen = if near == 0.0 {
            signs(control, start.may_be_zero(), rounding)
        } else {
            None
        };
        let whole = length >= self.flow.length();
        let seen = seen.unwrap_or_else(|| turns(control, near, rounding, whole));
        seen.in_time(self.flow.length().to_f64())
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
        let rounding = S::from_f64(8.0 * S::ROUNDOFF) * whole;
        let theta = self
            .theta
            .map(|theta| theta + self.flow.phase_rate() * time);
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
            let values = &self.extended.values;
            self.flow
                .states_at(time, values, value, &mut state[..states]);
        }
        if let (Some(theta), Some(phase)) = (theta, state.get_mut(states)) {
            *phase = theta;
        }
        state.iter().all(|value| value.is_finite())
    }
}

/// What the signs of a function's control points tell of its zeros on the step; `None` if not enough.
///
/// A polynomial has no more zeros than its control points have changes of sign, and differs from that by an even
/// number. The first point has no say where the step starts on a zero.
#[inline(always)]
pub(super) fn signs(control: &[f64], on_zero: bool, rounding: f64) -> Option<Outlook> {
    let rest = &control[usize::from(on_zero)..];
    if all_above(rest, rounding) {
        return Some(Outlook::QUIET);
    }
    let positive = rest.iter().take_while(|&&b| b > rounding).count();
    if positive == 0 || !rest[positive..].iter().all(|&b| b < -rounding) {
        return None;
    }
    let place = positive + usize::from(on_zero);
    let (before, after) = (control[place - 1], control[place]);
    let share = (place as f64 - after / (after - before)) / (control.len() - 1) as f64;
    Some(Outlook::OneCrossing { near: share })
}

/// Whether all are larger than a bound; most often they are, so that none is left out for being late.
#[inline(always)]
fn all_above(values: &[f64], bound: f64) -> bool {
    let (chunks, rest) = values.as_chunks::<4>();
    let mut above = [true; 4];
    for chunk in chunks {
        for (above, &value) in above.iter_mut().zip(chunk) {
            *above &= value > bound;
        }
    }
    above == [true; 4] && rest.iter().all(|&value| value > bound)
}

/// What the turns of a function's control points tell of its extrema on the step, gaps up to `near` being of interest.
///
/// A polynomial has no more extrema than its control points, and differs from that by an even number; it lies
/// between the least and the greatest of them, and starts and ends with the first and the last. `whole`: nothing is cut
/// off the step.
fn turns(control: &[f64], near: f64, rounding: f64, whole: bool) -> Outlook {
    let lowest = control
        .iter()
        .fold(f64::INFINITY, |low, &b| if b < low { b } else { low });
    if lowest > near + rounding {
        return Outlook::QUIET;
    }
    let last = control.len() - 1;
    let run = |from: usize, falls: bool| {
        let pairs = control[from..].windows(2);
        let goes_on = |pair: &&[f64]| {
            if falls {
                pair[1] < pair[0] - rounding
            } else {
                pair[1] > pair[0] + rounding
            }
        };
        from + pairs.take_while(goes_on).count()
    };
    let falls = control[1] < control[0];
    let first = run(0, falls);
    if first == last {
        return match falls && control[last] <= rounding {
            true => Outlook::Monotone,
            false => Outlook::Quiet {
                end: if falls {
                    Heading::Falling
                } else {
                    Heading::Rising
                },
            },
        };
    }
    if first == 0 || run(first, !falls) != last {
        return Outlook::Open;
    }
    if !falls && whole && control[last] > rounding {
        return Outlook::Quiet {
            end: Heading::Falling,
        };
    }
    let [before, at, after] = [control[first - 1], control[first], control[first + 1]];
    let offset = 0.5 * (before - after) / (before - 2.0 * at + after);
    Outlook::OneExtremum {
        near: (first as f64 + offset) / last as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_points_tell_quiet_steps_from_those_that_must_be_searched() {
        let quiet = [
            [3.0, 2.0, 1.0, 0.5],
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 3.0, 1.0],
        ];
        for control in quiet {
            let seen = turns(&control, f64::INFINITY, 1e-9, true);
            assert!(matches!(seen, Outlook::Quiet { .. }), "{seen:?}");
        }
        let dip = [3.0, 1.0, 0.5, 2.0, 4.0];
        assert_eq!(turns(&dip, 0.0, 1e-9, true), Outlook::QUIET);
        assert!(matches!(
            turns(&dip, 1.0, 1e-9, true),
            Outlook::OneExtremum { near } if near > 0.25 && near < 0.75
        ));
        assert_eq!(turns(&[3.0, 1.0, -1.0], 0.0, 1e-9, true), Outlook::Monotone);
        assert_eq!(
            turns(&[1.0, 0.0, 1.0, 0.0, 1.0], 0.0, 1e-9, true),
            Outlook::Open
        );
        assert_eq!(
            turns(&[1.0, 1.0 + 1e-12, 2.0], 2.0, 1e-9, true),
            Outlook::Open
        );
    }
}
