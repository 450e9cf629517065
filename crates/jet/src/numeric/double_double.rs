//! Double-double numbers: an unevaluated sum of two doubles, about 32 decimal digits.
//!
//! The one idea: the rounding error of a sum or product of two doubles is itself a double, so
//! carrying it along doubles the precision. Error bounds below are those of Joldes, Muller and
//! Popescu (2017), *Tight and rigorous error bounds for basic building blocks of double-word
//! arithmetic*; `u = 2^-53`.
//!
//! Infinite and NaN values carry `lo = 0` and propagate as in `f64`. Near the ends of the exponent
//! range (beyond about `1e290`, or below `1e-290`) the trailing part degrades to `f64` accuracy.

mod decimal;
mod functions;

use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use super::scalar::inherent;
use super::{Real, Scalar, Vectorised};

pub use decimal::ParseDdError;

/// An unevaluated sum `hi + lo` of two doubles: about 32 decimal digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dd {
    /// Leading part: the sum rounded to `f64`.
    pub hi: f64,
    /// Trailing part, at most half a unit in the last place of `hi`.
    pub lo: f64,
}

impl Dd {
    /// Zero.
    pub const ZERO: Dd = Dd::exact(0.0);
    /// One.
    pub const ONE: Dd = Dd::exact(1.0);
    /// Not a number.
    pub const NAN: Dd = Dd::exact(f64::NAN);
    /// Positive infinity.
    pub const INFINITY: Dd = Dd::exact(f64::INFINITY);
    /// The circle constant `pi`.
    pub const PI: Dd = Dd { hi: std::f64::consts::PI, lo: 1.2246467991473532e-16 };
    /// `2 pi`: the period of a forcing in its phase.
    pub const TWO_PI: Dd = Dd { hi: std::f64::consts::TAU, lo: 2.4492935982947064e-16 };
    /// `pi / 2`.
    pub const FRAC_PI_2: Dd = Dd { hi: std::f64::consts::FRAC_PI_2, lo: 6.123233995736766e-17 };
    /// `pi / 4`.
    pub const FRAC_PI_4: Dd = Dd { hi: std::f64::consts::FRAC_PI_4, lo: 3.061616997868383e-17 };
    /// `ln 2`.
    pub const LN_2: Dd = Dd { hi: std::f64::consts::LN_2, lo: 2.3190468138462996e-17 };
    /// `ln 10`.
    pub const LN_10: Dd = Dd { hi: std::f64::consts::LN_10, lo: -2.1707562233822494e-16 };
    /// Euler's number `e`.
    pub const E: Dd = Dd { hi: std::f64::consts::E, lo: 1.4456468917292502e-16 };
    /// `sqrt 2`.
    pub const SQRT_2: Dd = Dd { hi: std::f64::consts::SQRT_2, lo: -9.667293313452913e-17 };

    /// The sum of two doubles, renormalised: `hi` becomes the sum rounded to `f64`.
    pub fn new(hi: f64, lo: f64) -> Dd {
        let (sum, error) = two_sum(hi, lo);
        Dd::guarded(sum, error)
    }

    /// The nearest `f64`.
    pub const fn to_f64(self) -> f64 {
        self.hi
    }

    /// Whether the number is neither infinite nor NaN.
    pub const fn is_finite(self) -> bool {
        self.hi.is_finite()
    }

    /// Whether the number is NaN.
    pub const fn is_nan(self) -> bool {
        self.hi.is_nan()
    }

    /// Absolute value.
    pub fn abs(self) -> Dd {
        if self.hi.is_sign_negative() { -self } else { self }
    }

    /// Largest integer not above the number.
    pub fn floor(self) -> Dd {
        let hi = self.hi.floor();
        if hi == self.hi && hi.is_finite() {
            let (hi, lo) = fast_two_sum(hi, self.lo.floor());
            Dd { hi, lo }
        } else {
            Dd::exact(hi)
        }
    }

