//! What control points tell of the events of one gap of several orbits: [`Look`](super::look::Look)
//! in lanes.
//!
//! One idea: the few kinds of an answer are masks. A kind is worked out where any lane has it,
//! minima and contacts once for all lanes that have them; all others are left open.

use super::newton::GapCourse;
use super::polygon::{Piece, Polygon};
use crate::flow::{LaneLeaps, LeapTables};
use crate::numeric::{Branched, LaneMask, Lanes, Mask};

/// A look at the gaps on one piece; all minima are looked for, and contacts where they are not
/// flown through.
pub(super) struct LaneLook<'t, const N: usize> {
    pub(super) polygon: Polygon<'t, Lanes<N>>,
    pub(super) gap: GapCourse<'t, LaneLeaps<N>>,
    /// Start of the piece.
    pub(super) from: Lanes<N>,
    /// The time up to which events are of interest.
    pub(super) until: Lanes<N>,
    /// Time within which a minimum is one that is known already.
    pub(super) within: Lanes<N>,
    /// Where the gap is zero at the start, to a rounding.
    pub(super) leaving: LaneMask<N>,
    pub(super) left_within: Lanes<N>,
    /// Where contacts are flown through.
    pub(super) ignoring: LaneMask<N>,
    /// Which way the gap went before.
    pub(super) rose: LaneMask<N>,
    pub(super) fell: LaneMask<N>,
}

/// What is found of the gaps on a piece.
pub(super) struct Found<const N: usize> {
    pub(super) time: Lanes<N>,
    pub(super) contact: LaneMask<N>,
    pub(super) minimum: LaneMask<N>,
    /// For how long the gap is known to rise from a minimum.
    pub(super) rises_for: Lanes<N>,
    /// Where the points are not enough.
    pub(super) open: LaneMask<N>,
    /// Which way the gaps go at the end.
    pub(super) rises: LaneMask<N>,
    pub(super) falls: LaneMask<N>,
}

/// A contact to be found: near this time.
struct Sought<const N: usize> {
    near: Lanes<N>,
    wanted: LaneMask<N>,
}

impl<const N: usize> LaneLook<'_, N> {
    #[inline(always)]
    pub(super) fn found(&mut self, wanted: LaneMask<N>) -> Found<N> {
        let shape = self.polygon.shape(self.rose);
        let known = wanted & shape.known;
        let valley = known & shape.falls & shape.turns;
        let rising = known & !shape.falls & !shape.turns;
        let hill = known & !shape.falls & shape.turns;
        let falling = known & shape.falls & !shape.turns;
        let lost = (rising | hill) & self.fell;
        let mut found = Found {
            time: self.until,
            contact: LaneMask::NONE,
            minimum: LaneMask::NONE,
            rises_for: self.until,
            open: (wanted & !shape.known) | lost,
            rises: rising & !lost,
            falls: (hill & !lost) | falling,
        };
        let sought = self.fall(&mut found);
        if valley.any() {
            let near = self.from + self.polygon.turn(&shape) * self.gap.leaps.piece();
            self.valley(near, valley, sought, &mut found);
        } else if sought.wanted.any() {
            let (time, is_found) = self.gap.fall(sought.near, sought.wanted);
            take_contacts(&mut found, &sought, time, is_found);
        }
        found
    }

    /// The contacts of gaps that fall at the end, where they are not above zero there.
    #[inline(always)]
    fn fall(&mut self, found: &mut Found<N>) -> Sought<N> {
        let [_, ends_above] = self.polygon.ends_above();
        let mut wanted = found.falls & !self.ignoring & !ends_above;
        let mut near = self.until;
        if wanted.any() {
            let fall = self.polygon.one_fall(self.leaving);
            found.open |= wanted & !fall.exists;
            wanted &= !found.open;
            found.falls &= !wanted;
            near = self.from + self.polygon.fall(&fall) * self.gap.leaps.piece();
            let late = wanted & self.until.is_below(near);
            if late.any() {
                let value = self.gap.value(self.until, late);
                wanted &= !(late & Lanes::splat(0.0).is_below(value));
            }
        }
        Sought { near, wanted }
    }

    /// Gaps with one extremum, a minimum: that, or the contact before it; with these the contacts
    /// sought already.
    #[inline(always)]
    fn valley(
        &mut self,
        near: Lanes<N>,
        valley: LaneMask<N>,
        mut sought: Sought<N>,
        found: &mut Found<N>,
    ) {
        let turn = self.gap.turn(near, valley);
        let zero = Lanes::splat(0.0);
        let end = self.from + self.gap.leaps.piece();
        let outside = turn.time.is_below(self.from) | end.is_below(turn.time);
        let same = valley & self.rose & (turn.time - self.from).is_below(self.within);
        let is_left = !self.ignoring | (-self.left_within).is_at_most(turn.gap);
        let unclear = valley & (!turn.found | outside | (self.leaving & is_left));
        let clear = valley & !unclear & !same;
        found.open |= unclear;
        found.rises |= same & !unclear;
        found.falls |= clear & self.until.is_below(turn.time);
        found.rises_for = turn.rises_for;
        let below = clear & !self.ignoring & turn.gap.is_below(zero);
        let admitted = self.ignoring | zero.is_at_most(turn.gap);
        found.minimum |= clear & !below & admitted;
        found.rises |= clear & turn.time.is_at_most(self.until);
        found.time = Lanes::select(found.minimum, turn.time, found.time);
        if below.any() {
            let piece = Piece {
                from: self.from,
                length: self.gap.leaps.piece(),
                reach: self.gap.leaps.reach(),
            };
            let (near, known) = self.polygon.fall_before(&turn, piece, below);
            found.open |= below & !known;
            sought.near = Lanes::select(known, near, sought.near);
            sought.wanted |= known;
        }
        if sought.wanted.any() {
            let (time, is_found) = self.gap.fall(sought.near, sought.wanted);
            let inside = self.from.is_at_most(time) & time.is_at_most(turn.time);
            take_contacts(found, &sought, time, is_found & (inside | !below));
        }
    }
}

/// Puts down the contacts that were found; the others stay open.
#[inline(always)]
fn take_contacts<const N: usize>(
    found: &mut Found<N>,
    sought: &Sought<N>,
    time: Lanes<N>,
    is_found: LaneMask<N>,
) {
    found.open |= sought.wanted & !is_found;
    found.contact |= sought.wanted & is_found;
    found.time = Lanes::select(found.contact, time, found.time);
}
