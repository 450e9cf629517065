//! The first contact of a free flight, of one orbit or of several in lanes, in as many columns as
//! the compiler knows.
//!
//! One idea: control points say whether a gap stays open on a piece, falls through zero once, or
//! has one minimum, which then says whether there is a contact before it. A series about the node
//! nearest to a contact has it.

use num_traits::Zero as _;

use super::newton::turn;
use super::parabolas::falling_zero;
use super::polygon::{Piece, Polygon, ROUNDING};
use crate::flow::{FixedLeaps, FixedVisit, NumberMask, RoundedNumber, SERIES, ShapedLeaps};
use crate::numeric::{Branched, Mask, Scalar, polynomial};

/// A flight on which contacts are looked for.
pub(super) struct Contacts<'c, 't, T: ShapedLeaps, const C: usize, const B: usize> {
    pub(super) leaps: &'c FixedLeaps<'t, T, C, B>,
    pub(super) extended: &'c [T::Number; C],
    /// The time up to which contacts are of interest.
    pub(super) until: T::Number,
    pub(super) visit: &'c mut FixedVisit<T, B>,
}

/// The first contact of a flight.
pub(super) struct FirstContact<S: Branched> {
    /// Its time, or where the flight ends.
    pub(super) time: S,
    /// Where there is one.
    pub(super) met: S::Mask,
    /// Where nothing is known.
    pub(super) open: S::Mask,
}

/// A contact to be found: near which time, and within which.
struct Sought<S: Branched> {
    near: S::Rounded,
    wanted: S::Mask,
    earliest: S,
    latest: S,
}

impl<T: ShapedLeaps, const C: usize, const B: usize> Contacts<'_, '_, T, C, B> {
    /// The first contact, where it is wanted; `leaving` where the surface has just been left.
    #[inline(always)]
    pub(super) fn first(
        &mut self,
        wanted: NumberMask<T>,
        leaving: NumberMask<T>,
    ) -> FirstContact<T::Number> {
        let (leaps, until, none) = (self.leaps, self.until.rounded(), NumberMask::<T>::NONE);
        let (number, zero) = (RoundedNumber::<T>::from_f64, RoundedNumber::<T>::zero());
        let mut rounded = [zero; C];
        for (rounded, value) in rounded.iter_mut().zip(self.extended) {
            *rounded = value.rounded();
        }
        let rounding = number(ROUNDING) * leaps.size(&rounded);
        let mut first = FirstContact {
            time: self.until,
            met: none,
            open: none,
        };
        let (mut going, mut on_zero, mut from) = (wanted, leaving, zero);
        for piece in 0..leaps.pieces() {
            let points = leaps.look(piece, &rounded);
            let polygon = Polygon {
                points: points.as_flattened(),
                rounding,
            };
            let near = going & !polygon.is_above(zero, on_zero);
            if near.any() {
                let fall = polygon.one_fall(on_zero);
                let mut sought = Sought {
                    near: from,
                    wanted: near & fall.exists,
                    earliest: T::Number::from_f64(f64::NEG_INFINITY),
                    latest: T::Number::from_f64(f64::INFINITY),
                };
                if sought.wanted.any() {
                    sought.near += polygon.fall(&fall) * leaps.piece();
                }
                let unclear = near & !fall.exists;
                first.open |= unclear;
                let unclear = unclear & !on_zero;
                if unclear.any() {
                    first.open &= !self.unclear(&polygon, from, unclear, &mut sought);
                }
                self.seek(&sought, &mut first);
            }
            from = leaps.piece() * number((piece + 1) as f64);
            going &= !first.met & !first.open & from.is_below(until);
            if !going.any() {
                break;
            }
            on_zero = none;
        }
        first
    }