    /// The product with `2^exponent`, exact except for overflow and underflow.
    pub fn scaled_by_power_of_two(self, exponent: i32) -> Dd {
        let half = power_of_two(exponent / 2);
        let rest = power_of_two(exponent - exponent / 2);
        Dd::guarded(self.hi * half * rest, self.lo * half * rest)
    }

    /// A double as a double-double.
    const fn exact(hi: f64) -> Dd {
        Dd { hi, lo: 0.0 }
    }

    /// The pair, with the trailing part dropped if the leading one is infinite or NaN.
    #[inline]
    const fn guarded(hi: f64, lo: f64) -> Dd {
        let lo = if hi.is_finite() { lo } else { 0.0 };
        Dd { hi, lo }
    }
}

impl From<f64> for Dd {
    fn from(value: f64) -> Dd {
        Dd::exact(value)
    }
}

/// `a + b` rounded, and the error of that rounding, for any `a` and `b`.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_seen = sum - a;
    let a_seen = sum - b_seen;
    (sum, (a - a_seen) + (b - b_seen))
}

/// `a + b` rounded, and the error of that rounding, for `|a| >= |b|` or `a = 0`.
#[inline(always)]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// `a b` rounded, and the error of that rounding.
///
/// A fused multiply-add is used only if the machine has one: otherwise the function call would cost
/// far more than Dekker's splitting.
#[inline(always)]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let error = if cfg!(target_feature = "fma") {
        a.mul_add(b, -product)
    } else {
        let (a_high, a_low) = split(a);
        let (b_high, b_low) = split(b);
        ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    };
    (product, error)
}

/// Veltkamp's splitting of a double into two halves of at most 26 bits.
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    const FACTOR: f64 = 134_217_729.0;
    let scaled = FACTOR * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// `2^exponent` for exponents of normal numbers; `0` below and infinity above.
fn power_of_two(exponent: i32) -> f64 {
    match exponent {
        ..=-1023 => 0.0,
        1024.. => f64::INFINITY,
        _ => f64::from_bits(((exponent + 1023) as u64) << 52),
    }
}

