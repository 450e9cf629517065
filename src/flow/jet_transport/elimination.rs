//! Inverse of a small matrix of blocks, most of them zero: absent ones stay absent.

use super::block::Block;

/// A square matrix of blocks by rows, zero ones absent.
#[derive(Default)]
pub(super) struct BlockMatrix {
    dimension: usize,
    blocks: Vec<Option<Block>>,
}

impl BlockMatrix {
    /// Makes it a zero matrix, keeping its memory.
    pub(super) fn clear(&mut self, dimension: usize) {
        self.dimension = dimension;
        self.blocks.clear();
        self.blocks.resize_with(dimension * dimension, || None);
    }

    /// A block, unless it is zero.
    #[inline(always)]
    pub(super) fn get(&self, row: usize, column: usize) -> Option<&Block> {
        self.blocks[row * self.dimension + column].as_ref()
    }

    /// The place of a block.
    #[inline(always)]
    pub(super) fn entry(&mut self, row: usize, column: usize) -> &mut Option<Block> {
        &mut self.blocks[row * self.dimension + column]
    }

    /// Inverts it by block elimination along the diagonal, in the memory of both; `false` if a pivot is singular.
    #[inline(always)]
    pub(super) fn invert(&mut self, spare: &mut Self) -> bool {
        if let [Some(block)] = self.blocks.as_mut_slice() {
            return block.invert();
        }
        spare.clear(self.dimension);
        for row in 0..self.dimension {
            *spare.entry(row, row) = Some(Block::IDENTITY);
        }
        let is_regular = self.eliminate(spare);
        std::mem::swap(self, spare);
        is_regular
    }

    /// Turns itself into the identity and another matrix into its own inverse times that matrix.
    #[inline(always)]
    fn eliminate(&mut self, other: &mut Self) -> bool {
        for pivot in 0..self.dimension {
            let Some(mut scale) = *self.entry(pivot, pivot) else {
                return false;
            };
            if !scale.invert() {
                return false;
            }
            self.scale_row(pivot, &scale, pivot + 1);
            other.scale_row(pivot, &scale, 0);
            for row in (0..self.dimension).filter(|&row| row != pivot) {
                if let Some(factor) = *self.entry(row, pivot) {
                    self.subtract_row(row, pivot, &factor, pivot + 1);
                    other.subtract_row(row, pivot, &factor, 0);
                }
            }
        }
        true
    }

    /// `row = factor · row` in the columns from `first` on.
    #[inline(always)]
    fn scale_row(&mut self, row: usize, factor: &Block, first: usize) {
        for column in first..self.dimension {
            if let Some(block) = self.entry(row, column) {
                *block = factor.times(block);
            }
        }
    }

    /// `row −= factor · pivot` in the columns from `first` on.
    #[inline(always)]
    fn subtract_row(&mut self, row: usize, pivot: usize, factor: &Block, first: usize) {
        for column in first..self.dimension {
            if let Some(block) = self.get(pivot, column) {
                let product = factor.times(block);
                let target = self.entry(row, column).get_or_insert(Block::ZERO);
                target.subtract(&product);
            }
        }
    }
}
