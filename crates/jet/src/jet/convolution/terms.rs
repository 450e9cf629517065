//! The terms of one run of a product's coefficients.

use super::{Factor, Finish, LONGEST_IN_REGISTERS};
use crate::jet::product_table::{Pair, Pairs, ProductTable, Run};
use crate::numeric::{Scalar, one_by_one};

/// The terms of one run of the result.
pub(super) struct Terms<'a, S> {
    pub(super) table: &'a ProductTable,
    pub(super) run: &'a Run,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
}

impl<'a, S: Scalar> Terms<'a, S> {
    /// The pairs of which products are formed, and of a square the family that is multiplied with
    /// itself.
    #[inline(always)]
    fn pairs(&self, square: bool) -> (Pairs<'a>, Option<Pair<'a>>) {
        let pairs = self.table.pairs_of_run(self.run);
        if square { pairs.half() } else { (pairs, None) }
    }

    /// Whether a left run of a length and the right one that goes with it can differ from zero.
    #[inline(always)]
    fn counts(&self, pair: Pair<'_>, left: usize, len: usize) -> bool {
        pair.left[left - 1] >= self.a.first && pair.right[len - left] >= self.b.first
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
        if WITHOUT_FIRST {
            let (first, rest) = pairs.split_first();
            if let Some(pair) = first {
                self.add_blocks::<LEN>(pair, 2, LEN, &mut sums);
            }
            pairs = rest;
        }
        for pair in pairs.iter() {
            self.add_blocks::<LEN>(pair, 1, LEN, &mut sums);
        }
        if SQUARE {
            if let Some(pair) = root {
                self.add_blocks::<LEN>(pair, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(pair) = root
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks::<LEN>(pair, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Products of the runs of two families, the left ones of lengths in a range that is known in
    /// advance.
    #[inline(always)]
    fn add_blocks<const LEN: usize>(
        &self,
        pair: Pair<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let Some(pair) = pair.shortest::<LEN>() else {
            return;
        };
        let takes = |left: usize| from <= left && left <= to;
        self.add_block::<1, LEN>(pair, takes(1), sums);
        self.add_block::<2, LEN>(pair, takes(2), sums);
        self.add_block::<3, LEN>(pair, takes(3), sums);
        self.add_block::<4, LEN>(pair, takes(4), sums);
        self.add_block::<5, LEN>(pair, takes(5), sums);
        self.add_block::<6, LEN>(pair, takes(6), sums);
        self.add_block::<7, LEN>(pair, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(pair, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
    #[inline(always)]
    fn add_block<const LEFT: usize, const LEN: usize>(
        &self,
        [left, right]: [&[u32; LEN]; 2],
        is_taken: bool,
        sums: &mut [S; LEN],
    ) {
        if LEFT > LEN || !is_taken {
            return;
        }
        let rest = LEN + 1 - LEFT;
        let (i, j) = (left[LEFT - 1] as usize, right[rest - 1] as usize);
        let (Some(a), Some(b)) = (
            self.a.coefficients.get(i..i + LEFT),
            self.b.coefficients.get(j..j + rest),
        ) else {
            return;
        };
        for p in 0..LEFT {
            for q in 0..rest {
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
        for pair in pairs.iter() {
            self.add_blocks_that_count(pair, 1, LEN, &mut sums);
        }
        if square {
            if let Some(pair) = root {
                self.add_blocks_that_count(pair, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(pair) = root
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks_that_count(pair, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Those of the products of two families that can differ from zero.
    #[inline(always)]
    fn add_blocks_that_count<const LEN: usize>(
        &self,
        pair: Pair<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes =
            |left: usize| left <= LEN && from <= left && left <= to && self.counts(pair, left, LEN);
        let Some(pair) = pair.shortest::<LEN>() else {
            return;
        };
        self.add_block::<1, LEN>(pair, takes(1), sums);
        self.add_block::<2, LEN>(pair, takes(2), sums);
        self.add_block::<3, LEN>(pair, takes(3), sums);
        self.add_block::<4, LEN>(pair, takes(4), sums);
        self.add_block::<5, LEN>(pair, takes(5), sums);
        self.add_block::<6, LEN>(pair, takes(6), sums);
        self.add_block::<7, LEN>(pair, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(pair, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The same for a run of any length.
    #[inline(always)]
    pub(super) fn add_in_memory(&self, square: bool, out: &mut [S]) {
        let len = out.len();
        let mut sums = vec![S::zero(); len];
        let (pairs, root) = self.pairs(square);
        for pair in pairs.iter() {
            self.add_blocks_of(pair, 1..=len, &mut sums);
        }
        if square {
            if let Some(pair) = root {
                self.add_blocks_of(pair, 1..=len / 2, &mut sums);
            }
            sums.iter_mut().for_each(|sum| *sum += *sum);
            if let Some(pair) = root.filter(|_| len % 2 == 1) {
                let half = len.div_ceil(2);
                self.add_blocks_of(pair, half..=half, &mut sums);
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
        pair: Pair<'_>,
        lefts: std::ops::RangeInclusive<usize>,
        sums: &mut [S],
    ) {
        for left in lefts {
            if !self.counts(pair, left, sums.len()) {
                continue;
            }
            let right = sums.len() + 1 - left;
            let (i, j) = (pair.left[left - 1], pair.right[right - 1]);
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
