//! The numbers every floor above computes with.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use super::{Dd, Kernel, widest};

/// A field of numbers with the elementary functions: `f64`, `f32`, [`Dd`], or
/// [`Lanes`](super::Lanes) of `f64`.
///
/// Functions outside their real domain return NaN, as `f64` does; callers check with
/// [`is_finite`](Scalar::is_finite) where a NaN must become an error.
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Zero
    + One
    + Sum
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Unit roundoff of the type: half the distance from 1 to the next number.
    const ROUNDOFF: f64;

    /// The nearest scalar to an `f64` (exact but for `f32`; repeated in every lane).
    fn from_f64(value: f64) -> Self;
    /// The nearest scalar to a double-double: how constants of a model enter a computation.
    fn from_dd(value: Dd) -> Self;
    /// `self * a + b`; fused where the machine fuses without a call, otherwise two roundings.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Natural exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Arc sine.
    fn asin(self) -> Self;
    /// Arc cosine.
    fn acos(self) -> Self;
    /// Arc tangent.
    fn atan(self) -> Self;
    /// Angle of the point `(x, self)`, in `(-pi, pi]`.
    fn atan2(self, x: Self) -> Self;
    /// Hyperbolic sine and cosine.
    fn sinh_cosh(self) -> (Self, Self);
    /// `self` to a real power, for `self > 0`.
    fn powf(self, exponent: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `-1`, `0` or `1`, lane by lane.
    fn signum(self) -> Self;
    /// The smaller of two, lane by lane.
    fn min(self, other: Self) -> Self;
    /// The larger of two, lane by lane.
    fn max(self, other: Self) -> Self;
    /// Largest absolute value over the lanes, rounded to `f64`.
    fn magnitude(self) -> f64;
    /// Whether every lane is finite.
    fn is_finite(self) -> bool;

    /// Keeps a value that a loop carries from one turn to the next in whole registers.
    ///
    /// NOTE: left to itself, the compiler carries lanes one by one, and puts them together in any
    /// order at every turn.
    #[inline(always)]
    fn carried<V>(_: &mut V) {}

    /// Runs a kernel that treats one element of this type after another: in the widest registers
    /// for lanes, in its compact form for double-double. The bits are the same.
    #[inline(always)]
    fn dispatch<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }

    /// Runs a kernel that treats many neighbouring elements of this type alike: in the widest
    /// registers, but for double-double, which gains nothing by them. The bits are the same.
    #[inline(always)]
    fn dispatch_loops<K: Kernel>(kernel: K) -> K::Output {
        widest(kernel)
    }
}

/// A [`Scalar`] that is one ordered number: `f64`, `f32` or [`Dd`].
pub trait Real: Scalar + PartialOrd {
    /// Nearest `f64`.
    fn to_f64(self) -> f64;
    /// The number as a double-double (exact).
    fn to_dd(self) -> Dd;
    /// Largest integer not above the number.
    fn floor(self) -> Self;
}

/// Methods of [`Scalar`] by the type's own functions of the same names.
macro_rules! inherent {
    ($type:ident: $($function:ident($($argument:ident),*)),*) => {$(
        #[inline(always)]
        fn $function(self $(, $argument: Self)*) -> Self {
            $type::$function(self $(, $argument)*)
        }
    )*};
}

pub(super) use inherent;
