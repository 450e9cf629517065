//! The moving point: full state, time, regime, and what must be remembered between steps.

use super::passage::{Heading, Start};
use super::system::Regime;
use crate::numeric::Real;

/// Share of the time in which the motion changes within which a minimum is the one reported last.
pub(super) const SAME_MINIMUM: f64 = 1e-7;

/// State of a simulation between two steps.
#[derive(Clone, Debug)]
pub(super) struct Motion<S> {
    pub(super) state: Vec<S>,
    pub(super) time: S,
    pub(super) regime: Regime,
    /// Whole periods removed from the phase.
    pub(super) turns: i64,
    /// Phase about which the phase is kept: it stays within half a period of it.
    pub(super) reference_phase: S,
    /// Factor that makes the present regime's release function positive; 0 until its first step.
    pub(super) release_sign: S,
    /// Rounding of the release function where the present contact began.
    pub(super) release_rounding: S,
    /// Uncertainty of the time at which the surface was met: the gap left there over the speed.
    pub(super) entry_uncertainty: S,
    /// Time after which the gap would turn along the free flow from there; infinite where it would
    /// not.
    pub(super) entry_turn: S,
    /// Per surface: rounding of its gap if the state has just left it.
    pub(super) leaving: Vec<Option<S>>,
    /// Per surface: which way its gap was found to go here, so that a minimum between two steps is
    /// neither lost nor found twice.
    pub(super) headings: Vec<Heading>,
    /// The time in which the motion changed on the last step.
    pub(super) last_step: S,
}

impl<S: Real> Motion<S> {
    pub(super) fn new(dimension: usize, surfaces: usize) -> Self {
        Self {
            state: vec![S::zero(); dimension],
            time: S::zero(),
            regime: Regime::Free,
            turns: 0,
            reference_phase: S::zero(),
            release_sign: S::zero(),
            release_rounding: S::zero(),
            entry_uncertainty: S::zero(),
            entry_turn: S::zero(),
            leaving: vec![None; surfaces],
            headings: vec![Heading::Unknown; surfaces],
            last_step: S::one(),
        }
    }

    /// Takes over another motion without allocating.
    pub(super) fn copy_from(&mut self, other: &Self) {
        let mut state = std::mem::take(&mut self.state);
        let mut leaving = std::mem::take(&mut self.leaving);
        let mut headings = std::mem::take(&mut self.headings);
        state.copy_from_slice(&other.state);
        leaving.copy_from_slice(&other.leaving);
        headings.copy_from_slice(&other.headings);
        *self = Self {
            state,
            leaving,
            headings,
            ..*other
        };
    }

    /// How the search of a surface's gap starts here.
    pub(super) fn start(&self, surface: usize) -> Start<S> {
        self.start_after(surface, self.headings[surface])
    }

    /// The same where the gap went this way before.
    pub(super) fn start_after(&self, surface: usize, before: Heading) -> Start<S> {
        match self.leaving[surface] {
            Some(rounding) => Start::leaving(rounding),
            None => self.inside(before),
        }
    }

    /// A search that starts anywhere, the gap having gone this way before.
    pub(super) fn inside(&self, before: Heading) -> Start<S> {
        Start::inside(before, self.last_step * S::from_f64(SAME_MINIMUM))
    }

    /// Forgets which way the gaps go: the state or the field is another one.
    pub(super) fn lose_headings(&mut self) {
        self.headings.fill(Heading::Unknown);
    }

    /// Remembers that a surface's gap fell to zero here: if it does not fall any more its minimum
    /// is here too.
    pub(super) fn set_at_contact(&mut self, surface: usize) {
        self.lose_headings();
        self.headings[surface] = Heading::Falling;
    }

    /// Remembers that a minimum of a surface's gap was reported here.
    pub(super) fn set_at_minimum(&mut self, surface: usize) {
        self.lose_headings();
        self.headings[surface] = Heading::Rising;
    }

    /// Keeps the phase within half a period of its reference.
    pub(super) fn reduce_phase(&mut self, component: usize, period: S) {
        let half = period * S::from_f64(0.5);
        while self.state[component] - self.reference_phase >= half {
            self.state[component] -= period;
            self.turns += 1;
        }
    }
}
