//! Sine, cosine and their inverses for [`Dd`].

use super::Dd;
use super::elementary::{horner, minus_multiple};
use super::exact::binary_exponent;
use super::tables::{INVERSE_FACTORIAL, PI_SIXTEENTH_PARTS, SIN_SIXTEENTHS};

/// Beyond this magnitude the count of sixteenths of `pi` is no longer an exact double.
const LARGEST_ARGUMENT: f64 = 1e14;

impl Dd {
    /// Sine and cosine, to about `1e-31`; NaN for `|x| > 1e14`, where a period is no longer resolved.
    ///
    /// With `x = k pi/16 + r` and `|r| <= pi/32`, the addition theorems join tabulated values at
    /// `k pi/16` with Taylor series in `r`. Next to the zeros of each function its error is relative.
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
