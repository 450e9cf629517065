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

    /// `self` to a real power, `e^(y ln x)` for `x > 0`, with relative error about `(1 + |y ln x|)
    /// 1e-31`.
    ///
    /// Integer exponents below 1024 go through [`powi`](Dd::powi), also for negative bases; the
    /// powers of zero and of negative bases to a fraction are those of [`f64::powf`].
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

    /// `(m, k)` with `self = 2^k m` and `m` in about `[1/sqrt 2, sqrt 2]`, for normal positive
    /// numbers.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::double_double::reference::assert_agrees;
    use crate::numeric::sampling::fixed_samples;
    use proptest::prelude::*;

    #[test]
    fn exponential_agrees_with_forty_digits() {
        let digits = [
            ("0.3", "1.349858807576003103983744313328007330378"),
            (
                "-20.7",
                "0.000000001023538597759415425949628188452384734964",
            ),
            ("700.25", "1.30229973669917839353354223861921660135e+304"),
            ("1e-20", "1.00000000000000000001"),
        ];
        assert_agrees(Dd::exp, &digits, 2e-31);
    }

    #[test]
    fn logarithm_agrees_with_forty_digits_also_next_to_one() {
        let digits = [
            (
                "1.000000000116415321826934814453125",
                "0.0000000001164153218201585508756165045575548434501",
            ),
            ("3", "1.098612288668109691395245236922525704647"),
            ("1e-200", "-460.5170185988091368035982909368728415202"),
            ("0.7", "-0.356674943938732378912638711241184477964"),
            ("1.5", "0.405465108108164381978013115464349136572"),
        ];
        assert_agrees(Dd::ln, &digits, 2e-31);
    }

    #[test]
    fn hyperbolic_sine_agrees_with_forty_digits() {
        let digits = [
            ("1e-8", "0.0000000100000000000000001666666666666666675"),
            ("0.3", "0.304520293447142618958435267005095229098"),
            ("-5", "-74.20321057778875897700947199606456559962"),
            ("40", "117692633418509992.7039499553745174001303"),
        ];
        assert_agrees(|x| x.sinh_cosh().0, &digits, 4e-31);
    }

    #[test]
    fn hyperbolic_cosine_agrees_with_forty_digits() {
        let digits = [
            ("1e-8", "1.000000000000000050000000000000000416667"),
            ("0.3", "1.04533851412886048502530904632291210128"),
            ("-5", "74.20994852478784444410610804448771402387"),
            ("40", "117692633418509992.7039499553745174043786"),
        ];
        assert_agrees(|x| x.sinh_cosh().1, &digits, 4e-31);
    }

    #[test]
    fn powers_agree_with_forty_digits() {
        let power = |base: &str, exponent: f64, exact: &str| {
            let exponent = Dd::from_decimal(&exponent.to_string()).expect("digits");
            assert_agrees(|base| base.powf(exponent), &[(base, exact)], 1e-30);
        };
        power("1.7", 2.3, "3.388695291147646315559113614722301941724");
        power("0.01", 1.5, "0.001");
        power("1.1", 37.0, "34.0039485861577398992406882305761986971");
        power("1.1", -37.0, "0.0294083493705515723877190030586968753907");
    }

    #[test]
    fn values_outside_the_domain_propagate() {
        assert!(Dd::from(-1.0).ln().is_nan());
        assert_eq!(Dd::ZERO.ln(), -Dd::INFINITY);
        assert_eq!(Dd::INFINITY.exp(), Dd::INFINITY);
        assert_eq!((-Dd::INFINITY).exp(), Dd::ZERO);
        assert!(Dd::NAN.exp().is_nan() && Dd::NAN.ln().is_nan() && Dd::NAN.sinh_cosh().0.is_nan());
        assert!(Dd::NAN.powf(Dd::from(0.5)).is_nan());
    }

    proptest! {
        #![proptest_config(fixed_samples(256))]

        #[test]
        fn exponential_undoes_the_logarithm(hi in 1e-3..1e3_f64, lo in -1e-17..1e-17_f64) {
            let a = Dd::new(hi, lo);
            let error = (a.ln().exp() - a).abs() / a;
            // The rounding of the logarithm, up to 7, enters as an absolute error.
            prop_assert!(error.hi < 5e-31, "{error}");
        }
    }
}
