//! Numbers whose comparisons decide lane by lane.
//!
//! One idea: an algorithm that says with masks where its results hold runs on one number, whose
//! masks are truth values, and on lanes, which then take the same operations in the same order as
//! each number alone.

use std::fmt::Debug;
use std::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, Not};

use super::scalar::{Real, Scalar};

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

    /// Early-exit hint: whether no work is left for a loop that goes on where the mask is true;
    /// always false for lanes, where asking takes longer than going on.
    fn is_over(self) -> bool;

    /// The numbers of the lanes that are true.
    fn lanes(self) -> impl Iterator<Item = usize>;

    /// True in one lane alone.
    fn only(lane: usize) -> Self;
}

/// A [`Scalar`] that is compared lane by lane.
pub trait Branched: Scalar {
    /// A truth value for every lane.
    type Mask: Mask;
    /// As many doubles.
    type Rounded: Branched<Mask = Self::Mask, Rounded = Self::Rounded>;

    /// The nearest doubles.
    fn rounded(self) -> Self::Rounded;
    /// The same numbers.
    fn from_rounded(rounded: Self::Rounded) -> Self;
    /// The nearest doubles of several numbers, written to `room` unless the numbers are doubles.
    fn all_rounded<'r>(numbers: &'r [Self], room: &'r mut [Self::Rounded]) -> &'r [Self::Rounded];
    /// `self < other`.
    fn is_below(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn is_at_most(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn is_equal(self, other: Self) -> Self::Mask;
    /// One where a mask is true, the other where it is false.
    fn select(mask: Self::Mask, one: Self, other: Self) -> Self;
    /// The nearest double of one lane.
    fn lane(self, lane: usize) -> f64;
    /// A function of the nearest double of every lane.
    fn mapped(self, function: impl Fn(f64) -> f64) -> Self::Rounded;
    /// The numbers before, at and after a place; beyond an end, the number at that end.
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

    /// NOTE: block by block, as they were written: a wider load would wait until two stores have
    /// reached the cache.
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
