//! Extended states in lanes: [`Extended`](super::extended::Extended) of several orbits.

use crate::numeric::{LaneMask, Lanes, Scalar};

/// The extended states that belong to full states, and the phases whose harmonics are known.
#[derive(Clone, Debug)]
pub(super) struct LaneExtended<const N: usize> {
    states: usize,
    phase: Option<usize>,
    multiples: Vec<Lanes<N>>,
    pub(super) values: Vec<Lanes<N>>,
    /// Phases of the harmonics in `values`; NaN where they are not known.
    theta: Lanes<N>,
}

impl<const N: usize> LaneExtended<N> {
    pub(super) fn new(states: usize, phase: Option<usize>, multiples: Vec<Lanes<N>>) -> Self {
        let mut values = vec![Lanes::splat(0.0); states + 2 * multiples.len()];
        values.push(Lanes::splat(1.0));
        Self {
            states,
            phase,
            multiples,
            values,
            theta: Lanes::splat(f64::NAN),
        }
    }

    /// Forgets the harmonics, so that a motion does not depend on the one before.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        self.theta = Lanes::splat(f64::NAN);
    }

    /// Takes full states, and harmonics where they are wanted.
    #[inline(always)]
    pub(super) fn take(&mut self, state: &[Lanes<N>], wanted: LaneMask<N>) {
        self.values[..self.states].copy_from_slice(&state[..self.states]);
        if let Some(phase) = self.phase {
            for lane in wanted.lanes() {
                let theta = state[phase][lane];
                if self.theta[lane] != theta {
                    self.go_to(lane, theta);
                }
            }
        }
    }

    /// Turns the harmonics of a lane by a small angle, or forms them anew.
    fn go_to(&mut self, lane: usize, theta: f64) {
        let change = theta - self.theta[lane];
        self.theta[lane] = theta;
        let largest = (0.25 * f64::ROUNDOFF).sqrt();
        let is_small = |multiple: &Lanes<N>| (multiple[lane] * change).abs() < largest;
        let turns = self.multiples.iter().all(is_small);
        let harmonics = self.values[self.states..].chunks_exact_mut(2);
        for (pair, multiple) in harmonics.zip(&self.multiples) {
            let (cosine, sine) = if turns {
                let angle = multiple[lane] * change;
                let (cosine, sine) = (pair[0][lane], pair[1][lane]);
                (cosine - sine * angle, sine + cosine * angle)
            } else {
                let (sine, cosine) = (multiple[lane] * theta).sin_cos();
                (cosine, sine)
            };
            (pair[0][lane], pair[1][lane]) = (cosine, sine);
        }
    }
}
