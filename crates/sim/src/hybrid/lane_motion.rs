//! Orbits that are flown side by side: each at its own state and time.

use super::motion::SAME_MINIMUM;
use super::passage::Start;
use crate::numeric::{Branched, LaneMask, Lanes, Mask};

/// States of free flight of `N` orbits at one surface: [`Motion`](super::motion::Motion) in lanes.
#[derive(Clone, Debug)]
pub(super) struct LaneMotion<const N: usize> {
    pub(super) state: Vec<Lanes<N>>,
    pub(super) time: Lanes<N>,
    /// Whole periods removed from the phase.
    pub(super) turns: Lanes<N>,
    /// Where the surface has just been left, and the rounding of its gap there.
    pub(super) leaving: LaneMask<N>,
    pub(super) rounding: Lanes<N>,
    /// Where the gap is known to rise.
    pub(super) rises: LaneMask<N>,
    /// Where the gap is known to fall.
    pub(super) falls: LaneMask<N>,
    /// The times in which the motions changed on their last steps.
    pub(super) last_step: Lanes<N>,
}

impl<const N: usize> LaneMotion<N> {
    pub(super) fn new(dimension: usize) -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            state: vec![zero; dimension],
            time: zero,
            turns: zero,
            leaving: LaneMask::NONE,
            rounding: zero,
            rises: LaneMask::NONE,
            falls: LaneMask::NONE,
            last_step: Lanes::splat(1.0),
        }
    }

    /// Takes over other motions where that is wanted.
    #[inline(always)]
    pub(super) fn take(&mut self, wanted: LaneMask<N>, other: &Self) {
        if !wanted.any() {
            return;
        }
        for (state, &other) in self.state.iter_mut().zip(&other.state) {
            take(wanted, other, state);
        }
        take(wanted, other.time, &mut self.time);
        take(wanted, other.turns, &mut self.turns);
        take_mask(wanted, other.leaving, &mut self.leaving);
        take(wanted, other.rounding, &mut self.rounding);
        take_mask(wanted, other.rises, &mut self.rises);
        take_mask(wanted, other.falls, &mut self.falls);
        take(wanted, other.last_step, &mut self.last_step);
    }

    /// Forgets which way the gaps go.
    #[inline(always)]
    pub(super) fn lose_headings(&mut self, wanted: LaneMask<N>) {
        self.rises &= !wanted;
        self.falls &= !wanted;
    }

    /// How searches of the gaps start here.
    #[inline(always)]
    pub(super) fn start(&self) -> Start<Lanes<N>> {
        Start {
            rose: self.rises & !self.leaving,
            fell: self.falls & !self.leaving,
            within: self.last_step * Lanes::splat(SAME_MINIMUM),
            leaving: self.leaving,
            rounding: self.rounding,
        }
    }

    /// Keeps phases within half a period of their references.
    #[inline(always)]
    pub(super) fn reduce_phase(
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

// NOTE: no closures, which the compiler may leave out of a kernel, for the least machine.
#[inline(always)]
fn take<const N: usize>(wanted: LaneMask<N>, other: Lanes<N>, own: &mut Lanes<N>) {
    *own = Lanes::select(wanted, other, *own);
}

#[inline(always)]
fn take_mask<const N: usize>(wanted: LaneMask<N>, other: LaneMask<N>, own: &mut LaneMask<N>) {
    *own = (other & wanted) | (*own & !wanted);
}
