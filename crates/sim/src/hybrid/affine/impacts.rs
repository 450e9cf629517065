//! Free flights from impact to impact, all in one kernel, of one orbit or of several in lanes.
//!
//! One idea: where contacts alone are asked for, at one rigid surface at rest, most leaps are quiet
//! or end with a contact that control points tell of (`contacts`), and most impacts send the state
//! away again. These are one piece of code on numbers in fixed places; in lanes leaps, not times,
//! go in step. What is anything else is left to the general way, from where it begins.

use num_traits::{One as _, Zero as _};

use super::contacts::{Contacts, FirstContact};
use super::surface::{FixedSurface, SurfaceTables};
use crate::flow::{FixedLeaps, FixedVisit, NumberMask, ShapedLeaps};
use crate::hybrid::chatter::Rebound;
use crate::hybrid::landing::{REDUCED, ends_before_turn};
use crate::hybrid::motion::Left;
use crate::hybrid::response::PASSES;
use crate::numeric::{Branched, Kernel, Mask, Scalar};

/// The surface at which impacts are flown.
pub(super) const SURFACE: usize = 0;

/// Most leaps of a run.
const MAX_LEAPS: usize = 1000;

/// What one orbit and several have each in a way of their own.
pub(super) trait Company<S: Branched> {
    /// Cosine and sine of the force at a phase, where they are wanted; periods start from a
    /// reference.
    fn harmonic(&mut self, phase: S, reference: S, wanted: S::Mask) -> [S; 2];

    /// Takes the impacts at a time.
    fn record(&mut self, wanted: S::Mask, time: S, speed: S, rebound: S);
}

/// Where a flight is, but for its states and its phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress<S: Branched> {
    pub(super) time: S,
    /// Whole periods removed from the phase.
    pub(super) turns: S,
    /// Whether the surface has just been left, and the rounding of its gap there.
    pub(super) leaving: S::Mask,
    pub(super) rounding: S,
}

/// What a run of free flights and impacts is given.
pub(super) struct Run<'t, T: ShapedLeaps, P> {
    pub(super) leaps: &'t T,
    pub(super) surface: &'t SurfaceTables<T::Number>,
    pub(super) company: P,
    /// The states and the phase.
    pub(super) state: &'t mut [T::Number],
    pub(super) progress: Progress<T::Number>,
    pub(super) timing: Timing<T::Number>,
    pub(super) wanted: NumberMask<T>,
}

/// What times and phases are measured by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing<S> {
    pub(super) horizon: S,
    /// Period of the phase, and the phase about which it is kept.
    pub(super) period: S,
    pub(super) reference: S,
    /// The time in which the field changes.
    pub(super) time_scale: S,
}

/// A run of a system of as many states and columns.
pub(super) struct Impacts<'r, 't, T, P, const STATES: usize, const C: usize, const B: usize>(
    pub(super) &'r mut Run<'t, T, P>,
)
where
    T: ShapedLeaps;

/// A run under way.
struct Flying<'t, T, P, const STATES: usize, const C: usize, const B: usize>
where
    T: ShapedLeaps,
{
    leaps: FixedLeaps<'t, T, C, B>,
    surface: FixedSurface<'t, T::Number, C, B>,
    company: &'t mut P,
    timing: Timing<T::Number>,
    left: Left<T::Number>,
}

/// The moving point.
struct Point<S: Branched, const STATES: usize, const C: usize> {
    states: [S; STATES],
    phase: S,
    extended: [S; C],
    progress: Progress<S>,
}

impl<T, P, const STATES: usize, const C: usize, const B: usize> Kernel
    for Impacts<'_, '_, T, P, STATES, C, B>
where
    T: ShapedLeaps,
    P: Company<T::Number>,
{
    type Output = Left<T::Number>;

    #[inline(always)]
    fn run(self) -> Left<T::Number> {
        let run = self.0;
        let tables = (FixedLeaps::new(run.leaps), FixedSurface::new(run.surface));
        let (Some(leaps), Some(surface)) = tables else {
            return Left::at_start(run.wanted);
        };
        let mut flying = Flying::<T, P, STATES, C, B> {
            leaps,
            surface,
            company: &mut run.company,
            timing: run.timing,
            left: Left::at_start(NumberMask::<T>::NONE),
        };
        let phase = run.state[STATES];
        let mut point = Point {
            states: [phase; STATES],
            phase,
            extended: [T::Number::one(); C],
            progress: run.progress,
        };
        point.states.copy_from_slice(&run.state[..STATES]);
        flying.fly(run.wanted, &mut point);
        run.state[..STATES].copy_from_slice(&point.states);
        run.state[STATES] = point.phase;
        run.progress = point.progress;
        flying.left
    }
}

