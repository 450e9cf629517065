//! The stationary point of gaps in a step, in lanes: [`StationaryPoints`](super::stationary::StationaryPoints) where control
//! points tell that there is one, or none.

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
    /// The zeros, in units of the steps.
    pub(super) place: Lanes<N>,
    /// Where there is one, and no other.
    pub(super) found: LaneMask<N>,
    /// Where nothing is known.
    pub(super) open: LaneMask<N>,
}

/// Where the control points of slopes change sign.
struct Signs<const N: usize> {
    /// About where the slopes are zero.
    place: Lanes<N>,
    falling: LaneMask<N>,
    /// Where there is one change of sign, and where the points tell of no more.
    change: LaneMask<N>,
    told: LaneMask<N>,
    /// Where slopes that start at zero change their sign there.
    from_zero: LaneMask<N>,
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
        let moves = Lanes::splat(0.0).is_below(size) & size.is_below(Lanes::splat(f64::INFINITY));
        let wanted = wanted & moves;
        let count = self.scale(slope, length, Lanes::splat(1e-18) * size);
        let one = Lanes::splat(1.0);
        let left_out = sizes(&self.scaled[TERMS..], one) + Lanes::splat(ROUNDING) * size;
        let signs = self.signs(left_out);
        let (told, turning) = (wanted & signs.told, wanted & signs.told & signs.change);
        let mut zero = Turning {
            place: signs.place,
            found: told & signs.from_zero,
            open: wanted & !told,
        };
        if turning.any() {
            let (slope, settled) = self.refine(&mut zero.place, signs.falling, turning);
            let steep = settled & self.is_steep(slope.abs(), left_out, count);
            zero.found |= steep;
            zero.open |= turning & !steep;
        }
        zero
    }

    /// Fills the coefficients in units of the steps, zeros for the last ones where they are below `negligible`; how many
    /// are left.
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

    /// What the control points of the first terms tell, where they are larger than what is left out.
    #[inline(always)]
    fn signs(&self, left_out: Lanes<N>) -> Signs<N> {
        let zero = Lanes::splat(0.0);
        let mut first = [zero; TERMS];
        first.copy_from_slice(&self.scaled[..TERMS]);
        let points = control_points(&first);
        let falling = zero.is_below(points[0]);
        let (mut before, mut next, mut last) = (zero, zero, points[0]);
        let (mut same, mut told) = (!LaneMask::NONE, !LaneMask::NONE);
        let (mut rises, mut falls) = (points[0].is_equal(zero), points[0].is_equal(zero));
        for (index, &point) in points.iter().enumerate() {
            let (above, below) = (left_out.is_below(point), point.is_below(-left_out));
            let here = (above & falling) | (below & !falling);
            let other = (below & falling) | (above & !falling);
            if index > 0 {
                rises &= above;
                falls &= below;
            }
            let change = same & !here;
            same &= here;
            told &= same | other;
            next = Lanes::select(change, point, next);
            before = Lanes::select(change, Lanes::splat(index as f64), before);
            last = Lanes::select(same, point, last);
        }
        let place = (before - next / (next - last)) / Lanes::splat((TERMS - 1) as f64);
        Signs {
            place: Lanes::select(falls, zero, place),
            falling,
            change: !same & !rises & !falls,
            told: told | rises | falls,
            from_zero: falls,
        }
    }

    /// Puts zeros in the place of guesses; the slopes there, and where they were found.
    #[inline(always)]
    fn refine(
        &self,
        place: &mut Lanes<N>,
        falling: LaneMask<N>,
        wanted: LaneMask<N>,
    ) -> (Lanes<N>, LaneMask<N>) {
        let ends = [0.0, 1.0].map(Lanes::splat);
        let mut search = LaneNewton::new(ends, falling, *place, LAST_STEP);
        let (mut going, mut found, mut steepness) = (wanted, LaneMask::NONE, ends[0]);
        for _ in 0..MAX_NEWTON {
            let (value, slope) = polynomial::value_and_slope(&self.scaled, search.at);
            let step = search.advance(value, slope);
            let settled = going & step.settled;
            *place = Lanes::select(settled, step.next, *place);
            steepness = Lanes::select(settled, slope, steepness);
            found |= settled;
            going &= !step.settled & !step.open;
            if !going.any() {
                break;
            }
            Lanes::<N>::carried(&mut search);
        }
        (steepness, found)
    }

    /// Whether zeros with these slopes have no others beside them, whatever terms up to a bound add to the first ones.
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
