//! Flow of several orbits in lanes, each at its own parameters.
//!
//! One idea: callers ask for events, and do not depend on how a free flight is computed, by exact
//! steps or by Taylor steps.
//!
//! A [`LaneLog`] records the passages of several returns, as [`Log`](super::trajectory::Log) does
//! for one. The event nearest to a passage decides whether it made contact. Only the nearest event
//! so far is kept, so that the memory is constant.

use super::motion::{LaneMotion, Sense};
use super::passage::{Back, MinimumLog};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// Goals of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneAsked<const N: usize> {
    /// Mask: lanes that fly.
    pub(super) wanted: LaneMask<N>,
    /// Mask: contacts are flown through.
    pub(super) ignoring: LaneMask<N>,
    /// Mask: flights end at minima; in other lanes minima are logged and flown through.
    pub(super) stopping: LaneMask<N>,
    /// Mask: no events are sought.
    pub(super) blind: LaneMask<N>,
    /// Mask: only the existence of a minimum matters.
    pub(super) passing: LaneMask<N>,
    /// Mask: the motions after the longest flights are needed.
    pub(super) landing: LaneMask<N>,
    /// Longest flights.
    pub(super) longest: Lanes<N>,
}

/// Ends of steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneStepEnd<const N: usize> {
    /// Times flown.
    pub(super) time: Lanes<N>,
    /// Mask: the step ends at a contact.
    pub(super) contact: LaneMask<N>,
    /// Mask: the step ends at a minimum that stops the flight; then the time for which the gap is
    /// known to rise from there.
    pub(super) minimum: LaneMask<N>,
    pub(super) rises_for: Lanes<N>,
    /// Mask: nothing is known, and the scalar simulator must fly the lane.
    pub(super) undecided: LaneMask<N>,
}

/// Free flight, events and reset of `N` orbits at one rigid surface.
///
/// NOTE: all methods are inlined into the kernels of flights.
pub(super) trait LaneFlow<const N: usize> {
    /// Forgets earlier motions when states are placed.
    fn forget(&mut self);

    /// Time scales of the motions.
    fn time_scale(&self, motion: &LaneMotion<N>) -> Lanes<N>;

    /// Flies freely towards the first events, at most for the longest times, and moves the motions
    /// there in lanes that need them.
    fn step(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneStepEnd<N>;

    /// Moves motions back along the free flow to the zeros or minima of their gaps, at most for a
    /// time. Returns the mask of lanes in which these are known.
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N>;

    /// Normal motions at the surface, along the free flow.
    fn sense(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Sense<Lanes<N>>;

    /// Gaps and their velocities, as in [`sense`](Self::sense).
    #[inline(always)]
    fn approach(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> [Lanes<N>; 2] {
        let Sense { gap, velocity, .. } = self.sense(motion, wanted);
        [gap, velocity]
    }

    /// Gaps of the surface.
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N>;

    /// Applies the reset.
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>);

    /// Brings states that have landed beside the surface onto it. Returns the mask of lanes that
    /// stay beside it.
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N>;

    /// Clears the mark of a surface just left in lanes whose gap exceeds rounding.
    #[inline(always)]
    fn leave_behind(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        let wanted = wanted & motion.leaving;
        if wanted.any() {
            let gap = self.gap(motion, wanted);
            motion.leaving &= !(wanted & motion.rounding.is_below(gap.abs()));
        }
    }
}

/// Records of the passages of returns.
#[derive(Clone, Debug)]
pub(super) struct LaneLog<const N: usize> {
    /// Nominal return times.
    duration: Lanes<N>,
    passages: Vec<LaneRecord<N>>,
    /// Whether the first passage is that of the section, which the flight itself determines.
    has_own: bool,
}

/// Record of one passage.
#[derive(Clone, Copy, Debug)]
struct LaneRecord<const N: usize> {
    /// Expected time, as a share of the return time.
    share: Lanes<N>,
    /// Distance of the nearest event from there, in return times.
    distance: Lanes<N>,
    /// Mask: the nearest event is a contact; then its speed.
    met: LaneMask<N>,
    speed: Lanes<N>,
}

impl<const N: usize> LaneLog<N> {
    /// Log of returns of these durations, with passages expected at these shares of them; `has_own`
    /// tells whether the first passage is that of the section.
    pub(super) fn new(duration: Lanes<N>, shares: &[Lanes<N>], has_own: bool) -> Self {
        let zero = Lanes::splat(0.0);
        let record =
            |&share| LaneRecord { share, distance: zero, met: LaneMask::NONE, speed: zero };
        Self { duration, passages: shares.iter().map(record).collect(), has_own }
    }

    /// Clears the records when returns start.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        for (number, passage) in self.passages.iter_mut().enumerate() {
            passage.met = LaneMask::NONE;
            // NOTE: no event is nearer than this to the section's own passage, which events do not
            // determine.
            let is_own = self.has_own && number == 0;
            passage.distance = Lanes::splat(f64::INFINITY * if is_own { -1.0 } else { 1.0 });
        }
    }

