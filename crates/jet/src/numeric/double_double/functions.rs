//! Exponential, logarithm, powers, hyperbolic and circular functions of [`Dd`] and their inverses.
//!
//! Each function reduces its argument exactly enough (constants as sums of three or four doubles)
//! for a short Taylor series to reach about `1e-31` relative accuracy.
//!
//! The tables of the series and of the argument reductions hold digits from a 600-bit computation:
//! each entry is `hi + lo` with `hi` the constant rounded to `f64` and `lo` the remainder rounded
//! to `f64`.

use super::{Dd, binary_exponent, two_product};

impl Dd {
    /// Natural exponential; infinity above about `709.78`, zero below about `-745.13`.
    ///
    /// With `x = k ln 2 + 16 r` and `|r| < 0.022`, `e^x = 2^k (e^r)^16`. The squarings run on
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
        // NOTE: half of the exponential is still finite where the exponential itself overflows, up
        // to 710.47.
        let growing = if self.hi.abs() < 700.0 {
            self.abs().exp().scaled_exactly(0.5)
        } else {
            (self.abs() - Dd::LN_2).exp()
        };
        let decaying = Dd::exact(0.25) / growing;
        let sinh = growing - decaying;
        let signed = if self.hi < 0.0 { -sinh } else { sinh };
        (signed, growing + decaying)
    }

    /// Hyperbolic tangent, ±1 where that is the nearest number; full relative accuracy next to
    /// zero.
    pub fn tanh(self) -> Dd {
        let size = self.abs();
        let tangent = if self.hi.abs() < 0.4 {
            let (sinh, cosh) = self.sinh_cosh();
            return sinh / cosh;
        } else {
            let decay = (-size.scaled_exactly(2.0)).exp();
            (Dd::ONE - decay) / (Dd::ONE + decay)
        };
        if self.hi < 0.0 { -tangent } else { tangent }
    }

    /// The product with a power of two that neither overflows nor underflows.
    #[inline]
    fn scaled_exactly(self, factor: f64) -> Dd {
        Dd { hi: self.hi * factor, lo: self.lo * factor }
    }

    /// `(m, k)` with `self = 2^k m` and `m` in about `[1/sqrt 2, sqrt 2]`, for positive normal
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
fn minus_multiple(value: Dd, count: f64, parts: &[f64]) -> Dd {
    parts.iter().fold(value, |remainder, &part| {
        let (hi, lo) = two_product(count, part);
        remainder - Dd { hi, lo }
    })
}

/// `sum c_k x^k` over the coefficients in ascending order.
fn horner<'a>(x: Dd, coefficients: impl DoubleEndedIterator<Item = &'a Dd>) -> Dd {
    coefficients.rev().fold(Dd::ZERO, |sum, &coefficient| sum * x + coefficient)
}

/// `e^r - 1` by its Taylor series, for `|r| < 0.022`.
fn exp_minus_one(r: Dd) -> Dd {
    r * horner(r, INVERSE_FACTORIAL[1..16].iter())
}

/// Beyond this magnitude the count of sixteenths of `pi` is no longer an exact double.
const LARGEST_ARGUMENT: f64 = 1e14;

impl Dd {
    /// Sine and cosine, to about `1e-31`; NaN for `|x| > 1e14`, where a period is no longer
    /// resolved.
    ///
    /// With `x = k pi/16 + r` and `|r| <= pi/32`, the addition theorems join tabulated values at
    /// `k pi/16` with Taylor series in `r`. Next to the zeros of each function its error is
    /// relative.
    pub fn sin_cos(self) -> (Dd, Dd) {
        if self.is_nan() || self.hi.abs() > LARGEST_ARGUMENT {
            return (Dd::NAN, Dd::NAN);
        }
        let count = (self.hi / (std::f64::consts::PI / 16.0)).round();
        let reduced = minus_multiple(self, count, &PI_SIXTEENTH_PARTS);
        let quarter_turns = (count / 8.0).round();
        let sixteenths = (count - 8.0 * quarter_turns) as i64;
        let (sin, cos) = rotated(sixteenths, taylor_sin_cos(reduced));
        match (quarter_turns as i64).rem_euclid(4) {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        }
    }

    /// Arc sine, with full relative accuracy; NaN outside `[-1, 1]`.
    pub fn asin(self) -> Dd {
        self.atan2(self.cofactor())
    }

