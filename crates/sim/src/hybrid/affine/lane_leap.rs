//! Free flight of several orbits to their next events: [`Leaper`](super::leap::Leaper) in lanes, at
//! one surface.
//!
//! One idea: leaps, not times, go in step. Each lane has its own time and its own event; where one
//! lane is done on a piece it waits for the others. What control points leave open is left to the
//! orbit alone.

use super::lane_look::{Found, LaneLook};
use super::newton::{GapCourse, NodeVisit};
use super::polygon::Polygon;
use super::polygon::ROUNDING;
use crate::flow::{LaneLeaps, LeapTables};
use crate::hybrid::lane_flow::{LaneAsked, LaneLeap};
use crate::hybrid::lane_log::LaneLog;
use crate::hybrid::lane_motion::LaneMotion;
use crate::hybrid::motion::SAME_MINIMUM;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// The surface at which orbits are flown in lanes.
const SURFACE: usize = 0;

/// Working memory of leaps in lanes.
#[derive(Clone, Debug)]
pub(super) struct LaneLeapBuffers<const N: usize> {
    pub(super) visit: NodeVisit<LaneLeaps<N>>,
    control: Vec<Lanes<N>>,
}

impl<const N: usize> LaneLeapBuffers<N> {
    pub(super) fn new(leaps: &LaneLeaps<N>) -> Self {
        Self {
            visit: NodeVisit::new(leaps, leaps.columns()),
            control: vec![Lanes::splat(0.0); leaps.points()],
        }
    }
}

/// Leaps to be flown.
pub(super) struct LaneLeaper<'t, const N: usize> {
    pub(super) leaps: &'t LaneLeaps<N>,
    pub(super) extended: &'t [Lanes<N>],
    pub(super) buffers: &'t mut LaneLeapBuffers<N>,
    pub(super) motion: &'t mut LaneMotion<N>,
    pub(super) asked: LaneAsked<N>,
    /// Where minima at which flights do not end are put down.
    pub(super) log: &'t mut LaneLog<N>,
}

impl<const N: usize> LaneLeaper<'_, N> {
    /// Flies to the first events or for the longest time; the motions' headings are those there.
    #[inline(always)]
    pub(super) fn fly(&mut self) -> LaneLeap<N> {
        let rounding = Lanes::splat(ROUNDING) * self.leaps.size(SURFACE, self.extended);
        let quiet = self.asked.longest.min(self.leaps.span());
        self.buffers.visit.forget();
        let mut leap = LaneLeap {
            time: quiet,
            contact: LaneMask::NONE,
            minimum: LaneMask::NONE,
            rises_for: Lanes::splat(0.0),
            open: LaneMask::NONE,
        };
        self.motion.lose_headings(self.asked.blind);
        let mut going = self.asked.wanted & !self.asked.blind;
        let mut within = Lanes::splat(SAME_MINIMUM) * self.leaps.time_scale();
        let mut leaving = self.motion.leaving;
        for piece in 0..self.leaps.pieces() {
            let start = self.leaps.piece() * Lanes::splat(piece as f64);
            going &= start.is_below(quiet);
            if !going.any() {
                break;
            }
            self.leaps
                .look(SURFACE, piece, self.extended, &mut self.buffers.control);
            let found = self.found(start, quiet, going, rounding, within, leaving);
            leap.open |= going & found.open;
            going &= !found.open;
            let inside = going & found.time.is_at_most(quiet);
            let missed = inside & found.minimum & !self.asked.stopping;
            self.log.miss(missed, self.motion.time + found.time);
            let met = inside & (found.contact | found.minimum) & !missed;
            leap.time = Lanes::select(met, found.time, leap.time);
            leap.rises_for = Lanes::select(met, found.rises_for, leap.rises_for);
            leap.contact |= met & found.contact;
            leap.minimum |= met & found.minimum;
            self.turn(going, &found);
            going &= !met & (start + self.leaps.piece()).is_below(quiet);
            (within, leaving) = (Lanes::splat(0.0), LaneMask::NONE);
        }
        leap
    }

    /// Remembers which way the gaps go where a piece ends.
    #[inline(always)]
    fn turn(&mut self, wanted: LaneMask<N>, found: &Found<N>) {
        self.motion.lose_headings(wanted);
        self.motion.rises |= found.rises & wanted;
        self.motion.falls |= found.falls & wanted;
    }

    /// What the control points of the gaps on a piece tell of their events.
    #[inline(always)]
    fn found(
        &mut self,
        from: Lanes<N>,
        until: Lanes<N>,
        wanted: LaneMask<N>,
        rounding: Lanes<N>,
        within: Lanes<N>,
        leaving: LaneMask<N>,
    ) -> Found<N> {
        let LaneLeapBuffers { visit, control } = &mut *self.buffers;
        let polygon = Polygon {
            points: control,
            rounding,
        };
        let gap = GapCourse {
            leaps: self.leaps,
            extended: self.extended,
            surface: SURFACE,
            visit,
        };
        let mut look = LaneLook {
            polygon,
            gap,
            from,
            until,
            within,
            leaving,
            ignoring: self.asked.ignoring,
            rose: self.motion.rises & !leaving,
            fell: self.motion.falls & !leaving,
            left_within: self.motion.rounding,
        };
        look.found(wanted)
    }
}
