//! [`Dd`] as a [`Scalar`] and a [`Real`].

use super::Dd;
use crate::numeric::{Kernel, Real, Scalar};

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

    fn sqrt(self) -> Self {
        Dd::sqrt(self)
    }

    fn exp(self) -> Self {
        Dd::exp(self)
    }

    fn ln(self) -> Self {
        Dd::ln(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        Dd::sin_cos(self)
    }

    fn asin(self) -> Self {
        Dd::asin(self)
    }

    fn acos(self) -> Self {
        Dd::acos(self)
    }

    fn atan(self) -> Self {
        Dd::atan(self)
    }

    fn atan2(self, x: Self) -> Self {
        Dd::atan2(self, x)
    }

    fn sinh_cosh(self) -> (Self, Self) {
        Dd::sinh_cosh(self)
    }

    fn powf(self, exponent: Self) -> Self {
        Dd::powf(self, exponent)
    }

    fn abs(self) -> Self {
        Dd::abs(self)
    }

    fn signum(self) -> Self {
        Dd::from(Scalar::signum(self.hi))
    }

    fn min(self, other: Self) -> Self {
        if other < self || self.is_nan() {
            other
        } else {
            self
        }
    }

    fn max(self, other: Self) -> Self {
        if other > self || self.is_nan() {
            other
        } else {
            self
        }
    }

    fn magnitude(self) -> f64 {
        self.hi.abs()
    }

    fn is_finite(self) -> bool {
        Dd::is_finite(self)
    }

    #[inline(always)]
    fn dispatch<K: Kernel>(kernel: K) -> K::Output {
        kernel.run_compact()
    }

    #[inline(always)]
    fn dispatch_loops<K: Kernel>(kernel: K) -> K::Output {
        kernel.run_compact()
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