    /// Arc cosine, with full relative accuracy next to `x = 1`; NaN outside `[-1, 1]`.
    pub fn acos(self) -> Dd {
        self.cofactor().atan2(self)
    }

    /// Arc tangent, in `[-pi/2, pi/2]`.
    pub fn atan(self) -> Dd {
        self.atan2(Dd::ONE)
    }

    /// Angle of the point `(x, self)`, in `[-pi, pi]`, with the signs of zero of [`f64::atan2`].
    ///
    /// One Newton step from the `f64` angle `t`:
    /// `t + d - d^3/3` with `d = (y cos t - x sin t) / (x cos t + y sin t)`, about `1e-16`.
    pub fn atan2(self, x: Dd) -> Dd {
        let largest = self.hi.abs().max(x.hi.abs());
        if largest == 0.0 || !self.is_finite() || !x.is_finite() {
            return nearest_axis_or_diagonal(self.hi.atan2(x.hi));
        }
        if self.hi == 0.0 {
            return nearest_axis_or_diagonal(self.hi.atan2(x.hi));
        }
        let exponent = -binary_exponent(largest);
        let (y, x) = (self.scaled_by_power_of_two(exponent), x.scaled_by_power_of_two(exponent));
        let angle = Dd::exact(y.hi.atan2(x.hi));
        let (sin, cos) = angle.sin_cos();
        let correction = (y * cos - x * sin) / (x * cos + y * sin);
        angle + correction
    }

    /// `sqrt(1 - x^2)` without cancellation next to `|x| = 1`.
    fn cofactor(self) -> Dd {
        ((Dd::ONE - self) * (Dd::ONE + self)).sqrt()
    }
}

/// `(sin, cos)` of `k pi/16 + r` from those of `r`, for `|k| <= 4`.
fn rotated(sixteenths: i64, (sin_r, cos_r): (Dd, Dd)) -> (Dd, Dd) {
    let index = sixteenths.unsigned_abs() as usize;
    if index == 0 {
        return (sin_r, cos_r);
    }
    let cos_k = SIN_SIXTEENTHS[8 - index];
    let magnitude = SIN_SIXTEENTHS[index];
    let sin_k = if sixteenths < 0 { -magnitude } else { magnitude };
    (sin_k * cos_r + cos_k * sin_r, cos_k * cos_r - sin_k * sin_r)
}

/// Sine and cosine by their Taylor series, for `|r| <= pi/32`.
fn taylor_sin_cos(r: Dd) -> (Dd, Dd) {
    let minus_square = -(r * r);
    let sin = r * horner(minus_square, INVERSE_FACTORIAL[1..20].iter().step_by(2));
    let cos = horner(minus_square, INVERSE_FACTORIAL[0..21].iter().step_by(2));
    (sin, cos)
}

/// The multiple of `pi/4` nearest to the `f64` angle, to full precision; NaN stays NaN.
fn nearest_axis_or_diagonal(angle: f64) -> Dd {
    Dd::FRAC_PI_4.times_f64((angle / std::f64::consts::FRAC_PI_4).round())
}

const fn dd(hi: f64, lo: f64) -> Dd {
    Dd { hi, lo }
}

/// `1 / k!` for `k = 0..=27`.
const INVERSE_FACTORIAL: [Dd; 28] = [
    dd(1.0, 0.0),
    dd(1.0, 0.0),
    dd(0.5, 0.0),
    dd(0.16666666666666666, 9.25185853854297e-18),
    dd(0.041666666666666664, 2.3129646346357427e-18),
    dd(0.008333333333333333, 1.1564823173178714e-19),
    dd(0.001388888888888889, -5.300543954373577e-20),
    dd(0.0001984126984126984, 1.7209558293420705e-22),
    dd(2.48015873015873e-05, 2.1511947866775882e-23),
    dd(2.7557319223985893e-06, -1.858393274046472e-22),
    dd(2.755731922398589e-07, 2.3767714622250297e-23),
    dd(2.505210838544172e-08, -1.448814070935912e-24),
    dd(2.08767569878681e-09, -1.20734505911326e-25),
    dd(1.6059043836821613e-10, 1.2585294588752098e-26),
    dd(1.1470745597729725e-11, 2.0655512752830745e-28),
    dd(7.647163731819816e-13, 7.03872877733453e-30),
    dd(4.779477332387385e-14, 4.399205485834081e-31),
    dd(2.8114572543455206e-15, 1.6508842730861433e-31),
    dd(1.5619206968586225e-16, 1.1910679660273754e-32),
    dd(8.22063524662433e-18, 2.2141894119604265e-34),
    dd(4.110317623312165e-19, 1.4412973378659527e-36),
    dd(1.9572941063391263e-20, -1.3643503830087908e-36),
    dd(8.896791392450574e-22, -7.911402614872376e-38),
    dd(3.868170170630684e-23, -8.843177655482344e-40),
    dd(1.6117375710961184e-24, -3.6846573564509766e-41),
    dd(6.446950284384474e-26, -1.9330404233703465e-42),
    dd(2.4795962632247976e-27, -1.2953730964765229e-43),
    dd(9.183689863795546e-29, 1.4303150396787322e-45),
];

