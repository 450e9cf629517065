//! Isolation of every stationary point of a gap in a step: all zeros of its slope, in `f64`.
//!
//! First the control points of its first sixteen terms `q` are asked, where all are larger than
//! `r`, a bound of the terms left out: without a change of sign there is no zero; with one, `q`
//! takes each value in `[−r, r]` once, and where it crosses them steeply the whole has one zero as
//! well; with two, twice at most, and there is a zero on either side of a point between them where
//! the slope has the sign of the control points there. A slope that starts at zero, at a minimum or
//! a maximum, is that of the other control points, one change of sign at most among them. What they
//! leave open is halved: an interval of half-width `w` about `m` holds no zero of `p` if
//! `|p(m)| > w (|p'(m)| + B w/2)` and at most one if `|p'(m)| > B w`, where `B` bounds `|p''|` on
//! it.

use crate::numeric::polynomial::{TERMS, control_points};
use crate::numeric::{Bracket, Real, polynomial};

/// Zeros of a slope, and the memory to find them.
#[derive(Clone, Debug, Default)]
pub(super) struct StationaryPoints {
    /// The zeros in units of the step, increasing.
    pub(super) roots: Vec<f64>,
    /// The slope's coefficients in units of the step.
    scaled: Vec<f64>,
    /// Those of its second derivative.
    bends: Vec<f64>,
    pending: Vec<(f64, f64)>,
}

/// Intervals examined per step before the rest is given up; a step of an analytic field needs tens.
const MAX_INTERVALS: usize = 100_000;
/// Half-width, relative to the step, below which a multiple zero of the slope is not resolved.
const SMALLEST_HALF: f64 = 1e-9;
/// Share of the size of its terms within which a control point has no sign.
pub(super) const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Share of the interval below which a step of Newton's method, whose error is its square, is the
/// last.
pub(super) const LAST_STEP: f64 = 1e-9;

impl StationaryPoints {
    /// Fills `roots` with the zeros of the slope in units of the length, increasing.
    pub(super) fn isolate<S: Real>(&mut self, slope: &[S], length: f64) {
        self.roots.clear();
        let size = polynomial::size(slope, length);
        if !(size > 0.0 && size.is_finite()) {
            return;
        }
        self.scale(slope, length, 1e-18 * size);
        self.bend();
        if !self.solve_by_control_points(size) {
            self.roots.clear();
            self.halve();
        }
    }

    /// Finds the zeros by halving.
    fn halve(&mut self) {
        self.pending.clear();
        self.pending.push((0.0, 1.0));
        for _ in 0..MAX_INTERVALS {
            let Some((a, b)) = self.pending.pop() else {
                return;
            };
            self.examine(a, b);
        }
    }

    /// Fills the coefficients in units of the step, the last ones left out where they are below
    /// `negligible`.
    fn scale<S: Real>(&mut self, slope: &[S], length: f64, negligible: f64) {
        let square = length * length;
        let mut powers = [1.0, length, square, square * length];
        self.scaled.clear();
        for chunk in slope.chunks(powers.len()) {
            let terms = chunk.iter().zip(&powers);
            self.scaled
                .extend(terms.map(|(c, power)| c.to_f64() * power));
            powers = powers.map(|power| power * (square * square));
        }
        let is_term = |c: &f64| c.abs() >= negligible;
        let degree = self.scaled.iter().rposition(is_term).unwrap_or(0);
        self.scaled.truncate(degree.max(1) + 1);
    }