    /// What is to be sought on a piece where control points come near the surface, and where that
    /// is known.
    #[inline(always)]
    fn unclear(
        &mut self,
        polygon: &Polygon<'_, RoundedNumber<T>>,
        from: RoundedNumber<T>,
        wanted: NumberMask<T>,
        sought: &mut Sought<T::Number>,
    ) -> NumberMask<T> {
        let shape = polygon.shape(NumberMask::<T>::NONE);
        let wanted = wanted & shape.known;
        let [starts, ends] = polygon.ends_above();
        let valley = wanted & shape.falls & shape.turns;
        let falls_at_end = shape.falls | shape.turns;
        let known = wanted & !valley & (starts | shape.falls) & (ends | !falls_at_end);
        if !valley.any() {
            return known;
        }
        let near = from + polygon.turn(&shape) * self.leaps.piece();
        known | self.valley(polygon, from, near, valley, sought)
    }

    /// The same of a gap with one extremum, a minimum near a time.
    #[inline(always)]
    fn valley(
        &mut self,
        polygon: &Polygon<'_, RoundedNumber<T>>,
        from: RoundedNumber<T>,
        near: RoundedNumber<T>,
        wanted: NumberMask<T>,
        sought: &mut Sought<T::Number>,
    ) -> NumberMask<T> {
        let (leaps, zero) = (self.leaps, T::Number::zero());
        let (length, reach) = (leaps.piece(), leaps.reach());
        let start = leaps.go_to(near, self.extended, self.visit);
        let series = leaps.watched_series(self.visit);
        let mut slopes = [zero; SERIES];
        let guess = T::Number::from_rounded(near) - start;
        let mut minimum = turn(series.as_flattened(), &mut slopes, guess, reach, wanted);
        minimum.time += start;
        let first = T::Number::from_rounded(from);
        let last = first + T::Number::from_rounded(length);
        let inside = first.is_at_most(minimum.time) & minimum.time.is_at_most(last);
        let known = wanted & minimum.found & inside;
        let open = known & zero.is_below(minimum.gap);
        let below = known & minimum.gap.is_below(zero);
        if !below.any() {
            return open;
        }
        let piece = Piece {
            from,
            length,
            reach: reach.rounded(),
        };
        let (near, known) = polygon.fall_before(&minimum, piece, below);
        sought.near = RoundedNumber::<T>::select(known, near, sought.near);
        sought.earliest = T::Number::select(known, first, sought.earliest);
        sought.latest = T::Number::select(known, minimum.time, sought.latest);
        sought.wanted |= known;
        open | known
    }

    /// The contact that is sought, where it does not lie later than is of interest.
    #[inline(always)]
    fn seek(&mut self, sought: &Sought<T::Number>, first: &mut FirstContact<T::Number>) {
        let (leaps, until) = (self.leaps, self.until);
        let (near, mut wanted) = (sought.near, sought.wanted);
        let late = wanted & until.rounded().is_below(near);
        if late.any() {
            let start = leaps.go_to(until.rounded(), self.extended, self.visit);
            let series = leaps.watched_series(self.visit);
            let value = polynomial::value(series.as_flattened(), until - start);
            wanted &= !(late & T::Number::zero().is_below(value));
        }
        if !wanted.any() {
            return;
        }
        let reach = leaps.reach().rounded();
        let start = leaps.go_to(near, self.extended, self.visit);
        let series = leaps.watched_series(self.visit);
        let series = series.as_flattened();
        let mut room = [RoundedNumber::<T>::zero(); SERIES];
        let rounded = T::Number::all_rounded(series, &mut room);
        let guess = (T::Number::from_rounded(near) - start).rounded();
        let zero = falling_zero(rounded, guess, reach, wanted).polished(series, reach);
        let time = start + zero.time;
        let inside = sought.earliest.is_at_most(time) & time.is_at_most(sought.latest);
        let found = wanted & zero.found & inside;
        first.open |= wanted & !found;
        let met = found & time.is_at_most(until);
        first.met |= met;
        first.time = T::Number::select(met, time, first.time);
    }
}
