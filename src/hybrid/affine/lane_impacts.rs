//! Free flights from impact to impact of several orbits, all in one kernel: [`impacts`](super::impacts) in lanes.
//!
//! One idea: leaps, not times, go in step. What is not of the common kind leaves the lanes where it begins, and is left to the
//! orbit alone.

use super::extended::Harmonic;
use super::lane_contacts::{FirstContacts, LaneContacts};
use super::lane_harmonics::LaneHarmonics;
use super::lane_tools::OrbitTables;
use super::surface::{FixedSurface, SurfaceTables};
use crate::flow::{FixedLaneLeaps, FixedLaneVisit, LaneLeaps};
use crate::hybrid::chatter::{AfterImpact, Rebound};
use crate::hybrid::landing::REDUCED;
use crate::hybrid::lane_motion::{EventRecord, LaneLeft, LaneMotion};
use crate::hybrid::response::{PASSES, PENETRATES};
use crate::hybrid::trajectory::{Event, EventKind};
use crate::numeric::{Branched, Kernel, LaneMask, Lanes, Mask, Scalar, wide};

/// The surface at which impacts are flown.
const SURFACE: usize = 0;

/// Most leaps of a run.
const MAX_LEAPS: usize = 1000;

/// What several orbits fly by, and the harmonics where they are.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct LaneImpacts<const N: usize> {
    leaps: LaneLeaps<N>,
    surface: SurfaceTables<Lanes<N>>,
    harmonics: LaneHarmonics<N>,
    /// Place of the phase in a state.
    phase: usize,
}

impl<const N: usize> LaneImpacts<N> {
    /// From the tables of every orbit; `None` where they have other shapes, and for systems but of one mass or two under one
    /// force, at a stop at rest.
    pub(in crate::hybrid) fn new(alone: [&OrbitTables; N]) -> Option<Self> {
        let first = alone[0];
        let (phase, states) = (first.phase?, first.states);
        if !matches!((states, first.multiples.len()), (2 | 4, 1)) || first.surface.moves() {
            return None;
        }
        let impacts = Self {
            leaps: LaneLeaps::new(alone.map(|own| own.leaps.clone()).to_vec())?,
            surface: SurfaceTables::interleaved(alone.map(|own| &own.surface))?,
            harmonics: LaneHarmonics::new(Lanes::from_fn(|lane| alone[lane].multiples[0])),
            phase,
        };
        let is_fixed = match states {
            2 => impacts.fixed::<5, 1>().is_some(),
            _ => impacts.fixed::<7, 2>().is_some(),
        };
        is_fixed.then_some(impacts)
    }

    #[inline(always)]
    fn fixed<const C: usize, const B: usize>(
        &self,
    ) -> Option<(
        FixedLaneLeaps<'_, N, C, B>,
        FixedSurface<'_, Lanes<N>, C, B>,
    )> {
        Some((
            FixedLaneLeaps::new(&self.leaps)?,
            FixedSurface::new(&self.surface)?,
        ))
    }

    /// The harmonic of a lane, and the phase at which it is known.
    pub(in crate::hybrid) fn harmonic(&self, lane: usize) -> Harmonic {
        self.harmonics.of(lane)
    }

    /// Puts the harmonic of a lane.
    pub(in crate::hybrid) fn put_harmonic(&mut self, lane: usize, harmonic: Harmonic) {
        self.harmonics.put(lane, harmonic);
    }

    /// Flies the wanted lanes through a period, from a phase about which phases are kept; where that ended early.
    pub(in crate::hybrid) fn fly(
        &mut self,
        motion: &mut LaneMotion<N>,
        wanted: LaneMask<N>,
        horizon: Lanes<N>,
        period: f64,
        record: EventRecord<'_>,
    ) -> LaneLeft<N> {
        let states = self.phase;
        let run = Run {
            impacts: self,
            motion,
            wanted,
            horizon,
            period,
            record,
        };
        let left = match states {
            2 => wide(Impacts::<N, 2, 5, 1>(run)),
            _ => wide(Impacts::<N, 4, 7, 2>(run)),
        };
        left.unwrap_or(LaneLeft::at_start(wanted))
    }
}

struct Run<'t, const N: usize> {
    impacts: &'t mut LaneImpacts<N>,
    motion: &'t mut LaneMotion<N>,
    wanted: LaneMask<N>,
    horizon: Lanes<N>,
    period: f64,
    record: EventRecord<'t>,
}

/// A run of systems of as many states and columns.
struct Impacts<'t, const N: usize, const STATES: usize, const C: usize, const B: usize>(Run<'t, N>);

