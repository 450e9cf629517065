//! The field operations, the square root and the order of [`Dd`].

use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use super::Dd;
use super::exact::{fast_two_sum, two_product, two_sum};

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
        if exponent < 0 {
            Dd::ONE / result
        } else {
            result
        }
    }

    /// The product with a double, with relative error below `2 u^2`.
    #[inline]
    pub(super) fn times_f64(self, factor: f64) -> Dd {
        let (product, error) = two_product(self.hi, factor);
        finished(product, error + self.lo * factor, product)
    }
}

/// The renormalised pair, or `plain` alone where the pair is infinite or NaN.
#[inline(always)]
fn finished(high: f64, low: f64, plain: f64) -> Dd {
    let (hi, lo) = fast_two_sum(high, low);
    if lo.is_finite() && hi.is_finite() {
        Dd { hi, lo }
    } else {
        Dd { hi: plain, lo: 0.0 }
    }
}

impl Neg for Dd {
    type Output = Dd;

    #[inline]
    fn neg(self) -> Dd {
        Dd {
            hi: -self.hi,
            lo: -self.lo,
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::double_double::reference::assert_agrees;
    use crate::numeric::sampling::fixed_samples;
    use proptest::prelude::*;

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
        fn quotient_times_divisor_is_the_dividend(a in 1e-3..1e3_f64, b in 1e-3..1e3_f64, lo in -1e-17..1e-17_f64) {
            let (dividend, divisor) = (Dd::new(a, a * lo), Dd::new(b, -b * lo));
            let error = (dividend / divisor * divisor - dividend).abs() / dividend;
            // 15 u^2 of the quotient and 5 u^2 of the product.
            prop_assert!(error.hi < 20.0 * f64::EPSILON * f64::EPSILON / 4.0, "{error}");
        }

        #[test]
        fn product_of_a_sum_and_a_difference_is_the_difference_of_squares(a in 1.0..2.0_f64, b in -0.5..0.5_f64) {
            let (a, b) = (Dd::from(a), Dd::from(b));
            let error = (a + b) * (a - b) - (a * a - b * b);
            prop_assert!(error.hi.abs() < 1e-30, "{error}");
        }

        #[test]
        fn integers_are_computed_exactly(a in -(1_i64 << 52)..(1_i64 << 52), b in -(1_i64 << 52)..(1_i64 << 52)) {
            let product = Dd::from(a as f64) * Dd::from(b as f64) + Dd::from(a as f64);
            let exact = i128::from(a) * i128::from(b) + i128::from(a);
            prop_assert_eq!(product.hi as i128 + product.lo as i128, exact);
        }
    }
}
