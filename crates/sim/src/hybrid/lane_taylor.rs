//! Steps of Taylor's method of several orbits at one rigid surface, in lanes.
//!
//! One idea: a step forms the series of all orbits together; each has its own length, its own
//! event, and lands at its own time.

use super::backward::alternate;
use super::lane_flow::{LaneAsked, LaneFlow, LaneLeap};
use super::lane_log::{LaneLog, LoggedFrom};
use super::motion::LaneMotion;
use super::passage::{Back, Goal, NoLog, REDUCED, Start, ends_before_turn};
use super::search::{Gap, SearchEnd, search};
use super::sensing::{Evaluator, Sense, Sensor};
use super::stationary::StationaryPoints;
use super::system::{HybridSystem, Law};
use crate::flow::{LaneIntegrator, LaneStep};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// The surface at which orbits are flown in lanes, the only watched one.
const SURFACE: usize = 0;

/// What steps of several orbits are taken with, each at its own parameters.
#[derive(Clone, Debug)]
pub(super) struct LaneTaylor<'a, const N: usize> {
    parameters: Vec<Lanes<N>>,
    integrator: LaneIntegrator<'a, N>,
    sensor: Sensor<'a, Lanes<N>>,
    contact: Evaluator<'a, Lanes<N>>,
    reset: Evaluator<'a, Lanes<N>>,
    points: StationaryPoints<Lanes<N>>,
    /// Gaps and their slopes in reversed time.
    reversed: (Vec<Lanes<N>>, Vec<Lanes<N>>),
}

impl<'a, const N: usize> LaneTaylor<'a, N> {
    /// At the parameters of every lane; `None` unless the system has one rigid surface.
    pub(super) fn new(system: &'a HybridSystem, parameters: [&[f64]; N]) -> Option<Self> {
        let [surface] = &system.surfaces[..] else {
            return None;
        };
        let Law::Rigid { reset, .. } = &surface.law else {
            return None;
        };
        let parameter = |place: usize| Lanes::from_fn(|lane| parameters[lane][place]);
        let dimension = system.dimension;
        Some(Self {
            parameters: (0..system.parameters).map(parameter).collect(),
            integrator: LaneIntegrator::new(&system.free.field),
            sensor: Sensor::new(&surface.sensor, dimension),
            contact: Evaluator::new(&surface.landing, 2 + dimension),
            reset: Evaluator::new(reset, dimension),
            points: StationaryPoints::new(),
            reversed: (Vec::new(), Vec::new()),
        })
    }
}

