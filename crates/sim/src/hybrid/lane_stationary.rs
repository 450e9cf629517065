//! The stationary points of gaps in a step, in lanes:
//! [`StationaryPoints`](super::stationary::StationaryPoints) where control points tell that there
//! are two at most.

use super::lane_newton::LaneNewton;
use super::stationary::{LAST_STEP, ROUNDING};
use crate::numeric::polynomial::{TERMS, control_points, sizes};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar, polynomial};

/// Most steps of Newton's method.
const MAX_NEWTON: usize = 12;

/// Working memory of the search.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneStationary<const N: usize> {
    /// The slopes' coefficients in units of the steps.
    scaled: Vec<Lanes<N>>,
    /// Those of their second derivatives.
    bends: Vec<Lanes<N>>,
}

/// Zeros of slopes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning<const N: usize> {
    /// The zeros, in units of the steps, increasing.
    pub(super) places: [Lanes<N>; 2],
    /// Where there is one, and where two; no others.
    pub(super) found: [LaneMask<N>; 2],
    /// Where nothing is known.
    pub(super) open: LaneMask<N>,
}

/// Where the control points of slopes change sign: [`Signs`](super::stationary::Signs) in lanes.
struct Signs<const N: usize> {
    from_zero: LaneMask<N>,
    positive: LaneMask<N>,
    /// The changes of sign, and where the points tell of no more.
    changes: [Change<N>; 2],
    told: LaneMask<N>,
    points: [Lanes<N>; TERMS],
}

/// A change of sign between two control points.
#[derive(Clone, Copy)]
struct Change<const N: usize> {
    exists: LaneMask<N>,
    /// The number of the second of the points, and both.
    number: Lanes<N>,
    last: Lanes<N>,
    next: Lanes<N>,
}

/// Zeros of slopes between ends, from points inside; the slopes' slopes there.
struct Refined<const N: usize> {
    place: Lanes<N>,
    steepness: Lanes<N>,
    found: LaneMask<N>,
}

impl<const N: usize> LaneStationary<N> {
    /// The zeros of the slopes, increasing, in units of the lengths.
    #[inline(always)]
    pub(super) fn isolate(
        &mut self,
        slope: &[Lanes<N>],
        length: Lanes<N>,
        wanted: LaneMask<N>,
    ) -> Turning<N> {
        let size = sizes(slope, length);
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let moves = zero.is_below(size) & size.is_below(Lanes::splat(f64::INFINITY));
        let wanted = wanted & moves;
        let count = self.scale(slope, length, Lanes::splat(1e-18) * size);
        let left_out = sizes(&self.scaled[TERMS..], one) + Lanes::splat(ROUNDING) * size;
        let signs = self.signs(left_out);
        let [first, second] = signs.changes;
        let mut told = wanted & signs.told;
        let divided = told & (second.exists | (signs.from_zero & first.exists));
        let mut middle = zero;
        if divided.any() {
            middle = signs.middle();
            let value = polynomial::value(&self.scaled, middle);
            let is_positive =
                (signs.from_zero & signs.positive) | !(signs.from_zero | signs.positive);
            let above = Lanes::select(is_positive, value, -value);
            told &= !divided | (left_out + left_out).is_below(above);
        }
        let at_start = told & signs.from_zero & !signs.positive;
        let mut turning = Turning {
            places: [zero; 2],
            found: [at_start, LaneMask::NONE],
            open: wanted & !told,
        };
        for (index, change) in signs.changes.iter().enumerate() {
            let turns = told & change.exists;
            if !turns.any() {
                break;
            }
            let (after, before, falling) = match index {
                0 => (signs.from_zero, second.exists, signs.positive),
                _ => (turns, LaneMask::NONE, !signs.positive),
            };
            let ends = [
                Lanes::select(after, middle, zero),
                Lanes::select(before, middle, one),
            ];
            let refined = self.refine(ends, change.place(), falling, turns);
            let steep = refined.found & self.is_steep(refined.steepness.abs(), left_out, count);
            turning.open |= turns & !steep;
            turning.put(steep, refined.place);
        }
        turning
    }

    /// Fills the coefficients in units of the steps, zeros for the last ones where they are below
    /// `negligible`; how many are left.
    #[inline(always)]
    fn scale(&mut self, slope: &[Lanes<N>], length: Lanes<N>, negligible: Lanes<N>) -> Lanes<N> {
        let square = length * length;
        let mut powers = [Lanes::splat(1.0), length, square, square * length];
        self.scaled.resize(slope.len(), length);
        for (chunk, out) in slope.chunks(4).zip(self.scaled.chunks_mut(4)) {
            for ((&coefficient, power), out) in chunk.iter().zip(&mut powers).zip(out) {
                *out = coefficient * *power;
                *power *= square * square;
            }
        }
        let (zero, mut count) = (Lanes::splat(0.0), Lanes::splat(2.0));
        let mut beyond = !LaneMask::NONE;
        for (degree, coefficient) in self.scaled.iter_mut().enumerate().skip(2).rev() {
            let is_last = beyond & negligible.is_at_most(coefficient.abs());
            count = Lanes::select(is_last, Lanes::splat((degree + 1) as f64), count);
            beyond &= !is_last;
            if !beyond.any() {
                break;
            }
            *coefficient = Lanes::select(beyond, zero, *coefficient);
        }
        count
    }

