//! Lanes: several independent `f64` computations in step, and their masks.
//!
//! The one idea: plain loops over a fixed-size array, inlined, become vector instructions.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{
    Add, AddAssign, BitAnd, BitAndAssign, BitOr, BitOrAssign, Div, DivAssign, Index, IndexMut, Mul,
    MulAssign, Neg, Not, Sub, SubAssign,
};

use num_traits::{One, Zero};

use super::float::{Quartered, sin_cos};
use super::{Branched, Dd, Mask, Scalar, Vectorised, widest};

/// `N` doubles on which every operation acts lane by lane.
///
/// ```
/// use grazemap_jet::numeric::{Lanes, Scalar};
/// let x = Lanes([1.0, 4.0, 9.0, 16.0]);
/// assert_eq!(x.sqrt() + Lanes::splat(1.0), Lanes([2.0, 3.0, 4.0, 5.0]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(
    /// The lanes.
    pub [f64; N],
);

impl<const N: usize> Lanes<N> {
    /// Lanes that all hold the same value.
    #[inline(always)]
    pub const fn splat(value: f64) -> Self {
        Lanes([value; N])
    }

    /// Lanes whose values are functions of their index.
    #[inline(always)]
    pub fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        // NOTE: `array::from_fn` is not always inlined, and is then compiled for the baseline
        // instruction set.
        let mut lanes = [0.0; N];
        for (lane, out) in lanes.iter_mut().enumerate() {
            *out = value(lane);
        }
        Lanes(lanes)
    }

    /// Applies a function of `f64` lane by lane.
    #[inline(always)]
    pub fn map(self, mut function: impl FnMut(f64) -> f64) -> Self {
        Self::from_fn(|lane| function(self.0[lane]))
    }

    /// Applies a function of two `f64` lane by lane.
    #[inline(always)]
    pub fn zip_map(self, other: Self, mut function: impl FnMut(f64, f64) -> f64) -> Self {
        Self::from_fn(|lane| function(self.0[lane], other.0[lane]))
    }

    /// The lanes as a slice.
    #[inline(always)]
    pub const fn as_slice(&self) -> &[f64] {
        &self.0
    }

    /// Applies a function with two results lane by lane.
    #[inline(always)]
    fn unzip_map(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self) {
        let mut results = (self, self);
        for lane in 0..N {
            (results.0.0[lane], results.1.0[lane]) = function(self.0[lane]);
        }
        results
    }
}

impl<const N: usize> Index<usize> for Lanes<N> {
    type Output = f64;

    #[inline(always)]
    fn index(&self, lane: usize) -> &f64 {
        &self.0[lane]
    }
}

impl<const N: usize> IndexMut<usize> for Lanes<N> {
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut f64 {
        &mut self.0[lane]
    }
}

/// Keeps a loop over lanes to one element at a time.
///
/// NOTE: without this, the compiler spreads neighbouring elements over a register, lane by lane,
/// with gathers and scatters, which are many times slower than the lanes themselves.
#[inline(always)]
pub fn one_by_one<S>(element: usize) {
    if size_of::<S>() > size_of::<f64>() {
        std::hint::black_box(element);
    }
}

/// Implements an operator of two values of a type of lanes, lane by lane.
macro_rules! lane_operator {
    (
        $lanes:ident, $trait:ident, $method:ident,
        $assign_trait:ident, $assign_method:ident, $assign:tt
    ) => {
        impl<const N: usize> $trait for $lanes<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for lane in 0..N {
                    self.0[lane] $assign other.0[lane];
                }
                self
            }
        }

        impl<const N: usize> $assign_trait for $lanes<N> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = (*self).$method(other);
            }
        }
    };
}

lane_operator!(Lanes, Add, add, AddAssign, add_assign, +=);
lane_operator!(Lanes, Sub, sub, SubAssign, sub_assign, -=);
lane_operator!(Lanes, Mul, mul, MulAssign, mul_assign, *=);
lane_operator!(Lanes, Div, div, DivAssign, div_assign, /=);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|value| -value)
    }
}

impl<const N: usize> Sum for Lanes<N> {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::splat(0.0), Add::add)
    }
}

impl<const N: usize> Zero for Lanes<N> {
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    fn is_zero(&self) -> bool {
        self.0.iter().all(|&value| value == 0.0)
    }
}

