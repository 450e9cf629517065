//! Square blocks over the nodes of an element.

use super::gauss::{NODES, NodeValues};
use crate::numeric::Lanes;

/// A matrix over the nodes, by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Block(pub(super) [NodeValues; NODES]);

impl Block {
    /// The identity.
    pub(super) fn identity() -> Self {
        Self(std::array::from_fn(|j| {
            Lanes::from_fn(|i| if i == j { 1.0 } else { 0.0 })
        }))
    }

    /// The product with a column of node values.
    #[inline(always)]
    pub(super) fn apply(&self, values: NodeValues) -> NodeValues {
        self.apply_add(values, Lanes([0.0; NODES]))
    }

    /// The product with a column of node values, plus a column.
    #[inline(always)]
    pub(super) fn apply_add(&self, values: NodeValues, start: NodeValues) -> NodeValues {
        let mut sum = start.0;
        for (column, &value) in self.0.iter().zip(&values.0) {
            for (lane, &entry) in sum.iter_mut().zip(&column.0) {
                *lane += entry * value;
            }
        }
        Lanes(sum)
    }

    /// `self · other`.
    pub(super) fn times(&self, other: &Self) -> Self {
        Self(other.0.map(|column| self.apply(column)))
    }

    /// `self − other`.
    pub(super) fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|j| self.0[j] - other.0[j]))
    }

    /// `−self`.
    pub(super) fn negative(&self) -> Self {
        Self(self.0.map(|column| -column))
    }

    /// The inverse by Gauss-Jordan elimination with pivots from each column; `None` if singular.
    pub(super) fn inverse(&self) -> Option<Self> {
        let (mut matrix, mut inverse) = (self.transposed().0, Self::identity().0);
        for k in 0..NODES {
            let size = |row: &usize| matrix[*row].0[k].abs();
            let pivot = (k..NODES).max_by(|a, b| size(a).total_cmp(&size(b)))?;
            matrix.swap(k, pivot);
            inverse.swap(k, pivot);
            let factor = 1.0 / matrix[k].0[k];
            if !factor.is_finite() {
                return None;
            }
            matrix[k] *= Lanes::splat(factor);
            inverse[k] *= Lanes::splat(factor);
            let (row, inverse_row) = (matrix[k], inverse[k]);
            for i in (0..NODES).filter(|&i| i != k) {
                let factor = Lanes::splat(matrix[i].0[k]);
                matrix[i] -= row * factor;
                inverse[i] -= inverse_row * factor;
            }
        }
        Some(Self(inverse).transposed())
    }

    fn transposed(&self) -> Self {
        Self(std::array::from_fn(|j| Lanes::from_fn(|i| self.0[i].0[j])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_block_is_the_identity() {
        let block = Block(std::array::from_fn(|j| {
            Lanes::from_fn(|i| {
                1.0 / (1.0 + (i as f64 - 0.7 * j as f64).powi(2)) + 0.3 * (i == j) as u8 as f64
            })
        }));
        let product = block.inverse().unwrap().times(&block);
        let difference = product.minus(&Block::identity());
        for column in difference.0 {
            assert!(column.0.iter().all(|entry| entry.abs() < 1e-12));
        }
    }

    #[test]
    fn singular_blocks_have_no_inverse() {
        assert_eq!(Block([Lanes([1.0; NODES]); NODES]).inverse(), None);
    }
}
