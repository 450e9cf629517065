//! Square blocks over the nodes of an element.

use super::gauss::{NODES, NodeValues};
use crate::numeric::{Lanes, Scalar, one_by_one};

/// A matrix over the nodes, by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Block(pub(super) [NodeValues; NODES]);

/// Entries of the natural size of the blocks here, `1 − small`: a diagonal one above it is taken as
/// pivot.
const GOOD_PIVOT: f64 = 0.5;

/// Columns that a product forms together: their sums fit the registers and hide each other's
/// latency.
pub(super) const TOGETHER: usize = 4;

impl Block {
    /// The zero block.
    pub(super) const ZERO: Self = Self([Lanes([0.0; NODES]); NODES]);

    /// The identity.
    pub(super) const IDENTITY: Self = {
        let mut identity = Self::ZERO;
        let mut node = 0;
        while node < NODES {
            identity.0[node].0[node] = 1.0;
            node += 1;
        }
        identity
    };

    /// Adds the products with some columns to other columns.
    #[inline(always)]
    pub(super) fn add_products<const COLUMNS: usize>(
        &self,
        values: &[NodeValues; COLUMNS],
        sums: &mut [NodeValues; COLUMNS],
    ) {
        for (j, column) in self.0.iter().enumerate() {
            for (sum, values) in sums.iter_mut().zip(values) {
                *sum = column.mul_add(Lanes::splat(values.0[j]), *sum);
            }
        }
    }

    /// The product with a column of node values.
    #[inline(always)]
    pub(super) fn apply(&self, values: NodeValues) -> NodeValues {
        let mut sums = [Lanes([0.0; NODES])];
        self.add_products(&[values], &mut sums);
        sums[0]
    }

    /// `self · other`.
    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = Self::ZERO;
        self.add_times(other, &mut product);
        product
    }

    /// Adds `self · other` to a sum.
    #[inline(always)]
    pub(super) fn add_times(&self, other: &Self, sum: &mut Self) {
        let (values, _) = other.0.as_chunks::<TOGETHER>();
        let (sums, _) = sum.0.as_chunks_mut::<TOGETHER>();
        for (sums, values) in sums.iter_mut().zip(values) {
            self.add_products(values, sums);
        }
    }

    /// `factor · self`.
    #[inline(always)]
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let mut block = *self;
        for (j, column) in block.0.iter_mut().enumerate() {
            one_by_one::<NodeValues>(j);
            *column *= Lanes::splat(factor);
        }
        block
    }

    /// Becomes another block less `diag(rows) · factor`.
    #[inline(always)]
    pub(super) fn set_difference(&mut self, from: &Self, rows: NodeValues, factor: &Self) {
        let columns = from.0.iter().zip(&factor.0);
        for (j, (column, (from, factor))) in self.0.iter_mut().zip(columns).enumerate() {
            one_by_one::<NodeValues>(j);
            *column = *from - rows * *factor;
        }
    }

    /// Subtracts `diag(rows) · other`.
    #[inline(always)]
    pub(super) fn subtract_scaled_rows(&mut self, rows: NodeValues, other: &Self) {
        for (j, (column, other)) in self.0.iter_mut().zip(&other.0).enumerate() {
            one_by_one::<NodeValues>(j);
            *column -= rows * *other;
        }
    }

    /// Subtracts another block.
    #[inline(always)]
    pub(super) fn subtract(&mut self, other: &Self) {
        for (j, (column, other)) in self.0.iter_mut().zip(&other.0).enumerate() {
            one_by_one::<NodeValues>(j);
            *column -= *other;
        }
    }

    /// Inverts it by elimination in place; `false` if it is singular, and spoilt.
    ///
    /// NOTE: it eliminates along columns, that is, inverts the transpose.
    #[inline(always)]
    pub(super) fn invert(&mut self) -> bool {
        let columns = &mut self.0;
        let mut pivots = [0; NODES];
        for k in 0..NODES {
            let pivot = pivot(columns, k);
            pivots[k] = pivot;
            if pivot != k {
                columns.swap(k, pivot);
            }
            let factor = 1.0 / columns[k].0[k];
            if !factor.is_finite() {
                return false;
            }
            // NOTE: no lane is written alone: a vector read after it would wait for the write to
            // reach the cache.
            let (unit, others) = (Self::IDENTITY.0[k], OTHERS[k]);
            let column = (columns[k] * others + unit) * Lanes::splat(factor);
            for (i, target) in columns.iter_mut().enumerate() {
                one_by_one::<NodeValues>(i);
                let factor = Lanes::splat(target.0[k]);
                *target = *target * others - column * factor;
            }
            columns[k] = column;
        }
        for (k, &pivot) in pivots.iter().enumerate().rev() {
            if pivot != k {
                columns.iter_mut().for_each(|column| column.0.swap(k, pivot));
            }
        }
        true
    }
}

/// Ones in all lanes but one.
const OTHERS: [NodeValues; NODES] = {
    let mut others = [Lanes([1.0; NODES]); NODES];
    let mut lane = 0;
    while lane < NODES {
        others[lane].0[lane] = 0.0;
        lane += 1;
    }
    others
};

/// The column from `k` on with the largest entry in row `k`, or `k` itself where its own is large
/// enough.
#[inline(always)]
fn pivot(columns: &[NodeValues; NODES], k: usize) -> usize {
    if columns[k].0[k].abs() >= GOOD_PIVOT {
        return k;
    }
    let size = |column: &usize| columns[*column].0[k].abs();
    (k..NODES).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_inverts(block: &Block, tolerance: f64) {
        let mut inverse = *block;
        assert!(inverse.invert());
        let mut difference = inverse.times(block);
        difference.subtract(&Block::IDENTITY);
        for column in difference.0 {
            assert!(column.0.iter().all(|entry| entry.abs() < tolerance));
        }
    }

    #[test]
    fn inverse_times_block_is_the_identity() {
        assert_inverts(
            &Block(std::array::from_fn(|j| {
                Lanes::from_fn(|i| {
                    1.0 / (1.0 + (i as f64 - 0.7 * j as f64).powi(2)) + 0.3 * (i == j) as u8 as f64
                })
            })),
            1e-12,
        );
    }

    #[test]
    fn a_block_without_a_diagonal_is_inverted_by_pivots() {
        let cycle = |j: usize| Lanes::from_fn(|i| f64::from(i == (j + 3) % NODES) * (j + 1) as f64);
        assert_inverts(&Block(std::array::from_fn(cycle)), 1e-15);
    }

    #[test]
    fn singular_blocks_have_no_inverse() {
        assert!(!Block([Lanes([1.0; NODES]); NODES]).invert());
    }
}
