//! The numbers with which every floor above computes.
//!
//! Comparisons of [`Branched`] numbers decide lane by lane. One idea: an algorithm that marks the
//! validity of its results with masks runs on one number, whose masks are truth values, and on
//! lanes, which then go through the operations of each single number in the same order.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{
    Add, AddAssign, BitAnd, BitAndAssign, BitOr, BitOrAssign, Div, DivAssign, Mul, MulAssign, Neg,
    Not, Sub, SubAssign,
};

use num_traits::{One, Zero};

use super::{Dd, Vectorised, widest};

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

    /// The nearest scalar to an `f64` (exact, except for `f32`; repeated in every lane).
    fn from_f64(value: f64) -> Self;
    /// The nearest scalar to a double-double; constants of a model are converted in this way.
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
    /// Hyperbolic tangent, ±1 where that is the nearest number.
    fn tanh(self) -> Self;
    /// `1/cosh²`, the derivative of the hyperbolic tangent, to full relative accuracy.
    ///
    /// With `t = e^{−2|x|}` it is `4 t/(1 + t)²`: nothing overflows or cancels.
    #[inline(always)]
    fn sech_squared(self) -> Self {
        let size = self.abs();
        let decay = (-(size + size)).exp();
        let sum = Self::one() + decay;
        let twice = decay + decay;
        (twice + twice) / (sum * sum)
    }
    /// `1/cosh`, to full relative accuracy: with `t = e^{−|x|}` it is `2 t/(1 + t²)`.
    #[inline(always)]
    fn sech(self) -> Self {
        let decay = (-self.abs()).exp();
        (decay + decay) / (Self::one() + decay * decay)
    }
    /// Logistic function `1/(1 + e^{−x})`, to full relative accuracy; nothing overflows.
    #[inline(always)]
    fn logistic(self) -> Self {
        let decay = (-self.abs()).exp();
        self.min(Self::zero()).exp() / (Self::one() + decay)
    }
    /// `ln(1 + e^x)`, the integral of the logistic function; nothing overflows.
    #[inline(always)]
    fn softplus(self) -> Self {
        self.max(Self::zero()) + ln_of_one_plus((-self.abs()).exp())
    }
    /// `ln cosh x`, the integral of the hyperbolic tangent; nothing overflows.
    #[inline(always)]
    fn ln_cosh(self) -> Self {
        let size = self.abs();
        size - Self::from_dd(Dd::LN_2) + ln_of_one_plus((-(size + size)).exp())
    }
    /// Factor that brings the larger of two magnitudes into `[1e-70, 1e70]`, so that squares
    /// neither overflow nor underflow; 1 if it lies there already.
    #[inline(always)]
    fn balance(self, other: Self) -> Self {
        let (one, most) = (Self::one(), Self::from_f64(1e70));
        let size = self.abs().max(other.abs());
        (most / size).min(one) * (one / (most * size)).max(one)
    }
    /// `self` to a real power, for `self > 0`.
    fn powf(self, exponent: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Sign: `-1`, `0` or `1`, lane by lane.
    fn signum(self) -> Self;
    /// The smaller of two, lane by lane.
    fn min(self, other: Self) -> Self;
    /// The larger of two, lane by lane.
    fn max(self, other: Self) -> Self;
    /// Largest absolute value over the lanes, rounded to `f64`.
    fn magnitude(self) -> f64;
    /// Whether every lane is finite.
    fn is_finite(self) -> bool;

    /// Keeps a value that a loop carries from one iteration to the next in whole registers.
    ///
    /// NOTE: without this, the compiler carries lanes one by one, and reassembles them in any order
    /// in every iteration.
    #[inline(always)]
    fn carried<V>(_: &mut V) {}

    /// Runs work that treats elements of this type one by one: in the widest registers for
    /// lanes, in its compact form for double-double. The bits are the same.
    #[inline(always)]
    fn dispatch<W: Vectorised>(work: W) -> W::Output {
        work.run()
    }

    /// Runs work that treats many neighbouring elements of this type alike: in the widest
    /// registers, except for double-double, which does not gain from them. The bits are the same.
    #[inline(always)]
    fn dispatch_loops<W: Vectorised>(work: W) -> W::Output {
        widest(work)
    }
}