impl<const N: usize> LaneFlow<N> for LaneTaylor<'_, N> {
    #[inline(always)]
    fn forget(&mut self) {}

    #[inline(always)]
    fn time_scale(&self, motion: &LaneMotion<N>) -> Lanes<N> {
        motion.last_step
    }

    #[inline(always)]
    fn leap(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneLeap<N> {
        let (wanted, remaining) = (asked.wanted, asked.longest);
        let step = self.integrator.expand(&motion.state, &self.parameters);
        let (admissible, mut open) = admissible(&step, motion, wanted);
        let slack = Lanes::splat(8.0 * <f64 as Scalar>::ROUNDOFF) * admissible;
        let is_last = remaining.is_at_most(admissible + slack);
        let length = Lanes::select(is_last, remaining, admissible);
        let gap = Gap {
            value: step.watched_coefficients(2 * SURFACE),
            slope: step.watched_coefficients(2 * SURFACE + 1),
            sign: Lanes::splat(1.0),
            surface: SURFACE,
        };
        let goal = Goal {
            minima: asked.ignoring,
            stopping: asked.stopping,
            near: Lanes::splat(asked.near),
        };
        let flown = wanted & !open;
        let watched = flown & !asked.blind & !quiet(&step, length, &asked);
        let start = motion.start();
        let mut passage = SearchEnd::none(length);
        if watched.any() {
            let from = motion.time;
            let log = LoggedFrom { start: from, log };
            passage = search(&mut self.points, gap, length, start, goal, watched, log);
        }
        let quiet = flown & !passage.minimum & !passage.crossing;
        motion.lose_headings(wanted);
        motion.rises |= (quiet & watched & !passage.falls) | (flown & passage.minimum);
        motion.falls |= quiet & watched & passage.falls;
        let there = motion.time + passage.time;
        let is_over = passage.time.is_equal(remaining);
        let is_stuck = quiet & passage.time.is_below(remaining) & there.is_equal(motion.time);
        open |= is_stuck;
        let mut rises_for = Lanes::splat(0.0);
        if (passage.minimum & !asked.passing).any() {
            rises_for = gap.rises_for(passage.time, admissible);
        }
        let of_use = !(quiet & is_over) | asked.landing;
        let useful = flown & of_use & !(passage.minimum & asked.passing);
        if useful.any() {
            step.states_at(passage.time, useful, &mut motion.state);
        }
        let time = Lanes::select(is_over, horizon, there);
        motion.time = Lanes::select(flown, time, motion.time);
        LaneLeap {
            time: passage.time,
            contact: flown & passage.crossing,
            minimum: flown & passage.minimum,
            rises_for,
            open,
        }
    }

    /// NOTE: by one step; who does not come there in it is left to the orbit alone.
    #[inline(always)]
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N> {
        let step = self.integrator.expand(&motion.state, &self.parameters);
        let (admissible, open) = admissible(&step, motion, wanted);
        let length = admissible.min(longest);
        let (sign, minima) = match goal {
            Back::ToMinimum => (Lanes::splat(1.0), wanted),
            Back::ToSurface => (Lanes::splat(-1.0), LaneMask::NONE),
        };
        let (value, slope) = &mut self.reversed;
        alternate(step.watched_coefficients(2 * SURFACE), sign, value);
        alternate(step.watched_coefficients(2 * SURFACE + 1), -sign, slope);
        let start = Start {
            rose: LaneMask::NONE,
            fell: LaneMask::NONE,
            leaving: LaneMask::NONE,
            ..motion.start()
        };
        let goal = Goal {
            minima,
            stopping: wanted,
            near: Lanes::splat(-1.0),
        };
        let flown = wanted & !open;
        let gap = Gap {
            value,
            slope,
            sign: Lanes::splat(1.0),
            surface: SURFACE,
        };
        let points = &mut self.points;
        let passage = search(points, gap, length, start, goal, flown, NoLog);
        let known = flown & (passage.crossing | passage.minimum);
        step.states_at(-passage.time, known, &mut motion.state);
        motion.time = Lanes::select(known, motion.time - passage.time, motion.time);
        known
    }

    #[inline(always)]
    fn sense(&mut self, motion: &LaneMotion<N>, _: LaneMask<N>) -> Sense<Lanes<N>> {
        self.sensor.sense(&motion.state, &self.parameters)
    }

    #[inline(always)]
    fn approach(&mut self, motion: &LaneMotion<N>, _: LaneMask<N>) -> [Lanes<N>; 2] {
        self.sensor.approach(&motion.state, &self.parameters)
    }

    #[inline(always)]
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N> {
        self.approach(motion, wanted)[0]
    }

    #[inline(always)]
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        let image = self.reset.evaluate(&motion.state, &self.parameters);
        for (state, &image) in motion.state.iter_mut().zip(image) {
            *state = Lanes::select(wanted, image, *state);
        }
    }

    #[inline(always)]
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N> {
        let curvature = self.sense(motion, wanted).acceleration;
        let landing = self.contact.evaluate(&motion.state, &self.parameters);
        let (value, slope, zero) = (landing[0], landing[1], Lanes::splat(0.0));
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero);
        let shift = -value / slope;
        for (state, &rate) in motion.state.iter_mut().zip(&landing[2..]) {
            *state = Lanes::select(settles, rate.mul_add(shift, *state), *state);
        }
        let after = self.gap(motion, settles);
        let less = after.abs().is_at_most(value.abs() * Lanes::splat(REDUCED));
        motion.time = Lanes::select(settles, motion.time + shift, motion.time);
        settles & !(less & ends_before_turn(value, slope, curvature))
    }
}

/// The lengths on which states and gaps meet the tolerance, which are those in which the motions
/// change; where there are none.
#[inline(always)]
fn admissible<const N: usize>(
    step: &LaneStep<'_, N>,
    motion: &mut LaneMotion<N>,
    wanted: LaneMask<N>,
) -> (Lanes<N>, LaneMask<N>) {
    let lengths = step.length.min(step.watched_length(2 * SURFACE));
    motion.last_step = Lanes::select(wanted, lengths, motion.last_step);
    (lengths, wanted & !Lanes::splat(0.0).is_below(step.length))
}

/// Where there is known beforehand to be no event, and no value of interest.
#[inline(always)]
fn quiet<const N: usize>(
    step: &LaneStep<'_, N>,
    lengths: Lanes<N>,
    asked: &LaneAsked<N>,
) -> LaneMask<N> {
    if asked.near == f64::INFINITY {
        return LaneMask::NONE;
    }
    let bound = step.watched_lower_bound(2 * SURFACE, lengths);
    Lanes::splat(asked.near.max(0.0)).is_below(bound) & !asked.ignoring
}
