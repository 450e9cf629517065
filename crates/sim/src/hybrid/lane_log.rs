//! What is known of the passages of several returns: [`Log`](super::itinerary::Log) in lanes.
//!
//! One idea: the event nearest to a passage tells of it, so the nearest one so far is all that is
//! kept of the events, and nothing grows on the way.

use super::passage::MinimumLog;
use super::sensing::Sense;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

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
