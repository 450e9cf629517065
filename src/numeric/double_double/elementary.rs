//! Exponential, logarithm, powers and hyperbolic functions of [`Dd`].
//!
//! Each reduces its argument exactly enough (constants as sums of three doubles) that a short
//! Taylor series finishes to about `1e-31` relative.

use super::Dd;
use super::exact::{binary_exponent, two_product};
use super::tables::{INVERSE_FACTORIAL, INVERSE_ODD, LN_2_PARTS};

impl Dd {
    /// Natural exponential; infinity above about `709.78`, zero below about `-745.13`.
    ///
    /// With `x = k ln 2 + 16 r` and `|r| < 0.022`, `e^x = 2^k (e^r)^16`, where the squarings run on
    /// `e^r - 1`, which keeps its leading digits.
    pub fn exp(self) -> Dd {
        if self.is_nan() {
            return self;
        }
        if self.hi > 709.79 {
            return Dd::INFINITY;
        }
        if self.hi < -745.2 {
            return Dd::ZERO;
        }
        let count = (self.hi / std::f64::consts::LN_2).round();
        let reduced = minus_multiple(self, count, &LN_2_PARTS);
        let mut excess = exp_minus_one(reduced.scaled_exactly(0.0625));
        for _ in 0..4 {
            excess = excess.scaled_exactly(2.0) + excess * excess;
        }
        (excess + Dd::ONE).scaled_by_power_of_two(count as i32)
    }

    /// Natural logarithm; `-inf` at zero, NaN for negative numbers.
    ///
    /// With `x = 2^k m`, `m` in `[1/sqrt 2, sqrt 2]` and `s = (m - 1) / (m + 1)`:
    ///
    /// ```text
    /// ln x = k ln 2 + 2 (s + s^3/3 + s^5/5 + ...)
    /// ```
    ///
    /// which keeps its relative accuracy next to `x = 1`.
    pub fn ln(self) -> Dd {
        if self.hi <= 0.0 || !self.is_finite() {
            return Dd::exact(self.hi.ln());
        }
        if self.hi < f64::MIN_POSITIVE {
            return self.scaled_by_power_of_two(100).ln() - Dd::LN_2.times_f64(100.0);
        }
        let (mantissa, exponent) = self.near_one();
        let ratio = (mantissa - Dd::ONE) / (mantissa + Dd::ONE);
        let square = ratio * ratio;
        let series = horner(square, INVERSE_ODD[..22].iter());
        (ratio * series).scaled_exactly(2.0) + Dd::LN_2.times_f64(f64::from(exponent))
    }

    /// `self` to a real power, `e^(y ln x)` for `x > 0`, with relative error about `(1 + |y ln x|) 1e-31`.
    ///
    /// Integer exponents below 1024 go through [`powi`](Dd::powi), also for negative bases; the powers of zero and of
    /// negative bases to a fraction are those of [`f64::powf`].
    pub fn powf(self, exponent: Dd) -> Dd {
        let whole = exponent.floor();
        if whole == exponent && exponent.hi.abs() < 1024.0 {
            return self.powi(exponent.hi as i32);
        }
        if self.hi <= 0.0 || !self.is_finite() || !exponent.is_finite() {
            return Dd::exact(self.hi.powf(exponent.hi));
        }
        (exponent * self.ln()).exp()
    }

    /// Hyperbolic sine and cosine, the sine with full relative accuracy next to zero.
    pub fn sinh_cosh(self) -> (Dd, Dd) {
        if self.hi.abs() < 0.4 {
            let square = self * self;
            let sinh = self * horner(square, INVERSE_FACTORIAL[1..26].iter().step_by(2));
            return (sinh, (Dd::ONE + sinh * sinh).sqrt());
        }
        let growing = self.abs().exp().scaled_exactly(0.5);
        let decaying = Dd::exact(0.25) / growing;
        let sinh = growing - decaying;
        let signed = if self.hi < 0.0 { -sinh } else { sinh };
        (signed, growing + decaying)
    }

    /// The product with a power of two that neither overflows nor underflows.
    #[inline]
    pub(super) fn scaled_exactly(self, factor: f64) -> Dd {
        Dd {
            hi: self.hi * factor,
            lo: self.lo * factor,
        }
    }

    /// `(m, k)` with `self = 2^k m` and `m` in about `[1/sqrt 2, sqrt 2]`, for normal positive numbers.
    fn near_one(self) -> (Dd, i32) {
        let exponent = binary_exponent(self.hi);
        let mantissa = self.scaled_by_power_of_two(-exponent);
        if mantissa.hi > std::f64::consts::SQRT_2 {
            (mantissa.scaled_exactly(0.5), exponent + 1)
        } else {
            (mantissa, exponent)
        }
    }
}

/// `value - count * sum(parts)`, each product exact and each difference rounded once.
pub(super) fn minus_multiple(value: Dd, count: f64, parts: &[f64]) -> Dd {
    parts.iter().fold(value, |remainder, &part| {
        let (hi, lo) = two_product(count, part);
        remainder - Dd { hi, lo }
    })
}

/// `sum c_k x^k` over the coefficients in ascending order.
pub(super) fn horner<'a>(x: Dd, coefficients: impl DoubleEndedIterator<Item = &'a Dd>) -> Dd {
    coefficients
        .rev()
        .fold(Dd::ZERO, |sum, &coefficient| sum * x + coefficient)
}

/// `e^r - 1` by its Taylor series, for `|r| < 0.022`.
fn exp_minus_one(r: Dd) -> Dd {
    r * horner(r, INVERSE_FACTORIAL[1..16].iter())
}
