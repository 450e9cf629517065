//! What the control points of one gap on one piece of a span tell of its events, of one orbit or of
//! several in lanes.
//!
//! One idea: no event, or exactly one zero or one extremum, which is found; anything else is
//! undecided. The few kinds of an answer are masks: a kind is worked out where any lane has it,
//! minima and contacts once for all lanes that have them.

use num_traits::Zero as _;

use super::polygon::{Piece, Polygon};
use super::zeros::GapCourse;
use crate::flow::{Backend, NumberMask, RoundedNumber};
use crate::numeric::{Branched, Mask, Scalar};

/// A gap of which events are asked, and where its flight starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedGap<S: Branched> {
    /// Where anything is asked.
    pub(super) wanted: S::Mask,
    /// Where contacts are flown through, and minima of any depth are looked for.
    pub(super) ignoring: S::Mask,
    /// The largest gap of other minima that are looked for.
    pub(super) near: S,
    /// Where the flight stops at its minima.
    pub(super) stops: S::Mask,
    /// Where the gap is zero at the start, and to which rounding.
    pub(super) leaving: S::Mask,
    pub(super) left_within: S,
    /// Which way the gap goes: at the start, then at the end.
    pub(super) rises: S::Mask,
    pub(super) falls: S::Mask,
    /// Time within which a minimum is one that is known already.
    pub(super) within: S,
    /// Rounding of its control points.
    pub(super) rounding: S::Rounded,
    /// What was found of it on the present piece: its course, and the minima that are flown
    /// through.
    pub(super) course: Course<S>,
    pub(super) passed: S::Mask,
    pub(super) passed_time: S,
    pub(super) passed_gap: S,
}

/// What is found of a gap on a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<S: Branched> {
    /// Time of the contact or of the minimum, where there is one.
    pub(super) time: S,
    pub(super) contact: S::Mask,
    pub(super) minimum: S::Mask,
    /// The gap at the minimum, and for how long it is known to rise from there.
    pub(super) gap: S,
    pub(super) rises_for: S,
    /// Where the points are not enough.
    pub(super) undecided: S::Mask,
    pub(super) course: Course<S>,
}

/// Which way a gap goes on a piece.
///
/// NOTE: of three masks, not of four: four truth values that are stored together are first put
/// together in one register.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course<S: Branched> {
    /// Which way it goes at the end.
    pub(super) rises: S::Mask,
    pub(super) falls: S::Mask,
    /// Where it goes the other way first.
    pub(super) turns: S::Mask,
    /// When it turns, where it rises at the end.
    pub(super) lowest: S,
}

impl<S: Branched> WatchedGap<S> {
    /// Of which nothing is asked.
    pub(super) fn unasked() -> Self {
        let (none, zero) = (S::Mask::NONE, S::zero());
        Self {
            wanted: none,
            ignoring: none,
            near: zero,
            stops: none,
            leaving: none,
            left_within: zero,
            rises: none,
            falls: none,
            within: zero,
            rounding: S::Rounded::zero(),
            course: Course::unknown(zero),
            passed: none,
            passed_time: zero,
            passed_gap: zero,
        }
    }
}

impl<S: Branched> Course<S> {
    #[inline(always)]
    pub(super) fn unknown(time: S) -> Self {
        Self { rises: S::Mask::NONE, falls: S::Mask::NONE, turns: S::Mask::NONE, lowest: time }
    }
}

impl<S: Branched> Found<S> {
    /// No event up to a time, nor which way the gap goes.
    #[inline(always)]
    pub(super) fn nothing(until: S) -> Self {
        let none = S::Mask::NONE;
        Self {
            time: until,
            contact: none,
            minimum: none,
            gap: until,
            rises_for: until,
            undecided: none,
            course: Course::unknown(until),
        }
    }
}

/// A test of one gap on one piece.
pub(super) struct EnclosureTest<'t, B: Backend> {
    pub(super) polygon: Polygon<'t, RoundedNumber<B>>,
    pub(super) watched: &'t WatchedGap<B::Number>,
    pub(super) gap: GapCourse<'t, B>,
    /// Start of the piece.
    pub(super) from: RoundedNumber<B>,
    /// The time up to which events are of interest.
    pub(super) until: B::Number,
}

/// A contact to be found: near which time, and within which.
struct Sought<S: Branched> {
    wanted: S::Mask,
    near: S::Rounded,
    earliest: S,
    latest: S,
}

