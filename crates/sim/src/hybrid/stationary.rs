//! Isolation of every stationary point of a gap in a step: all zeros of its slope, in `f64`, for
//! one gap or for one in every lane.
//!
//! First the control points of the slope's first sixteen terms `q` are examined. They decide if all
//! of them exceed `r`, a bound on the remaining terms. Without a change of sign there is no zero.
//! With one change, `q` takes each value in `[−r, r]` once; if it crosses them steeply, the whole
//! slope has one zero as well. With two changes, `q` takes each value at most twice, and there is a
//! zero on either side of a point between them at which the slope has the sign of the control
//! points there. A slope that is zero at the start, at a minimum or a maximum, is judged by the
//! other control points, with at most one change of sign among them. Undecided slopes are halved,
//! one gap after another: an interval of half-width `w` about `m` has no zero of `p` if
//! `|p(m)| > w (|p'(m)| + B w/2)`, and at most one if `|p'(m)| > B w`, where `B` bounds `|p''|` on
//! it.

use crate::numeric::polynomial::{TERMS, control_points, sizes};
use crate::numeric::{Bracket, Branched, Mask, NewtonSteps, polynomial};

/// Zeros of slopes, with the memory to find them. `R` is the number type in `f64`.
#[derive(Clone, Debug)]
pub(super) struct StationaryPoints<R: Branched> {
    /// Zeros in units of the steps, increasing.
    pub(super) turns: Vec<SlopeZero<R>>,
    /// Coefficients of the slopes in units of the steps.
    scaled: Vec<R>,
    /// Coefficients of the second derivatives of the slopes.
    bends: Vec<R>,
    halving: Halving,
}

/// The next zeros of slopes, one for each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlopeZero<R: Branched> {
    /// Mask: there is a zero; then all earlier zeros exist too.
    pub(super) exists: R::Mask,
    /// Zero, in units of the step.
    pub(super) place: R,
}

/// Changes of sign in the control points of slopes.
struct Signs<R: Branched> {
    /// Mask: the first control point is zero and is skipped when signs are counted.
    ///
    /// NOTE: the other points are those of a polynomial times the time, `(i/15) c_{i−1}`, so that
    /// `|c_i|` is above the bound too. The slope changes its sign at the start if it is negative
    /// after it, because its sign at the start counts as not negative.
    from_zero: R::Mask,
    /// Mask: the first counted point is positive.
    positive: R::Mask,
    /// Changes of sign.
    changes: [SignChange<R>; 2],
    /// Mask: all counted points have a sign, and there are no further changes.
    known: R::Mask,
    points: [R; TERMS],
}

/// A change of sign between two control points.
#[derive(Clone, Copy)]
struct SignChange<R: Branched> {
    exists: R::Mask,
    /// Number of the second of the two points; then both points.
    number: R,
    last: R,
    next: R,
}

/// Zeros of slopes between ends, from starts inside; and the derivatives of the slopes there.
struct Refined<R: Branched> {
    place: R,
    steepness: R,
    found: R::Mask,
}

/// Largest number of Newton and bisection steps to a zero.
const MAX_NEWTON: usize = 400;
/// Largest number of intervals examined per step before the search gives up; a step of an analytic
/// field needs tens.
const MAX_INTERVALS: usize = 100_000;
/// Half-width, relative to the step, below which a multiple zero of the slope is not resolved.
const SMALLEST_HALF: f64 = 1e-9;
/// Rounding of a control point, as a share of the size of its terms: a smaller point has no sign.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Share of the interval below which a Newton step, whose error is its square, is the last.
const LAST_STEP: f64 = 1e-9;

impl<R: Branched<Rounded = R>> StationaryPoints<R> {
    pub(super) fn new() -> Self {
        Self {
            turns: Vec::new(),
            scaled: Vec::new(),
            bends: Vec::new(),
            halving: Halving::default(),
        }
    }

    /// Fills `turns` with the zeros of the wanted slopes.
    #[inline(always)]
    pub(super) fn isolate<S: Branched<Rounded = R, Mask = R::Mask>>(
        &mut self,
        slope: &[S],
        length: R,
        wanted: R::Mask,
    ) {
        self.turns.clear();
        let size = sizes(slope, length);
        let moves = R::zero().is_below(size) & size.is_below(R::from_f64(f64::INFINITY));
        let wanted = wanted & moves;
        if wanted.is_over() {
            return;
        }
        let count = self.scale(slope, length, R::from_f64(1e-18) * size);
        let undecided = self.solve_by_control_points(size, count, wanted);
        if undecided.any() {
            self.halve(undecided, count);
        }
    }

