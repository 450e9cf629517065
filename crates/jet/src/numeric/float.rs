//! The machine's numbers, `f64` and `f32`, as scalars.
//!
//! The sine and cosine, of one number or of lanes, have the same bits on every machine. Arguments
//! are reduced by multiples of `π/2` in three parts, and the polynomials on `[−π/4, π/4]` are those
//! of fdlibm (Sun Microsystems 1993, `k_sin.c` and `k_cos.c`), summed in pairs. The reduced
//! argument keeps two parts. Quarter turns act on bits, without branches.

use std::f64::consts::FRAC_2_PI;

use super::scalar::inherent;
use super::{Branched, Dd, Mask, Real, Scalar};

macro_rules! float {
    ($float:ident) => {
        impl Scalar for $float {
            const ROUNDOFF: f64 = $float::EPSILON as f64 / 2.0;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $float
            }

            #[inline(always)]
            fn from_dd(value: Dd) -> Self {
                value.hi as $float
            }

            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                if cfg!(target_feature = "fma") {
                    $float::mul_add(self, a, b)
                } else {
                    self * a + b
                }
            }

            inherent!($float: sqrt(), exp(), ln(), asin(), acos(), atan(), atan2(x), tanh());
            inherent!($float: powf(exponent), abs(), min(other), max(other));

            fn sin_cos(self) -> (Self, Self) {
                let (sine, cosine) = sin_cos(f64::from(self));
                (sine as $float, cosine as $float)
            }

            fn sinh_cosh(self) -> (Self, Self) {
                (self.sinh(), self.cosh())
            }

            /// `0` at zero, unlike the inherent function; NaN stays NaN.
            #[inline(always)]
            fn signum(self) -> Self {
                if self == 0.0 {
                    0.0
                } else {
                    $float::signum(self)
                }
            }

            #[inline(always)]
            fn magnitude(self) -> f64 {
                f64::from($float::abs(self))
            }

            #[inline(always)]
            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }
        }

        impl Real for $float {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn to_dd(self) -> Dd {
                Dd::from(f64::from(self))
            }

            #[inline(always)]
            fn floor(self) -> Self {
                $float::floor(self)
            }
        }
    };
}

float!(f64);
float!(f32);

/// Floating-point format in which a map is run.
///
/// ```
/// use grazemap_jet::numeric::FloatFormat;
/// assert_eq!(FloatFormat::F32.to_string(), "f32");
/// assert_eq!(FloatFormat::F32.roundoff(), 2f64.powi(-24));
/// ```
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum FloatFormat {
    /// Single precision: 24 bits, half the memory, twice as many lanes.
    F32,
    /// Double precision: 53 bits.
    #[default]
    F64,
}

impl FloatFormat {
    /// Unit roundoff: half the distance from 1 to the next number.
    pub fn roundoff(self) -> f64 {
        match self {
            Self::F32 => f32::ROUNDOFF,
            Self::F64 => f64::ROUNDOFF,
        }
    }
}

impl std::fmt::Display for FloatFormat {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}

/// Largest argument that is reduced in three parts: the products with the first two are exact.
const LARGEST: f64 = 1e5;

/// `π/2` in three parts, the first two of 33 bits.
const HALF_PI: [f64; 3] = [
    f64::from_bits(0x3FF9_21FB_5440_0000),
    f64::from_bits(0x3DD0_B461_1A60_0000),
    f64::from_bits(0x3BA3_198A_2E03_7073),
];

/// Constant whose addition to a number rounds the number to an integer, left in the last bits.
const ROUNDING: f64 = 1.5 / f64::EPSILON;

/// `(sin x − x)/x³` in powers of `x²`.
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// `(cos x − 1 + x²/2)/x⁴` in powers of `x²`.
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Doubles, one or in lanes, with access to their bits.
pub(super) trait Quartered: Branched {
    /// Sine and cosine after a number of quarter turns, given by the last bits of `quarters`.
    fn turned(quarters: Self, sine: Self, cosine: Self) -> (Self, Self);
    /// Applies a function with two results to each double.
    fn each(self, function: fn(f64) -> (f64, f64)) -> (Self, Self);
}

impl Quartered for f64 {
    #[inline(always)]
    fn turned(quarters: f64, sine: f64, cosine: f64) -> (f64, f64) {
        let (quarters, sine, cosine) = (quarters.to_bits(), sine.to_bits(), cosine.to_bits());
        let is_odd = (quarters & 1).wrapping_neg();
        let exchanged = (sine ^ cosine) & is_odd;
        let sign = |quarters: u64| (quarters & 2) << 62;
        (
            f64::from_bits(sine ^ exchanged ^ sign(quarters)),
            f64::from_bits(cosine ^ exchanged ^ sign(quarters.wrapping_add(1))),
        )
    }

    #[inline(always)]
    fn each(self, function: fn(f64) -> (f64, f64)) -> (f64, f64) {
        function(self)
    }
}

/// Sine and cosine, within one unit in the last place (the largest error found is 0.86); NaN for
/// infinities.
///
/// Arguments above `1e5` are computed in double-double, which takes twenty times as long, and those
/// above `1e14` by the platform.
#[inline(always)]
pub(super) fn sin_cos<S: Quartered>(x: S) -> (S, S) {
    let is_near = x.abs().is_at_most(S::from_f64(LARGEST));
    let near = near(x);
    if (!is_near).any() {
        let far = x.each(far);
        let chosen = |near, far| S::select(is_near, near, far);
        return (chosen(near.0, far.0), chosen(near.1, far.1));
    }
    near
}

