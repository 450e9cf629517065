//! Zeros at which a series falls, by parabolas about one point after another, and polished in other
//! numbers.
//!
//! One idea: near a graze a gap is a parabola, whose zeros are known, where Newton's method from
//! far away is slow.

use super::newton::{MAX_NEWTON, Zero};
use crate::numeric::{Branched, Mask, Scalar, polynomial};

/// Share of the reach of a node, and of a slope, within which a zero is known when it is to be
/// polished.
const CLOSE: f64 = 1e-4;

/// A zero at which a series falls, to `f64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearZero<S: Branched> {
    /// Its time, or where the search left the node.
    time: S,
    slope: S,
    curvature: S,
    /// A bound of the third derivative.
    third: S,
    /// A bound of the error of the time.
    error: S,
    /// Where it is one.
    found: S::Mask,
}

/// The zero within reach of a node at which a series falls, by parabolas about one point after
/// another, first about the node; from a guess where that one has no zero near. Where the search
/// left the node, if it did.
///
/// With `g`, `g'`, `g''` at a point the next is `s = 2 g / (√(g'² − 2 g g'') − g')` further, with
/// an error of `g''' s³ / 6` over the speed there: near a graze, where the gap is a parabola, no
/// more than elsewhere.
#[inline(always)]
pub(super) fn falling_zero<S: Branched>(
    series: &[S],
    guess: S,
    reach: S,
    wanted: S::Mask,
) -> NearZero<S> {
    let number = S::from_f64;
    let [c0, c1, c2, c3, c4, c5] =
        std::array::from_fn(|k| series.get(k).copied().unwrap_or(S::zero()));
    let third = number(6.0) * c3.abs()
        + reach * (number(24.0) * c4.abs() + reach * number(60.0) * c5.abs());
    let size = c0.abs() + reach * (c1.abs() + reach * c2.abs());
    let rounding = number(4.0 * f64::EPSILON) * size;
    let close = number(CLOSE) * reach;
    let (start, _) = parabola(c0, c1, number(2.0) * c2);
    let is_near = start.abs().is_at_most(number(2.0) * reach);
    let mut zero = NearZero {
        time: S::select(is_near, start, guess),
        slope: c1,
        curvature: c2,
        third,
        error: size,
        found: S::Mask::NONE,
    };
    let mut going = wanted;
    for _ in 0..MAX_NEWTON {
        let time = zero.time;
        let (value, slope) = polynomial::value_and_slope(series, time);
        let bend = number(6.0) * c3 + time * (number(12.0) * c4 + time * number(20.0) * c5);
        let curvature = number(2.0) * c2 + time * bend;
        let (step, speed) = parabola(value, slope, curvature);
        let size = step.abs();
        let error = (third * (size * size * size) / number(6.0) + rounding) / speed;
        let select = |one, other| S::select(going, one, other);
        zero.time = select(time + step, time);
        zero.slope = select(-speed, zero.slope);
        zero.curvature = select(curvature, zero.curvature);
        zero.error = select(error, zero.error);
        let is_near = zero.time.abs().is_at_most(reach);
        let bent = (curvature.abs() + third * reach) * error;
        let is_close = error.is_at_most(close) & bent.is_at_most(number(CLOSE) * speed);
        zero.found |= going & is_near & is_close;
        going &= is_near & !is_close;
        if !going.any() {
            break;
        }
        S::carried(&mut zero);
    }
    zero
}

impl<R: Branched<Rounded = R>> NearZero<R> {
    /// The same to the rounding of other numbers, by Newton's method: a step takes one value, for
    /// the slope is known.
    #[inline(always)]
    pub(super) fn polished<S>(self, series: &[S], reach: R) -> Zero<S>
    where
        S: Branched<Rounded = R, Mask = R::Mask>,
    {
        let slope = S::from_rounded(self.slope);
        let limit = R::from_f64(0.25 * S::ROUNDOFF) * reach;
        let bend = self.curvature.abs() + self.third * self.error;
        let bend = bend * self.error / self.slope.abs() + R::from_f64(f64::EPSILON);
        let (mut time, mut error) = (S::from_rounded(self.time), self.error);
        let (mut going, mut found) = (self.found, R::Mask::NONE);
        for _ in 0..MAX_NEWTON {
            let done = error.is_at_most(limit);
            found |= going & done;
            going &= !done;
            if !going.any() {
                break;
            }
            let next = time - polynomial::value(series, time) / slope;
            time = S::select(going, next, time);
            error = R::select(going, error * bend, error);
            R::carried(&mut time);
            R::carried(&mut error);
        }
        Zero { time, slope, found }
    }
}

/// From a point to where the parabola with this value, slope and curvature falls through zero, and
/// its speed there.
#[inline(always)]
fn parabola<S: Scalar>(value: S, slope: S, curvature: S) -> (S, S) {
    let two = S::from_f64(2.0);
    let speed = (slope * slope - two * value * curvature).sqrt();
    (two * value / (speed - slope), speed)
}