    /// Computes the coefficients in units of the steps, with zeros for the last ones that are below
    /// `negligible`. Returns the number of the others.
    #[inline(always)]
    fn scale<S: Branched<Rounded = R>>(&mut self, slope: &[S], length: R, negligible: R) -> R {
        let (zero, square) = (R::zero(), length * length);
        let mut powers = [R::one(), length, square, square * length];
        self.scaled.resize(slope.len(), zero);
        let (blocks, rest) = slope.as_chunks::<4>();
        let (scaled, last) = self.scaled.as_chunks_mut::<4>();
        for (block, out) in blocks.iter().zip(scaled) {
            for place in 0..4 {
                out[place] = block[place].rounded() * powers[place];
                powers[place] *= square * square;
            }
        }
        for ((coefficient, power), out) in rest.iter().zip(&powers).zip(last) {
            *out = coefficient.rounded() * *power;
        }
        let (mut beyond, mut count, mut kept) = (!R::Mask::NONE, R::from_f64(2.0), 2);
        for (degree, coefficient) in self.scaled.iter_mut().enumerate().skip(2).rev() {
            let is_last = beyond & negligible.is_at_most(coefficient.abs());
            if is_last.any() {
                kept = kept.max(degree + 1);
                count = R::select(is_last, R::from_f64((degree + 1) as f64), count);
                beyond &= !is_last;
                if !beyond.any() {
                    break;
                }
            }
            *coefficient = R::select(beyond, zero, *coefficient);
        }
        self.scaled.truncate(kept);
        count
    }

    /// Adds the zeros of slopes whose control points show that there are at most two. Returns the
    /// mask of undecided slopes.
    #[inline(always)]
    fn solve_by_control_points(&mut self, size: R, count: R, wanted: R::Mask) -> R::Mask {
        let (zero, one) = (R::zero(), R::one());
        let terms = self.scaled.len().min(TERMS);
        let mut first = [zero; TERMS];
        match self.scaled.first_chunk() {
            Some(whole) => first = *whole,
            None => first[..terms].copy_from_slice(&self.scaled),
        }
        let left_out = sizes(&self.scaled[terms..], one) + R::from_f64(ROUNDING) * size;
        let signs = Signs::new(control_points(&first), left_out);
        let [first, second] = signs.changes;
        let mut known = wanted & signs.known;
        let divided = known & (second.exists | (signs.from_zero & first.exists));
        let mut middle = zero;
        if divided.any() {
            middle = signs.middle();
            let value = polynomial::value(&self.scaled, middle);
            let is_positive =
                (signs.from_zero & signs.positive) | !(signs.from_zero | signs.positive);
            let above = R::select(is_positive, value, -value);
            known &= !divided | (left_out + left_out).is_below(above);
        }
        let at_start = known & signs.from_zero & !signs.positive;
        if at_start.any() {
            self.put(at_start, zero);
        }
        if !(known & first.exists).any() {
            return wanted & !known;
        }
        self.bend();
        let bound = sizes(&self.bends, one);
        for (index, change) in signs.changes.iter().enumerate() {
            let turns = known & change.exists;
            if !turns.any() {
                break;
            }
            let (after, before, falling) = match index {
                0 => (signs.from_zero, second.exists, signs.positive),
                _ => (turns, R::Mask::NONE, !signs.positive),
            };
            let ends = [R::select(after, middle, zero), R::select(before, middle, one)];
            let refined = self.refine(ends, change.place(), falling, turns);
            let steep = is_steep(refined.steepness.abs(), bound, left_out, count);
            let steep = refined.found & steep;
            known &= !turns | steep;
            self.put(steep, refined.place);
        }
        wanted & !known
    }

    /// Adds zeros that are larger than those before.
    #[inline(always)]
    fn put(&mut self, wanted: R::Mask, place: R) {
        let mut left = wanted;
        for turn in &mut self.turns {
            let here = left & !turn.exists;
            turn.place = R::select(here, place, turn.place);
            turn.exists |= here;
            left &= !here;
        }
        if left.any() {
            let exists = left;
            self.turns.push(SlopeZero { exists, place });
        }
    }

