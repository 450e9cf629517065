//! Extended states in lanes: [`Extended`](super::extended::Extended) of several orbits.

use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

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
            let moves = wanted & !self.theta.is_equal(state[phase]);
            if moves.any() {
                self.go_to(state[phase], moves);
            }
        }
    }

    /// Turns the harmonics of lanes by a small angle, or forms them anew.
    #[inline(always)]
    fn go_to(&mut self, theta: Lanes<N>, moves: LaneMask<N>) {
        let change = theta - self.theta;
        self.theta = Lanes::select(moves, theta, self.theta);
        let largest = Lanes::splat((0.25 * f64::ROUNDOFF).sqrt());
        let mut turns = moves;
        for &multiple in &self.multiples {
            turns &= (multiple * change).abs().is_below(largest);
        }
        let anew = moves & !turns;
        let harmonics = self.values[self.states..].chunks_exact_mut(2);
        for (pair, &multiple) in harmonics.zip(&self.multiples) {
            let (cosine, sine, angle) = (pair[0], pair[1], multiple * change);
            pair[0] = Lanes::select(turns, cosine - sine * angle, cosine);
            pair[1] = Lanes::select(turns, sine + cosine * angle, sine);
            if anew.any() {
                let (sine, cosine) = (multiple * theta).sin_cos();
                pair[0] = Lanes::select(anew, cosine, pair[0]);
                pair[1] = Lanes::select(anew, sine, pair[1]);
            }
        }
    }
}
