//! What control points tell in lanes: [`Polygon`](super::polygon::Polygon) of one gap of several orbits.
//!
//! One idea: a run of points ends, for all orbits at once, where a mask does; a sum of what the mask selects is how many one
//! orbit counts.

use super::newton::Turn;
use super::polygon::{Piece, SAME_MINIMUM};
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
    /// The number of the first point that is not above the bound.
    point: Lanes<N>,
    /// The one before it, itself, and the one after it.
    before: Lanes<N>,
    after: Lanes<N>,
    next: Lanes<N>,
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

    /// Where the polynomials start above zero by more than rounding, and where they end so.
    #[inline(always)]
    pub(super) fn ends_above(&self) -> [LaneMask<N>; 2] {
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        ends.map(|end| self.rounding.is_below(end))
    }

    /// The least of the points; the first has no say where the polynomials start on a zero.
    #[inline(always)]
    pub(super) fn least(&self, on_zero: LaneMask<N>) -> Lanes<N> {
        let mut least = [Lanes::splat(f64::INFINITY); 8];
        let (chunks, rest) = self.points.as_chunks::<8>();
        for (chunk, number) in chunks.iter().zip(0..) {
            for (place, (least, &value)) in least.iter_mut().zip(chunk).enumerate() {
                let value = match number + place {
                    0 => Lanes::select(on_zero, Lanes::splat(f64::INFINITY), value),
                    _ => value,
                };
                *least = smaller(*least, value);
            }
        }
        let rest = rest
            .iter()
            .fold(least[0], |least, &value| smaller(least, value));
        let [_, b, c, d, e, f, g, h] = least;
        smaller(
            smaller(smaller(rest, b), smaller(c, d)),
            smaller(smaller(e, f), smaller(g, h)),
        )
    }

    /// Where the polynomials first come down to a bound; the first point has no say where they start on a zero.
    #[inline(always)]
    pub(super) fn first_fall(&self, bound: Lanes<N>, on_zero: LaneMask<N>) -> LaneFall<N> {
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let first = self.points[0];
        let mut above = bound.is_below(first) | on_zero;
        let starts = bound.is_below(Lanes::select(on_zero, self.points[1], first));
        let mut point = Lanes::select(above, one, zero);
        let mut stays = above | first.is_below(-self.rounding);
        let (mut before, mut after, mut next) = (first, first, self.points[1]);
        let mut ended = LaneMask::NONE;
        for &value in &self.points[1..] {
            next = Lanes::select(!above & !ended, value, next);
            ended |= !above;
            let was = above;
            above &= bound.is_below(value);
            before = Lanes::select(was, after, before);
            after = Lanes::select(was, value, after);
            point += Lanes::select(above, one, zero);
            stays &= above | value.is_below(-self.rounding);
        }
        LaneFall {
            point,
            before,
            after,
            next,
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
        let LaneFall {
            before,
            after,
            next,
            ..
        } = *fall;
        let down = after - before;
        let (step, slope) = (number(1.0) / last, number(1.0) / down);
        let has_next = fall.point.is_below(last);
        let bend = Lanes::select(has_next, next - after - down, number(0.0));
        let place = (fall.point - after * slope) * step;
        let within = place * (number(1.0) - place) * last * number(0.5) * bend * slope;
        place - within.map(|within| within.clamp(-0.5, 0.5)) * step
    }

    /// The times near which gaps, above zero at the start of a piece, fell through zero before minima below it, and where they are
    /// known: those of the zeros of the parabolas about the minima, or of the points.
    #[inline(always)]
    pub(super) fn fall_before(
        &self,
        minimum: &Turn<Lanes<N>>,
        piece: Piece<Lanes<N>>,
        wanted: LaneMask<N>,
    ) -> (Lanes<N>, LaneMask<N>) {
        let two = Lanes::splat(2.0);
        let lead = (-two * minimum.gap / minimum.curvature).sqrt();
        let is_near = lead.is_at_most(two * piece.reach);
        let mut near = minimum.time - lead;
        let mut known = wanted & self.rounding.is_below(self.points[0]);
        let far = wanted & !is_near;
        if far.any() {
            let fall = self.first_fall(Lanes::splat(0.0), LaneMask::NONE);
            known &= is_near | fall.exists;
            near = Lanes::select(is_near, near, piece.from + self.fall(&fall) * piece.length);
        }
        (near, known)
    }

    /// A point of every lane, the one at a distance from a number.
    #[inline(always)]
    fn point(&self, number: Lanes<N>, distance: f64) -> Lanes<N> {
        let last = self.points.len() - 1;
        let place = |lane: usize| ((number[lane] + distance) as usize).min(last);
        Lanes::from_fn(|lane| self.points[place(lane)][lane])
    }
}

/// The smaller numbers of both.
#[inline(always)]
fn smaller<const N: usize>(one: Lanes<N>, other: Lanes<N>) -> Lanes<N> {
    one.zip_map(other, |one, other| if other < one { other } else { one })
}
