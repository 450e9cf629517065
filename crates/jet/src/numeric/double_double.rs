//! Double-double numbers: an unevaluated sum of two doubles, about 32 decimal digits.
//!
//! The one idea: the rounding error of a sum or product of two doubles is itself a double, so
//! carrying it along doubles the precision. Error bounds below are those of Joldes, Muller and
//! Popescu (2017), *Tight and rigorous error bounds for basic building blocks of double-word
//! arithmetic*; `u = 2^-53`.
//!
//! Infinite and NaN values carry `lo = 0` and propagate as in `f64`. Near the ends of the exponent
//! range (beyond about `1e290`, or below `1e-290`) the trailing part degrades to `f64` accuracy.

mod arithmetic;
mod decimal;
mod elementary;
mod exact;
#[cfg(test)]
mod reference;
mod scalar;
mod tables;
mod trigonometric;

pub use decimal::ParseDdError;

use exact::{fast_two_sum, two_sum};

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
    pub const PI: Dd = Dd {
        hi: std::f64::consts::PI,
        lo: 1.2246467991473532e-16,
    };
    /// `2 pi`: the period of a forcing in its phase.
    pub const TWO_PI: Dd = Dd {
        hi: std::f64::consts::TAU,
        lo: 2.4492935982947064e-16,
    };
    /// `pi / 2`.
    pub const FRAC_PI_2: Dd = Dd {
        hi: std::f64::consts::FRAC_PI_2,
        lo: 6.123233995736766e-17,
    };
    /// `pi / 4`.
    pub const FRAC_PI_4: Dd = Dd {
        hi: std::f64::consts::FRAC_PI_4,
        lo: 3.061616997868383e-17,
    };
    /// `ln 2`.
    pub const LN_2: Dd = Dd {
        hi: std::f64::consts::LN_2,
        lo: 2.3190468138462996e-17,
    };
    /// `ln 10`.
    pub const LN_10: Dd = Dd {
        hi: std::f64::consts::LN_10,
        lo: -2.1707562233822494e-16,
    };
    /// Euler's number `e`.
    pub const E: Dd = Dd {
        hi: std::f64::consts::E,
        lo: 1.4456468917292502e-16,
    };
    /// `sqrt 2`.
    pub const SQRT_2: Dd = Dd {
        hi: std::f64::consts::SQRT_2,
        lo: -9.667293313452913e-17,
    };

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
        if self.hi.is_sign_negative() {
            -self
        } else {
            self
        }
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

    /// The product with `2^exponent`, exact but for overflow and underflow.
    pub fn scaled_by_power_of_two(self, exponent: i32) -> Dd {
        let half = exact::power_of_two(exponent / 2);
        let rest = exact::power_of_two(exponent - exponent / 2);
        Dd::guarded(self.hi * half * rest, self.lo * half * rest)
    }

    /// A double as it stands.
    const fn exact(hi: f64) -> Dd {
        Dd { hi, lo: 0.0 }
    }

    /// The pair, with the trailing part dropped where the leading one is infinite or NaN.
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

#[cfg(test)]
mod tests {
    use super::Dd;

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
}
