//! Sine, cosine and their inverses for [`Dd`].

use super::Dd;
use super::elementary::{horner, minus_multiple};
use super::exact::binary_exponent;
use super::tables::{INVERSE_FACTORIAL, PI_SIXTEENTH_PARTS, SIN_SIXTEENTHS};

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
        let (y, x) = (
            self.scaled_by_power_of_two(exponent),
            x.scaled_by_power_of_two(exponent),
        );
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
    let sin_k = if sixteenths < 0 {
        -magnitude
    } else {
        magnitude
    };
    (sin_k * cos_r + cos_k * sin_r, cos_k * cos_r - sin_k * sin_r)
}

/// Sine and cosine by their Taylor series, for `|r| <= pi/32`.
fn taylor_sin_cos(r: Dd) -> (Dd, Dd) {
    let minus_square = -(r * r);
    let sin = r * horner(minus_square, INVERSE_FACTORIAL[1..20].iter().step_by(2));
    let cos = horner(minus_square, INVERSE_FACTORIAL[0..21].iter().step_by(2));
    (sin, cos)
}

/// A multiple of `pi/4` that the `f64` angle rounds, to full precision; NaN stays NaN.
fn nearest_axis_or_diagonal(angle: f64) -> Dd {
    Dd::FRAC_PI_4.times_f64((angle / std::f64::consts::FRAC_PI_4).round())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::double_double::reference::assert_agrees;
    use crate::numeric::sampling::fixed_samples;
    use proptest::prelude::*;

    #[test]
    fn sine_agrees_with_forty_digits() {
        let digits = [
            ("0.1", "0.09983341664682815230681419841062202698992"),
            ("3", "0.1411200080598672221007448028081102798469"),
            ("100000", "0.03574879797201650931647050069580882900905"),
            ("-7.3", "-0.8504366206285645175173662279669060444075"),
            (
                "1e-10",
                "0.00000000009999999999999999999983333333333333333333",
            ),
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
            (
                "0.99999904632568359375",
                "1.569415258753134202049212853162183975158",
            ),
            ("-0.3", "-0.3046926540153975079720029612275291669546"),
            (
                "1e-12",
                "0.000000000001000000000000000000000000166666666666667",
            ),
        ];
        assert_agrees(Dd::asin, &digits, 2e-31);
    }

    #[test]
    fn arc_cosine_agrees_with_forty_digits() {
        let digits = [
            (
                "0.99999904632568359375",
                "0.001381068041762417182108838477567466940486",
            ),
            ("-0.3", "1.875488980810294127203324652867280609053"),
            ("-1", "3.141592653589793238462643383279502884197"),
        ];
        assert_agrees(Dd::acos, &digits, 2e-31);
    }

    #[test]
    fn arc_tangent_agrees_with_forty_digits() {
        let digits = [
            (
                "1e-9",
                "0.0000000009999999999999999996666666666666666668667",
            ),
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
        fn angle_of_a_point_on_the_circle_is_recovered(hi in -3.1..3.1_f64, lo in -1e-17..1e-17_f64) {
            let angle = Dd::new(hi, lo);
            let (sin, cos) = angle.sin_cos();
            let error = (sin.atan2(cos) - angle).abs();
            prop_assert!(error.hi < 2e-31, "{error}");
        }
    }
}
