//! What control points tell of a polynomial: the signs of its values and of its slope.
//!
//! One idea: a polynomial has no more zeros than its control points have changes of sign, no more extrema than they have
//! turns, and differs from either number by an even one. Signs are bits of a word, so that a pattern of them is a number.

/// Share of the size of its terms within which a control point has no sign.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Share of the next difference below which the first is that of a minimum reported already: it then lies within the
/// first 1e-7 of the time in which the motion changes.
const SAME_MINIMUM: f64 = 5e-7;

/// Control points of a polynomial on `[0, 1]`, at most 64, and the size within which they have no sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon<'c> {
    pub(super) points: &'c [f64],
    pub(super) rounding: f64,
}

/// The zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zeros {
    /// None: it is positive.
    None,
    /// Exactly one, where it falls.
    OneFall,
    /// Not known.
    Unknown,
}

/// The extrema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// None.
    Rising,
    /// None.
    Falling,
    /// Exactly one, a minimum.
    Valley,
    /// Exactly one, a maximum.
    Hill,
    /// Not known.
    Unknown,
}

impl Polygon<'_> {
    /// What the points' signs tell; the first has no say where the polynomial starts on a zero.
    #[inline(always)]
    pub(super) fn zeros(&self, on_zero: bool) -> Zeros {
        let all = low_bits(self.points.len());
        let first = u64::from(on_zero);
        let above = bits(self.points, |&b| b > self.rounding) | first;
        if above == all {
            return Zeros::None;
        }
        let below = bits(self.points, |&b| b < -self.rounding) & !first;
        match are_low(above) && above > first && above ^ below == all {
            true => Zeros::OneFall,
            false => Zeros::Unknown,
        }
    }

    /// What the points' turns tell; `at_minimum` where the polynomial starts at one that is known.
    #[inline(always)]
    pub(super) fn shape(&self, at_minimum: bool) -> Shape {
        let all = low_bits(self.points.len() - 1);
        let flat = u64::from(at_minimum && self.starts_flat());
        let rises = steps(self.points, |a, b| b > a + self.rounding) | flat;
        let falls = steps(self.points, |a, b| b < a - self.rounding) & !rises;
        match (rises ^ falls == all, are_low(rises), are_low(falls)) {
            (false, ..) => Shape::Unknown,
            (_, _, true) if rises == 0 => Shape::Falling,
            (_, true, _) if falls == 0 => Shape::Rising,
            (_, _, true) => Shape::Valley,
            (_, true, _) => Shape::Hill,
            _ => Shape::Unknown,
        }
    }

    /// Whether the first difference is nothing beside the second.
    fn starts_flat(&self) -> bool {
        let [a, b, c] = [self.points[0], self.points[1], self.points[2]];
        (b - a).abs() <= SAME_MINIMUM * (c - b)
    }

    /// Whether the polynomial is above a bound.
    #[inline(always)]
    pub(super) fn is_above(&self, bound: f64) -> bool {
        bits(self.points, |&b| b > bound + self.rounding) == low_bits(self.points.len())
    }

    /// Whether the polynomial ends above zero, or below; `None` where that is within rounding.
    #[inline(always)]
    pub(super) fn ends_above(&self) -> Option<bool> {
        let last = *self.points.last()?;
        (last.abs() > self.rounding).then_some(last > 0.0)
    }

    /// Where the points first fall through zero, from 0 to 1.
    #[inline(always)]
    pub(super) fn first_fall(&self, on_zero: bool) -> Option<f64> {
        let below = bits(self.points, |&b| b < 0.0) & !u64::from(on_zero);
        let place = below.trailing_zeros() as usize;
        if place == 0 || place >= self.points.len() {
            return None;
        }
        let (before, after) = (self.points[place - 1], self.points[place]);
        Some((place as f64 - after / (after - before)) / (self.points.len() - 1) as f64)
    }

    /// Where a hill or a valley turns, from 0 to 1, by the parabola through the three points there.
    #[inline(always)]
    pub(super) fn turn(&self) -> f64 {
        let last = self.points.len() - 1;
        let rises = steps(self.points, |a, b| b > a);
        let change = (rises ^ (rises >> 1)) & low_bits(last - 1);
        let place = (change.trailing_zeros() as usize + 1).min(last - 1);
        let [before, at, after] = [
            self.points[place - 1],
            self.points[place],
            self.points[place + 1],
        ];
        let offset = 0.5 * (before - after) / (before - 2.0 * at + after);
        (place as f64 + offset) / last as f64
    }
}

