//! Enclosure test: the events of one gap on one piece of a span, from its control points; for one
//! orbit or for several in lanes.
//!
//! One idea: the answer is no event, or exactly one zero or one extremum, which is located;
//! everything else is undecided. The few kinds of answers are masks: a kind is computed if any lane
//! has it, minima and contacts once for all lanes that have them.

use num_traits::Zero as _;

use super::polygon::{Polygon, SpanPiece};
use super::zeros::GapCourse;
use crate::flow::{Backend, NumberMask, RoundedNumber};
use crate::numeric::{Branched, Mask, Scalar};

/// A gap to be tested, and the conditions at the start of its flight.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedGap<S: Branched> {
    /// Mask: the gap is tested.
    pub(super) wanted: S::Mask,
    /// Mask: contacts are flown through, and minima of any depth are sought.
    pub(super) ignoring: S::Mask,
    /// Largest gap at which other minima are sought.
    pub(super) near: S,
    /// Mask: the flight stops at minima of this gap.
    pub(super) stops: S::Mask,
    /// Mask: the gap is zero at the start, and the state leaves the surface; then the rounding of
    /// that zero.
    pub(super) leaving: S::Mask,
    pub(super) left_within: S,
    /// Masks: the gap rises; the gap falls. Before the test of a piece they hold at its start,
    /// after the test at its end.
    pub(super) rises: S::Mask,
    pub(super) falls: S::Mask,
    /// Time within which a minimum is the one already reported.
    pub(super) within: S,
    /// Rounding of the control points.
    pub(super) rounding: S::Rounded,
    /// Result on the present piece: the course of the gap, and the minima that are flown through.
    pub(super) course: Course<S>,
    pub(super) passed: S::Mask,
    pub(super) passed_time: S,
    pub(super) passed_gap: S,
}

/// Result of the test of a gap on a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<S: Branched> {
    /// Time of the contact or of the minimum, if there is one.
    pub(super) time: S,
    pub(super) contact: S::Mask,
    pub(super) minimum: S::Mask,
    /// Gap at the minimum, and the time for which the gap is known to rise from there.
    pub(super) gap: S,
    pub(super) rises_for: S,
    /// Mask: the control points do not decide.
    pub(super) undecided: S::Mask,
    pub(super) course: Course<S>,
}

/// Course of a gap on a piece.
///
/// NOTE: three masks, not four, because four truth values that are stored together are first
/// assembled in one register.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course<S: Branched> {
    /// Heading at the end.
    pub(super) rises: S::Mask,
    pub(super) falls: S::Mask,
    /// Mask: the heading at the start is the opposite one.
    pub(super) turns: S::Mask,
    /// Time of the minimum, if the gap turns and rises at the end.
    pub(super) lowest: S,
}

impl<S: Branched> WatchedGap<S> {
    /// A gap that is not tested.
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
    /// No event up to a time, with unknown course.
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

/// Test of one gap on one piece.
pub(super) struct EnclosureTest<'t, B: Backend> {
    pub(super) polygon: Polygon<'t, RoundedNumber<B>>,
    pub(super) watched: &'t WatchedGap<B::Number>,
    pub(super) gap: GapCourse<'t, B>,
    /// Start of the piece.
    pub(super) from: RoundedNumber<B>,
    /// Time up to which events are sought.
    pub(super) until: B::Number,
}

/// A contact to be located: near this time, and between the earliest and the latest time.
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

    /// Decides gaps for which few minima are sought: those that stay above the minima sought, and
    /// those with a single zero, which is then sought. Returns the mask of decided gaps.
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

    /// Seeks the contacts of gaps that fall at the end and are not above zero there.
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

    /// Drops contacts after the last time at which events are sought; the gap at that time confirms
    /// that none comes before.
    #[inline(always)]
    fn leave_out_late(&mut self, sought: &mut Sought<B::Number>) {
        let late = sought.wanted & self.until.rounded().is_below(sought.near);
        if late.any() {
            let value = self.gap.value(self.until, late);
            sought.wanted &= !(late & B::Number::zero().is_below(value));
        }
    }

    /// Decides gaps with one extremum, a minimum near a time: the event is that minimum, or the
    /// contact before it.
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
            let piece =
                SpanPiece { from: self.from, length, reach: self.gap.tables.reach().rounded() };
            let (near, known) = self.polygon.fall_before(&turn, piece, below);
            found.undecided |= below & !known;
            sought.near = RoundedNumber::<B>::select(below, near, sought.near);
            sought.earliest = select(known, from, sought.earliest);
            sought.latest = select(known, turn.time, sought.latest);
            sought.wanted |= known;
        }
    }

    /// Time on the span for a share of the piece.
    #[inline(always)]
    fn time(&self, share: RoundedNumber<B>) -> RoundedNumber<B> {
        self.from + share * self.gap.tables.piece()
    }
}
