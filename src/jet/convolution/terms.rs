//! The terms of one run of a product's coefficients.

use super::{Factor, Finish, LONGEST_IN_REGISTERS};
use crate::jet::product_table::{Pair, ProductTable, Run};
use crate::numeric::{Scalar, one_by_one};

/// The terms of one run of the result.
pub(super) struct Terms<'a, S> {
    pub(super) table: &'a ProductTable,
    pub(super) run: &'a Run,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
}

/// The first monomials of the runs of two families, by length.
#[derive(Clone, Copy)]
struct Families<'a> {
    left: &'a [u32],
    right: &'a [u32],
}

impl<'a, S: Scalar> Terms<'a, S> {
    /// The pairs of which products are formed, and of a square the family that is multiplied with itself.
    #[inline(always)]
    fn pairs(&self, square: bool) -> (&'a [Pair], Option<Pair>) {
        let pairs = self.table.pairs_of(self.run);
        if square {
            let (half, rest) = pairs.split_at(pairs.len() / 2);
            (half, rest.first().copied().filter(|_| pairs.len() % 2 == 1))
        } else {
            (pairs, None)
        }
    }

    /// The runs of a pair.
    #[inline(always)]
    fn families(&self, (left, right): Pair, len: usize) -> Option<Families<'a>> {
        Some(Families {
            left: self.table.starts(left, len)?,
            right: self.table.starts(right, len)?,
        })
    }

    /// Whether a left run of a length and the right one that goes with it can differ from zero.
    #[inline(always)]
    fn counts(&self, families: Families<'_>, left: usize) -> bool {
        let right = families.right.len() - left;
        families.left[left - 1] >= self.a.first && families.right[right] >= self.b.first
    }

    #[inline(always)]
    pub(super) fn add_all<const LEN: usize, const WITHOUT_FIRST: bool, const SQUARE: bool>(
        &self,
        out: &mut [S],
    ) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        let (mut pairs, root) = self.pairs(SQUARE);
        if WITHOUT_FIRST && let [first, rest @ ..] = pairs {
            let Some(families) = self.families(*first, LEN) else {
                return;
            };
            self.add_blocks::<LEN>(families, 2, LEN, &mut sums);
            pairs = rest;
        }
        for &pair in pairs {
            let Some(families) = self.families(pair, LEN) else {
                return;
            };
            self.add_blocks::<LEN>(families, 1, LEN, &mut sums);
        }
        if SQUARE {
            if let Some(families) = root.and_then(|root| self.families(root, LEN)) {
                self.add_blocks::<LEN>(families, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(families) = root.and_then(|root| self.families(root, LEN))
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks::<LEN>(families, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Products of the runs of two families, the left ones of lengths in a range that is known in advance.
    #[inline(always)]
    fn add_blocks<const LEN: usize>(
        &self,
        families: Families<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes = |left: usize| from <= left && left <= to;
        self.add_block::<1, LEN>(families, takes(1), sums);
        self.add_block::<2, LEN>(families, takes(2), sums);
        self.add_block::<3, LEN>(families, takes(3), sums);
        self.add_block::<4, LEN>(families, takes(4), sums);
        self.add_block::<5, LEN>(families, takes(5), sums);
        self.add_block::<6, LEN>(families, takes(6), sums);
        self.add_block::<7, LEN>(families, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(families, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
    #[inline(always)]
    fn add_block<const LEFT: usize, const LEN: usize>(
        &self,
        families: Families<'_>,
        is_taken: bool,
        sums: &mut [S; LEN],
    ) {
        if LEFT > LEN || !is_taken {
            return;
        }
        let right = LEN + 1 - LEFT;
        let i = families.left[LEFT - 1] as usize;
        let j = families.right[right - 1] as usize;
        let (Some(a), Some(b)) = (
            self.a.coefficients.get(i..i + LEFT),
            self.b.coefficients.get(j..j + right),
        ) else {
            return;
        };
        for p in 0..LEFT {
            for q in 0..right {
                sums[p + q] = a[p].mul_add(b[q], sums[p + q]);
            }
        }
    }

    /// Products that can differ from zero.
    #[inline(always)]
    pub(super) fn add_some<const LEN: usize>(&self, square: bool, out: &mut [S]) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        let (pairs, root) = self.pairs(square);
        for &pair in pairs {
            if let Some(families) = self.families(pair, LEN) {
                self.add_blocks_that_count(families, 1, LEN, &mut sums);
            }
        }
        if square {
            if let Some(families) = root.and_then(|root| self.families(root, LEN)) {
                self.add_blocks_that_count(families, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(families) = root.and_then(|root| self.families(root, LEN))
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks_that_count(families, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Those of the products of two families that can differ from zero.
    #[inline(always)]
    fn add_blocks_that_count<const LEN: usize>(
        &self,
        families: Families<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes =
            |left: usize| left <= LEN && from <= left && left <= to && self.counts(families, left);
        self.add_block::<1, LEN>(families, takes(1), sums);
        self.add_block::<2, LEN>(families, takes(2), sums);
        self.add_block::<3, LEN>(families, takes(3), sums);
        self.add_block::<4, LEN>(families, takes(4), sums);
        self.add_block::<5, LEN>(families, takes(5), sums);
        self.add_block::<6, LEN>(families, takes(6), sums);
        self.add_block::<7, LEN>(families, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(families, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The same for a run of any length.
    #[inline(always)]
    pub(super) fn add_in_memory(&self, square: bool, out: &mut [S]) {
        let len = out.len();
        let mut sums = vec![S::zero(); len];
        let (pairs, root) = self.pairs(square);
        for &pair in pairs {
            if let Some(families) = self.families(pair, len) {
                self.add_blocks_of(families, 1..=len, &mut sums);
            }
        }
        if square {
            let families = root.and_then(|root| self.families(root, len));
            if let Some(families) = families {
                self.add_blocks_of(families, 1..=len / 2, &mut sums);
            }
            sums.iter_mut().for_each(|sum| *sum += *sum);
            if let Some(families) = families.filter(|_| len % 2 == 1) {
                let half = len.div_ceil(2);
                self.add_blocks_of(families, half..=half, &mut sums);
            }
        }
        let monomials = self.run.monomials.clone();
        for ((monomial, &sum), value) in monomials.zip(&sums).zip(out) {
            self.finish
                .store(monomial, [sum], std::array::from_mut(value));
        }
    }

    #[inline(always)]
    fn add_blocks_of(
        &self,
        families: Families<'_>,
        lefts: std::ops::RangeInclusive<usize>,
        sums: &mut [S],
    ) {
        for left in lefts {
            if !self.counts(families, left) {
                continue;
            }
            let right = sums.len() + 1 - left;
            let (i, j) = (families.left[left - 1], families.right[right - 1]);
            let a = &self.a.coefficients[i as usize..i as usize + left];
            let b = &self.b.coefficients[j as usize..j as usize + right];
            for (p, &a) in a.iter().enumerate() {
                for (sum, &b) in sums[p..].iter_mut().zip(b) {
                    *sum = a.mul_add(b, *sum);
                }
            }
        }
    }
}