    /// Speed at which a passage of a lane made contact; `None` without contact.
    pub(super) fn speed(&self, passage: usize, lane: usize) -> Option<f64> {
        let passage = &self.passages[passage];
        passage.met.holds(lane).then(|| passage.speed[lane])
    }

    /// Records contacts of the section's own passages at these speeds.
    #[inline(always)]
    pub(super) fn meet(&mut self, wanted: LaneMask<N>, speed: Lanes<N>) {
        if let Some(own) = self.passages.first_mut() {
            own.take(wanted, own.distance, speed, wanted);
        }
    }

    /// Records contacts at a time with a normal motion: at the minima that their approaches would
    /// have had, to leading order.
    #[inline(always)]
    pub(super) fn contact(&mut self, wanted: LaneMask<N>, time: Lanes<N>, sense: &Sense<Lanes<N>>) {
        if !self.asks_events() {
            return;
        }
        let limit = self.duration * Lanes::splat(0.25);
        let turns = Lanes::splat(0.0).is_below(sense.acceleration);
        let lead = (-sense.velocity / sense.acceleration).min(limit);
        let lead = Lanes::select(turns, lead, Lanes::splat(0.0));
        self.put(wanted, time + lead, -sense.velocity, wanted);
    }

    /// Records minima without contact.
    #[inline(always)]
    pub(super) fn miss(&mut self, wanted: LaneMask<N>, time: Lanes<N>) {
        if self.asks_events() && wanted.any() {
            self.put(wanted, time, time, LaneMask::NONE);
        }
    }

    /// Whether events determine any passage.
    #[inline(always)]
    fn asks_events(&self) -> bool {
        self.passages.len() > usize::from(self.has_own)
    }

    /// Records events for the passages that are nearest to them around the return.
    #[inline(always)]
    fn put(&mut self, wanted: LaneMask<N>, time: Lanes<N>, speed: Lanes<N>, contact: LaneMask<N>) {
        let share = time / self.duration;
        let mut least = Lanes::splat(f64::INFINITY);
        for passage in &self.passages {
            least = least.min(passage.distance_of(share));
        }
        let mut left = wanted;
        for passage in &mut self.passages {
            let distance = passage.distance_of(share);
            let here = left & distance.is_equal(least);
            left &= !here;
            let nearer = here & distance.is_below(passage.distance);
            passage.take(nearer, distance, speed, contact);
        }
    }
}

impl<const N: usize> LaneRecord<N> {
    /// Distance of shares of the return time from this passage.
    #[inline(always)]
    fn distance_of(&self, share: Lanes<N>) -> Lanes<N> {
        let difference = share - self.share;
        (difference - difference.map(f64::round)).abs()
    }

    #[inline(always)]
    fn take(
        &mut self,
        wanted: LaneMask<N>,
        distance: Lanes<N>,
        speed: Lanes<N>,
        contact: LaneMask<N>,
    ) {
        self.distance = Lanes::select(wanted, distance, self.distance);
        self.speed = Lanes::select(wanted, speed, self.speed);
        self.met = (self.met & !wanted) | (contact & wanted);
    }
}

/// Log of the minima of a step that starts at a time.
pub(super) struct LoggedFrom<'t, const N: usize> {
    pub(super) start: Lanes<N>,
    pub(super) log: &'t mut LaneLog<N>,
}

impl<const N: usize> MinimumLog<Lanes<N>> for LoggedFrom<'_, N> {
    #[inline(always)]
    fn miss(&mut self, wanted: LaneMask<N>, _: usize, time: Lanes<N>, _: Lanes<N>) {
        self.log.miss(wanted, self.start + time);
    }
}