impl<const N: usize> One for Lanes<N> {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

macro_rules! lane_by_lane {
    ($($function:ident($($argument:ident),*)),* $(,)?) => {
        $(
            #[inline(always)]
            fn $function(self $(, $argument: Self)*) -> Self {
                Self::from_fn(|lane| Scalar::$function(self.0[lane] $(, $argument.0[lane])*))
            }
        )*
    };
}

impl<const N: usize> Scalar for Lanes<N> {
    const ROUNDOFF: f64 = f64::EPSILON / 2.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn from_dd(value: Dd) -> Self {
        Self::splat(value.hi)
    }

    #[inline(always)]
    fn mul_add(self, a: Self, mut b: Self) -> Self {
        for lane in 0..N {
            b.0[lane] = Scalar::mul_add(self.0[lane], a.0[lane], b.0[lane]);
        }
        b
    }

    lane_by_lane!(
        sqrt(),
        exp(),
        ln(),
        asin(),
        acos(),
        atan(),
        atan2(x),
        tanh(),
        powf(exponent),
        abs(),
        signum(),
        min(other),
        max(other),
    );

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }

    #[inline(always)]
    fn sinh_cosh(self) -> (Self, Self) {
        self.unzip_map(<f64 as Scalar>::sinh_cosh)
    }

    /// Largest magnitude; NaN if any lane is NaN.
    #[inline(always)]
    fn magnitude(self) -> f64 {
        // NOTE: halves are compared lane by lane, because one long chain of comparisons would be
        // many times slower.
        let mut magnitudes = self.map(f64::abs).0;
        let mut len = N;
        while len > 1 {
            let half = len.div_ceil(2);
            for lane in 0..len - half {
                let (a, b) = (magnitudes[lane], magnitudes[lane + half]);
                magnitudes[lane] = if b > a || b.is_nan() { b } else { a };
            }
            len = half;
        }
        magnitudes.first().copied().unwrap_or(0.0)
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        self.0.iter().fold(true, |finite, value| finite & value.is_finite())
    }

    #[inline(always)]
    fn carried<V>(value: &mut V) {
        std::hint::black_box(value);
    }

    #[inline(always)]
    fn dispatch<W: Vectorised>(work: W) -> W::Output {
        widest(work)
    }
}

/// A truth value for each of `N` lanes: all bits set, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct LaneMask<const N: usize>([u64; N]);

impl<const N: usize> LaneMask<N> {
    /// Mask from a truth value for each lane.
    #[inline(always)]
    pub fn from_fn(mut value: impl FnMut(usize) -> bool) -> Self {
        let mut lanes = [0; N];
        for (lane, out) in lanes.iter_mut().enumerate() {
            *out = if value(lane) { u64::MAX } else { 0 };
        }
        Self(lanes)
    }

    /// Whether the mask is true in a lane.
    #[inline(always)]
    pub fn holds(self, lane: usize) -> bool {
        self.0[lane] != 0
    }

    /// Numbers of the lanes that are true.
    #[inline(always)]
    pub fn lanes(self) -> impl Iterator<Item = usize> {
        (0..N).filter(move |&lane| self.holds(lane))
    }

    /// Sets one lane to a truth value.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: bool) {
        self.0[lane] = if value { u64::MAX } else { 0 };
    }
}

lane_operator!(LaneMask, BitAnd, bitand, BitAndAssign, bitand_assign, &=);
lane_operator!(LaneMask, BitOr, bitor, BitOrAssign, bitor_assign, |=);

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;

    #[inline(always)]
    fn not(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = !*lane;
        }
        self
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    const NONE: Self = Self([0; N]);

    #[inline(always)]
    fn any(self) -> bool {
        let mut any = 0;
        for lane in self.0 {
            any |= lane;
        }
        any != 0
    }

    #[inline(always)]
    fn is_over(self) -> bool {
        false
    }

    #[inline(always)]
    fn lanes(self) -> impl Iterator<Item = usize> {
        LaneMask::lanes(self)
    }

    #[inline(always)]
    fn only(lane: usize) -> Self {
        Self::from_fn(|other| other == lane)
    }
}

impl<const N: usize> Branched for Lanes<N> {
    type Mask = LaneMask<N>;
    type Rounded = Self;

    #[inline(always)]
    fn rounded(self) -> Self {
        self
    }

    #[inline(always)]
    fn from_rounded(rounded: Self) -> Self {
        rounded
    }

