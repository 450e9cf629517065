//! What control points tell in lanes: [`Polygon`](super::polygon::Polygon) of one gap of several orbits.
//!
//! One idea: a run of points ends, for all orbits at once, where a mask does; a sum of what the mask selects is how many one
//! orbit counts.

use super::polygon::SAME_MINIMUM;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// Control points of `N` polynomials on `[0, 1]`, and the sizes within which they have no sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct LanePolygon<'c, const N: usize> {
    pub(super) points: &'c [Lanes<N>],
    pub(super) rounding: Lanes<N>,
}

/// The extrema.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneShape<const N: usize> {
    /// Whether it is known.
    pub(super) known: LaneMask<N>,
    /// Whether the polynomials fall first.
    pub(super) falls: LaneMask<N>,
    /// Whether they have one extremum.
    pub(super) turns: LaneMask<N>,
    /// The point at which that is.
    turn: Lanes<N>,
}

/// The first fall through a bound.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneFall<const N: usize> {
    /// The first point that is not above the bound.
    point: Lanes<N>,
    /// Whether there is one, after others.
    pub(super) exists: LaneMask<N>,
    /// Whether all points from there on are below zero.
    pub(super) stays: LaneMask<N>,
}

impl<const N: usize> LanePolygon<'_, N> {
    /// What the points' turns tell; `at_minimum` where the polynomial starts at one that is known.
    #[inline(always)]
    pub(super) fn shape(&self, at_minimum: LaneMask<N>) -> LaneShape<N> {
        let points = self.points;
        let first = points[1] - points[0];
        let second = points[2] - points[1];
        let is_flat = first.abs().is_at_most(Lanes::splat(SAME_MINIMUM) * second);
        let flat = at_minimum & is_flat;
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let falls = Lanes::select(flat, second, first).is_below(zero);
        let sign = Lanes::select(falls, -one, one);
        let (mut along, mut known, mut turn) = (!LaneMask::NONE, !LaneMask::NONE, zero);
        let mut has_no_say = flat;
        for pair in points.windows(2) {
            let difference = sign * (pair[1] - pair[0]);
            along &= self.rounding.is_below(difference) | has_no_say;
            known &= along | self.rounding.is_below(-difference);
            turn += Lanes::select(along, one, zero);
            has_no_say = LaneMask::NONE;
        }
        let start = Lanes::select(flat, one, zero);
        LaneShape {
            known: known & start.is_below(turn),
            falls,
            turns: !along,
            turn,
        }
    }

    /// Where the polynomials first come down to a bound; the first point has no say where they start on a zero.
    #[inline(always)]
    pub(super) fn first_fall(&self, bound: Lanes<N>, on_zero: LaneMask<N>) -> LaneFall<N> {
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let mut above = bound.is_below(self.points[0]) | on_zero;
        let starts = bound.is_below(Lanes::select(on_zero, self.points[1], self.points[0]));
        let mut point = Lanes::select(above, one, zero);
        let mut stays = above | self.points[0].is_below(-self.rounding);
        for &value in &self.points[1..] {
            above &= bound.is_below(value);
            point += Lanes::select(above, one, zero);
            stays &= above | value.is_below(-self.rounding);
        }
        LaneFall {
            point,
            exists: starts & !above,
            stays,
        }
    }

    /// Where the polynomials turn, from 0 to 1, by the parabola through three points.
    #[inline(always)]
    pub(super) fn turn(&self, shape: &LaneShape<N>) -> Lanes<N> {
        let point = |offset| self.point(shape.turn, offset);
        let [before, at, after] = [point(-1.0), point(0.0), point(1.0)];
        let number = Lanes::splat;
        let offset = number(0.5) * (before - after) / (before - number(2.0) * at + after);
        (shape.turn + offset) / number((self.points.len() - 1) as f64)
    }

    /// Where the polynomials fall through zero, from 0 to 1, if their points do.
    #[inline(always)]
    pub(super) fn fall(&self, fall: &LaneFall<N>) -> Lanes<N> {
        let number = Lanes::splat;
        let last = number((self.points.len() - 1) as f64);
        let point = |offset| self.point(fall.point, offset);
        let [before, after, next] = [point(-1.0), point(0.0), point(1.0)];
        let down = after - before;
        let (step, slope) = (number(1.0) / last, number(1.0) / down);
        let has_next = fall.point.is_below(last);
        let bend = Lanes::select(has_next, next - after - down, number(0.0));
        let place = (fall.point - after * slope) * step;
        let within = place * (number(1.0) - place) * last * number(0.5) * bend * slope;
        place - within.map(|within| within.clamp(-0.5, 0.5)) * step
    }

    /// A point of every lane, the one at a distance from a number.
    #[inline(always)]
    fn point(&self, number: Lanes<N>, distance: f64) -> Lanes<N> {
        let last = self.points.len() - 1;
        let place = |lane: usize| ((number[lane] + distance) as usize).min(last);
        Lanes::from_fn(|lane| self.points[place(lane)][lane])
    }
}