impl<B: Backend> EnclosureTest<'_, B> {
    #[inline(always)]
    pub(super) fn found(&mut self, wanted: NumberMask<B>) -> Found<B::Number> {
        let mut found = Found::nothing(self.until);
        let mut sought = Sought {
            wanted: NumberMask::<B>::NONE,
            near: self.from,
            earliest: B::Number::from_f64(f64::NEG_INFINITY),
            latest: B::Number::from_f64(f64::INFINITY),
        };
        let mut open = wanted;
        let few = wanted & self.watched.near.is_below(sought.latest);
        if few.any() {
            open &= !self.without_extrema(few, &mut sought);
        }
        let mut valley = NumberMask::<B>::NONE;
        let mut near = self.from;
        if open.any() {
            let WatchedGap { leaving, .. } = *self.watched;
            let (rose, fell) = (self.watched.rises & !leaving, self.watched.falls & !leaving);
            let shape = self.polygon.shape(rose);
            let known = open & shape.known;
            let (falls, turns) = (shape.falls, shape.turns);
            let contradicts = known & !falls & fell;
            valley = known & falls & turns;
            found.undecided = (open & !known) | contradicts;
            let upward = known & !falls & !contradicts;
            found.course.rises = upward & !turns;
            found.course.falls = (upward & turns) | (known & falls & !turns);
            found.course.turns = upward & turns;
            self.falls_at_end(&mut found, &mut sought);
            if valley.any() {
                near += self.polygon.turn(&shape) * self.gap.tables.piece();
            }
        }
        if sought.wanted.any() {
            self.leave_out_late(&mut sought);
        }
        if valley.any() {
            self.valley(near, valley, &mut found, &mut sought);
        }
        if sought.wanted.any() {
            let (time, is_found) = self.gap.fall(sought.near, sought.wanted);
            let inside = sought.earliest.is_at_most(time) & time.is_at_most(sought.latest);
            let contact = sought.wanted & is_found & inside;
            found.undecided |= sought.wanted & !contact;
            found.contact = contact;
            found.time = B::Number::select(sought.wanted, time, found.time);
        }
        found
    }

    /// Where few minima are of interest: where the gap stays above them, and where it has one zero,
    /// which is to be sought.
    #[inline(always)]
    fn without_extrema(
        &self,
        wanted: NumberMask<B>,
        sought: &mut Sought<B::Number>,
    ) -> NumberMask<B> {
        let (polygon, zero) = (&self.polygon, B::Number::zero());
        let WatchedGap { near, leaving, .. } = *self.watched;
        let contacts_alone = wanted & near.is_at_most(zero);
        let bound = B::Number::select(contacts_alone, zero, near).rounded();
        let above = wanted & polygon.is_above(bound, leaving & contacts_alone);
        let below = contacts_alone & !above;
        if !below.any() {
            return above;
        }
        let fall = polygon.one_fall(leaving);
        sought.wanted = below & fall.exists;
        if sought.wanted.any() {
            sought.near = self.time(polygon.fall(&fall));
        }
        above | sought.wanted
    }

    /// The contacts of gaps that fall at the end, where they are not above zero there.
    #[inline(always)]
    fn falls_at_end(&self, found: &mut Found<B::Number>, sought: &mut Sought<B::Number>) {
        let [_, ends_above] = self.polygon.ends_above();
        let wanted = found.course.falls & !self.watched.ignoring & !ends_above;
        if !wanted.any() {
            return;
        }
        let fall = self.polygon.one_fall(self.watched.leaving);
        found.undecided |= wanted & !fall.exists;
        let wanted = wanted & fall.exists;
        if !wanted.any() {
            return;
        }
        found.course.falls &= !wanted;
        let near = self.time(self.polygon.fall(&fall));
        sought.near = RoundedNumber::<B>::select(wanted, near, sought.near);
        sought.wanted |= wanted;
    }

    /// Leaves out contacts that lie later than is of interest: the motion there is asked for in any
    /// case.
    #[inline(always)]
    fn leave_out_late(&mut self, sought: &mut Sought<B::Number>) {
        let late = sought.wanted & self.until.rounded().is_below(sought.near);
        if late.any() {
            let value = self.gap.value(self.until, late);
            sought.wanted &= !(late & B::Number::zero().is_below(value));
        }
    }

    /// Gaps with one extremum, a minimum near a time: that, or the contact before it.
    #[inline(always)]
    fn valley(
        &mut self,
        near: RoundedNumber<B>,
        valley: NumberMask<B>,
        found: &mut Found<B::Number>,
        sought: &mut Sought<B::Number>,
    ) {
        let turn = self.gap.turn(near, valley);
        let (select, zero) = (B::Number::select, B::Number::zero());
        let WatchedGap { ignoring, leaving, rises, .. } = *self.watched;
        let length = self.gap.tables.piece();
        let from = B::Number::from_rounded(self.from);
        let end = from + B::Number::from_rounded(length);
        let outside = turn.time.is_below(from) | end.is_below(turn.time);
        let is_old = (turn.time - from).is_below(self.watched.within);
        let same = valley & rises & !leaving & is_old;
        let is_left = !ignoring | (-self.watched.left_within).is_at_most(turn.gap);
        let unclear = valley & (!turn.found | outside | (leaving & is_left));
        let clear = valley & !unclear & !same;
        found.undecided |= unclear;
        found.course.rises |= (same & !unclear) | clear;
        found.course.turns |= clear;
        found.course.lowest = turn.time;
        (found.gap, found.rises_for) = (turn.gap, turn.rises_for);
        let below = clear & !ignoring & turn.gap.is_below(zero);
        let is_near = zero.is_at_most(turn.gap) & turn.gap.is_at_most(self.watched.near);
        found.minimum = clear & !below & (ignoring | is_near);
        found.time = select(valley, turn.time, found.time);
        if below.any() {
            let piece = Piece { from: self.from, length, reach: self.gap.tables.reach().rounded() };
            let (near, known) = self.polygon.fall_before(&turn, piece, below);
            found.undecided |= below & !known;
            sought.near = RoundedNumber::<B>::select(below, near, sought.near);
            sought.earliest = select(known, from, sought.earliest);
            sought.latest = select(known, turn.time, sought.latest);
            sought.wanted |= known;
        }
    }

    /// A time of the span from a share of the piece.
    #[inline(always)]
    fn time(&self, share: RoundedNumber<B>) -> RoundedNumber<B> {
        self.from + share * self.gap.tables.piece()
    }
}