/// Which values satisfy a condition.
#[inline(always)]
fn bits(values: &[f64], condition: impl Fn(&f64) -> bool) -> u64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut word = 0;
    for (number, chunk) in chunks.iter().enumerate() {
        let mut byte = 0u8;
        for lane in 0..8 {
            byte |= u8::from(condition(&chunk[lane])) << lane;
        }
        word |= u64::from(byte) << (8 * number);
    }
    for (lane, value) in rest.iter().enumerate() {
        word |= u64::from(condition(value)) << (8 * chunks.len() + lane);
    }
    word
}

/// Which neighbours satisfy a condition.
#[inline(always)]
fn steps(values: &[f64], condition: impl Fn(f64, f64) -> bool) -> u64 {
    let after = &values[1..];
    let mut word = 0;
    let (chunks, rest) = after.as_chunks::<8>();
    for (number, chunk) in chunks.iter().enumerate() {
        let (before, _) = values[8 * number..].as_chunks::<8>();
        let mut byte = 0u8;
        for lane in 0..8 {
            byte |= u8::from(condition(before[0][lane], chunk[lane])) << lane;
        }
        word |= u64::from(byte) << (8 * number);
    }
    for (lane, &value) in rest.iter().enumerate() {
        let place = 8 * chunks.len() + lane;
        word |= u64::from(condition(values[place], value)) << place;
    }
    word
}

/// The lowest bits, as many as these, from 1 to 64.
#[inline(always)]
fn low_bits(count: usize) -> u64 {
    u64::MAX >> (64 - count)
}

/// Whether all bits that are set are below all others.
#[inline(always)]
fn are_low(word: u64) -> bool {
    word & word.wrapping_add(1) == 0
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
        assert_eq!(polygon(&[3.0, 1.0, -1.0]).zeros(false), Zeros::OneFall);
        assert_eq!(polygon(&[-1e-12, 1.0, -1.0]).zeros(true), Zeros::OneFall);
        for points in [
            [3.0, -1.0, 2.0],
            [3.0, 1e-12, -2.0],
            [-1.0, -2.0, -3.0],
            [-1.0, 1.0, 2.0],
        ] {
            assert_eq!(polygon(&points).zeros(false), Zeros::Unknown, "{points:?}");
        }
        assert_eq!(polygon(&[0.0, -2.0, -3.0]).zeros(true), Zeros::Unknown);
        assert_eq!(polygon(&[3.0, 1.0, -1.0]).first_fall(false), Some(0.75));
        assert_eq!(polygon(&[-1.0, 1.0, -1.0]).first_fall(true), Some(0.75));
        assert_eq!(polygon(&[1.0, 1.0, 2.0]).first_fall(false), None);
    }

    #[test]
    fn shapes_with_one_extremum_or_none_are_known_and_no_others() {
        let cases = [
            ([1.0, 2.0, 3.0, 4.0], Shape::Rising),
            ([4.0, 2.0, 1.0, 0.5], Shape::Falling),
            ([3.0, 1.0, 2.0, 4.0], Shape::Valley),
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
        assert_eq!(polygon(&[1.0, 0.9, 2.0, 3.0]).shape(true), Shape::Valley);
        assert_eq!(polygon(&[0.0, 3.0, 4.0, 3.0, 0.0]).turn(), 0.5);
        assert_eq!(polygon(&[4.0, 1.0, 0.0, 1.0, 4.0]).turn(), 0.5);
    }
}
