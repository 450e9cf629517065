//! What several orbits fly by in lanes, each at its own parameters.
//!
//! One idea: how a free flight is computed, by leaps of the exact flow or by steps of Taylor's
//! method, is no concern of who asks for its events.

use super::lane_log::LaneLog;
use super::motion::LaneMotion;
use super::passage::Back;
use super::sensing::Sense;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// What is asked of a leap.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneAsked<const N: usize> {
    /// The lanes that fly.
    pub(super) wanted: LaneMask<N>,
    /// Where contacts are flown through.
    pub(super) ignoring: LaneMask<N>,
    /// Where flights end at minima, which elsewhere are put down and flown through.
    pub(super) stopping: LaneMask<N>,
    /// Where nothing is looked for.
    pub(super) blind: LaneMask<N>,
    /// The largest gap of minima that are put down, the same in all lanes.
    ///
    /// NOTE: the exact flow puts down all.
    pub(super) near: f64,
    /// Where it is of interest only whether there is a minimum.
    pub(super) passing: LaneMask<N>,
    /// Where the motions at the ends of the longest flights are of use.
    pub(super) landing: LaneMask<N>,
    /// The longest flights.
    pub(super) longest: Lanes<N>,
}

/// Where leaps end.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneLeap<const N: usize> {
    /// Times flown.
    pub(super) time: Lanes<N>,
    /// At a contact.
    pub(super) contact: LaneMask<N>,
    /// At a minimum that ends the flight, from which the gap is known to rise for a time.
    pub(super) minimum: LaneMask<N>,
    pub(super) rises_for: Lanes<N>,
    /// Where nothing is known: to be flown alone.
    pub(super) open: LaneMask<N>,
}

/// Free flight, events and reset of `N` orbits at one rigid surface.
///
/// NOTE: all of it is inlined into the kernels of flights.
pub(super) trait LaneFlow<const N: usize> {
    /// To be called where states are placed.
    fn forget(&mut self);

    /// The times in which the motions change.
    fn time_scale(&self, motion: &LaneMotion<N>) -> Lanes<N>;

    /// Flies freely towards the first events, to a time at most, and takes the motions there where
    /// that is of use.
    fn leap(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneLeap<N>;

    /// Takes motions back along the free flow to where their gaps were zero or least, a time at
    /// most; where that is known.
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N>;

    /// The normal motion at the surface, along the free flow.
    fn sense(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Sense<Lanes<N>>;

    /// The gap and its velocity, as [`sense`](Self::sense) tells them.
    #[inline(always)]
    fn approach(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> [Lanes<N>; 2] {
        let Sense { gap, velocity, .. } = self.sense(motion, wanted);
        [gap, velocity]
    }

    /// The gap.
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N>;

    /// The states after an impact.
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>);

    /// Brings states onto the surface that they have landed beside; where they stay beside it.
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N>;

    /// Lets surfaces be left behind where their gaps are more than rounding.
    #[inline(always)]
    fn leave_behind(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        let wanted = wanted & motion.leaving;
        if wanted.any() {
            let gap = self.gap(motion, wanted);
            motion.leaving &= !(wanted & motion.rounding.is_below(gap.abs()));
        }
    }
}
