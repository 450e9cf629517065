//! The motion: full state, time, regime, and memory between steps; the motions of several orbits in
//! free flight, in lanes; and the evaluation of a model's expressions at one state.

use super::passage::{Heading, Start};
use crate::flow::Program;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Real, Scalar};

/// Share of the motion's time scale within which a minimum is the one reported last.
pub(super) const SAME_MINIMUM: f64 = 1e-7;

/// Regime of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// Free flight.
    Free,
    /// Compliant contact with a surface.
    Contact {
        /// The surface.
        surface: usize,
    },
    /// Sustained contact with a rigid surface.
    Stick {
        /// The surface.
        surface: usize,
    },
}

impl Regime {
    /// The surface that holds the state.
    #[inline]
    pub(super) fn surface(self) -> Option<usize> {
        match self {
            Self::Free => None,
            Self::Contact { surface } | Self::Stick { surface } => Some(surface),
        }
    }
}

/// State of a simulation between two steps.
#[derive(Clone, Debug)]
pub(super) struct Motion<S> {
    pub(super) state: Vec<S>,
    pub(super) time: S,
    pub(super) regime: Regime,
    /// Whole periods removed from the phase.
    pub(super) turns: i64,
    /// Phase about which the phase is reduced: the phase stays within half a period of it.
    pub(super) reference_phase: S,
    /// Factor that makes the present regime's release function positive; 0 until its first step.
    pub(super) release_sign: S,
    /// Sign of the release function at the start of the present contact, from its slope with
    /// respect to the speed of approach; 0 if the function does not depend on that speed.
    pub(super) entry_sign: S,
    /// Rounding of the release function at the start of the present contact.
    pub(super) release_rounding: S,
    /// Uncertainty of the time of contact: the remaining gap divided by the speed.
    pub(super) entry_uncertainty: S,
    /// Time after the contact at which the gap would turn along the free flow; infinite if the gap
    /// would not turn.
    pub(super) entry_turn: S,
    /// Length of the last hop near a surface on which the present contact has no series; 0 if the
    /// contact has one.
    pub(super) hop: S,
    /// Number of hops of the present contact.
    pub(super) hops: usize,
    /// For each surface: rounding of its gap if the state has just left it.
    pub(super) leaving: Vec<Option<S>>,
    /// For each surface: heading of its gap, so that a minimum between two steps is neither lost
    /// nor found twice.
    pub(super) headings: Vec<Heading>,
    /// Time scale of the motion in the last step.
    pub(super) last_step: S,
    /// Number of successive steps that ended at a corner of the field without leading away from it.
    pub(super) slides: usize,
    /// Time of the last change of velocity or regime at a surface; −∞ before the first.
    pub(super) changed: S,
    /// Number of recorded changes up to this state.
    pub(super) changes: usize,
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
            entry_sign: S::zero(),
            release_rounding: S::zero(),
            entry_uncertainty: S::zero(),
            entry_turn: S::zero(),
            hop: S::zero(),
            hops: 0,
            leaving: vec![None; surfaces],
            headings: vec![Heading::Unknown; surfaces],
            last_step: S::one(),
            slides: 0,
            changed: S::from_f64(f64::NEG_INFINITY),
            changes: 0,
        }
    }

    /// Copies another motion without allocating.
    pub(super) fn copy_from(&mut self, other: &Self) {
        let mut state = std::mem::take(&mut self.state);
        let mut leaving = std::mem::take(&mut self.leaving);
        let mut headings = std::mem::take(&mut self.headings);
        state.copy_from_slice(&other.state);
        leaving.copy_from_slice(&other.leaving);
        headings.copy_from_slice(&other.headings);
        *self = Self { state, leaving, headings, ..*other };
    }

    /// Start of the search for a surface's gap.
    pub(super) fn start(&self, surface: usize) -> Start<S> {
        self.start_after(surface, self.headings[surface])
    }

    /// Start of the search for a surface's gap with a given earlier heading.
    pub(super) fn start_after(&self, surface: usize, before: Heading) -> Start<S> {
        match self.leaving[surface] {
            Some(rounding) => Start::leaving(rounding),
            None => self.inside(before),
        }
    }

    /// Start of a search anywhere, with a given earlier heading.
    pub(super) fn inside(&self, before: Heading) -> Start<S> {
        Start::inside(before, self.last_step * S::from_f64(SAME_MINIMUM))
    }

    /// Forgets the headings of all gaps, because the state or the field has changed.
    pub(super) fn lose_headings(&mut self) {
        self.headings.fill(Heading::Unknown);
    }

    /// Records a contact: a surface's gap fell to zero here. If the gap does not fall any more, its
    /// minimum is here too.
    pub(super) fn set_at_contact(&mut self, surface: usize) {
        self.lose_headings();
        self.headings[surface] = Heading::Falling;
    }

    /// Records that a minimum of a surface's gap was reported here.
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

/// Free-flight states of `N` orbits at one surface: [`Motion`] in lanes.
#[derive(Clone, Debug)]
pub(super) struct LaneMotion<const N: usize> {
    pub(super) state: Vec<Lanes<N>>,
    pub(super) time: Lanes<N>,
    /// Whole periods removed from the phase.
    pub(super) turns: Lanes<N>,
    /// Mask: the state has just left the surface; then the rounding of its gap there.
    pub(super) leaving: LaneMask<N>,
    pub(super) rounding: Lanes<N>,
    /// Mask: the gap is known to rise.
    pub(super) rises: LaneMask<N>,
    /// Mask: the gap is known to fall.
    pub(super) falls: LaneMask<N>,
    /// Time scales of the motions in their last steps.
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

