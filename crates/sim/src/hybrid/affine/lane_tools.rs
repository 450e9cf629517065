//! The affine side of simulators in lanes: [`AffineTools`](super::AffineTools) of several orbits at
//! one rigid surface.

use super::exact_step::{BackwardStep, StepBuffers, Stepper};
use super::extended::Extended;
use super::surface::SurfaceTables;
use super::tools::OrbitTables;
use crate::flow::{Batch, SpanTables};
use crate::hybrid::lane_flow::{LaneAsked, LaneFlow, LaneStepEnd};
use crate::hybrid::lane_log::{LaneLog, LoggedFrom};
use crate::hybrid::motion::LaneMotion;
use crate::hybrid::passage::{Back, REDUCED, ends_before_turn};
use crate::hybrid::sensing::Sense;
use crate::numeric::{Branched, Kernel, LaneMask, Lanes, Mask, Scalar};

/// The surface at which orbits are flown in lanes, the only one.
const SURFACE: usize = 0;

/// Tables of several orbits, and what they work on.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct LaneTools<const N: usize> {
    tables: SpanTables<Batch<N>>,
    buffers: StepBuffers<Batch<N>>,
    extended: Extended<Batch<N>>,
    surface: SurfaceTables<Lanes<N>>,
    phase: Option<usize>,
    /// States somewhere else.
    there: Vec<Lanes<N>>,
    /// Value and slope of the gap and the rates of the states.
    landing: Vec<Lanes<N>>,
}

impl<const N: usize> LaneTools<N> {
    /// From the tables of every orbit; `None` where they have other shapes.
    pub(in crate::hybrid) fn new(alone: [OrbitTables; N]) -> Option<Self> {
        let tables = SpanTables::interleaved(alone.each_ref().map(|own| &own.span))?;
        let surface = SurfaceTables::interleaved(alone.each_ref().map(|own| &own.surface))?;
        let OrbitTables { phase, states, ref multiples, .. } = alone[0];
        let multiple = |place: usize| Lanes::from_fn(|lane| alone[lane].multiples[place]);
        let multiples: Vec<_> = (0..multiples.len()).map(multiple).collect();
        let mut extended = Extended::new(states, phase, multiples.len());
        extended.set_multiples(&multiples);
        let zero = Lanes::splat(0.0);
        Some(Self {
            buffers: StepBuffers::new(&tables),
            extended,
            surface,
            phase,
            there: vec![zero; states],
            landing: vec![zero; 2 + states],
            tables,
        })
    }

    /// Puts motions to the states computed, and their phases on by a time.
    #[inline(always)]
    fn take_there(&self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>, time: Lanes<N>) {
        for (state, &there) in motion.state.iter_mut().zip(&self.there) {
            *state = Lanes::select(wanted, there, *state);
        }
        if let Some(phase) = self.phase {
            let phase = &mut motion.state[phase];
            let there = self.tables.phase_rate().mul_add(time, *phase);
            *phase = Lanes::select(wanted, there, *phase);
        }
    }
}

impl<const N: usize> LaneFlow<N> for LaneTools<N> {
    #[inline(always)]
    fn forget(&mut self) {
        self.extended.forget();
    }

    #[inline(always)]
    fn time_scale(&self, _: &LaneMotion<N>) -> Lanes<N> {
        self.tables.time_scale()
    }

    #[inline(always)]
    fn step(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneStepEnd<N> {
        self.extended.take(&motion.state, asked.wanted);
        let gap = &mut self.buffers.gaps[SURFACE];
        gap.wanted = asked.wanted & !asked.blind;
        (gap.ignoring, gap.stops) = (asked.ignoring, asked.stopping);
        // NOTE: lanes look for all minima.
        gap.near = Lanes::splat(f64::INFINITY);
        (gap.leaving, gap.left_within) = (motion.leaving, motion.rounding);
        gap.rises = motion.rises & !asked.blind;
        gap.falls = motion.falls & !asked.blind;
        let step = Stepper {
            tables: &self.tables,
            extended: &self.extended.values,
            buffers: &mut self.buffers,
            going_on: LaneMask::NONE,
            longest: asked.longest,
            log: LoggedFrom { start: motion.time, log },
        }
        .fly();
        let gap = &self.buffers.gaps[SURFACE];
        (motion.rises, motion.falls) = (gap.rises, gap.falls);
        let end = LaneStepEnd {
            time: step.time,
            contact: step.contact,
            minimum: step.minimum,
            rises_for: step.rises_for,
            undecided: step.undecided,
        };
        let flown = asked.wanted & !end.undecided;
        let at_end = end.time.is_equal(asked.longest) & !end.contact & !end.minimum;
        let of_use = !at_end | asked.landing;
        let useful = flown & of_use & !(end.minimum & asked.passing);
        if useful.any() {
            let visit = &mut self.buffers.visit;
            let (tables, extended) = (&self.tables, &self.extended.values);
            visit.states_at(end.time, useful, tables, extended, &mut self.there);
            self.take_there(motion, useful, end.time);
        }
        let time = Lanes::select(end.time.is_equal(asked.longest), horizon, motion.time + end.time);
        motion.time = Lanes::select(flown, time, motion.time);
        end
    }

    #[inline(always)]
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N> {
        self.extended.take(&motion.state, wanted);
        let (time, known) = BackwardStep {
            tables: &self.tables,
            extended: &self.extended.values,
            visit: &mut self.buffers.visit,
            surface: SURFACE,
            goal,
            longest,
            wanted,
            states: &mut self.there,
        }
        .run();
        let known = known & wanted;
        self.take_there(motion, known, -time);
        motion.time = Lanes::select(known, motion.time - time, motion.time);
        known
    }

    #[inline(always)]
    fn sense(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Sense<Lanes<N>> {
        self.extended.take(&motion.state, wanted);
        self.surface.sense(&self.extended.values)
    }

    #[inline(always)]
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        self.extended.take(&motion.state, wanted);
        if let Some(reset) = &self.surface.reset {
            reset.multiply(&self.extended.values, &mut self.there);
        }
        for (state, &there) in motion.state.iter_mut().zip(&self.there) {
            *state = Lanes::select(wanted, there, *state);
        }
    }

    #[inline(always)]
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N> {
        let zero = Lanes::splat(0.0);
        self.extended.take(&motion.state, wanted);
        self.surface.contact.multiply(&self.extended.values, &mut self.landing);
        let (value, slope) = (self.landing[0], self.landing[1]);
        let curvature = self.surface.sense(&self.extended.values).acceleration;
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero);
        let shift = -value / slope;
        let rates = self.landing[2..].iter().copied();
        let rates = rates.chain([self.tables.phase_rate()]);
        for (state, rate) in motion.state.iter_mut().zip(rates) {
            *state = Lanes::select(settles, rate.mul_add(shift, *state), *state);
        }
        let after = self.gap(motion, settles);
        let less = after.abs().is_at_most(value.abs() * Lanes::splat(REDUCED));
        motion.time = Lanes::select(settles, motion.time + shift, motion.time);
        settles & !(less & ends_before_turn(value, slope, curvature))
    }

    #[inline(always)]
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N> {
        if self.surface.moves() {
            self.extended.take(&motion.state, wanted);
            return self.surface.clearance(&self.extended.values).gap;
        }
        self.surface.clearance(&motion.state).gap
    }
}