    /// Zeros between ends from starts inside; `falling` marks slopes that are positive at the first
    /// end.
    #[inline(always)]
    fn refine(&self, ends: [R; 2], start: R, falling: R::Mask, wanted: R::Mask) -> Refined<R> {
        let tolerance = R::from_f64(LAST_STEP) * ends[1];
        let mut search = NewtonSteps::new(ends, falling, start, tolerance);
        let mut refined = Refined { place: start, steepness: start, found: R::Mask::NONE };
        let mut going = wanted;
        for _ in 0..MAX_NEWTON {
            let (value, slope) = polynomial::value_and_slope(&self.scaled, search.at());
            let step = search.advance(value, slope);
            let settled = going & step.settled;
            refined.place = R::select(settled, step.next, refined.place);
            refined.steepness = R::select(settled, slope, refined.steepness);
            refined.found |= settled;
            going &= !settled;
            if !going.any() {
                break;
            }
            R::carried(&mut search);
        }
        refined
    }

    /// Computes the coefficients of the second derivatives.
    #[inline(always)]
    fn bend(&mut self) {
        let coefficients = self.scaled.get(2..).unwrap_or_default();
        self.bends.resize(coefficients.len(), R::zero());
        let terms = self.bends.iter_mut().zip(coefficients).enumerate();
        for (degree, (out, &coefficient)) in terms {
            let factor = R::from_f64(((degree + 2) * (degree + 1)) as f64);
            *out = factor * coefficient;
        }
    }

    /// Finds the zeros by halving, one slope after another.
    #[cold]
    #[inline(never)]
    fn halve(&mut self, undecided: R::Mask, count: R) {
        for turn in &mut self.turns {
            turn.exists &= !undecided;
        }
        for lane in undecided.lanes() {
            let terms = (count.lane(lane) as usize).min(self.scaled.len());
            let coefficients = self.scaled[..terms].iter();
            self.halving.set(coefficients.map(|c| c.lane(lane)));
            self.halving.run();
            for index in 0..self.halving.roots.len() {
                let root = R::from_f64(self.halving.roots[index]);
                self.put(R::Mask::only(lane), root);
            }
        }
    }
}

/// Mask: a zero with this slope has no others beside it, for all remaining terms up to a bound;
/// `bound` is that of the second derivative.
///
/// NOTE: with `|p''| ≤ B` the slope is above `s/2` within `s/2B` of the zero. This includes the
/// distance by which the remaining terms can move the zero, if `4 B r < s²`. The slope of these
/// terms is below a quarter of `s` if `4 n r < s`, with `n` terms in all. Both conditions are
/// required with a factor of two.
#[inline(always)]
fn is_steep<R: Branched>(slope: R, bound: R, left_out: R, count: R) -> R::Mask {
    let eight = R::from_f64(8.0);
    (eight * bound * left_out).is_below(slope * slope) & (eight * count * left_out).is_below(slope)
}

impl<R: Branched> Signs<R> {
    /// Signs of control points, which count if they are above a bound.
    #[inline(always)]
    fn new(points: [R; TERMS], bound: R) -> Self {
        let (zero, none) = (R::zero(), R::Mask::NONE);
        let from_zero = points[0].is_equal(zero);
        let positive = zero.is_below(R::select(from_zero, points[1], points[0]));
        let change = SignChange { exists: none, number: zero, last: zero, next: zero };
        let mut signs = Signs { from_zero, positive, changes: [change; 2], known: !none, points };
        let mut above = positive;
        for (index, &point) in points.iter().enumerate() {
            let last = points[index.saturating_sub(1)];
            let (rises, falls) = (bound.is_below(point), point.is_below(-bound));
            let counts = if index > 0 { !none } else { !from_zero };
            signs.known &= rises | falls | !counts;
            if signs.known.is_over() {
                break;
            }
            let changes = counts & ((rises & !above) | (falls & above));
            if changes.is_over() {
                continue;
            }
            let [first, second] = &mut signs.changes;
            signs.known &= !(changes & (second.exists | (first.exists & from_zero)));
            second.take(changes & first.exists, index, [last, point]);
            first.take(changes & !first.exists, index, [last, point]);
            above = (above & !changes) | (rises & changes);
        }
        signs
    }

