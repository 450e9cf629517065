//! The first contacts of several orbits on a free flight: [`Contacts`](super::contacts::Contacts) in lanes.
//!
//! One idea: what control points say of the gaps is masks; minima and contacts are worked out once for all lanes that have them.

use super::newton::turn;
use super::parabolas::falling_zero;
use super::polygon::{Piece, Polygon, ROUNDING};
use crate::flow::{FixedLaneLeaps, FixedLaneVisit, SERIES};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, polynomial};

/// Flights on which contacts are looked for.
pub(super) struct LaneContacts<'t, const N: usize, const C: usize, const B: usize> {
    pub(super) leaps: &'t FixedLaneLeaps<'t, N, C, B>,
    pub(super) extended: &'t [Lanes<N>; C],
    /// The times up to which contacts are of interest.
    pub(super) until: Lanes<N>,
    pub(super) visit: &'t mut FixedLaneVisit<N, B>,
}

/// The first contacts of flights.
pub(super) struct FirstContacts<const N: usize> {
    /// Their times, or where the flights end.
    pub(super) time: Lanes<N>,
    /// Where there is one.
    pub(super) met: LaneMask<N>,
    /// Where nothing is known.
    pub(super) open: LaneMask<N>,
}

/// Contacts to be found: near which times, and within which.
struct Sought<const N: usize> {
    near: Lanes<N>,
    wanted: LaneMask<N>,
    earliest: Lanes<N>,
    latest: Lanes<N>,
}

impl<const N: usize, const C: usize, const B: usize> LaneContacts<'_, N, C, B> {
    /// The first contacts of the wanted lanes; `leaving` where the surface has just been left.
    #[inline(always)]
    pub(super) fn first(&mut self, wanted: LaneMask<N>, leaving: LaneMask<N>) -> FirstContacts<N> {
        let leaps = self.leaps;
        let rounding = Lanes::splat(ROUNDING) * leaps.size(self.extended);
        let mut first = FirstContacts {
            time: self.until,
            met: LaneMask::NONE,
            open: LaneMask::NONE,
        };
        let (mut going, mut on_zero) = (wanted, leaving);
        let mut from = Lanes::splat(0.0);
        for piece in 0..leaps.pieces() {
            let points = leaps.look(piece, self.extended);
            let polygon = Polygon {
                points: points.as_flattened(),
                rounding,
            };
            let near = going & !polygon.is_above(Lanes::splat(0.0), on_zero);
            if near.any() {
                let fall = polygon.one_fall(on_zero);
                let falls = near & fall.exists;
                let mut sought = Sought {
                    near: from,
                    wanted: falls,
                    earliest: Lanes::splat(f64::NEG_INFINITY),
                    latest: Lanes::splat(f64::INFINITY),
                };
                if falls.any() {
                    sought.near += polygon.fall(&fall) * leaps.piece();
                }
                let unclear = near & !falls;
                if unclear.any() {
                    let known = self.unclear(&polygon, from, unclear & !on_zero, &mut sought);
                    first.open |= unclear & !known;
                }
                self.seek(&sought, &mut first);
            }
            from = leaps.piece() * Lanes::splat((piece + 1) as f64);
            going &= !first.met & !first.open & from.is_below(self.until);
            if !going.any() {
                break;
            }
            on_zero = LaneMask::NONE;
        }
        first
    }

    /// What is to be sought on a piece where control points come near the surface, and where that is known.
    #[inline(always)]
    fn unclear(
        &mut self,
        polygon: &Polygon<'_, Lanes<N>>,
        from: Lanes<N>,
        wanted: LaneMask<N>,
        sought: &mut Sought<N>,
    ) -> LaneMask<N> {
        let shape = polygon.shape(LaneMask::NONE);
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

    /// The same of gaps with one extremum, a minimum near a time.
    #[inline(always)]
    fn valley(
        &mut self,
        polygon: &Polygon<'_, Lanes<N>>,
        from: Lanes<N>,
        near: Lanes<N>,
        wanted: LaneMask<N>,
        sought: &mut Sought<N>,
    ) -> LaneMask<N> {
        let (leaps, zero) = (self.leaps, Lanes::splat(0.0));
        let (length, reach) = (leaps.piece(), leaps.reach());
        let start = leaps.go_to(near, self.extended, self.visit);
        let series = leaps.watched_series(self.visit);
        let mut slopes = [zero; SERIES];
        let series = series.as_flattened();
        let mut minimum = turn(series, &mut slopes, near - start, reach, wanted);
        minimum.time += start;
        let last = from + length;
        let inside = from.is_at_most(minimum.time) & minimum.time.is_at_most(last);
        let known = wanted & minimum.found & inside;
        let open = known & zero.is_below(minimum.gap);
        let below = known & minimum.gap.is_below(zero);
        if !below.any() {
            return open;
        }
        let piece = Piece {
            from,
            length,
            reach,
        };
        let (near, known) = polygon.fall_before(&minimum, piece, below);
        sought.near = Lanes::select(known, near, sought.near);
        sought.earliest = Lanes::select(known, from, sought.earliest);
        sought.latest = Lanes::select(known, minimum.time, sought.latest);
        sought.wanted |= known;
        open | known
    }

    /// The contacts that are sought.
    #[inline(always)]
    fn seek(&mut self, sought: &Sought<N>, first: &mut FirstContacts<N>) {
        let (leaps, until) = (self.leaps, self.until);
        let (near, mut wanted) = (sought.near, sought.wanted);
        let late = wanted & until.is_below(near);
        if late.any() {
            let start = leaps.go_to(until, self.extended, self.visit);
            let series = leaps.watched_series(self.visit);
            let value = polynomial::value(series.as_flattened(), until - start);
            wanted &= !(late & Lanes::splat(0.0).is_below(value));
        }
        if !wanted.any() {
            return;
        }
        let reach = leaps.reach();
        let start = leaps.go_to(near, self.extended, self.visit);
        let series = leaps.watched_series(self.visit);
        let series = series.as_flattened();
        let zero = falling_zero(series, near - start, reach, wanted).polished(series, reach);
        let time = start + zero.time;
        let inside = sought.earliest.is_at_most(time) & time.is_at_most(sought.latest);
        let found = wanted & zero.found & inside;
        first.open |= wanted & !found;
        let met = found & time.is_at_most(until);
        first.met |= met;
        first.time = Lanes::select(met, time, first.time);
    }
}
