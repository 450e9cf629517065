//! The first contacts of several orbits on a free flight, in as many columns as the compiler knows.
//!
//! One idea: control points say which gaps stay open on a piece and which fall through zero once, and where: a series about the
//! nearest node has the contact. What they leave open is no matter of lanes.

use super::lane_polygon::LanePolygon;
use super::parabolas::falling_zero;
use super::polygon::ROUNDING;
use crate::flow::{FixedLaneLeaps, FixedLaneVisit};
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
            let polygon = LanePolygon {
                points: points.as_flattened(),
                rounding,
            };
            let near = going & !rounding.is_below(polygon.least(on_zero));
            if near.any() {
                let fall = polygon.first_fall(rounding, on_zero);
                let falls = near & fall.exists & fall.stays;
                first.open |= near & !falls;
                let place = from + polygon.fall(&fall) * leaps.piece();
                self.seek(place, falls, &mut first);
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

    /// The contacts near times at which the gaps fall.
    #[inline(always)]
    fn seek(&mut self, near: Lanes<N>, falls: LaneMask<N>, first: &mut FirstContacts<N>) {
        let (leaps, until) = (self.leaps, self.until);
        let mut sought = falls;
        let late = falls & until.is_below(near);
        if late.any() {
            let start = leaps.go_to(until, self.extended, self.visit);
            let series = leaps.watched_series(self.visit);
            let value = polynomial::value(series.as_flattened(), until - start);
            sought &= !(late & Lanes::splat(0.0).is_below(value));
        }
        if !sought.any() {
            return;
        }
        let reach = leaps.reach();
        let start = leaps.go_to(near, self.extended, self.visit);
        let series = leaps.watched_series(self.visit);
        let series = series.as_flattened();
        let zero = falling_zero(series, near - start, reach, sought).polished(series, reach);
        let time = start + zero.time;
        first.open |= sought & !zero.found;
        let met = sought & zero.found & time.is_at_most(until);
        first.met |= met;
        first.time = Lanes::select(met, time, first.time);
    }
}