/// `1 / (2k + 1)` for `k = 0..=22`.
const INVERSE_ODD: [Dd; 23] = [
    dd(1.0, 0.0),
    dd(0.3333333333333333, 1.850371707708594e-17),
    dd(0.2, -1.1102230246251566e-17),
    dd(0.14285714285714285, 7.93016446160826e-18),
    dd(0.1111111111111111, 6.1679056923619804e-18),
    dd(0.09090909090909091, -2.523234146875356e-18),
    dd(0.07692307692307693, -4.270088556250602e-18),
    dd(0.06666666666666667, 9.251858538542971e-19),
    dd(0.058823529411764705, 8.163404592832033e-19),
    dd(0.05263157894736842, 2.921639538487254e-18),
    dd(0.047619047619047616, 2.64338815386942e-18),
    dd(0.043478260869565216, 1.206764157201257e-18),
    dd(0.04, -8.326672684688674e-19),
    dd(0.037037037037037035, 2.05596856412066e-18),
    dd(0.034482758620689655, 4.785444071660157e-19),
    dd(0.03225806451612903, 8.953411488912552e-19),
    dd(0.030303030303030304, -8.410780489584519e-19),
    dd(0.02857142857142857, 8.921435019309293e-19),
    dd(0.02702702702702703, -1.50030138462859e-18),
    dd(0.02564102564102564, 8.896017825522087e-19),
    dd(0.024390243902439025, -8.46206573647223e-19),
    dd(0.023255813953488372, 3.2273925134452225e-19),
    dd(0.022222222222222223, -8.480870326997723e-19),
];

/// `sin(k pi / 16)` for `k = 0..=8`.
const SIN_SIXTEENTHS: [Dd; 9] = [
    dd(0.0, 0.0),
    dd(0.19509032201612828, -7.991079068461731e-18),
    dd(0.3826834323650898, -1.0050772696461588e-17),
    dd(0.5555702330196022, 4.709410940561677e-17),
    dd(std::f64::consts::FRAC_1_SQRT_2, -4.833646656726457e-17),
    dd(0.8314696123025452, 1.4073856984728024e-18),
    dd(0.9238795325112867, 1.7645047084336677e-17),
    dd(0.9807852804032304, 1.8546939997825006e-17),
    dd(1.0, 0.0),
];

/// `pi / 16` as an unevaluated sum of four doubles.
const PI_SIXTEENTH_PARTS: [f64; 4] = [
    std::f64::consts::PI / 16.0,
    7.654042494670958e-18,
    -1.8717311310739623e-34,
    6.952838880396033e-51,
];

