//! The numbers on which kernels run.

use crate::numeric::{Lanes, Scalar};

/// Numbers on which the operations of a kernel act.
pub trait Number: Copy {
    /// Numbers that are known before a run: without derivative, where these have one.
    type Known: Copy;

    /// 0.
    const ZERO: Self;

    /// A known number as one of these.
    fn of(known: Self::Known) -> Self;
    /// `a + b`.
    fn plus(self, b: Self) -> Self;
    /// `a b`.
    fn times(self, b: Self) -> Self;
    /// `a b + c`.
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// `a b + c` with a known `c`.
    fn times_plus_known(self, b: Self, c: Self::Known) -> Self;
    /// `√max(0, a)`, where `max(0, a)` is 0 for NaN.
    fn root_of_positive_part(self) -> Self;
    /// `1/(2a)`; 0 where `a` is not positive.
    fn half_reciprocal(self) -> Self;
    /// `a`, without derivative.
    fn held(self) -> Self;
}

macro_rules! number {
    ($($type:ty [$($generic:tt)*] $zero:expr, $positive_part:expr, $half_reciprocal:expr;)*) => {$(
        impl<$($generic)*> Number for $type {
            type Known = Self;
            const ZERO: Self = $zero;

            #[inline(always)]
            fn of(known: Self) -> Self {
                known
            }

            #[inline(always)]
            fn plus(self, b: Self) -> Self {
                self + b
            }

            #[inline(always)]
            fn times(self, b: Self) -> Self {
                self * b
            }

            #[inline(always)]
            fn times_plus(self, b: Self, c: Self) -> Self {
                Scalar::mul_add(self, b, c)
            }

            #[inline(always)]
            fn times_plus_known(self, b: Self, c: Self) -> Self {
                Scalar::mul_add(self, b, c)
            }

            #[inline(always)]
            fn root_of_positive_part(self) -> Self {
                Scalar::sqrt($positive_part(self))
            }

            #[inline(always)]
            fn half_reciprocal(self) -> Self {
                $half_reciprocal(self)
            }

            #[inline(always)]
            fn held(self) -> Self {
                self
            }
        }
    )*};
}

number! {
    f64 [] 0.0, |a| if a > 0.0 { a } else { 0.0 }, |a| if a > 0.0 { 0.5 / a } else { 0.0 };
    f32 [] 0.0, |a| if a > 0.0 { a } else { 0.0 }, |a| if a > 0.0 { 0.5 / a } else { 0.0 };
    Lanes<N> [const N: usize] Self::splat(0.0),
        |a: Self| a.map(|a| if a > 0.0 { a } else { 0.0 }),
        |a: Self| a.map(|a| if a > 0.0 { 0.5 / a } else { 0.0 });
}

/// A value with its derivative along a tangent vector.
///
/// A kernel that runs on these carries the vector along, by the rules of
/// [`Kernel::with_jacobian`](super::Kernel::with_jacobian).
///
/// ```
/// use grazemap_jet::jet::kernel::{Dual, Number};
/// let x = Dual { value: 4.0, slope: 1.0 };
/// let root = x.root_of_positive_part();
/// assert_eq!((root.value, root.slope), (2.0, 0.25));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T> {
    /// The value.
    pub value: T,
    /// Its derivative.
    pub slope: T,
}

impl<T: Number<Known = T> + Scalar> Number for Dual<T> {
    type Known = T;
    const ZERO: Self = Self { value: T::ZERO, slope: T::ZERO };

    #[inline(always)]
    fn of(value: T) -> Self {
        let slope = T::ZERO;
        Self { value, slope }
    }

    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        Self { value: self.value + b.value, slope: self.slope + b.slope }
    }

    #[inline(always)]
    fn times(self, b: Self) -> Self {
        let second = self.value * b.slope;
        Self { value: self.value * b.value, slope: self.slope.times_plus(b.value, second) }
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        let second = self.value.times_plus(b.slope, c.slope);
        Self {
            value: self.value.times_plus(b.value, c.value),
            slope: self.slope.times_plus(b.value, second),
        }
    }

    #[inline(always)]
    fn times_plus_known(self, b: Self, c: T) -> Self {
        let second = self.value * b.slope;
        Self {
            value: self.value.times_plus(b.value, c),
            slope: self.slope.times_plus(b.value, second),
        }
    }

    #[inline(always)]
    fn root_of_positive_part(self) -> Self {
        let value = self.value.root_of_positive_part();
        let slope = self.slope * value.half_reciprocal();
        Self { value, slope }
    }

    #[inline(always)]
    fn half_reciprocal(self) -> Self {
        let value = self.value.half_reciprocal();
        let outer = T::from_f64(-2.0) * (value * value);
        let slope = self.slope * outer;
        Self { value, slope }
    }

    #[inline(always)]
    fn held(self) -> Self {
        Self::of(self.value)
    }
}
