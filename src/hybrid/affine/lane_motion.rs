//! Orbits that are flown side by side: each at its own state and time.

use crate::numeric::{Branched, LaneMask, Lanes, Mask};

/// States of free flight of `N` orbits at one surface: [`Motion`](crate::hybrid::motion::Motion) in lanes.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct LaneMotion<const N: usize> {
    pub(in crate::hybrid) state: Vec<Lanes<N>>,
    pub(in crate::hybrid) time: Lanes<N>,
    /// Whole periods removed from the phase.
    pub(in crate::hybrid) turns: Lanes<N>,
    /// Where the surface has just been left, and the rounding of its gap there.
    pub(in crate::hybrid) leaving: LaneMask<N>,
    pub(in crate::hybrid) rounding: Lanes<N>,
    /// Where the gap is known to rise.
    pub(in crate::hybrid) rises: LaneMask<N>,
    /// Where the gap is known to fall.
    pub(in crate::hybrid) falls: LaneMask<N>,
}

impl<const N: usize> LaneMotion<N> {
    pub(in crate::hybrid) fn new(dimension: usize) -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            state: vec![zero; dimension],
            time: zero,
            turns: zero,
            leaving: LaneMask::NONE,
            rounding: zero,
            rises: LaneMask::NONE,
            falls: LaneMask::NONE,
        }
    }

    /// Takes over other motions where that is wanted.
    #[inline(always)]
    pub(in crate::hybrid) fn take(&mut self, wanted: LaneMask<N>, other: &Self) {
        for (state, &other) in self.state.iter_mut().zip(&other.state) {
            *state = Lanes::select(wanted, other, *state);
        }
        let number = |one, other| Lanes::select(wanted, one, other);
        let mask = |one: LaneMask<N>, other: LaneMask<N>| (one & wanted) | (other & !wanted);
        self.time = number(other.time, self.time);
        self.turns = number(other.turns, self.turns);
        self.leaving = mask(other.leaving, self.leaving);
        self.rounding = number(other.rounding, self.rounding);
        self.rises = mask(other.rises, self.rises);
        self.falls = mask(other.falls, self.falls);
    }

    /// Forgets which way the gaps go.
    #[inline(always)]
    pub(in crate::hybrid) fn lose_headings(&mut self, wanted: LaneMask<N>) {
        self.rises &= !wanted;
        self.falls &= !wanted;
    }

    /// Keeps phases within half a period of their references.
    #[inline(always)]
    pub(in crate::hybrid) fn reduce_phase(
        &mut self,
        wanted: LaneMask<N>,
        component: usize,
        reference: Lanes<N>,
        period: f64,
    ) {
        let (half, one) = (Lanes::splat(0.5 * period), Lanes::splat(1.0));
        loop {
            let phase = self.state[component];
            let beyond = half.is_at_most(phase - reference) & wanted;
            if !beyond.any() {
                return;
            }
            let reduced = phase - Lanes::splat(period);
            self.state[component] = Lanes::select(beyond, reduced, phase);
            self.turns = Lanes::select(beyond, self.turns + one, self.turns);
        }
    }
}