/// `ln 2` as an unevaluated sum of three doubles.
const LN_2_PARTS: [f64; 3] =
    [std::f64::consts::LN_2, 2.3190468138462996e-17, 5.707708438416212e-34];

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numeric::fixed_samples;

    /// Asserts that a function maps each argument to its value, given by digits computed with
    /// mpmath 1.3 (60 digits), within the relative tolerance.
    pub(in super::super) fn assert_agrees(
        function: impl Fn(Dd) -> Dd,
        digits: &[(&str, &str)],
        tolerance: f64,
    ) {
        for (argument, value) in digits {
            let exact = Dd::from_decimal(value).expect("digits of the test");
            let found = function(Dd::from_decimal(argument).expect("digits of the test"));
            let error = ((found - exact) / exact).abs().to_f64();
            assert!(error < tolerance, "at {argument}: {found}, not {exact}: {error:e}");
        }
    }

    #[test]
    fn exponential_agrees_with_forty_digits() {
        let digits = [
            ("0.3", "1.349858807576003103983744313328007330378"),
            ("-20.7", "0.000000001023538597759415425949628188452384734964"),
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

    #[test]
    fn sine_agrees_with_forty_digits() {
        let digits = [
            ("0.1", "0.09983341664682815230681419841062202698992"),
            ("3", "0.1411200080598672221007448028081102798469"),
            ("100000", "0.03574879797201650931647050069580882900905"),
            ("-7.3", "-0.8504366206285645175173662279669060444075"),
            ("1e-10", "0.00000000009999999999999999999983333333333333333333"),
        ];
        assert_agrees(|x| x.sin_cos().0, &digits, 1e-31);
    }

    #[test]
    fn cosine_agrees_with_forty_digits() {
        let digits = [
            ("0.1", "0.9950041652780257660955619878038702948386"),
            ("3", "-0.9899924966004454572715727947312613023937"),
            ("100000", "-0.9993608074382124518911354141448022032354"),
            ("-7.3", "0.5260775173811051889154065767376851916778"),
            ("1e-10", "0.999999999999999999995"),
        ];
        assert_agrees(|x| x.sin_cos().1, &digits, 1e-31);
    }

    #[test]
    fn arc_sine_agrees_with_forty_digits() {
        let digits = [
            ("0.99999904632568359375", "1.569415258753134202049212853162183975158"),
            ("-0.3", "-0.3046926540153975079720029612275291669546"),
            ("1e-12", "0.000000000001000000000000000000000000166666666666667"),
        ];
        assert_agrees(Dd::asin, &digits, 2e-31);
    }

    #[test]
    fn arc_cosine_agrees_with_forty_digits() {
        let digits = [
            ("0.99999904632568359375", "0.001381068041762417182108838477567466940486"),
            ("-0.3", "1.875488980810294127203324652867280609053"),
            ("-1", "3.141592653589793238462643383279502884197"),
        ];
        assert_agrees(Dd::acos, &digits, 2e-31);
    }

    #[test]
    fn arc_tangent_agrees_with_forty_digits() {
        let digits = [
            ("1e-9", "0.0000000009999999999999999996666666666666666668667"),
            ("2.5", "1.190289949682531732927733774829318337601"),
            ("-1e20", "-1.570796326794896619221321691639751442099"),
        ];
        assert_agrees(Dd::atan, &digits, 1e-31);
    }

    #[test]
    fn angles_of_points_in_every_quadrant_agree_with_forty_digits() {
        let below = Dd::from_decimal("-0.7").expect("digits");
        assert_agrees(
            |y| y.atan2(below),
            &[("0.3", "2.736700867304709815150570454270060267645")],
            1e-31,
        );
        assert_agrees(
            |y| y.atan2(Dd::from(-2.0)),
            &[("-1e-5", "-3.141587653589793280129310049321169550875")],
            1e-31,
        );
        assert_eq!(Dd::ZERO.atan2(-Dd::ONE), Dd::PI);
        assert_eq!(Dd::ONE.atan2(Dd::ZERO), Dd::FRAC_PI_2);
        assert_eq!(Dd::INFINITY.atan2(Dd::INFINITY), Dd::FRAC_PI_4);
        let tiny = Dd::from(1e-300);
        assert!((tiny.atan2(tiny) - Dd::FRAC_PI_4).abs() < Dd::from(1e-32));
    }

    #[test]
    fn values_outside_the_domain_are_nan() {
        assert!(Dd::from(1.5).asin().is_nan() && Dd::from(-1.5).acos().is_nan());
        assert!(Dd::INFINITY.sin_cos().0.is_nan() && Dd::NAN.sin_cos().1.is_nan());
        assert!(Dd::NAN.atan().is_nan());
    }

    proptest! {
        #![proptest_config(fixed_samples(256))]

        #[test]
        fn squares_of_sine_and_cosine_sum_to_one(hi in -1e5..1e5_f64, lo in -1e-12..1e-12_f64) {
            let (sin, cos) = Dd::new(hi, lo).sin_cos();
            let error = (sin * sin + cos * cos - Dd::ONE).abs();
            prop_assert!(error.hi < 1e-31, "{error}");
        }

        #[test]
        fn angle_of_a_point_on_the_circle_is_recovered(
            hi in -3.1..3.1_f64,
            lo in -1e-17..1e-17_f64,
        ) {
            let angle = Dd::new(hi, lo);
            let (sin, cos) = angle.sin_cos();
            let error = (sin.atan2(cos) - angle).abs();
            prop_assert!(error.hi < 2e-31, "{error}");
        }
    }
}