    #[inline(always)]
    fn all_rounded<'r>(numbers: &'r [Self], _: &'r mut [Self]) -> &'r [Self] {
        numbers
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> LaneMask<N> {
        LaneMask::from_fn(|lane| self[lane] < other[lane])
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> LaneMask<N> {
        LaneMask::from_fn(|lane| self[lane] <= other[lane])
    }

    #[inline(always)]
    fn is_equal(self, other: Self) -> LaneMask<N> {
        LaneMask::from_fn(|lane| self[lane] == other[lane])
    }

    #[inline(always)]
    fn select(mask: LaneMask<N>, one: Self, other: Self) -> Self {
        Self::from_fn(|lane| if mask.holds(lane) { one[lane] } else { other[lane] })
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self[lane]
    }

    #[inline(always)]
    fn mapped(self, function: impl Fn(f64) -> f64) -> Self {
        self.map(function)
    }

    #[inline(always)]
    fn around(numbers: &[Self], place: Self) -> [Self; 3] {
        let last = numbers.len() - 1;
        let mut places = [0; N];
        for (lane, own) in places.iter_mut().enumerate() {
            *own = (place[lane] as usize).min(last);
        }
        [
            Self::from_fn(|lane| numbers[places[lane].saturating_sub(1)][lane]),
            Self::from_fn(|lane| numbers[places[lane]][lane]),
            Self::from_fn(|lane| numbers[(places[lane] + 1).min(last)][lane]),
        ]
    }
}

impl<const N: usize> Quartered for Lanes<N> {
    #[inline(always)]
    fn turned(quarters: Self, mut sine: Self, mut cosine: Self) -> (Self, Self) {
        for lane in 0..N {
            (sine[lane], cosine[lane]) = f64::turned(quarters[lane], sine[lane], cosine[lane]);
        }
        (sine, cosine)
    }

    #[inline(always)]
    fn each(self, function: fn(f64) -> (f64, f64)) -> (Self, Self) {
        self.unzip_map(function)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: Lanes<4> = Lanes([0.25, -0.5, 0.75, 1.0]);
    const Y: Lanes<4> = Lanes([2.0, 0.5, -0.125, 3.0]);

    #[test]
    fn every_lane_computes_what_a_double_computes() {
        let formula =
            |x: f64, y: f64| (Scalar::mul_add(x, y, x) - y / x) * Scalar::sin_cos(y.exp()).0;
        let lanes = (X.mul_add(Y, X) - Y / X) * Y.exp().sin_cos().0;
        assert_eq!(lanes, X.zip_map(Y, formula));
        assert_eq!(X.sinh_cosh().1, X.map(f64::cosh));
        assert_eq!(Y.atan2(X), Y.zip_map(X, f64::atan2));
    }

    #[test]
    fn magnitude_is_the_largest_over_the_lanes() {
        assert_eq!(Y.magnitude(), 3.0);
        assert_eq!((-Y).magnitude(), 3.0);
        assert!(Lanes([1.0, f64::NAN, 2.0]).magnitude().is_nan());
        assert!(!Lanes([1.0, f64::INFINITY]).is_finite());
    }

    /// The larger of `x` and `x² − 1`, computed with masks.
    fn larger<S: Branched>(x: S) -> S {
        let other = x * x - S::one();
        S::select(x.is_below(other), other, x)
    }

    #[test]
    fn masked_code_does_with_every_lane_what_it_does_with_a_number() {
        let x = Lanes([-2.0, -0.5, 1.0, f64::NAN, 2.0]);
        let (found, expected) = (larger(x), x.map(larger));
        for lane in [0, 1, 2, 4] {
            assert_eq!(found[lane], expected[lane]);
        }
        assert!(found[3].is_nan());
        let below = x.is_below(Lanes::splat(1.0));
        assert_eq!(below.lanes().collect::<Vec<_>>(), [0, 1]);
        assert_eq!((!below).lanes().collect::<Vec<_>>(), [2, 3, 4]);
        assert!(!(below & !below).any() && (below | !below).holds(3));
    }

    #[test]
    fn places_among_lanes_are_those_of_each_number() {
        let columns = [[3.0, 2.0, -1.0, 4.0], [-1.0, 2.0, 1.0, 0.5], [1.0; 4]];
        let lanes: [_; 4] = std::array::from_fn(|row| Lanes(columns.map(|column| column[row])));
        let places = Lanes([2.0, 0.0, 4.0]);
        let around = Lanes::around(&lanes, places);
        for (lane, column) in columns.iter().enumerate() {
            assert_eq!(f64::around(column, places[lane]), around.map(|own| own[lane]));
        }
        assert_eq!(f64::around(&columns[0], 0.0), [3.0, 3.0, 2.0]);
    }
}
