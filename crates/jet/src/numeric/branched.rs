//! Numbers whose comparisons decide lane by lane.
//!
//! One idea: an algorithm that says with masks where its results hold runs on one number, whose
//! masks are truth values, and on lanes, which then take the same operations in the same order as
//! each number alone.

use std::fmt::Debug;
use std::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, Not};

use super::lanes::lane_operator;
use super::{Lanes, Real, Scalar};

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

    /// Early-exit hint: whether it is false everywhere, for one number; always false for lanes,
    /// where asking takes longer than going on.
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
    /// The nearest doubles of several, which may need room.
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
    /// The numbers before a place, at it and after it, the outermost ones beyond.
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

/// A truth value for each of `N` lanes: all bits, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct LaneMask<const N: usize>([u64; N]);

impl<const N: usize> LaneMask<N> {
    /// From a truth value for each lane.
    #[inline(always)]
    pub fn from_fn(mut value: impl FnMut(usize) -> bool) -> Self {
        let mut lanes = [0; N];
        for (lane, out) in lanes.iter_mut().enumerate() {
            *out = if value(lane) { u64::MAX } else { 0 };
        }
        Self(lanes)
    }

    /// Whether one lane is true.
    #[inline(always)]
    pub fn holds(self, lane: usize) -> bool {
        self.0[lane] != 0
    }

    /// The numbers of the lanes that are true.
    #[inline(always)]
    pub fn lanes(self) -> impl Iterator<Item = usize> {
        (0..N).filter(move |&lane| self.holds(lane))
    }

    /// Puts one lane to a truth value.
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
        Self::from_fn(|lane| {
            if mask.holds(lane) {
                one[lane]
            } else {
                other[lane]
            }
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The larger of a number and its square's excess over one, by masks.
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
            assert_eq!(
                f64::around(column, places[lane]),
                around.map(|own| own[lane])
            );
        }
        assert_eq!(f64::around(&columns[0], 0.0), [3.0, 3.0, 2.0]);
    }
}