/// Sine and cosine of arguments that are reduced in three parts.
#[inline(always)]
fn near<S: Quartered>(x: S) -> (S, S) {
    let (one, half) = (S::one(), S::from_f64(0.5));
    let quarters = x * S::from_f64(FRAC_2_PI) + S::from_f64(ROUNDING);
    let turns = quarters - S::from_f64(ROUNDING);
    let [first, second, third] = HALF_PI.map(|part| turns * S::from_f64(part));
    let partly = x - first;
    let y = partly - second;
    let tail = partly - y - second - third;
    let square = y * y;
    let cube = square * y;
    let [lead, higher @ ..] = SINE;
    let correction = square * (half * tail - cube * polynomial(&higher, square)) - tail;
    let sine = y - (correction - cube * S::from_f64(lead));
    let fourth = square * polynomial(&COSINE, square);
    let rough = one - half * square;
    let cosine = rough + ((one - rough - half * square) + (square * fourth - y * tail));
    S::turned(quarters, sine, cosine)
}

/// Value of a polynomial, summed in pairs of terms that do not depend on each other.
#[inline(always)]
fn polynomial<S: Quartered>(coefficients: &[f64], x: S) -> S {
    let square = x * x;
    let mut sum = S::zero();
    for pair in coefficients.chunks(2).rev() {
        let pair = match *pair {
            [one, other] => x.mul_add(S::from_f64(other), S::from_f64(one)),
            _ => S::from_f64(pair[0]),
        };
        sum = sum.mul_add(square, pair);
    }
    sum
}

#[cold]
#[inline(never)]
fn far(x: f64) -> (f64, f64) {
    let (sine, cosine) = Dd::from(x).sin_cos();
    if cosine.is_nan() {
        return x.sin_cos();
    }
    (sine.hi, cosine.hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{Lanes, Scalar};
    use std::f64::consts::FRAC_PI_2;

    /// Distance of sine and cosine from those of double-double, in units in the last place.
    fn units(x: f64) -> f64 {
        let (sine, cosine) = sin_cos(x);
        let exact = Dd::from(x).sin_cos();
        let unit = |value: f64| value.abs().next_up() - value.abs();
        let distance = |value: f64, exact: Dd| (Dd::from(value) - exact).abs().hi / unit(exact.hi);
        distance(sine, exact.0).max(distance(cosine, exact.1))
    }

    /// Numbers of `[0, 1)` that are spread evenly.
    fn shares(count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(|number| (number as f64 * 0.618_033_988_749_894_9).fract())
    }

    #[test]
    fn sine_and_cosine_are_within_one_unit_in_the_last_place_of_those_of_double_doubles() {
        let mut worst = 0.0_f64;
        for scale in [1e-9, 1e-3, 0.8, 3.2, 30.0, 1e3, 1e5, LARGEST, 1e9, 1e14] {
            for share in shares(40_000) {
                worst = worst.max(units(scale * share)).max(units(-scale * share));
            }
        }
        assert!(worst < 1.0, "{worst}");
    }

    #[test]
    fn the_same_holds_next_to_every_multiple_of_a_quarter_turn() {
        let mut worst = 0.0_f64;
        for multiple in 0..(LARGEST / FRAC_PI_2) as i32 {
            let x = f64::from(multiple) * FRAC_PI_2;
            for x in [x, x.next_up(), x.next_down(), x + 1e-9 * (x + 1.0)] {
                worst = worst.max(units(x));
            }
        }
        assert!(worst < 1.0, "{worst}");
    }

    #[test]
    fn the_same_holds_where_quadrants_meet() {
        let mut worst = 0.0_f64;
        for (multiple, share) in (0..200_000).zip(shares(200_000)) {
            let x = (f64::from(multiple) + 0.5) * FRAC_PI_2;
            for x in [x.next_down(), x, x.next_up(), x + 1e-3 * (share - 0.5)] {
                worst = worst.max(units(x));
            }
        }
        assert!(worst < 1.0, "{worst}");
    }

    #[test]
    fn every_lane_has_the_bits_of_one_number() {
        let bits = |(sine, cosine): (f64, f64)| [sine.to_bits(), cosine.to_bits()];
        for scale in [1.0, 1e3, 4e6, 1e15] {
            for share in shares(2000) {
                let x = Lanes([1.0, -2.0, 1e-3, -1e-160, 0.3, f64::NAN, -0.0, 7.0])
                    * Lanes::splat(scale * share);
                let (sine, cosine) = x.sin_cos();
                for lane in 0..8 {
                    let alone = bits(Scalar::sin_cos(x[lane]));
                    assert_eq!(bits((sine[lane], cosine[lane])), alone, "{}", x[lane]);
                }
            }
        }
    }

    #[test]
    fn zeros_keep_their_sign_small_numbers_their_value_and_what_is_not_finite_has_no_sine() {
        for x in [0.0, -0.0, 5e-324, -1e-310, 1e-200] {
            assert_eq!(sin_cos(x).0.to_bits(), f64::to_bits(x));
            assert_eq!(sin_cos(x).1, 1.0);
        }
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(sin_cos(x).0.is_nan() && sin_cos(x).1.is_nan());
        }
        assert_eq!(sin_cos(3e22), 3e22_f64.sin_cos());
    }
}
