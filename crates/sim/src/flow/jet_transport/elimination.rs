//! Inverse of a small matrix of blocks, most of them zero: absent ones stay absent.

use super::block::Block;

/// A square matrix of blocks by rows, zero ones absent.
#[derive(Default)]
pub(super) struct BlockMatrix {
    dimension: usize,
    blocks: Vec<Block>,
    /// Of each block, whether it is there; what is kept of others means nothing.
    present: Vec<bool>,
}

impl BlockMatrix {
    /// Makes it a zero matrix, keeping its memory.
    pub(super) fn clear(&mut self, dimension: usize) {
        self.dimension = dimension;
        self.blocks.resize(dimension * dimension, Block::ZERO);
        self.present.clear();
        self.present.resize(dimension * dimension, false);
    }

    /// A block, unless it is zero.
    #[inline(always)]
    pub(super) fn get(&self, row: usize, column: usize) -> Option<&Block> {
        let place = row * self.dimension + column;
        self.present[place].then(|| &self.blocks[place])
    }

    /// The place of a block that is there from now on, whatever it holds.
    #[inline(always)]
    pub(super) fn place(&mut self, row: usize, column: usize) -> &mut Block {
        let place = row * self.dimension + column;
        self.present[place] = true;
        &mut self.blocks[place]
    }

    /// Inverts it by block elimination along the diagonal, in the memory of both; `false` if a
    /// pivot is singular.
    #[inline(always)]
    pub(super) fn invert(&mut self, spare: &mut Self) -> bool {
        if let ([block], [true]) = (self.blocks.as_mut_slice(), self.present.as_slice()) {
            return block.invert();
        }
        spare.clear(self.dimension);
        for row in 0..self.dimension {
            *spare.place(row, row) = Block::IDENTITY;
        }
        let is_regular = self.eliminate(spare);
        std::mem::swap(self, spare);
        is_regular
    }

    /// Turns itself into the identity and another matrix into its own inverse times that matrix.
    #[inline(always)]
    fn eliminate(&mut self, other: &mut Self) -> bool {
        for pivot in 0..self.dimension {
            let Some(mut scale) = self.get(pivot, pivot).copied() else {
                return false;
            };
            if !scale.invert() {
                return false;
            }
            self.scale_row(pivot, &scale, pivot + 1);
            other.scale_row(pivot, &scale, 0);
            for row in (0..self.dimension).filter(|&row| row != pivot) {
                if let Some(factor) = self.get(row, pivot).copied() {
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
            if let Some(product) = self.get(row, column).map(|block| factor.times(block)) {
                *self.place(row, column) = product;
            }
        }
    }

    /// `row −= factor · pivot` in the columns from `first` on.
    #[inline(always)]
    fn subtract_row(&mut self, row: usize, pivot: usize, factor: &Block, first: usize) {
        for column in first..self.dimension {
            if let Some(block) = self.get(pivot, column) {
                let product = factor.times(block);
                if self.get(row, column).is_none() {
                    *self.place(row, column) = Block::ZERO;
                }
                self.place(row, column).subtract(&product);
            }
        }
    }
}
