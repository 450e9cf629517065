//! What several orbits fly by in lanes, each at its own parameters.
//!
//! One idea: the caller asks for events, and does not depend on how a free flight is computed, by
//! exact steps or by steps of Taylor's method.
//!
//! What is known of the passages of several returns is a [`LaneLog`], in lanes what
//! [`Log`](super::trajectory::Log) is for one. The event nearest to a passage tells of it, so the
//! nearest one so far is all that is kept of the events, and nothing grows on the way.

use super::motion::{LaneMotion, Sense};
use super::passage::{Back, MinimumLog};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// What is asked of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneAsked<const N: usize> {
    /// The lanes that fly.
    pub(super) wanted: LaneMask<N>,
    /// Where contacts are flown through.
    pub(super) ignoring: LaneMask<N>,
    /// Where flights end at minima, which elsewhere are logged and flown through.
    pub(super) stopping: LaneMask<N>,
    /// Where nothing is looked for.
    pub(super) blind: LaneMask<N>,
    /// Where it is of interest only whether there is a minimum.
    pub(super) passing: LaneMask<N>,
    /// Where the motions at the ends of the longest flights are of use.
    pub(super) landing: LaneMask<N>,
    /// The longest flights.
    pub(super) longest: Lanes<N>,
}

/// Where steps end.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneStepEnd<const N: usize> {
    /// Times flown.
    pub(super) time: Lanes<N>,
    /// At a contact.
    pub(super) contact: LaneMask<N>,
    /// At a minimum that ends the flight, from which the gap is known to rise for a time.
    pub(super) minimum: LaneMask<N>,
    pub(super) rises_for: Lanes<N>,
    /// Where nothing is known: to be flown by the scalar simulator.
    pub(super) undecided: LaneMask<N>,
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
    fn step(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneStepEnd<N>;

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

/// The passages of returns, as far as they are known.
#[derive(Clone, Debug)]
pub(super) struct LaneLog<const N: usize> {
    /// Nominal return times.
    duration: Lanes<N>,
    passages: Vec<LaneRecord<N>>,
    /// Whether the first passage is that of the section, known from the flight.
    has_own: bool,
}

/// One passage.
#[derive(Clone, Copy, Debug)]
struct LaneRecord<const N: usize> {
    /// When it is expected: shares of the return times.
    share: Lanes<N>,
    /// How far the nearest event is from there.
    distance: Lanes<N>,
    /// Where that is a contact, and at which speed.
    met: LaneMask<N>,
    speed: Lanes<N>,
}

impl<const N: usize> LaneLog<N> {
    /// Of returns that take these times, with passages expected at these shares of them; `has_own`
    /// where the first passage is that of the section.
    pub(super) fn new(duration: Lanes<N>, shares: &[Lanes<N>], has_own: bool) -> Self {
        let zero = Lanes::splat(0.0);
        let record =
            |&share| LaneRecord { share, distance: zero, met: LaneMask::NONE, speed: zero };
        Self { duration, passages: shares.iter().map(record).collect(), has_own }
    }

    /// To be called where returns start.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        for (number, passage) in self.passages.iter_mut().enumerate() {
            passage.met = LaneMask::NONE;
            // NOTE: no event is nearer than this to the section's own passage, of which events do
            // not tell.
            let is_own = self.has_own && number == 0;
            passage.distance = Lanes::splat(f64::INFINITY * if is_own { -1.0 } else { 1.0 });
        }
    }

    /// Speed at which a passage of a lane met the surface.
    pub(super) fn speed(&self, passage: usize, lane: usize) -> Option<f64> {
        let passage = &self.passages[passage];
        passage.met.holds(lane).then(|| passage.speed[lane])
    }

    /// The section's own passages met the surface at these speeds.
    #[inline(always)]
    pub(super) fn meet(&mut self, wanted: LaneMask<N>, speed: Lanes<N>) {
        if let Some(own) = self.passages.first_mut() {
            own.take(wanted, own.distance, speed, wanted);
        }
    }

    /// Contacts at a time with a normal motion: at the minima that their approaches would have had,
    /// to leading order.
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

    /// Minima without contact.
    #[inline(always)]
    pub(super) fn miss(&mut self, wanted: LaneMask<N>, time: Lanes<N>) {
        if self.asks_events() && wanted.any() {
            self.put(wanted, time, time, LaneMask::NONE);
        }
    }

    /// Whether events tell of any passage.
    #[inline(always)]
    fn asks_events(&self) -> bool {
        self.passages.len() > usize::from(self.has_own)
    }

    /// Events belong to the passages that are nearest to them around the return.
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
    /// How far shares of the return times are from here.
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

/// Logs the minima of a step that starts at a time.
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