    /// Finds the zeros where the control points tell that there are two at most, and where; whether
    /// they do.
    fn solve_by_control_points(&mut self, size: f64) -> bool {
        let mut first = [0.0; TERMS];
        let terms = self.scaled.len().min(TERMS);
        first[..terms].copy_from_slice(&self.scaled[..terms]);
        let left_out = polynomial::size(&self.scaled[terms..], 1.0) + ROUNDING * size;
        let points = control_points(&first);
        let Some(signs) = Signs::of(&points, left_out) else {
            return false;
        };
        let mut ends = [(0.0, points[0]), (1.0, points[TERMS - 1])];
        let mut middle = ends[0];
        if let Some((place, is_positive)) = signs.middle {
            let value = polynomial::value(&self.scaled, place);
            middle = (place, value);
            let above = if is_positive { value } else { -value };
            if above <= left_out + left_out {
                return false;
            }
        }
        if signs.from_zero {
            ends[0] = middle;
            if !signs.positive {
                self.roots.push(0.0);
            }
        }
        for (index, &place) in signs.changes().iter().enumerate() {
            let ends = match (signs.count, index) {
                (2, 0) => [ends[0], middle],
                (2, _) => [middle, ends[1]],
                _ => ends,
            };
            match self.root_between(ends, place) {
                Some((root, slope)) if self.is_steep(slope.abs(), left_out) => {
                    self.roots.push(root)
                }
                _ => return false,
            }
        }
        true
    }

    /// Whether a zero with this slope has no others beside it, whatever terms up to a bound add to
    /// the first ones.
    ///
    /// NOTE: where `|p''| ≤ B` the slope is above `s/2` within `s/2B` of the zero, and so within
    /// what the terms left out can move it by if `4 B r < s²`; they have less than a quarter of
    /// it themselves if `4 n r < s`, with `n` terms in all. Both are asked for twice over.
    fn is_steep(&self, slope: f64, left_out: f64) -> bool {
        let bound = polynomial::size(&self.bends, 1.0);
        let count = self.scaled.len() as f64;
        8.0 * bound * left_out < slope * slope && 8.0 * count * left_out < slope
    }

    /// Fills the coefficients of the second derivative.
    fn bend(&mut self) {
        self.bends.clear();
        let (mut twice, mut factor) = (0.0, 0.0);
        for coefficient in self.scaled.iter().skip(2) {
            twice += 2.0;
            factor += twice;
            self.bends.push(factor * coefficient);
        }
    }

    /// Excludes, solves or splits one interval.
    fn examine(&mut self, a: f64, b: f64) {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let (value, slope) = polynomial::value_and_slope(&self.scaled, middle);
        let bound = polynomial::size(&self.bends, b);
        if value.abs() > half * (slope.abs() + 0.5 * bound * half) {
            return;
        }
        if slope.abs() > bound * half || half < SMALLEST_HALF {
            let ends = [a, b].map(|end| (end, polynomial::value(&self.scaled, end)));
            if (ends[0].1 < 0.0) != (ends[1].1 < 0.0) {
                let root = self.root_between(ends, middle);
                self.roots.extend(root.map(|(root, _)| root));
            }
            return;
        }
        self.pending.push((middle, b));
        self.pending.push((a, middle));
    }

    /// The zero between two points at which the values differ in sign, from one in between, and the
    /// slope near it.
    fn root_between(&self, ends: [(f64, f64); 2], start: f64) -> Option<(f64, f64)> {
        let [(a, left), (b, right)] = ends;
        let bracket = Bracket::new(a, b, left, right).ok()?;
        let mut last = 0.0;
        let value_and_slope = |at: f64| {
            let (value, slope) = polynomial::value_and_slope(&self.scaled, at);
            last = slope;
            (value, slope)
        };
        let root = bracket.newton_from(start, LAST_STEP * b, value_and_slope);
        Some((root.root()?, last))
    }
}

/// Signs of control points, two changes at most.
struct Signs {
    /// Whether the first is zero, and counts for nothing.
    ///
    /// NOTE: the others are those of a polynomial times the time, `(i/15) c_{i−1}`, so that
    /// `|c_i|` is above the bound too. The slope changes its sign there if it is negative
    /// after it, for at the start it counts as not negative.
    from_zero: bool,
    /// Whether the first that counts is positive.
    positive: bool,
    /// About where the polynomial is zero.
    places: [f64; 2],
    count: usize,
    /// Where the control points between two zeros, the start being one, are largest, and whether
    /// they are positive.
    middle: Option<(f64, bool)>,
}