    /// Place of the control point of largest magnitude between two zeros, one of which may be the
    /// start.
    #[inline(always)]
    fn middle(&self) -> R {
        let [first, second] = &self.changes;
        let from = R::select(self.from_zero, R::one(), first.number);
        let until = R::select(self.from_zero, first.number, second.number);
        let (mut largest, mut middle) = (R::zero(), from);
        for (index, point) in self.points.iter().enumerate() {
            let number = R::from_f64(index as f64);
            let size = point.abs();
            let larger = from.is_at_most(number) & number.is_below(until) & largest.is_below(size);
            largest = R::select(larger, size, largest);
            middle = R::select(larger, number, middle);
        }
        middle / R::from_f64((TERMS - 1) as f64)
    }
}

impl<R: Branched> SignChange<R> {
    // NOTE: further changes after the second are overwritten; the result is then not used.
    #[inline(always)]
    fn take(&mut self, wanted: R::Mask, index: usize, [last, next]: [R; 2]) {
        self.exists |= wanted;
        self.number = R::select(wanted, R::from_f64(index as f64), self.number);
        self.last = R::select(wanted, last, self.last);
        self.next = R::select(wanted, next, self.next);
    }

    /// Approximate zero of the polynomial.
    #[inline(always)]
    fn place(&self) -> R {
        let place = self.number - self.next / (self.next - self.last);
        place / R::from_f64((TERMS - 1) as f64)
    }
}

/// Isolation of all zeros of one slope by halving.
#[derive(Clone, Debug, Default)]
struct Halving {
    /// Zeros in units of the step, increasing.
    roots: Vec<f64>,
    /// Coefficients of the slope in units of the step.
    scaled: Vec<f64>,
    /// Coefficients of the second derivative of the slope.
    bends: Vec<f64>,
    pending: Vec<(f64, f64)>,
}

impl Halving {
    /// Sets the slope.
    fn set(&mut self, coefficients: impl Iterator<Item = f64>) {
        self.scaled.clear();
        self.scaled.extend(coefficients);
        let bend = |(degree, c): (usize, &f64)| (degree * (degree - 1)) as f64 * c;
        self.bends.clear();
        self.bends.extend(self.scaled.iter().enumerate().skip(2).map(bend));
    }

    /// Finds all zeros of the slope between 0 and 1, and collects them in `roots`.
    fn run(&mut self) {
        self.roots.clear();
        self.pending.clear();
        self.pending.push((0.0, 1.0));
        for _ in 0..MAX_INTERVALS {
            let Some((a, b)) = self.pending.pop() else {
                return;
            };
            self.examine(a, b);
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
            let [left, right] = [a, b].map(|end| polynomial::value(&self.scaled, end));
            if (left < 0.0) != (right < 0.0) {
                self.roots.extend(self.root_between([a, b], left, right));
            }
            return;
        }
        self.pending.push((middle, b));
        self.pending.push((a, middle));
    }