    /// Copies other motions in the wanted lanes.
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

    /// Forgets the headings of the gaps.
    #[inline(always)]
    pub(super) fn lose_headings(&mut self, wanted: LaneMask<N>) {
        self.rises &= !wanted;
        self.falls &= !wanted;
    }

    /// Starts of the searches for the gaps.
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

// NOTE: no closures, which the compiler may leave out of a kernel and compile for the baseline
// instruction set.
#[inline(always)]
fn take<const N: usize>(wanted: LaneMask<N>, other: Lanes<N>, own: &mut Lanes<N>) {
    *own = Lanes::select(wanted, other, *own);
}

#[inline(always)]
fn take_mask<const N: usize>(wanted: LaneMask<N>, other: LaneMask<N>, own: &mut LaneMask<N>) {
    *own = (other & wanted) | (*own & !wanted);
}

/// Evaluator of a program at degree 0: the values of its outputs.
#[derive(Clone, Debug)]
pub(super) struct Evaluator<'a, S: Scalar> {
    program: &'a Program,
    outputs: usize,
    tape: Vec<S>,
    values: Vec<S>,
}

impl<'a, S: Scalar> Evaluator<'a, S> {
    /// `outputs` is the number of outputs of the program.
    pub(super) fn new(program: &'a Program, outputs: usize) -> Self {
        Self {
            program,
            outputs,
            tape: vec![S::zero(); program.slots()],
            values: vec![S::zero(); outputs],
        }
    }

    /// Values of the first outputs, without computing the others.
    pub(super) fn first<const M: usize>(&mut self, state: &[S], parameters: &[S]) -> [S; M] {
        let slots: [usize; M] = std::array::from_fn(|output| self.program.output(output));
        self.take(state, parameters);
        let slots_needed = slots.iter().map(|&slot| slot + 1).max().unwrap_or(0);
        self.program.evaluate_values_to(slots_needed, &mut self.tape);
        slots.map(|slot| self.tape[slot])
    }

    /// Values of all outputs.
    pub(super) fn evaluate(&mut self, state: &[S], parameters: &[S]) -> &[S] {
        self.take(state, parameters);
        self.program.evaluate_values(&mut self.tape);
        for output in 0..self.outputs {
            self.values[output] = self.tape[self.program.output(output)];
        }
        &self.values
    }

    fn take(&mut self, state: &[S], parameters: &[S]) {
        self.tape[..state.len()].copy_from_slice(state);
        self.tape[state.len()..state.len() + parameters.len()].copy_from_slice(parameters);
    }
}

/// Normal motion at a surface, along the free flow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense<S> {
    /// `h`.
    pub(super) gap: S,
    /// `h'`.
    pub(super) velocity: S,
    /// `h''`.
    pub(super) acceleration: S,
    /// `h'''`.
    pub(super) jerk: S,
    /// Rounding of `h`: a few units in the last place of its largest term.
    pub(super) rounding: S,
}

impl<S: Branched> Sense<S> {
    /// Mask: the state rests on the rigid surface. The state is pressed against the surface, and a
    /// bounce at its speed stays within the rounding of the gap.
    #[inline(always)]
    pub(super) fn rests(&self) -> S::Mask {
        let bounce = self.velocity * self.velocity;
        self.gap.abs().is_at_most(self.rounding)
            & bounce.is_at_most(-self.acceleration * self.rounding)
            & self.acceleration.is_below(S::zero())
    }
}

impl<S: Real> Sense<S> {
    /// Whether a state on a surface moves into it, at a speed that exceeds the rounding of the gap.
    pub(super) fn approaches(&self) -> bool {
        let bounce = self.velocity * self.velocity;
        self.velocity < S::zero() && bounce > self.acceleration.abs() * self.rounding
    }
}

/// Sensor of the normal motion at a surface.
#[derive(Clone, Debug)]
pub(super) struct Sensor<'a, S: Scalar>(Evaluator<'a, S>);

impl<'a, S: Scalar> Sensor<'a, S> {
    pub(super) fn new(program: &'a Program, dimension: usize) -> Self {
        Self(Evaluator::new(program, 4 + dimension))
    }

    /// Gap and its velocity.
    pub(super) fn approach(&mut self, state: &[S], parameters: &[S]) -> [S; 2] {
        self.0.first(state, parameters)
    }

    pub(super) fn sense(&mut self, state: &[S], parameters: &[S]) -> Sense<S> {
        let values = self.0.evaluate(state, parameters);
        Sense {
            gap: values[0],
            velocity: values[1],
            acceleration: values[2],
            jerk: values[3],
            rounding: rounding_of(&values[4..]),
        }
    }
}

/// A gap and its rounding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<S> {
    pub(super) gap: S,
    pub(super) rounding: S,
}

/// Number of roundings of a gap by which a state may lie beyond a surface.
const PENETRATES: f64 = 64.0;

impl<S: Real> Clearance<S> {
    /// Distance by which a state on the surface may lie beside it.
    pub(super) fn slack(&self) -> S {
        self.rounding * S::from_f64(PENETRATES)
    }

    /// Whether the terms of the gap are as small as the gap. Their size then does not tell the
    /// rounding of a state that was flown to the surface.
    pub(super) fn vanishes(&self) -> bool {
        self.rounding <= self.gap.abs() * S::from_f64(PENETRATES * S::ROUNDOFF)
    }
}

/// Rounding of a sum: a few units in the last place of its largest term.
pub(super) fn rounding_of<S: Scalar>(terms: &[S]) -> S {
    let size = terms.iter().fold(S::zero(), |size, term| size.max(term.abs()));
    S::from_f64(16.0 * S::ROUNDOFF) * size
}
