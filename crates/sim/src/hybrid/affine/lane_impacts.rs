//! Flights through impacts of several orbits: the tables they fly by, the harmonics where they are.
//!
//! One idea: what is not of the common kind leaves the lanes where it begins, and is left to the
//! orbit alone.

use super::extended::Harmonic;
use super::impacts::{Company, Impacts, Progress, Run, SURFACE, Timing};
use super::lane_harmonics::LaneHarmonics;
use super::lane_tools::OrbitTables;
use super::surface::{FixedSurface, SurfaceTables};
use crate::flow::{FixedLeaps, LaneLeaps};
use crate::hybrid::lane_motion::{EventRecord, LaneLeft, LaneMotion};
use crate::hybrid::response::PENETRATES;
use crate::hybrid::trajectory::{Event, EventKind};
use crate::numeric::{Branched, LaneMask, Lanes, wide};

/// What several orbits fly by, and the harmonics where they are.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct LaneImpacts<const N: usize> {
    leaps: LaneLeaps<N>,
    surface: SurfaceTables<Lanes<N>>,
    harmonics: LaneHarmonics<N>,
    /// Place of the phase in a state.
    phase: usize,
}

/// The harmonics of several orbits, and who takes their events.
struct Together<'t, const N: usize> {
    harmonics: &'t mut LaneHarmonics<N>,
    record: EventRecord<'t>,
}

impl<const N: usize> LaneImpacts<N> {
    /// From the tables of every orbit; `None` where they have other shapes, and for systems but of
    /// one mass or two under one force, at a stop at rest.
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
            2 => impacts.is_fixed::<5, 1>(),
            _ => impacts.is_fixed::<7, 2>(),
        };
        is_fixed.then_some(impacts)
    }

    fn is_fixed<const C: usize, const B: usize>(&self) -> bool {
        FixedLeaps::<_, C, B>::new(&self.leaps).is_some()
            && FixedSurface::<_, C, B>::new(&self.surface).is_some()
    }

    /// The harmonic of a lane, and the phase at which it is known.
    pub(in crate::hybrid) fn harmonic(&self, lane: usize) -> Harmonic {
        self.harmonics.of(lane)
    }

    /// Puts the harmonic of a lane.
    pub(in crate::hybrid) fn put_harmonic(&mut self, lane: usize, harmonic: Harmonic) {
        self.harmonics.put(lane, harmonic);
    }

    /// Flies the wanted lanes through a period, from a phase about which phases are kept; where
    /// that ended early.
    pub(in crate::hybrid) fn fly(
        &mut self,
        motion: &mut LaneMotion<N>,
        wanted: LaneMask<N>,
        horizon: Lanes<N>,
        period: f64,
        record: EventRecord<'_>,
    ) -> LaneLeft<N> {
        let clearance = self.surface.clearance(&motion.state);
        let least = -clearance.rounding * Lanes::splat(PENETRATES);
        let going = wanted & (motion.leaving | !clearance.gap.is_below(least));
        let mut run = Run {
            leaps: &self.leaps,
            surface: &self.surface,
            company: Together {
                harmonics: &mut self.harmonics,
                record,
            },
            progress: Progress {
                time: Lanes::splat(0.0),
                turns: Lanes::splat(0.0),
                leaving: motion.leaving,
                rounding: motion.rounding,
            },
            timing: Timing {
                horizon,
                period: Lanes::splat(period),
                reference: motion.state[self.phase],
                time_scale: self.leaps.time_scale(),
            },
            state: &mut motion.state,
            wanted: going,
        };
        let left = match self.phase {
            2 => wide(Impacts::<_, _, 2, 5, 1>(&mut run)),
            _ => wide(Impacts::<_, _, 4, 7, 2>(&mut run)),
        };
        let progress = run.progress;
        (motion.time, motion.turns) = (progress.time, progress.turns);
        (motion.leaving, motion.rounding) = (progress.leaving, progress.rounding);
        let mut left = left.unwrap_or(LaneLeft::at_start(wanted));
        left.open |= wanted & !going;
        left
    }
}

impl<const N: usize> Company<Lanes<N>> for Together<'_, N> {
    #[inline(always)]
    fn harmonic(
        &mut self,
        phase: Lanes<N>,
        reference: Lanes<N>,
        wanted: LaneMask<N>,
    ) -> [Lanes<N>; 2] {
        self.harmonics.go_to(phase, reference, wanted);
        self.harmonics.pair()
    }

    #[inline(always)]
    fn record(&mut self, wanted: LaneMask<N>, time: Lanes<N>, speed: Lanes<N>, rebound: Lanes<N>) {
        for lane in wanted.lanes() {
            let (speed, rebound) = (speed[lane], rebound[lane]);
            let event = Event {
                time: time[lane],
                surface: SURFACE,
                kind: EventKind::Impact { speed, rebound },
            };
            (self.record)(lane, event);
        }
    }
}
