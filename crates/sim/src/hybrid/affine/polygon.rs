//! Signs of the values and the slope of a polynomial, from its control points.
//!
//! One idea: a polynomial has no more zeros than its control points have changes of sign, no more
//! extrema than they have turns, and each number differs by an even number. In lanes, a run of
//! points ends separately for each lane.

use super::zeros::GapExtremum;
use crate::numeric::{Branched, Mask};

/// Rounding of a control point, as a share of the size of its terms: a smaller point has no sign.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Share of the next difference below which the first difference belongs to a minimum already
/// reported: the minimum then lies within the first 1e-7 of the motion's time scale.
pub(super) const SAME_MINIMUM: f64 = 5e-7;

/// Control points of polynomials on `[0, 1]`, and the rounding within which they have no sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon<'c, R> {
    pub(super) points: &'c [R],
    pub(super) rounding: R,
}

/// A piece of a span.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpanPiece<R> {
    /// Start and length.
    pub(super) from: R,
    pub(super) length: R,
    /// Radius about a node in which its series are accurate.
    pub(super) reach: R,
}

/// Extrema of polynomials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape<R: Branched> {
    /// Mask: the shape is known.
    pub(super) known: R::Mask,
    /// Mask: the polynomial falls first.
    pub(super) falls: R::Mask,
    /// Mask: the polynomial has one extremum.
    pub(super) turns: R::Mask,
    /// Number of the control point at the extremum.
    turn: R,
}

/// A fall of polynomials through a bound.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fall<R: Branched> {
    /// Mask: a control point is not above the bound.
    pub(super) exists: R::Mask,
    /// Number of the first control point that is not above the bound.
    point: R,
}

/// Number of leading places, out of `$count`, at which a condition holds.
///
/// NOTE: a macro, because the compiler may leave a closure out of a kernel and compile it for the
/// baseline instruction set.
macro_rules! leading {
    ($number:ty, $count:expr, $place:ident: $holds:expr) => {{
        let (zero, one) = (<$number>::zero(), <$number>::one());
        let (mut run, mut leading) = (!<$number as Branched>::Mask::NONE, zero);
        for $place in 0..$count {
            run &= $holds;
            if run.is_over() {
                break;
            }
            leading += <$number>::select(run, one, zero);
        }
        leading
    }};
}