    /// Zero between two points at which the values differ in sign.
    fn root_between(&self, [a, b]: [f64; 2], left: f64, right: f64) -> Option<f64> {
        let bracket = Bracket::new(a, b, left, right).ok()?;
        let value_and_slope = |at: f64| polynomial::value_and_slope(&self.scaled, at);
        bracket.newton_from(0.5 * (a + b), LAST_STEP * b, value_and_slope).root()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{LaneMask, Lanes};

    fn places(points: &StationaryPoints<f64>) -> Vec<f64> {
        points.turns.iter().map(|turn| turn.place).collect()
    }

    fn isolated(slope: &[f64], length: f64) -> Vec<f64> {
        let mut points = StationaryPoints::new();
        points.isolate(slope, length, true);
        assert!(points.turns.iter().all(|turn| turn.exists));
        places(&points)
    }

    fn halved(slope: &[f64], length: f64) -> Vec<f64> {
        let mut points = StationaryPoints::new();
        let count = points.scale(slope, length, 0.0);
        points.halve(true, count);
        places(&points)
    }

    #[test]
    fn close_and_distant_zeros_are_all_isolated() {
        // (t − 0.2)(t − 0.2 − 1e-6)(t − 0.9)
        let (a, b, c) = (0.2, 0.2 + 1e-6, 0.9);
        let coefficients = [-a * b * c, a * b + a * c + b * c, -(a + b + c), 1.0];
        let found = isolated(&coefficients, 1.0);
        assert_eq!(found.len(), 3, "{found:?}");
        for (root, expected) in found.iter().zip([a, b, c]) {
            // Conditioning of the close pair: rounding 1e-17 over the slope 7e-7.
            assert!((root - expected).abs() < 1e-9, "{root} {expected}");
        }
    }

    #[test]
    fn zeros_on_the_ends_of_halves_are_found_to_the_last_bits() {
        // sin(t − c): no coefficient vanishes, and the intervals are divided at c.
        for (share, length) in [(0.125, 1.6), (0.25, 1.6), (0.5, 0.9), (0.5, 1.6), (0.75, 1.6)] {
            let zero: f64 = share * length;
            let derivatives = [-zero.sin(), zero.cos(), zero.sin(), -zero.cos()];
            let factorial = |k: usize| (1..=k).map(|j| j as f64).product::<f64>();
            let coefficient = |k: usize| derivatives[k % 4] / factorial(k);
            let coefficients: Vec<_> = (0..28).map(coefficient).collect();
            let found = isolated(&coefficients, length);
            for roots in [found, halved(&coefficients, length)] {
                assert_eq!(roots.len(), 1, "{share} {roots:?}");
                assert!((roots[0] - share).abs() < 4e-16, "{share} {roots:?}");
            }
        }
    }

    #[test]
    fn two_zeros_that_control_points_tell_are_those_of_halving() {
        // (t − a)(b − t) e^(−t), by its series; for a = 0, the zero at the start counts if the
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
            let mut points = StationaryPoints::new();
            let count = points.scale(&series, 1.0, 0.0);
            let size = polynomial::size(&series, 1.0);
            assert!(!points.solve_by_control_points(size, count, true));
            let told = places(&points);
            let halved = halved(&series, 1.0);
            // NOTE: halving does not distinguish a zero at the start from none.
            let halved = halved.iter().filter(|&&zero| zero > 1e-9);
            let inside = expected.iter().filter(|&&zero| zero > 0.0);
            assert_eq!(told.len(), expected.len(), "{sign} {a} {b}");
            assert_eq!(halved.clone().count(), inside.clone().count());
            // Roundings of terms that sum up to 5, at slopes of 1/4 and more.
            let near = |(found, zero): (&f64, &f64)| (found - zero).abs() < 1e-14;
            assert!(told.iter().zip(expected).all(near), "{told:?}");
            assert!(halved.zip(inside).all(near), "{told:?}");
        }
    }

    #[test]
    fn every_change_of_sign_of_a_cubic_times_a_series_is_found() {
        let mut seed = 1u32;
        let mut number = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1u32 << 23) - 1.0
        };
        let (mut counts, mut slopes) = ([0; 4], Vec::new());
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
            let changes = (0..2000).filter(|&place| at(place) != at(place + 1)).count();
            let found = isolated(&coefficients, 1.0);
            assert_eq!(found.len(), changes, "{coefficients:?}");
            counts[changes.min(3)] += 1;
            slopes.push((coefficients, found));
        }
        for chunk in slopes.as_chunks::<8>().0 {
            let slope: Vec<_> = (0..chunk[0].0.len())
                .map(|k| Lanes::<8>::from_fn(|lane| chunk[lane].0[k]))
                .collect();
            let mut points = StationaryPoints::new();
            points.isolate(&slope, Lanes::splat(1.0), !LaneMask::NONE);
            for (lane, (_, alone)) in chunk.iter().enumerate() {
                let turns = points.turns.iter();
                let own = turns.filter(|turn| turn.exists.holds(lane));
                let own: Vec<_> = own.map(|turn| turn.place[lane]).collect();
                assert_eq!(own, *alone);
            }
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
        for (sign, length, zeros) in
            [(1.0, 2.0, &[][..]), (-1.0, 2.0, &[0.0]), (1.0, 4.0, &[std::f64::consts::PI / 4.0])]
        {
            let found = isolated(&series(sign), length);
            assert_eq!(found.len(), zeros.len(), "{sign} {length}");
            for (root, zero) in found.iter().zip(zeros) {
                // Terms of up to 11, whose rounding a slope of 4 divides.
                assert!((root - zero).abs() < 2e-15, "{root} {zero}");
            }
        }
    }

    #[test]
    fn a_vanishing_slope_has_no_stationary_points() {
        assert!(isolated(&[0.0f64; 8], 1.0).is_empty());
    }
}
