//! Inverse of a small matrix of blocks, most of them zero: absent ones stay absent.

use super::block::Block;

/// A square matrix of blocks by rows, zero ones absent.
pub(super) type BlockMatrix = Vec<Vec<Option<Block>>>;

/// Inverse by block elimination along the diagonal; `None` if a pivot is singular.
#[inline(always)]
pub(super) fn inverse(mut matrix: BlockMatrix) -> Option<BlockMatrix> {
    let dimension = matrix.len();
    if let [row] = matrix.as_mut_slice() {
        row[0] = Some(row[0].as_ref()?.inverse()?);
        return Some(matrix);
    }
    let unit = |row: usize, column: usize| (row == column).then_some(Block::IDENTITY);
    let mut inverse: BlockMatrix = (0..dimension)
        .map(|row| (0..dimension).map(|column| unit(row, column)).collect())
        .collect();
    for pivot in 0..dimension {
        let scale = matrix[pivot][pivot].as_ref()?.inverse()?;
        scale_row(&mut matrix[pivot][pivot + 1..], &scale);
        scale_row(&mut inverse[pivot], &scale);
        for row in (0..dimension).filter(|&row| row != pivot) {
            if let Some(factor) = matrix[row][pivot] {
                subtract_row(&mut matrix, row, pivot, &factor, pivot + 1);
                subtract_row(&mut inverse, row, pivot, &factor, 0);
            }
        }
    }
    Some(inverse)
}

#[inline(always)]
fn scale_row(row: &mut [Option<Block>], factor: &Block) {
    for block in row.iter_mut().flatten() {
        *block = factor.times(block);
    }
}

/// `row −= factor · pivot` in the columns from `first` on.
#[inline(always)]
fn subtract_row(matrix: &mut BlockMatrix, row: usize, pivot: usize, factor: &Block, first: usize) {
    let pivot_row = matrix[pivot].clone();
    for (block, target) in pivot_row.iter().zip(&mut matrix[row]).skip(first) {
        if let Some(block) = block {
            let old = target.unwrap_or(Block::ZERO);
            *target = Some(old.minus(&factor.times(block)));
        }
    }
}