impl<R: Branched> Polygon<'_, R> {
    /// Mask: the polynomial is above a bound; `on_zero` marks polynomials that start on a zero,
    /// whose first point is ignored.
    #[inline(always)]
    pub(super) fn is_above(&self, bound: R, on_zero: R::Mask) -> R::Mask {
        (bound + self.rounding).is_below(least(self.points, on_zero))
    }

    /// Masks: the polynomial is above zero by more than rounding at the start, and at the end.
    #[inline(always)]
    pub(super) fn ends_above(&self) -> [R::Mask; 2] {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        [self.rounding.is_below(first), self.rounding.is_below(last)]
    }

    /// The zero at which the polynomial falls, if it has exactly one zero.
    #[inline(always)]
    pub(super) fn one_fall(&self, on_zero: R::Mask) -> Fall<R> {
        let (points, count) = (self.points, self.points.len());
        let mut fall = self.first_fall(self.rounding, on_zero);
        if fall.exists.any() {
            let least = -self.rounding;
            let below = leading!(R, count, place: points[count - 1 - place].is_below(least));
            let below = fall.point + below;
            fall.exists &= below.is_equal(R::from_f64(count as f64));
        }
        fall
    }

    /// First fall of the control points to a bound.
    #[inline(always)]
    fn first_fall(&self, bound: R, on_zero: R::Mask) -> Fall<R> {
        let points = self.points;
        let mut has_no_say = on_zero;
        let point = leading!(R, points.len(), place: {
            let holds = bound.is_below(points[place]) | has_no_say;
            has_no_say = R::Mask::NONE;
            holds
        });
        let starts = bound.is_below(R::select(on_zero, points[1], points[0]));
        let exists = starts & point.is_below(R::from_f64(points.len() as f64));
        Fall { exists, point }
    }

    /// Approximate place, from 0 to 1, at which the polynomial falls through zero, if its control
    /// points do.
    ///
    /// A polynomial of degree `n` is near its polygon plus `t (1 − t) n Δ²b / 2`, with the second
    /// difference `Δ²b` of the points.
    #[inline(always)]
    pub(super) fn fall(&self, fall: &Fall<R>) -> R {
        let (number, zero) = (R::from_f64, R::zero());
        let degree = self.degree();
        let [before, after, next] = R::around(self.points, fall.point);
        let down = after - before;
        let (step, slope) = (number(1.0) / degree, number(1.0) / down);
        let has_next = fall.point.is_below(degree);
        let bend = R::select(has_next, next - after - down, zero);
        let place = (fall.point - after * slope) * step;
        let within = place * (number(1.0) - place) * degree * number(0.5) * bend * slope;
        let least = number(-0.5);
        let within = R::select(within.is_below(least), least, within);
        let within = R::select((-least).is_below(within), -least, within);
        place - within * step
    }

    /// Extrema from the turns of the control points; `at_minimum` marks polynomials that start at a
    /// known minimum.
    #[inline(always)]
    pub(super) fn shape(&self, at_minimum: R::Mask) -> Shape<R> {
        let (points, rounding) = (self.points, self.rounding);
        let (zero, one, last) = (R::zero(), R::one(), points.len() - 1);
        let first = points[1] - points[0];
        let second = points[2] - points[1];
        let is_flat = first.abs().is_at_most(R::from_f64(SAME_MINIMUM) * second);
        let flat = at_minimum & is_flat;
        let falls = R::select(flat, second, first).is_below(zero);
        let sign = R::select(falls, -one, one);
        let mut has_no_say = flat;
        let turn = leading!(R, last, pair: {
            let along = sign * (points[pair + 1] - points[pair]);
            let holds = rounding.is_below(along) | has_no_say;
            has_no_say = R::Mask::NONE;
            holds
        });
        let mut known = R::select(flat, one, zero).is_below(turn);
        let turns = turn.is_below(self.degree());
        if turns.any() {
            let back = leading!(R, last, pair: {
                let after = last - pair;
                rounding.is_below(-(sign * (points[after] - points[after - 1])))
            });
            known &= !turns | (turn + back).is_equal(self.degree());
        }
        Shape { known, falls, turns, turn }
    }

    /// Approximate place of the extremum, from 0 to 1, by the parabola through three points.
    #[inline(always)]
    pub(super) fn turn(&self, shape: &Shape<R>) -> R {
        let [before, at, after] = R::around(self.points, shape.turn);
        let bend = before - R::from_f64(2.0) * at + after;
        let offset = R::from_f64(0.5) * (before - after) / bend;
        (shape.turn + offset) / self.degree()
    }

    /// Approximate times at which gaps fall through zero before a minimum below zero, and the mask
    /// of lanes in which they are known. The gaps are above zero at the start of the piece. The
    /// times are zeros of the parabola about the minimum, or of the control points.
    #[inline(always)]
    pub(super) fn fall_before<S>(
        &self,
        minimum: &GapExtremum<S>,
        piece: SpanPiece<R>,
        wanted: R::Mask,
    ) -> (R, R::Mask)
    where
        S: Branched<Rounded = R, Mask = R::Mask>,
    {
        let two = R::from_f64(2.0);
        let lead = (-two * minimum.gap.rounded() / minimum.curvature.rounded()).sqrt();
        let is_near = lead.is_at_most(two * piece.reach);
        let mut near = minimum.time.rounded() - lead;
        let [starts, _] = self.ends_above();
        let mut known = wanted & starts;
        if (known & !is_near).any() {
            let fall = self.first_fall(R::zero(), R::Mask::NONE);
            known &= is_near | fall.exists;
            near = R::select(is_near, near, piece.from + self.fall(&fall) * piece.length);
        }
        (near, known)
    }

    #[inline(always)]
    fn degree(&self) -> R {
        R::from_f64((self.points.len() - 1) as f64)
    }
}

