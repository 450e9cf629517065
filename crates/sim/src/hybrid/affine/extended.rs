//! The extended state: the states, the harmonics of the phase, and the number 1; for one orbit, or
//! for several in lanes. Also one step of an affine flight.

use num_traits::{One as _, Zero as _};

use super::polygon::{Polygon, ROUNDING};
use crate::flow::{AffineFlow, Backend, NumberMask, RoundedNumber, Single};
use crate::hybrid::passage::{Flight, Goal, Outlook};
use crate::numeric::{Branched, Mask, Real, Scalar, Vectorised};

/// Extended state of a full state, with the phases for which harmonics are known.
#[derive(Clone, Debug)]
pub(super) struct Extended<B: Backend> {
    states: usize,
    phase: Option<usize>,
    multiples: Vec<B::Number>,
    pub(super) values: Vec<B::Number>,
    /// Phase of the harmonics in `values`; NaN if unknown.
    theta: B::Number,
    /// Phase at which harmonics were first computed, to which the phase comes back after periods
    /// and returns, and the harmonics there; NaN before the first computation.
    anchor: B::Number,
    anchored: Vec<B::Number>,
}

impl<B: Backend> Extended<B> {
    pub(super) fn new(states: usize, phase: Option<usize>, harmonics: usize) -> Self {
        let (zero, unknown) = (B::Number::zero(), B::Number::from_f64(f64::NAN));
        let mut values = vec![zero; states + 2 * harmonics];
        values.push(B::Number::one());
        Self {
            states,
            phase,
            multiples: Vec::new(),
            values,
            theta: unknown,
            anchor: unknown,
            anchored: vec![zero; 2 * harmonics],
        }
    }

    /// Number of states before the harmonics.
    pub(super) fn states(&self) -> usize {
        self.states
    }

    pub(super) fn set_multiples(&mut self, multiples: &[B::Number]) {
        self.multiples.clear();
        self.multiples.extend_from_slice(multiples);
        self.forget();
    }

    /// Forgets the harmonics, so that a motion does not depend on the previous one.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        let unknown = B::Number::from_f64(f64::NAN);
        (self.theta, self.anchor) = (unknown, unknown);
    }

    /// Sets the states from full states, and the harmonics in the wanted lanes.
    #[inline(always)]
    pub(super) fn take(&mut self, state: &[B::Number], wanted: NumberMask<B>) {
        for (value, &state) in self.values[..self.states].iter_mut().zip(state) {
            *value = state;
        }
        if let Some(phase) = self.phase {
            let theta = state[phase];
            let moves = wanted & !self.theta.is_equal(theta);
            if moves.any() {
                B::seldom(NewPhase { extended: self, theta, moves });
            }
        }
    }

    /// Sets the extended state after a step, and its phase.
    pub(super) fn put(&mut self, values: &[B::Number], theta: Option<B::Number>) {
        self.values.copy_from_slice(values);
        self.theta = theta.unwrap_or(B::Number::from_f64(f64::NAN));
    }
}

/// Moves harmonics to another phase: turned by a small angle, copied, or computed anew.
struct NewPhase<'t, B: Backend> {
    extended: &'t mut Extended<B>,
    theta: B::Number,
    moves: NumberMask<B>,
}

impl<B: Backend> Vectorised for NewPhase<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { extended, theta, moves } = self;
        let select = B::Number::select;
        let change = theta - extended.theta;
        extended.theta = select(moves, theta, extended.theta);
        let largest = RoundedNumber::<B>::from_f64((0.25 * B::Number::ROUNDOFF).sqrt());
        let mut turns = moves;
        for &multiple in &extended.multiples {
            turns &= (multiple * change).rounded().abs().is_below(largest);
        }
        let anew = moves & !turns;
        let home = anew & theta.is_equal(extended.anchor);
        let formed = anew & !home;
        let first = formed & !extended.anchor.is_equal(extended.anchor);
        let harmonics = extended.values[extended.states..].chunks_exact_mut(2);
        let anchored = extended.anchored.chunks_exact_mut(2);
        for ((pair, anchored), &multiple) in harmonics.zip(anchored).zip(&extended.multiples) {
            if turns.any() {
                let (cosine, sine, angle) = (pair[0], pair[1], multiple * change);
                pair[0] = select(turns, cosine - sine * angle, cosine);
                pair[1] = select(turns, sine + cosine * angle, sine);
            }
            if home.any() {
                pair[0] = select(home, anchored[0], pair[0]);
                pair[1] = select(home, anchored[1], pair[1]);
            }
            if formed.any() {
                let (sine, cosine) = (multiple * theta).sin_cos();
                pair[0] = select(formed, cosine, pair[0]);
                pair[1] = select(formed, sine, pair[1]);
                anchored[0] = select(first, cosine, anchored[0]);
                anchored[1] = select(first, sine, anchored[1]);
            }
        }
        extended.anchor = select(first, theta, extended.anchor);
    }
}

/// Buffers for the polynomials of one watched function, and for the extended state after a step.
#[derive(Clone, Debug)]
pub(super) struct FlightBuffers<S> {
    value: Vec<S>,
    slope: Vec<S>,
    next: Vec<S>,
    control: Vec<f64>,
    rounded: Vec<f64>,
}

impl<S: Real> FlightBuffers<S> {
    /// Buffers for extended states with this number of columns.
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

/// A step of the exact flow; polynomials of the watched functions are computed on demand.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::{Batch, Single};
    use crate::numeric::{LaneMask, Lanes};

    /// Successive phases: harmonics are computed, turned, computed anew, taken from the anchor; and
    /// the last.
    const PHASES: [[f64; 5]; 3] = [
        [0.3, 0.3 + 1e-10, 2.0, 0.3, 0.3],
        [-1.0, 0.5, 0.5 + 1e-9, -1.0, 4.0],
        [0.0, 0.0, 1e-11, 3.0, 0.0],
    ];

    fn extended<B: Backend>(multiples: &[B::Number]) -> Extended<B> {
        let mut extended = Extended::new(1, Some(1), multiples.len());
        extended.set_multiples(multiples);
        extended
    }

    #[test]
    fn harmonics_in_lanes_are_those_of_each_orbit_and_follow_the_phase() {
        let mut lanes = extended::<Batch<3>>(&[1.0, 2.0].map(Lanes::splat));
        let mut alone = [(); 3].map(|()| extended::<Single<f64>>(&[1.0, 2.0]));
        let none = LaneMask::from_fn(|_| false);
        for step in 0..PHASES[0].len() {
            let phase = Lanes(PHASES.map(|phases| phases[step]));
            lanes.take(&[Lanes::splat(7.0), Lanes::splat(9.0)], none);
            lanes.take(&[Lanes::splat(7.0), phase], !none);
            for (lane, own) in alone.iter_mut().enumerate() {
                own.take(&[7.0, phase[lane]], true);
                let found: Vec<f64> = lanes.values.iter().map(|value| value[lane]).collect();
                assert_eq!(found, own.values, "{step} {lane}");
                let (sine, cosine) = (2.0 * phase[lane]).sin_cos();
                assert!((own.values[3] - cosine).abs() < 1e-15, "{step} {lane}");
                assert!((own.values[4] - sine).abs() < 1e-15, "{step} {lane}");
            }
        }
    }
}
