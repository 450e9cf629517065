//! [`f64`] as a [`Scalar`] and a [`Real`].

use super::{Dd, Real, Scalar};

impl Scalar for f64 {
    const ROUNDOFF: f64 = f64::EPSILON / 2.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn from_dd(value: Dd) -> Self {
        value.hi
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        if cfg!(target_feature = "fma") {
            f64::mul_add(self, a, b)
        } else {
            self * a + b
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    fn exp(self) -> Self {
        f64::exp(self)
    }

    fn ln(self) -> Self {
        f64::ln(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }

    fn asin(self) -> Self {
        f64::asin(self)
    }

    fn acos(self) -> Self {
        f64::acos(self)
    }

    fn atan(self) -> Self {
        f64::atan(self)
    }

    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }

    fn sinh_cosh(self) -> (Self, Self) {
        (self.sinh(), self.cosh())
    }

    fn powf(self, exponent: Self) -> Self {
        f64::powf(self, exponent)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    /// `0` at zero, unlike [`f64::signum`]; NaN stays NaN.
    #[inline(always)]
    fn signum(self) -> Self {
        if self == 0.0 { 0.0 } else { f64::signum(self) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        f64::min(self, other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }

    #[inline(always)]
    fn magnitude(self) -> f64 {
        f64::abs(self)
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn to_dd(self) -> Dd {
        Dd::from(self)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
}
