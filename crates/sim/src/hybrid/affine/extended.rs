//! The extended state: the states, the harmonics of the phase, and one.

use crate::numeric::Real;

/// The extended state that belongs to a full state, and the phases whose harmonics are known.
#[derive(Clone, Debug)]
pub(super) struct Extended<S> {
    states: usize,
    phase: Option<usize>,
    multiples: Vec<S>,
    pub(super) values: Vec<S>,
    /// Phase of the harmonics in `values`.
    theta: Option<S>,
    /// The phase a period starts from, and its harmonics.
    anchor: Option<S>,
    anchored: Vec<S>,
}

/// The harmonic of one force.
#[derive(Clone, Copy, Debug)]
pub(in crate::hybrid) struct Harmonic {
    /// The phase at which it is known.
    pub(super) phase: Option<f64>,
    /// Cosine and sine.
    pub(super) pair: [f64; 2],
}

impl<S: Real> Extended<S> {
    pub(super) fn new(states: usize, phase: Option<usize>, harmonics: usize) -> Self {
        let mut values = vec![S::zero(); states + 2 * harmonics + 1];
        values[states + 2 * harmonics] = S::one();
        Self {
            states,
            phase,
            multiples: Vec::new(),
            values,
            theta: None,
            anchor: None,
            anchored: vec![S::zero(); 2 * harmonics],
        }
    }

    /// Number of states before the harmonics.
    pub(super) fn states(&self) -> usize {
        self.states
    }

    pub(super) fn set_multiples(&mut self, multiples: &[S]) {
        self.multiples.clear();
        self.multiples.extend_from_slice(multiples);
        self.forget();
    }

    /// Forgets the harmonics, so that a motion does not depend on the one before.
    pub(super) fn forget(&mut self) {
        (self.theta, self.anchor) = (None, None);
    }

    /// Takes a full state; `anchor` is the phase a period starts from.
    #[inline(always)]
    pub(super) fn take(&mut self, state: &[S], anchor: S) {
        for (value, &state) in self.values[..self.states].iter_mut().zip(state) {
            *value = state;
        }
        if let Some(phase) = self.phase {
            self.go_to_phase(state[phase], anchor);
        }
    }

    /// Goes to the harmonics of a phase.
    #[inline(always)]
    pub(super) fn go_to_phase(&mut self, theta: S, anchor: S) {
        if self.theta != Some(theta) {
            self.go_to(theta, anchor);
        }
    }

    /// Cosine and sine of the first harmonic, where there is one.
    #[inline(always)]
    pub(super) fn first(&self) -> [S; 2] {
        match self.values[self.states..] {
            [cosine, sine, ..] => [cosine, sine],
            _ => [S::zero(); 2],
        }
    }

    #[inline(never)]
    fn go_to(&mut self, theta: S, anchor: S) {
        let before = self.theta.replace(theta);
        if before.is_some_and(|before| self.turn(theta - before)) {
            return;
        }
        let place = self.states..self.states + self.anchored.len();
        if self.anchor == Some(theta) {
            self.values[place].copy_from_slice(&self.anchored);
            return;
        }
        let harmonics = self.values[place.clone()].chunks_exact_mut(2);
        for (pair, &multiple) in harmonics.zip(&self.multiples) {
            let (sine, cosine) = (multiple * theta).sin_cos();
            pair.copy_from_slice(&[cosine, sine]);
        }
        if theta == anchor {
            self.anchor = Some(theta);
            self.anchored.copy_from_slice(&self.values[place]);
        }
    }

    /// Turns the harmonics by small angles `k change`; `false` where an angle is too large for
    /// that.
    fn turn(&mut self, change: S) -> bool {
        let place = self.states..self.states + self.anchored.len();
        let small = |&multiple: &S| (multiple * change).magnitude() < (0.25 * S::ROUNDOFF).sqrt();
        if !self.multiples.iter().all(small) {
            return false;
        }
        let harmonics = self.values[place].chunks_exact_mut(2);
        for (pair, &multiple) in harmonics.zip(&self.multiples) {
            let (cosine, sine, angle) = (pair[0], pair[1], multiple * change);
            pair.copy_from_slice(&[cosine - sine * angle, sine + cosine * angle]);
        }
        true
    }

    /// Takes over the extended state after a step, at a phase.
    pub(super) fn put(&mut self, values: &[S], theta: Option<S>) {
        self.values.copy_from_slice(values);
        self.theta = theta;
    }
}

impl Extended<f64> {
    /// The first harmonic, of a system that has one.
    pub(super) fn harmonic(&self) -> Harmonic {
        Harmonic {
            phase: self.theta,
            pair: self.first(),
        }
    }

    /// Puts the only harmonic.
    pub(super) fn put_harmonic(&mut self, harmonic: Harmonic) {
        self.values[self.states..][..2].copy_from_slice(&harmonic.pair);
        self.theta = harmonic.phase;
    }
}