/// A run under way.
struct Flying<'t, const N: usize, const STATES: usize, const C: usize, const B: usize> {
    leaps: FixedLaneLeaps<'t, N, C, B>,
    surface: FixedSurface<'t, Lanes<N>, C, B>,
    harmonics: LaneHarmonics<N>,
    reference: Lanes<N>,
    last_step: Lanes<N>,
    horizon: Lanes<N>,
    period: f64,
    left: LaneLeft<N>,
    record: EventRecord<'t>,
}

/// The moving points.
#[derive(Clone, Copy)]
struct Points<const N: usize, const STATES: usize, const C: usize> {
    states: [Lanes<N>; STATES],
    phase: Lanes<N>,
    extended: [Lanes<N>; C],
    time: Lanes<N>,
    turns: Lanes<N>,
    leaving: LaneMask<N>,
    /// Roundings of the gaps where the surface has just been left.
    rounding: Lanes<N>,
}

impl<const N: usize, const STATES: usize, const C: usize, const B: usize> Kernel
    for Impacts<'_, N, STATES, C, B>
{
    type Output = LaneLeft<N>;

    #[inline(always)]
    fn run(self) -> LaneLeft<N> {
        let Run {
            impacts,
            motion,
            wanted,
            horizon,
            period,
            record,
        } = self.0;
        let Some((leaps, surface)) = impacts.fixed::<C, B>() else {
            return LaneLeft::at_start(wanted);
        };
        let zero = Lanes::splat(0.0);
        let phase = motion.state[STATES];
        let mut states = [zero; STATES];
        states.copy_from_slice(&motion.state[..STATES]);
        let mut extended = [Lanes::splat(1.0); C];
        extended[..STATES].copy_from_slice(&states);
        let mut flying = Flying::<N, STATES, C, B> {
            leaps,
            surface,
            harmonics: impacts.harmonics,
            reference: phase,
            last_step: impacts.leaps.time_scale(),
            horizon,
            period,
            left: LaneLeft::at_start(LaneMask::NONE),
            record,
        };
        let mut points = Points {
            states,
            phase,
            extended,
            time: zero,
            turns: zero,
            leaving: motion.leaving,
            rounding: motion.rounding,
        };
        flying.fly(wanted, &mut points);
        motion.state[..STATES].copy_from_slice(&points.states);
        motion.state[STATES] = points.phase;
        (motion.time, motion.turns) = (points.time, points.turns);
        (motion.leaving, motion.rounding) = (points.leaving, points.rounding);
        let (harmonics, left) = (flying.harmonics, flying.left);
        impacts.harmonics = harmonics;
        left
    }
}

