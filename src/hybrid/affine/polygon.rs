//! What control points tell of a polynomial: the signs of its values and of its slope.
//!
//! One idea: a polynomial has no more zeros than its control points have changes of sign, no more extrema than they have
//! turns, and differs from either number by an even one.

use super::newton::Turn;
use crate::numeric::Real;

/// Share of the size of its terms within which a control point has no sign.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Share of the next difference below which the first is that of a minimum reported already: it then lies within the
/// first 1e-7 of the time in which the motion changes.
pub(super) const SAME_MINIMUM: f64 = 5e-7;

/// Control points of a polynomial on `[0, 1]`, and the size within which they have no sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon<'c> {
    pub(super) points: &'c [f64],
    pub(super) rounding: f64,
}

/// A piece of a span.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece<T = f64> {
    /// Its start and its length.
    pub(super) from: T,
    pub(super) length: T,
    /// How far from a node its series are good.
    pub(super) reach: T,
}

/// The zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zeros {
    /// None: it is positive.
    None,
    /// Exactly one, where it falls.
    OneFall {
        /// Where, from 0 to 1: a guess.
        place: f64,
    },
    /// Not known.
    Unknown,
}

/// The extrema.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// None.
    Rising,
    /// None.
    Falling,
    /// Exactly one, a minimum.
    Valley {
        /// Where, from 0 to 1: a guess.
        place: f64,
    },
    /// Exactly one, a maximum.
    Hill,
    /// Not known.
    Unknown,
}

impl Polygon<'_> {
    /// What the points' signs tell; the first has no say where the polynomial starts on a zero.
    #[inline(always)]
    pub(super) fn zeros(&self, on_zero: bool) -> Zeros {
        if least(self.points, on_zero) > self.rounding {
            return Zeros::None;
        }
        let first = usize::from(on_zero);
        let is_above = |&&b: &&f64| b > self.rounding;
        let is_below = |&b: &f64| b < -self.rounding;
        let place = first + self.points[first..].iter().take_while(is_above).count();
        match place > first && self.points[place..].iter().all(is_below) {
            true => Zeros::OneFall {
                place: self.fall(place),
            },
            false => Zeros::Unknown,
        }
    }

    /// What the points' turns tell; `at_minimum` where the polynomial starts at one that is known.
    #[inline(always)]
    pub(super) fn shape(&self, at_minimum: bool) -> Shape {
        let last = self.points.len() - 1;
        let start = usize::from(at_minimum && self.starts_flat());
        let falls = self.points[start + 1] < self.points[start];
        let first = self.run(start, falls);
        if first == start || (first < last && self.run(first, !falls) < last) {
            return Shape::Unknown;
        }
        match (first == last, falls) {
            (true, true) => Shape::Falling,
            (true, false) => Shape::Rising,
            (false, true) => Shape::Valley {
                place: self.turn(first),
            },
            (false, false) => Shape::Hill,
        }
    }

    /// The point to which the points fall, or rise, from one on.
    #[inline(always)]
    fn run(&self, from: usize, falls: bool) -> usize {
        let sign = if falls { -1.0 } else { 1.0 };
        let pairs = self.points[from..].windows(2);
        let goes_on = |pair: &&[f64]| sign * (pair[1] - pair[0]) > self.rounding;
        from + pairs.take_while(goes_on).count()
    }

    /// Whether the first difference is nothing beside the second.
    fn starts_flat(&self) -> bool {
        let [a, b, c] = [self.points[0], self.points[1], self.points[2]];
        (b - a).abs() <= SAME_MINIMUM * (c - b)
    }

    /// Where the points turn at one of them, from 0 to 1, by the parabola through three.
    fn turn(&self, place: usize) -> f64 {
        let [before, at, after] = [place - 1, place, place + 1].map(|place| self.points[place]);
        let offset = 0.5 * (before - after) / (before - 2.0 * at + after);
        (place as f64 + offset) / (self.points.len() - 1) as f64
    }

    /// Whether the polynomial is above a bound.
    #[inline(always)]
    pub(super) fn is_above(&self, bound: f64) -> bool {
        least(self.points, false) > bound + self.rounding
    }

    /// Whether the polynomial starts above zero by more than rounding.
    #[inline(always)]
    pub(super) fn starts_above(&self) -> bool {
        self.points
            .first()
            .is_some_and(|&first| first > self.rounding)
    }

    /// Whether the polynomial ends above zero, or below; `None` where that is within rounding.
    #[inline(always)]
    pub(super) fn ends_above(&self) -> Option<bool> {
        let last = *self.points.last()?;
        (last.abs() > self.rounding).then_some(last > 0.0)
    }

    /// Where the polynomial first falls through zero, from 0 to 1, if its points do: a guess.
    #[inline(always)]
    fn first_fall(&self) -> Option<f64> {
        let place = self.points.iter().position(|&b| b <= 0.0)?;
        (place > 0).then(|| self.fall(place))
    }

    /// The time near which a gap, above zero at the start of a piece, fell through zero before a minimum below it: that of the zero
    /// of the parabola about the minimum, or of the points.
    #[inline(always)]
    pub(super) fn fall_before<S: Real>(&self, minimum: &Turn<S>, piece: Piece) -> Option<f64> {
        if !self.starts_above() {
            return None;
        }
        let lead = (-2.0 * minimum.gap.to_f64() / minimum.curvature.to_f64()).sqrt();
        if lead <= 2.0 * piece.reach {
            return Some(minimum.time.to_f64() - lead);
        }
        Some(piece.from + self.first_fall()? * piece.length)
    }

    /// Where the polynomial falls through zero, from 0 to 1, if its points do before this one.
    ///
    /// Of degree `n` it is near the polygon and `t (1 − t) n Δ²b / 2`, with the second difference of the points.
    #[inline(always)]
    fn fall(&self, point: usize) -> f64 {
        let degree = (self.points.len() - 1) as f64;
        let (before, after) = (self.points[point - 1], self.points[point]);
        let fall = after - before;
        let (step, slope) = (1.0 / degree, 1.0 / fall);
        let bend = match self.points.get(point + 1) {
            Some(next) => next - after - fall,
            None => 0.0,
        };
        let place = (point as f64 - after * slope) * step;
        let within = place * (1.0 - place) * degree * 0.5 * bend * slope;
        place - within.clamp(-0.5, 0.5) * step
    }
}

