//! Forcing periods of several orbits by free flights and impacts in lanes, whatever they fly by.
//!
//! One idea: a turn is a step and, where it ends at the surface, the impact. Who does anything else
//! in a turn leaves the lanes where the turn began.

use super::lane_flow::{LaneAsked, LaneFlow};
use super::lane_log::LaneLog;
use super::lane_motion::{EventRecord, LaneLeft, LaneMotion};
use super::lane_orbits::LaneOrbits;
use super::system::HybridSystem;
use super::trajectory::{Event, EventKind};
use crate::numeric::{Branched, Kernel, LaneMask, Lanes, Mask, wide};

/// The surface at which orbits are flown in lanes, the only one.
const SURFACE: usize = 0;

/// Most turns of a period.
const MAX_TURNS: usize = 1000;

/// Orbits on their way through a period.
#[derive(Clone, Debug)]
pub(super) struct LaneStepping<F, const N: usize> {
    orbits: LaneOrbits<F, N>,
    /// The motions where the turn began.
    before: LaneMotion<N>,
}

impl<F: LaneFlow<N>, const N: usize> LaneStepping<F, N> {
    pub(super) fn new(flow: F, system: &HybridSystem) -> Self {
        let orbits = LaneOrbits::new(flow, system, LaneLog::none());
        let before = orbits.motion.clone();
        Self { orbits, before }
    }

    /// Flies the wanted lanes through a period; where that ended early.
    pub(super) fn fly(
        &mut self,
        motion: &mut LaneMotion<N>,
        wanted: LaneMask<N>,
        horizon: Lanes<N>,
        record: EventRecord<'_>,
    ) -> LaneLeft<N> {
        std::mem::swap(motion, &mut self.orbits.motion);
        self.orbits.alive = wanted;
        let left = wide(Period {
            stepping: self,
            horizon,
            record,
        });
        std::mem::swap(motion, &mut self.orbits.motion);
        left.unwrap_or(LaneLeft::at_start(wanted))
    }
}

struct Period<'t, F, const N: usize> {
    stepping: &'t mut LaneStepping<F, N>,
    horizon: Lanes<N>,
    record: EventRecord<'t>,
}

impl<F: LaneFlow<N>, const N: usize> Kernel for Period<'_, F, N> {
    type Output = LaneLeft<N>;

    #[inline(always)]
    fn run(self) -> LaneLeft<N> {
        let Self {
            stepping,
            horizon,
            record,
        } = self;
        let wanted = stepping.orbits.alive;
        stepping.orbits.start_period();
        let mut left = LaneLeft::at_start(wanted & !stepping.orbits.alive);
        for _ in 0..MAX_TURNS {
            let orbits = &stepping.orbits;
            let going = orbits.alive & orbits.motion.time.is_below(horizon);
            if !going.any() {
                return left;
            }
            stepping.turn(going, horizon, record);
            left.open |= going & !stepping.orbits.alive;
            left.flown |= going & stepping.orbits.alive;
        }
        let orbits = &stepping.orbits;
        left.open |= orbits.alive & orbits.motion.time.is_below(horizon);
        left
    }
}

impl<F: LaneFlow<N>, const N: usize> LaneStepping<F, N> {
    /// A step, and the impacts it ends with.
    #[inline(always)]
    fn turn(&mut self, going: LaneMask<N>, horizon: Lanes<N>, record: EventRecord<'_>) {
        let (orbits, none) = (&mut self.orbits, LaneMask::NONE);
        self.before.take(going, &orbits.motion);
        let asked = LaneAsked {
            wanted: going,
            ignoring: none,
            stopping: none,
            blind: none,
            near: 0.0,
            passing: none,
            landing: going,
            longest: horizon - orbits.motion.time,
        };
        let met = orbits.leap(horizon, asked).contact;
        if met.any() {
            let [speed, rebound] = orbits.respond(met, none);
            for lane in (met & orbits.alive).lanes() {
                let (speed, rebound) = (speed[lane], rebound[lane]);
                let event = Event {
                    time: orbits.motion.time[lane],
                    surface: SURFACE,
                    kind: EventKind::Impact { speed, rebound },
                };
                record(lane, event);
            }
        }
        orbits.motion.take(going & !orbits.alive, &self.before);
    }
}