impl Signs {
    /// `None` where there are more changes, or points that are not above a bound.
    fn of(points: &[f64; TERMS], bound: f64) -> Option<Self> {
        let from_zero = points[0] == 0.0;
        let first = usize::from(from_zero);
        let (most, before_middle) = if from_zero { (1, 0) } else { (2, 1) };
        let (mut places, mut count) = ([0.0; 2], 0);
        let (mut largest, mut middle) = (0.0, 0);
        for (index, &point) in points.iter().enumerate().skip(first) {
            let is_told = point.abs() > bound;
            if !is_told {
                return None;
            }
            let last = points[index.saturating_sub(1).max(first)];
            if (point > 0.0) != (last > 0.0) {
                *places[..most].get_mut(count)? = share(index as f64 - point / (point - last));
                count += 1;
            }
            if count == before_middle && point.abs() > largest {
                (largest, middle) = (point.abs(), index);
            }
        }
        Some(Self {
            from_zero,
            positive: points[first] > 0.0,
            places,
            count,
            middle: (count == most).then_some((share(middle as f64), points[middle] > 0.0)),
        })
    }

    fn changes(&self) -> &[f64] {
        &self.places[..self.count]
    }
}

/// Where a control point belongs to, as a share of the interval.
fn share(index: f64) -> f64 {
    index / (TERMS - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_and_distant_zeros_are_all_isolated() {
        // (t − 0.2)(t − 0.2 − 1e-6)(t − 0.9)
        let (a, b, c) = (0.2, 0.2 + 1e-6, 0.9);
        let coefficients = [-a * b * c, a * b + a * c + b * c, -(a + b + c), 1.0];
        let mut found = StationaryPoints::default();
        found.isolate(&coefficients, 1.0);
        assert_eq!(found.roots.len(), 3, "{:?}", found.roots);
        for (root, expected) in found.roots.iter().zip([a, b, c]) {
            // Conditioning of the close pair: rounding 1e-17 over the slope 7e-7.
            assert!((root - expected).abs() < 1e-9, "{root} {expected}");
        }
    }

    #[test]
    fn zeros_on_the_ends_of_halves_are_found_to_the_last_bits() {
        // sin(t − c): no coefficient vanishes, and c is where the intervals are divided.
        for (share, length) in [
            (0.125, 1.6),
            (0.25, 1.6),
            (0.5, 0.9),
            (0.5, 1.6),
            (0.75, 1.6),
        ] {
            let zero: f64 = share * length;
            let derivatives = [-zero.sin(), zero.cos(), zero.sin(), -zero.cos()];
            let factorial = |k: usize| (1..=k).map(|j| j as f64).product::<f64>();
            let coefficient = |k: usize| derivatives[k % 4] / factorial(k);
            let coefficients: Vec<_> = (0..28).map(coefficient).collect();
            let mut found = StationaryPoints::default();
            found.isolate(&coefficients, length);
            let mut halved = StationaryPoints::default();
            halved.scale(&coefficients, length, 0.0);
            halved.bend();
            halved.halve();
            for roots in [found.roots, halved.roots] {
                assert_eq!(roots.len(), 1, "{share} {roots:?}");
                assert!((roots[0] - share).abs() < 4e-16, "{share} {roots:?}");
            }
        }
    }

    #[test]
    fn two_zeros_that_control_points_tell_are_those_of_halving() {
        // (t − a)(b − t) e^(−t), by its series; from zero, the zero at the start counts where the
        // slope falls from it.
        for (sign, [a, b], expected) in [
            (1.0, [0.1, 0.7], &[0.1, 0.7][..]),
            (-1.0, [0.3, 0.95], &[0.3, 0.95]),
            (1.0, [0.0, 0.8], &[0.8]),
            (-1.0, [0.0, 0.8], &[0.0, 0.8]),
        ] {
            let mut term = sign;
            let mut series = [0.0; 30];
            for k in 0..28 {
                for (power, factor) in [-a * b, a + b, -1.0].into_iter().enumerate() {
                    series[k + power] += factor * term;
                }
                term /= -((k + 1) as f64);
            }
            let mut told = StationaryPoints::default();
            told.scale(&series, 1.0, 0.0);
            told.bend();
            assert!(told.solve_by_control_points(polynomial::size(&series, 1.0)));
            let mut halved = StationaryPoints::default();
            halved.scale(&series, 1.0, 0.0);
            halved.bend();
            halved.halve();
            // NOTE: halving does not tell a zero at the start from none.
            let halved = halved.roots.iter().filter(|&&zero| zero > 1e-9);
            let inside = expected.iter().filter(|&&zero| zero > 0.0);
            assert_eq!(told.roots.len(), expected.len(), "{sign} {a} {b}");
            assert_eq!(halved.clone().count(), inside.clone().count());
            // Roundings of terms that sum up to 5, at slopes of 1/4 and more.
            let near = |(found, zero): (&f64, &f64)| (found - zero).abs() < 1e-14;
            assert!(
                told.roots.iter().zip(expected).all(near),
                "{:?}",
                told.roots
            );
            assert!(halved.zip(inside).all(near), "{:?}", told.roots);
        }
    }

    #[test]
    fn every_change_of_sign_of_a_cubic_times_a_series_is_found() {
        let mut seed = 1u32;
        let mut number = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1u32 << 23) - 1.0
        };
        let mut counts = [0; 4];
        for _ in 0..400 {
            let mut coefficients: Vec<_> = (0..32).map(|k| number() * 0.4f64.powi(k)).collect();
            coefficients[0] = 2.0;
            for zero in [0.5 + number(), 0.5 + number(), 0.5 + number()] {
                coefficients.push(0.0);
                for k in (0..coefficients.len()).rev() {
                    let lower = if k > 0 { coefficients[k - 1] } else { 0.0 };
                    coefficients[k] = lower - zero * coefficients[k];
                }
            }
            let at = |place: usize| polynomial::value(&coefficients, place as f64 / 2000.0) > 0.0;
            let changes = (0..2000)
                .filter(|&place| at(place) != at(place + 1))
                .count();
            let mut found = StationaryPoints::default();
            found.isolate(&coefficients, 1.0);
            assert_eq!(found.roots.len(), changes, "{coefficients:?}");
            counts[changes.min(3)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
    }

    #[test]
    fn a_zero_at_the_start_counts_where_the_slope_falls_from_it() {
        // ± sin t, and its series with a zero further on.
        let series = |sign: f64| -> Vec<f64> {
            let mut term = sign;
            let term = |k: usize| {
                let present = if k % 2 == 1 { term } else { 0.0 };
                if k % 2 == 1 {
                    term /= -(((k + 1) * (k + 2)) as f64);
                }
                present
            };
            (0..32).map(term).collect()
        };
        let mut found = StationaryPoints::default();
        for (sign, length, zeros) in [
            (1.0, 2.0, &[][..]),
            (-1.0, 2.0, &[0.0]),
            (1.0, 4.0, &[std::f64::consts::PI / 4.0]),
        ] {
            found.isolate(&series(sign), length);
            assert_eq!(found.roots.len(), zeros.len(), "{sign} {length}");
            for (root, zero) in found.roots.iter().zip(zeros) {
                // Terms of up to 11, whose rounding a slope of 4 divides.
                assert!((root - zero).abs() < 2e-15, "{root} {zero}");
            }
        }
    }

    #[test]
    fn a_vanishing_slope_has_no_stationary_points() {
        let mut found = StationaryPoints::default();
        found.isolate(&[0.0f64; 8], 1.0);
        assert!(found.roots.is_empty());
    }
}