/// The least of some values, the first left out where it has no say; lane by lane, for it is asked of every piece.
#[inline(always)]
fn least(values: &[f64], but_first: bool) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut least = [f64::INFINITY; 8];
    let smaller = |a: f64, b: f64| if b < a { b } else { a };
    let Some((first, chunks)) = chunks.split_first() else {
        let rest = &rest[usize::from(but_first)..];
        return rest.iter().copied().fold(f64::INFINITY, smaller);
    };
    least.copy_from_slice(first);
    if but_first {
        least[0] = f64::INFINITY;
    }
    for chunk in chunks {
        for lane in 0..8 {
            least[lane] = smaller(least[lane], chunk[lane]);
        }
    }
    let four: [f64; 4] = std::array::from_fn(|lane| smaller(least[lane], least[lane + 4]));
    let two = [smaller(four[0], four[2]), smaller(four[1], four[3])];
    let rest = rest.iter().copied().fold(f64::INFINITY, smaller);
    smaller(smaller(two[0], two[1]), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[f64]) -> Polygon<'_> {
        Polygon {
            points,
            rounding: 1e-9,
        }
    }

    #[test]
    fn the_zeros_of_a_fall_and_of_positive_points_are_known_and_no_others() {
        assert_eq!(polygon(&[3.0, 2.0, 0.5]).zeros(false), Zeros::None);
        assert_eq!(polygon(&[0.0, 2.0, 0.5]).zeros(true), Zeros::None);
        assert_eq!(polygon(&[0.0, 2.0, 0.5]).zeros(false), Zeros::Unknown);
        let falls = |points: &[f64], on_zero| match polygon(points).zeros(on_zero) {
            Zeros::OneFall { place } => place,
            zeros => panic!("{points:?} {zeros:?}"),
        };
        assert_eq!(falls(&[3.0, 1.0, -1.0], false), 0.75);
        assert_eq!(falls(&[-1e-12, 1.0, -1.0], true), 0.75);
        for points in [
            [3.0, -1.0, 2.0],
            [3.0, 1e-12, -2.0],
            [-1.0, -2.0, -3.0],
            [-1.0, 1.0, 2.0],
        ] {
            assert_eq!(polygon(&points).zeros(false), Zeros::Unknown, "{points:?}");
        }
        assert_eq!(polygon(&[0.0, -2.0, -3.0]).zeros(true), Zeros::Unknown);
        assert_eq!(polygon(&[3.0, 1.0, -1.0]).first_fall(), Some(0.75));
        assert_eq!(polygon(&[1.0, 1.0, 2.0]).first_fall(), None);
        assert_eq!(polygon(&[-1.0, 1.0, -2.0]).first_fall(), None);
    }

    #[test]
    fn a_fall_is_guessed_where_the_polynomial_falls_and_not_its_points() {
        // (1 − t)² − 1/4 by its points of degree 8, (1 − i/8)(1 − i/7) − 1/4.
        let points: [f64; 9] = std::array::from_fn(|i| {
            let left = (8 - i) as f64;
            left * (left - 1.0) / 56.0 - 0.25
        });
        let place = polygon(&points).first_fall().expect("a fall");
        // It falls through zero at 1/2; the points alone do at 0.469.
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
        let cases = [
            ([1.0, 2.0, 3.0, 4.0], Shape::Rising),
            ([4.0, 2.0, 1.0, 0.5], Shape::Falling),
            ([1.0, 2.0, 3.0, 1.0], Shape::Hill),
            ([1.0, 0.0, 1.0, 0.0], Shape::Unknown),
            ([0.0, 1.0, 0.0, 1.0], Shape::Unknown),
            ([1.0, 1.0 + 1e-12, 2.0, 3.0], Shape::Unknown),
        ];
        for (points, shape) in cases {
            assert_eq!(polygon(&points).shape(false), shape, "{points:?}");
        }
        let flat = [1.0, 1.0 - 1e-12, 2.0, 3.0];
        assert_eq!(polygon(&flat).shape(true), Shape::Rising);
        let dip = polygon(&[1.0, 0.9, 2.0, 3.0]).shape(true);
        // The parabola through the first three points is least at 7/12 of the first third.
        assert!(matches!(dip, Shape::Valley { place } if (place - 7.0 / 36.0).abs() < 1e-15));
        let valley = polygon(&[4.0, 1.0, 0.0, 1.0, 4.0]).shape(false);
        assert_eq!(valley, Shape::Valley { place: 0.5 });
    }
}
