//! The harmonic of one force in lanes: [`Extended`](super::extended::Extended) of several orbits,
//! without their states.
//!
//! One idea: whatever is copied, turned or formed anew has the bits that one orbit has there.

use super::extended::Harmonic;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// Cosine and sine of a multiple of phases, and the phases they are known at.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneHarmonics<const N: usize> {
    multiple: Lanes<N>,
    /// NaN where they are not known.
    phase: Lanes<N>,
    pair: [Lanes<N>; 2],
    /// The phases that periods start from, and the harmonics there.
    anchor: Lanes<N>,
    anchored: [Lanes<N>; 2],
}

impl<const N: usize> LaneHarmonics<N> {
    pub(super) fn new(multiple: Lanes<N>) -> Self {
        let (unknown, zero) = (Lanes::splat(f64::NAN), Lanes::splat(0.0));
        Self {
            multiple,
            phase: unknown,
            pair: [zero; 2],
            anchor: unknown,
            anchored: [zero; 2],
        }
    }

    /// Puts the harmonic of a lane.
    pub(super) fn put(&mut self, lane: usize, harmonic: Harmonic) {
        self.phase[lane] = harmonic.phase.unwrap_or(f64::NAN);
        for (own, value) in self.pair.iter_mut().zip(harmonic.pair) {
            own[lane] = value;
        }
    }

    /// The harmonic of a lane.
    pub(super) fn of(&self, lane: usize) -> Harmonic {
        let phase = self.phase[lane];
        Harmonic {
            phase: (!phase.is_nan()).then_some(phase),
            pair: self.pair.map(|own| own[lane]),
        }
    }

    /// Cosines and sines.
    #[inline(always)]
    pub(super) fn pair(&self) -> [Lanes<N>; 2] {
        self.pair
    }

    /// Turns them by small angles, or forms them anew, where they are wanted.
    #[inline(always)]
    pub(super) fn go_to(&mut self, phase: Lanes<N>, reference: Lanes<N>, wanted: LaneMask<N>) {
        let moves = wanted & !self.phase.is_equal(phase);
        if !moves.any() {
            return;
        }
        let angle = self.multiple * (phase - self.phase);
        self.phase = Lanes::select(moves, phase, self.phase);
        let largest = Lanes::splat((0.25 * f64::ROUNDOFF).sqrt());
        let turns = moves & angle.abs().is_below(largest);
        let [cosine, sine] = self.pair;
        self.pair = [
            Lanes::select(turns, cosine - sine * angle, cosine),
            Lanes::select(turns, sine + cosine * angle, sine),
        ];
        let anew = moves & !turns;
        if anew.any() {
            let home = anew & phase.is_equal(self.anchor);
            self.select(home, self.anchored);
            let formed = anew & !home;
            if formed.any() {
                let (sine, cosine) = (self.multiple * phase).sin_cos();
                self.select(formed, [cosine, sine]);
                let home = formed & phase.is_equal(reference);
                self.anchor = Lanes::select(home, phase, self.anchor);
                for (anchored, value) in self.anchored.iter_mut().zip(self.pair) {
                    *anchored = Lanes::select(home, value, *anchored);
                }
            }
        }
    }

    #[inline(always)]
    fn select(&mut self, wanted: LaneMask<N>, values: [Lanes<N>; 2]) {
        for (own, value) in self.pair.iter_mut().zip(values) {
            *own = Lanes::select(wanted, value, *own);
        }
    }
}