    /// What the control points of the first terms tell, where they are larger than what is left
    /// out.
    #[inline(always)]
    fn signs(&self, left_out: Lanes<N>) -> Signs<N> {
        let (zero, none) = (Lanes::splat(0.0), LaneMask::NONE);
        let mut first = [zero; TERMS];
        first.copy_from_slice(&self.scaled[..TERMS]);
        let points = control_points(&first);
        let from_zero = points[0].is_equal(zero);
        let positive = zero.is_below(Lanes::select(from_zero, points[1], points[0]));
        let change = Change {
            exists: none,
            number: zero,
            last: zero,
            next: zero,
        };
        let mut signs = Signs {
            from_zero,
            positive,
            changes: [change; 2],
            told: !none,
            points,
        };
        let (mut above, mut last) = (positive, points[0]);
        for (index, &point) in points.iter().enumerate() {
            let (rises, falls) = (left_out.is_below(point), point.is_below(-left_out));
            let counts = if index > 0 { !none } else { !from_zero };
            signs.told &= rises | falls | !counts;
            let changes = counts & ((rises & !above) | (falls & above));
            let [first, second] = &mut signs.changes;
            signs.told &= !(changes & (second.exists | (first.exists & from_zero)));
            second.take(changes & first.exists, index, [last, point]);
            first.take(changes & !first.exists, index, [last, point]);
            above = (above & !changes) | (rises & changes);
            last = point;
        }
        signs
    }

    /// Zeros between ends from points inside.
    #[inline(always)]
    fn refine(
        &self,
        ends: [Lanes<N>; 2],
        start: Lanes<N>,
        falling: LaneMask<N>,
        wanted: LaneMask<N>,
    ) -> Refined<N> {
        let tolerance = Lanes::splat(LAST_STEP) * ends[1];
        let mut search = LaneNewton::new(ends, falling, start, tolerance);
        let mut refined = Refined {
            place: start,
            steepness: start,
            found: LaneMask::NONE,
        };
        let mut going = wanted;
        for _ in 0..MAX_NEWTON {
            let (value, slope) = polynomial::value_and_slope(&self.scaled, search.at);
            let step = search.advance(value, slope);
            let settled = going & step.settled;
            refined.place = Lanes::select(settled, step.next, refined.place);
            refined.steepness = Lanes::select(settled, slope, refined.steepness);
            refined.found |= settled;
            going &= !step.settled & !step.open;
            if !going.any() {
                break;
            }
            Lanes::<N>::carried(&mut search);
        }
        refined
    }

    /// Whether zeros with these slopes have no others beside them, whatever terms up to a bound add
    /// to the first ones.
    #[inline(always)]
    fn is_steep(&mut self, slope: Lanes<N>, left_out: Lanes<N>, count: Lanes<N>) -> LaneMask<N> {
        let (mut twice, mut factor) = (0.0, 0.0);
        self.bends.clear();
        for &coefficient in self.scaled.iter().skip(2) {
            twice += 2.0;
            factor += twice;
            self.bends.push(Lanes::splat(factor) * coefficient);
        }
        let bound = sizes(&self.bends, Lanes::splat(1.0));
        let eight = Lanes::splat(8.0);
        (eight * bound * left_out).is_below(slope * slope)
            & (eight * count * left_out).is_below(slope)
    }
}

impl<const N: usize> Turning<N> {
    /// Puts further zeros, larger ones.
    #[inline(always)]
    fn put(&mut self, wanted: LaneMask<N>, place: Lanes<N>) {
        let second = wanted & self.found[0];
        self.places = [
            Lanes::select(wanted & !second, place, self.places[0]),
            Lanes::select(second, place, self.places[1]),
        ];
        self.found[0] |= wanted;
        self.found[1] |= second;
    }
}

impl<const N: usize> Signs<N> {
    /// Where the control points between two zeros are largest, the start being one.
    #[inline(always)]
    fn middle(&self) -> Lanes<N> {
        let [first, second] = &self.changes;
        let one = Lanes::splat(1.0);
        let from = Lanes::select(self.from_zero, one, first.number);
        let until = Lanes::select(self.from_zero, first.number, second.number);
        let (mut largest, mut middle) = (Lanes::splat(0.0), from);
        for (index, point) in self.points.iter().enumerate() {
            let number = Lanes::splat(index as f64);
            let size = point.abs();
            let larger = from.is_at_most(number) & number.is_below(until) & largest.is_below(size);
            largest = Lanes::select(larger, size, largest);
            middle = Lanes::select(larger, number, middle);
        }
        middle / Lanes::splat((TERMS - 1) as f64)
    }
}

impl<const N: usize> Change<N> {
    #[inline(always)]
    fn take(&mut self, wanted: LaneMask<N>, index: usize, [last, next]: [Lanes<N>; 2]) {
        self.exists |= wanted;
        self.number = Lanes::select(wanted, Lanes::splat(index as f64), self.number);
        self.last = Lanes::select(wanted, last, self.last);
        self.next = Lanes::select(wanted, next, self.next);
    }

    /// About where the polynomial is zero.
    #[inline(always)]
    fn place(&self) -> Lanes<N> {
        let place = self.number - self.next / (self.next - self.last);
        place / Lanes::splat((TERMS - 1) as f64)
    }
}