/// Smallest of some values; `but_first` marks lanes that ignore the first. Eight values side by
/// side, for speed: the function runs for every piece.
#[inline(always)]
fn least<R: Branched>(values: &[R], but_first: R::Mask) -> R {
    let infinity = R::from_f64(f64::INFINITY);
    let (chunks, rest) = values.as_chunks::<8>();
    let (mut least, mut first) = ([infinity; 8], but_first);
    if let Some((start, chunks)) = chunks.split_first() {
        least = *start;
        least[0] = R::select(first, infinity, least[0]);
        first = R::Mask::NONE;
        for chunk in chunks {
            for place in 0..8 {
                least[place] = smaller(least[place], chunk[place]);
            }
        }
    }
    for &value in rest {
        least[0] = smaller(least[0], R::select(first, infinity, value));
        first = R::Mask::NONE;
    }
    let [a, b, c, d, e, f, g, h] = least;
    smaller(smaller(smaller(a, e), smaller(c, g)), smaller(smaller(b, f), smaller(d, h)))
}

#[inline(always)]
fn smaller<R: Branched>(one: R, other: R) -> R {
    R::select(other.is_below(one), other, one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{LaneMask, Lanes};

    fn polygon(points: &[f64]) -> Polygon<'_, f64> {
        Polygon { points, rounding: 1e-9 }
    }

    fn first_fall(points: &[f64]) -> Option<f64> {
        let fall = polygon(points).first_fall(0.0, false);
        fall.exists.then(|| polygon(points).fall(&fall))
    }

    #[test]
    fn the_zeros_of_a_fall_and_of_positive_points_are_known_and_no_others() {
        let zeros = |points: &[f64], on_zero| {
            let polygon = polygon(points);
            let fall = polygon.one_fall(on_zero);
            let place = fall.exists.then(|| polygon.fall(&fall));
            (polygon.is_above(0.0, on_zero), place)
        };
        assert_eq!(zeros(&[3.0, 2.0, 0.5], false), (true, None));
        assert_eq!(zeros(&[0.0, 2.0, 0.5], true), (true, None));
        assert_eq!(zeros(&[0.0, 2.0, 0.5], false), (false, None));
        assert_eq!(zeros(&[3.0, 1.0, -1.0], false), (false, Some(0.75)));
        assert_eq!(zeros(&[-1e-12, 1.0, -1.0], true), (false, Some(0.75)));
        for points in [[3.0, -1.0, 2.0], [3.0, 1e-12, -2.0], [-1.0, -2.0, -3.0], [-1.0, 1.0, 2.0]] {
            assert_eq!(zeros(&points, false), (false, None), "{points:?}");
        }
        assert_eq!(zeros(&[0.0, -2.0, -3.0], true), (false, None));
        assert_eq!(first_fall(&[3.0, 1.0, -1.0]), Some(0.75));
        assert_eq!(first_fall(&[1.0, 1.0, 2.0]), None);
        assert_eq!(first_fall(&[-1.0, 1.0, -2.0]), None);
    }

    #[test]
    fn a_fall_is_guessed_where_the_polynomial_falls_and_not_its_points() {
        // (1 − t)² − 1/4 by its points of degree 8, (1 − i/8)(1 − i/7) − 1/4.
        let points: [f64; 9] = std::array::from_fn(|i| {
            let left = (8 - i) as f64;
            left * (left - 1.0) / 56.0 - 0.25
        });
        let place = first_fall(&points).expect("a fall");
        // The polynomial falls through zero at 1/2; the points alone do at 0.469.
        assert!((place - 0.5).abs() < 2e-3, "{place}");
    }

    #[test]
    fn the_least_of_any_number_of_points_is_found_wherever_it_is() {
        for count in 2..30 {
            for place in 0..count {
                let mut values = vec![1.0; count];
                values[place] = -1.0;
                let expected = if place == 0 { 1.0 } else { -1.0 };
                assert_eq!(least(&values, true), expected, "{count} {place}");
                assert_eq!(least(&values, false), -1.0, "{count} {place}");
            }
        }
    }

    #[test]
    fn shapes_with_one_extremum_or_none_are_known_and_no_others() {
        // Whether the polynomial falls first, and whether it turns.
        let shape = |points: &[f64], at_minimum| {
            let shape = polygon(points).shape(at_minimum);
            shape.known.then_some((shape.falls, shape.turns))
        };
        let cases = [
            ([1.0, 2.0, 3.0, 4.0], Some((false, false))),
            ([4.0, 2.0, 1.0, 0.5], Some((true, false))),
            ([1.0, 2.0, 3.0, 1.0], Some((false, true))),
            ([1.0, 0.0, 1.0, 0.0], None),
            ([0.0, 1.0, 0.0, 1.0], None),
            ([1.0, 1.0 + 1e-12, 2.0, 3.0], None),
        ];
        for (points, expected) in cases {
            assert_eq!(shape(&points, false), expected, "{points:?}");
        }
        let flat = [1.0, 1.0 - 1e-12, 2.0, 3.0];
        assert_eq!(shape(&flat, true), Some((false, false)));
        let valley = |points: &[f64], at_minimum| {
            assert_eq!(shape(points, at_minimum), Some((true, true)));
            polygon(points).turn(&polygon(points).shape(at_minimum))
        };
        // The parabola through the first three points has its minimum at 7/12 of the first third.
        let place = valley(&[1.0, 0.9, 2.0, 3.0], true);
        assert!((place - 7.0 / 36.0).abs() < 1e-15);
        assert_eq!(valley(&[4.0, 1.0, 0.0, 1.0, 4.0], false), 0.5);
    }

    #[test]
    fn what_points_tell_in_lanes_is_what_those_of_each_lane_tell() {
        let columns = [
            [3.0, 1.0, -1.0, -2.0],
            [0.0, 2.0, 1.0, 0.5],
            [4.0, 1.0, 0.5, 2.0],
            [1.0, 2.0, 3.0, 1.0],
            [1.0, 0.0, 1.0, 0.0],
        ];
        let points: [_; 4] = std::array::from_fn(|row| Lanes(columns.map(|column| column[row])));
        let lanes = Polygon { points: &points, rounding: Lanes::splat(1e-9) };
        for on_zero in [false, true] {
            let everywhere = LaneMask::from_fn(|_| on_zero);
            let above = lanes.is_above(Lanes::splat(0.0), everywhere);
            let (fall, shape) = (lanes.one_fall(everywhere), lanes.shape(everywhere));
            for (lane, column) in columns.iter().enumerate() {
                let (one, own) = (polygon(column), polygon(column).shape(on_zero));
                assert_eq!(above.holds(lane), one.is_above(0.0, on_zero));
                let expected = one.one_fall(on_zero);
                assert_eq!(fall.exists.holds(lane), expected.exists, "{column:?}");
                if expected.exists {
                    assert_eq!(lanes.fall(&fall)[lane], one.fall(&expected));
                }
                assert_eq!(shape.known.holds(lane), own.known, "{column:?}");
                assert_eq!(shape.falls.holds(lane), own.falls);
                assert_eq!(shape.turns.holds(lane), own.turns);
                if own.known && own.turns {
                    assert_eq!(lanes.turn(&shape)[lane], one.turn(&own));
                }
            }
        }
    }
}