impl<T, P, const STATES: usize, const C: usize, const B: usize> Flying<'_, T, P, STATES, C, B>
where
    T: ShapedLeaps,
    P: Company<T::Number>,
{
    #[inline(always)]
    fn fly(&mut self, wanted: NumberMask<T>, point: &mut Point<T::Number, STATES, C>) {
        let mut going = wanted;
        for _ in 0..MAX_LEAPS {
            going &= point.progress.time.is_below(self.timing.horizon);
            if !going.any() {
                return;
            }
            going &= self.leap(point, going);
        }
        self.left.open |= going;
    }

    /// Puts the extended state to the present state.
    #[inline(always)]
    fn extend(&mut self, point: &mut Point<T::Number, STATES, C>, wanted: NumberMask<T>) {
        let reference = self.timing.reference;
        let harmonic = self.company.harmonic(point.phase, reference, wanted);
        [point.extended[STATES], point.extended[STATES + 1]] = harmonic;
        point.extended[..STATES].copy_from_slice(&point.states);
    }

    /// Leaps to the contact or to the horizon, and through the contact; where the flight goes on.
    #[inline(always)]
    fn leap(
        &mut self,
        point: &mut Point<T::Number, STATES, C>,
        going: NumberMask<T>,
    ) -> NumberMask<T> {
        let select = T::Number::select;
        let longest = self.timing.horizon - point.progress.time;
        self.extend(point, going);
        let mut visit = FixedVisit::none();
        let mut contacts = Contacts {
            leaps: &self.leaps,
            extended: &point.extended,
            until: longest.min(self.leaps.span()),
            visit: &mut visit,
        };
        let FirstContact { time, met, open } = contacts.first(going, point.progress.leaving);
        self.left.open |= open;
        let flown = going & !open;
        if !flown.any() {
            return flown;
        }
        self.left.flown |= flown;
        let rounded = time.rounded();
        let start = self.leaps.go_to(rounded, &point.extended, &mut visit);
        let states = self.leaps.states_at::<STATES>(time - start, &visit);
        take_states(flown, &states, &mut point.states);
        let phase = self.leaps.phase_rate().mul_add(time, point.phase);
        point.phase = select(flown, phase, point.phase);
        let there = point.progress.time + time;
        let there = select(time.is_equal(longest), self.timing.horizon, there);
        point.progress.time = select(flown, there, point.progress.time);
        if met.any() {
            self.settle(point, met);
        }
        self.tidy(point, flown & T::Number::zero().is_below(time), met);
        if met.any() {
            let stays = self.impact(point, met);
            self.left.contact |= met & !stays;
            return flown & (stays | !met);
        }
        flown
    }

    /// Brings the state onto the surface that it has landed beside.
    #[inline(always)]
    fn settle(&mut self, point: &mut Point<T::Number, STATES, C>, wanted: NumberMask<T>) {
        let (zero, select) = (T::Number::zero(), T::Number::select);
        self.extend(point, wanted);
        let landing = self.surface.contact.times(&point.extended);
        let landing = landing.as_flattened();
        let (value, slope) = (landing[0], landing[1]);
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero);
        if !settles.any() {
            return;
        }
        let curvature = self.surface.acceleration(&point.extended);
        let settles = settles & ends_before_turn(value, slope, curvature);
        let shift = -value / slope;
        let mut states = point.states;
        for (state, &rate) in states.iter_mut().zip(&landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        let after = self.surface.all.clearance(&states).gap.abs();
        let settles = settles & after.is_at_most(value.abs() * T::Number::from_f64(REDUCED));
        take_states(settles, &states, &mut point.states);
        let phase = self.leaps.phase_rate().mul_add(shift, point.phase);
        point.phase = select(settles, phase, point.phase);
        let time = point.progress.time;
        point.progress.time = select(settles, time + shift, time);
    }

    /// Forgets that the surface was left where it is no longer near, and keeps the phase near its
    /// reference.
    #[inline(always)]
    fn tidy(
        &mut self,
        point: &mut Point<T::Number, STATES, C>,
        flown: NumberMask<T>,
        met: NumberMask<T>,
    ) {
        let (period, select) = (self.timing.period, T::Number::select);
        let Progress {
            turns,
            leaving,
            rounding,
            ..
        } = &mut point.progress;
        let leaves = flown & *leaving & !met;
        if leaves.any() {
            let gap = self.surface.all.clearance(&point.states).gap;
            *leaving &= !(leaves & rounding.is_below(gap.abs()));
        }
        let half = period * T::Number::from_f64(0.5);
        loop {
            let beyond = flown & half.is_at_most(point.phase - self.timing.reference);
            if !beyond.any() {
                return;
            }
            point.phase = select(beyond, point.phase - period, point.phase);
            *turns = select(beyond, *turns + T::Number::one(), *turns);
        }
    }

    /// Applies the reset; where a free flight follows. Elsewhere the state is as it was.
    #[inline(always)]
    fn impact(
        &mut self,
        point: &mut Point<T::Number, STATES, C>,
        wanted: NumberMask<T>,
    ) -> NumberMask<T> {
        let number = T::Number::from_f64;
        self.extend(point, wanted);
        let speed = -self.surface.sense(&point.extended).velocity;
        let image = self.surface.reset.times(&point.extended);
        let mut states = point.states;
        states.copy_from_slice(&image.as_flattened()[..STATES]);
        let mut extended = point.extended;
        extended[..STATES].copy_from_slice(&states);
        let after = self.surface.sense(&extended);
        let free = wanted & T::Number::zero().is_at_most(speed);
        let free = free & !after.velocity.is_below(-speed.abs() * number(PASSES));
        let free = Rebound::new(speed, &after).flies_on(free, self.timing.time_scale);
        if !free.any() {
            return free;
        }
        let time = point.progress.time;
        self.company.record(free, time, speed, after.velocity);
        take_states(free, &states, &mut point.states);
        let rounding = after.rounding.max(after.gap.abs() * number(4.0));
        let progress = &mut point.progress;
        progress.rounding = T::Number::select(free, rounding, progress.rounding);
        progress.leaving |= free;
        free
    }
}

#[inline(always)]
fn take_states<S: Branched, const STATES: usize>(
    wanted: S::Mask,
    states: &[S; STATES],
    out: &mut [S; STATES],
) {
    for (out, &state) in out.iter_mut().zip(states) {
        *out = S::select(wanted, state, *out);
    }
}

#[cfg(test)]
mod tests;