/// The exponent `e` with `2^e <= |a| < 2^(e+1)` for normal numbers, `-1023` for zero and
/// subnormals.
fn binary_exponent(a: f64) -> i32 {
    ((a.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

impl Dd {
    /// Square root, with relative error below `25/8 u^2`; NaN for negative numbers.
    pub fn sqrt(self) -> Dd {
        let root = self.hi.sqrt();
        if root == 0.0 || !root.is_finite() {
            return Dd::exact(root);
        }
        let (square, error) = two_product(root, root);
        let remainder = ((self.hi - square) - error) + self.lo;
        finished(root, remainder / (2.0 * root), root)
    }

    /// Integer power by repeated squaring; the relative error grows as `|exponent| u^2`.
    pub fn powi(self, exponent: i32) -> Dd {
        let mut result = Dd::ONE;
        let mut square = self;
        let mut remaining = exponent.unsigned_abs();
        while remaining > 0 {
            if remaining & 1 == 1 {
                result *= square;
            }
            remaining >>= 1;
            if remaining > 0 {
                square *= square;
            }
        }
        if exponent < 0 { Dd::ONE / result } else { result }
    }

    /// The product with a double, with relative error below `2 u^2`.
    #[inline]
    fn times_f64(self, factor: f64) -> Dd {
        let (product, error) = two_product(self.hi, factor);
        finished(product, error + self.lo * factor, product)
    }
}

/// The renormalised pair, or `plain` alone if the pair is infinite or NaN.
#[inline(always)]
fn finished(high: f64, low: f64, plain: f64) -> Dd {
    let (hi, lo) = fast_two_sum(high, low);
    if lo.is_finite() && hi.is_finite() { Dd { hi, lo } } else { Dd { hi: plain, lo: 0.0 } }
}

impl Neg for Dd {
    type Output = Dd;

    #[inline]
    fn neg(self) -> Dd {
        Dd { hi: -self.hi, lo: -self.lo }
    }
}

/// Relative error below `3 u^2`, also under cancellation.
impl Add for Dd {
    type Output = Dd;

    #[inline]
    fn add(self, other: Dd) -> Dd {
        let (high, high_error) = two_sum(self.hi, other.hi);
        let (low, low_error) = two_sum(self.lo, other.lo);
        let (middle, middle_error) = fast_two_sum(high, high_error + low);
        finished(middle, low_error + middle_error, high)
    }
}

impl Sub for Dd {
    type Output = Dd;

    #[inline]
    fn sub(self, other: Dd) -> Dd {
        self + -other
    }
}

/// Relative error below `5 u^2`.
impl Mul for Dd {
    type Output = Dd;

    #[inline]
    fn mul(self, other: Dd) -> Dd {
        let (product, error) = two_product(self.hi, other.hi);
        let cross = self.hi * other.lo + self.lo * other.hi;
        finished(product, error + cross, product)
    }
}

/// Relative error below `15 u^2`.
impl Div for Dd {
    type Output = Dd;

    #[inline]
    fn div(self, other: Dd) -> Dd {
        let quotient = self.hi / other.hi;
        let product = other.times_f64(quotient);
        let remainder = (self.hi - product.hi) + (self.lo - product.lo);
        finished(quotient, remainder / other.hi, quotient)
    }
}

macro_rules! assign {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Dd {
            #[inline]
            fn $method(&mut self, other: Dd) {
                *self = *self $operator other;
            }
        }
    };
}

assign!(AddAssign, add_assign, +);
assign!(SubAssign, sub_assign, -);
assign!(MulAssign, mul_assign, *);
assign!(DivAssign, div_assign, /);

impl Sum for Dd {
    fn sum<I: Iterator<Item = Dd>>(terms: I) -> Dd {
        terms.fold(Dd::ZERO, Add::add)
    }
}

impl PartialOrd for Dd {
    #[inline]
    fn partial_cmp(&self, other: &Dd) -> Option<Ordering> {
        match self.hi.partial_cmp(&other.hi) {
            Some(Ordering::Equal) => self.lo.partial_cmp(&other.lo),
            unequal => unequal,
        }
    }
}

impl Zero for Dd {
    fn zero() -> Dd {
        Dd::ZERO
    }

    fn is_zero(&self) -> bool {
        self.hi == 0.0
    }
}

impl One for Dd {
    fn one() -> Dd {
        Dd::ONE
    }
}

impl Scalar for Dd {
    const ROUNDOFF: f64 = f64::EPSILON * f64::EPSILON / 4.0;

    fn from_f64(value: f64) -> Self {
        Dd::from(value)
    }

    fn from_dd(value: Dd) -> Self {
        value
    }

    #[inline]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }

    inherent!(Dd: sqrt(), exp(), ln(), asin(), acos(), atan(), atan2(x), tanh(), powf(exponent));
    inherent!(Dd: abs());

    fn sin_cos(self) -> (Self, Self) {
        Dd::sin_cos(self)
    }

    fn sinh_cosh(self) -> (Self, Self) {
        Dd::sinh_cosh(self)
    }

    fn signum(self) -> Self {
        Dd::from(Scalar::signum(self.hi))
    }

    fn min(self, other: Self) -> Self {
        if other < self || self.is_nan() { other } else { self }
    }

    fn max(self, other: Self) -> Self {
        if other > self || self.is_nan() { other } else { self }
    }

    fn magnitude(self) -> f64 {
        self.hi.abs()
    }

    fn is_finite(self) -> bool {
        Dd::is_finite(self)
    }

    #[inline(always)]
    fn dispatch<W: Vectorised>(work: W) -> W::Output {
        work.run_compact()
    }

    #[inline(always)]
    fn dispatch_loops<W: Vectorised>(work: W) -> W::Output {
        work.run_compact()
    }
}

impl Real for Dd {
    fn to_f64(self) -> f64 {
        self.hi
    }

    fn to_dd(self) -> Dd {
        self
    }

    fn floor(self) -> Self {
        Dd::floor(self)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::functions::tests::assert_agrees;
    use super::*;
    use crate::numeric::fixed_samples;

    #[test]
    fn floor_looks_at_the_trailing_part_of_an_integer_leading_part() {
        assert_eq!(Dd::new(3.0, -1e-20).floor(), Dd::from(2.0));
        assert_eq!(Dd::new(3.0, 1e-20).floor(), Dd::from(3.0));
        assert_eq!(Dd::from(-2.5).floor(), Dd::from(-3.0));
        assert_eq!(Dd::new(1e20, -0.5).floor(), Dd::new(1e20, -1.0));
    }

    #[test]
    fn new_moves_the_rounded_sum_into_the_leading_part() {
        assert_eq!(Dd::new(1e-20, 1.0), Dd { hi: 1.0, lo: 1e-20 });
    }

    #[test]
    fn product_and_error_are_the_exact_product_of_integers() {
        let (a, b) = (9_007_199_254_740_881_i64, 4_503_599_627_370_449_i64);
        let (product, error) = two_product(a as f64, b as f64);
        assert_eq!(product as i128 + error as i128, a as i128 * b as i128);
        assert_ne!(error, 0.0);
    }

    #[test]
    fn binary_exponent_inverts_power_of_two() {
        for exponent in [-1022, -3, 0, 52, 1023] {
            assert_eq!(binary_exponent(power_of_two(exponent)), exponent);
        }
    }

    #[test]
    fn square_root_agrees_with_forty_digits() {
        let digits = [
            ("2", "1.41421356237309504880168872420969807857"),
            ("1e-200", "1.0e-100"),
            ("7.3e101", "8.544003745317531167871648326239706434594e+50"),
        ];
        assert_agrees(Dd::sqrt, &digits, 4e-32);
    }

    #[test]
    fn infinities_and_nan_propagate_through_the_field_operations() {
        let infinity = Dd::INFINITY;
        assert_eq!(infinity + Dd::ONE, infinity);
        assert_eq!(infinity * -Dd::ONE, -infinity);
        assert_eq!(Dd::ONE / Dd::ZERO, infinity);
        assert_eq!(Dd::ONE / infinity, Dd::ZERO);
        assert_eq!(infinity.sqrt(), infinity);
        assert!((infinity - infinity).is_nan() && (Dd::ZERO / Dd::ZERO).is_nan());
        assert!((-Dd::ONE).sqrt().is_nan());
        assert_eq!(Dd::from(1e200) * Dd::from(1e200), infinity);
    }

    proptest! {
        #![proptest_config(fixed_samples(256))]

        #[test]
        fn quotient_times_divisor_is_the_dividend(
            a in 1e-3..1e3_f64,
            b in 1e-3..1e3_f64,
            lo in -1e-17..1e-17_f64,
        ) {
            let (dividend, divisor) = (Dd::new(a, a * lo), Dd::new(b, -b * lo));
            let error = (dividend / divisor * divisor - dividend).abs() / dividend;
            // 15 u^2 for the quotient and 5 u^2 for the product.
            prop_assert!(error.hi < 20.0 * f64::EPSILON * f64::EPSILON / 4.0, "{error}");
        }

        #[test]
        fn product_of_a_sum_and_a_difference_is_the_difference_of_squares(
            a in 1.0..2.0_f64,
            b in -0.5..0.5_f64,
        ) {
            let (a, b) = (Dd::from(a), Dd::from(b));
            let error = (a + b) * (a - b) - (a * a - b * b);
            prop_assert!(error.hi.abs() < 1e-30, "{error}");
        }

        #[test]
        fn integers_are_computed_exactly(
            a in -(1_i64 << 52)..(1_i64 << 52),
            b in -(1_i64 << 52)..(1_i64 << 52),
        ) {
            let product = Dd::from(a as f64) * Dd::from(b as f64) + Dd::from(a as f64);
            let exact = i128::from(a) * i128::from(b) + i128::from(a);
            prop_assert_eq!(product.hi as i128 + product.lo as i128, exact);
        }
    }
}