/// `ln(1 + x)` for `0 ≤ x ≤ 1`, to full relative accuracy.
///
/// NOTE: the rounding error of `1 + x`, recovered from the sum, corrects the logarithm.
#[inline(always)]
fn ln_of_one_plus<S: Scalar>(x: S) -> S {
    let sum = S::one() + x;
    sum.ln() - ((sum - S::one()) - x) / sum
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

/// Converts numbers to another type: exactly, or to the nearest.
///
/// ```
/// use grazemap_jet::numeric::{Dd, converted};
/// let exact: Vec<Dd> = converted(&[0.5, 2.0]);
/// assert_eq!(converted::<_, f64>(&exact), [0.5, 2.0]);
/// ```
pub fn converted<S: Real, T: Real>(values: &[S]) -> Vec<T> {
    values.iter().map(|value| T::from_dd(value.to_dd())).collect()
}

/// Implements methods of [`Scalar`] by the type's own functions of the same names.
macro_rules! inherent {
    ($type:ident: $($function:ident($($argument:ident),*)),*) => {$(
        #[inline(always)]
        fn $function(self $(, $argument: Self)*) -> Self {
            $type::$function(self $(, $argument)*)
        }
    )*};
}

pub(super) use inherent;

/// A truth value for every lane.
pub trait Mask:
    Copy
    + Debug
    + PartialEq
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + BitAndAssign
    + BitOrAssign
{
    /// False everywhere.
    const NONE: Self;

    /// Whether any lane is true.
    fn any(self) -> bool;

    /// Hint for early exit: whether a loop that runs while the mask is true has no work left;
    /// always false for lanes, where testing takes longer than another iteration.
    fn is_over(self) -> bool;

    /// The numbers of the lanes that are true.
    fn lanes(self) -> impl Iterator<Item = usize>;

    /// Mask that is true in one lane only.
    fn only(lane: usize) -> Self;
}

/// A [`Scalar`] that is compared lane by lane.
pub trait Branched: Scalar {
    /// Type of a truth value for every lane.
    type Mask: Mask;
    /// Type of doubles with the same number of lanes.
    type Rounded: Branched<Mask = Self::Mask, Rounded = Self::Rounded>;

    /// Nearest doubles.
    fn rounded(self) -> Self::Rounded;
    /// Numbers with exactly these values.
    fn from_rounded(rounded: Self::Rounded) -> Self;
    /// Nearest doubles of several numbers, written to `room` unless the numbers are doubles
    /// already.
    fn all_rounded<'r>(numbers: &'r [Self], room: &'r mut [Self::Rounded]) -> &'r [Self::Rounded];
    /// `self < other`.
    fn is_below(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn is_at_most(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn is_equal(self, other: Self) -> Self::Mask;
    /// Selects `one` where the mask is true, `other` where it is false.
    fn select(mask: Self::Mask, one: Self, other: Self) -> Self;
    /// Nearest double of one lane.
    fn lane(self, lane: usize) -> f64;
    /// Applies a function to the nearest double of every lane.
    fn mapped(self, function: impl Fn(f64) -> f64) -> Self::Rounded;
    /// Numbers before, at and after a place; beyond an end, the number at that end.
    fn around(numbers: &[Self], place: Self) -> [Self; 3];
}

impl Mask for bool {
    const NONE: Self = false;

    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn is_over(self) -> bool {
        !self
    }

    #[inline(always)]
    fn lanes(self) -> impl Iterator<Item = usize> {
        self.then_some(0).into_iter()
    }

    #[inline(always)]
    fn only(_: usize) -> Self {
        true
    }
}

impl<S: Real> Branched for S {
    type Mask = bool;
    type Rounded = f64;

    #[inline(always)]
    fn rounded(self) -> f64 {
        self.to_f64()
    }

    #[inline(always)]
    fn from_rounded(rounded: f64) -> Self {
        S::from_f64(rounded)
    }

    /// NOTE: numbers are loaded block by block, as they were written: a wider load would wait until
    /// two stores have reached the cache.
    #[inline(always)]
    fn all_rounded<'r>(numbers: &'r [Self], room: &'r mut [f64]) -> &'r [f64] {
        let blocks = room.as_chunks_mut::<4>().0.iter_mut();
        for (rounded, block) in blocks.zip(numbers.as_chunks::<4>().0) {
            *rounded = block.map(Real::to_f64);
        }
        room
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn is_equal(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn select(mask: bool, one: Self, other: Self) -> Self {
        if mask { one } else { other }
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self.to_f64()
    }

    #[inline(always)]
    fn mapped(self, function: impl Fn(f64) -> f64) -> f64 {
        function(self.to_f64())
    }

    #[inline(always)]
    fn around(numbers: &[Self], place: Self) -> [Self; 3] {
        let last = numbers.len() - 1;
        let place = (place.to_f64() as usize).min(last);
        let (before, after) = (place.saturating_sub(1), (place + 1).min(last));
        [numbers[before], numbers[place], numbers[after]]
    }
}