impl<const N: usize, const STATES: usize, const C: usize, const B: usize>
    Flying<'_, N, STATES, C, B>
{
    #[inline(always)]
    fn fly(&mut self, wanted: LaneMask<N>, points: &mut Points<N, STATES, C>) {
        let clearance = self.surface.all.clearance(&points.states);
        let least = -clearance.rounding * Lanes::splat(PENETRATES);
        let mut going = wanted & (points.leaving | !clearance.gap.is_below(least));
        self.left.open = wanted & !going;
        for _ in 0..MAX_LEAPS {
            if !going.any() {
                return;
            }
            going &= self.leap(points, going);
            going &= points.time.is_below(self.horizon);
        }
        self.left.open |= going;
    }

    /// Puts the extended states to the present states.
    #[inline(always)]
    fn extend(&mut self, points: &mut Points<N, STATES, C>, wanted: LaneMask<N>) {
        self.harmonics.go_to(points.phase, self.reference, wanted);
        [points.extended[STATES], points.extended[STATES + 1]] = self.harmonics.pair();
        points.extended[..STATES].copy_from_slice(&points.states);
    }

    /// Leaps to the contacts or to the horizon, and through the contacts; those that stay in the lanes.
    #[inline(always)]
    fn leap(&mut self, points: &mut Points<N, STATES, C>, going: LaneMask<N>) -> LaneMask<N> {
        let zero = Lanes::splat(0.0);
        let longest = self.horizon - points.time;
        self.extend(points, going);
        let mut visit = FixedLaneVisit::none();
        let quiet = longest.min(self.leaps.span());
        let mut contacts = LaneContacts {
            leaps: &self.leaps,
            extended: &points.extended,
            until: quiet,
            visit: &mut visit,
        };
        let FirstContacts { time, met, open } = contacts.first(going, points.leaving);
        self.left.open |= open;
        let flown = going & !open;
        self.left.flown |= flown;
        let start = self.leaps.go_to(time, &points.extended, &mut visit);
        let Some(states) = self.leaps.states_at::<STATES>(time - start, &visit) else {
            return LaneMask::NONE;
        };
        select_all(flown, &states, &mut points.states);
        let phase = self.leaps.phase_rate().mul_add(time, points.phase);
        points.phase = Lanes::select(flown, phase, points.phase);
        let there = Lanes::select(time.is_equal(longest), self.horizon, points.time + time);
        points.time = Lanes::select(flown, there, points.time);
        if met.any() {
            self.settle(points, met);
        }
        self.tidy(points, flown & zero.is_below(time), met);
        if met.any() {
            let stays = self.impact(points, met);
            self.left.contact |= met & !stays;
            return flown & (stays | !met);
        }
        flown
    }

    /// Brings states onto the surface that they have landed beside.
    #[inline(always)]
    fn settle(&mut self, points: &mut Points<N, STATES, C>, wanted: LaneMask<N>) {
        let zero = Lanes::splat(0.0);
        self.extend(points, wanted);
        let landing = self.surface.contact.times(&points.extended);
        let landing = landing.as_flattened();
        let (value, slope) = (landing[0], landing[1]);
        let shift = -value / slope;
        let mut states = points.states;
        for (state, &rate) in states.iter_mut().zip(&landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        let after = self.surface.all.clearance(&states).gap.abs();
        let less = after.is_at_most(value.abs() * Lanes::splat(REDUCED));
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero) & less;
        select_all(settles, &states, &mut points.states);
        let phase = self.leaps.phase_rate().mul_add(shift, points.phase);
        points.phase = Lanes::select(settles, phase, points.phase);
        points.time = Lanes::select(settles, points.time + shift, points.time);
    }

    /// Forgets that the surface was left where it is no longer near, and keeps phases near their references.
    #[inline(always)]
    fn tidy(&mut self, points: &mut Points<N, STATES, C>, flown: LaneMask<N>, met: LaneMask<N>) {
        let leaves = flown & points.leaving & !met;
        if leaves.any() {
            let gap = self.surface.all.clearance(&points.states).gap;
            points.leaving &= !(leaves & points.rounding.is_below(gap.abs()));
        }
        let (half, one) = (Lanes::splat(0.5 * self.period), Lanes::splat(1.0));
        loop {
            let beyond = flown & half.is_at_most(points.phase - self.reference);
            if !beyond.any() {
                return;
            }
            let reduced = points.phase - Lanes::splat(self.period);
            points.phase = Lanes::select(beyond, reduced, points.phase);
            points.turns = Lanes::select(beyond, points.turns + one, points.turns);
        }
    }

    /// Applies the reset; where a free flight follows. Elsewhere states are as they were.
    #[inline(always)]
    fn impact(&mut self, points: &mut Points<N, STATES, C>, wanted: LaneMask<N>) -> LaneMask<N> {
        self.extend(points, wanted);
        let speed = -self.surface.sense(&points.extended).velocity;
        let image = self.surface.reset.times(&points.extended);
        let mut extended = points.extended;
        extended[..STATES].copy_from_slice(&image.as_flattened()[..STATES]);
        let after = self.surface.sense(&extended);
        let least = -speed.abs() * Lanes::splat(PASSES);
        let mut free = wanted & !after.velocity.is_below(least);
        let pressed = free & after.acceleration.is_below(Lanes::splat(0.0));
        if pressed.any() {
            for lane in pressed.lanes() {
                let rebound = Rebound {
                    speed: speed[lane],
                    rebound: after.velocity[lane],
                    acceleration: after.acceleration[lane],
                    jerk: after.jerk[lane],
                };
                free.set(
                    lane,
                    rebound.follow(self.last_step[lane]) == AfterImpact::Flight,
                );
            }
        }
        for lane in free.lanes() {
            let event = Event {
                time: points.time[lane],
                surface: SURFACE,
                kind: EventKind::Impact {
                    speed: speed[lane],
                    rebound: after.velocity[lane],
                },
            };
            (self.record)(lane, event);
        }
        let mut states = points.states;
        states.copy_from_slice(&extended[..STATES]);
        select_all(free, &states, &mut points.states);
        let residual = after.gap.abs() * Lanes::splat(4.0);
        points.rounding = Lanes::select(free, after.rounding.max(residual), points.rounding);
        points.leaving |= free;
        free
    }
}

#[inline(always)]
fn select_all<const N: usize>(wanted: LaneMask<N>, values: &[Lanes<N>], out: &mut [Lanes<N>]) {
    for (out, &value) in out.iter_mut().zip(values) {
        *out = Lanes::select(wanted, value, *out);
    }
}
