//! The linear equations of collocation on one element, solved once for every coefficient.
//!
//! One idea: the part of degree `k` of the state enters its own equation linearly, with the same
//! matrix whatever the degree and the monomial:
//!
//! ```text
//! x(c_i) = x(0) + h Σ_j A_ij (J(c_j) x(c_j) + r(c_j))
//! ```
//!
//! so `x = P x(0) + Q r` with `P = (I − h A⊗J)⁻¹ (1⊗I)` and `Q = (I − h A⊗J)⁻¹ (h A⊗I)`. The matrix is
//! a few blocks over the nodes, most of them zero: block elimination keeps them absent.

use super::block::Block;
use super::gauss::{GAUSS, NODES, NodeValues};
use crate::numeric::{Lanes, Scalar};

/// `P` and `Q` of one element.
pub(super) struct ElementSolver {
    /// `(column, P_ac)` of each row: the response of component `a` to the initial value of `c`.
    responses: Vec<Vec<(usize, NodeValues)>>,
    /// `(column, Q_ac)` of each row: the response of component `a` to the remainder of `c`.
    remainders: Vec<Vec<(usize, Block)>>,
}

/// A matrix of blocks, zero ones absent.
type BlockMatrix = Vec<Vec<Option<Block>>>;

impl ElementSolver {
    /// From the Jacobian `jacobian[a · dimension + c] = ∂f_a/∂x_c` at the nodes, the element's length,
    /// and which components have a remainder at all.
    ///
    /// `None` if a block pivot is singular: the element is too long.
    pub(super) fn new(
        jacobian: &[NodeValues],
        length: f64,
        has_remainder: &[bool],
    ) -> Option<Self> {
        let dimension = has_remainder.len();
        let inverse = inverse(collocation_matrix(jacobian, length, dimension))?;
        let integration = Block(
            GAUSS
                .integration
                .map(|column| column * Lanes::splat(length)),
        );
        let row_response = |(column, block): (usize, &Option<Block>)| {
            let block = block.as_ref()?;
            Some((column, block.apply(Lanes([1.0; NODES]))))
        };
        let row_remainder = |(column, block): (usize, &Option<Block>)| {
            let block = block.as_ref().filter(|_| has_remainder[column])?;
            Some((column, block.times(&integration)))
        };
        let responses = inverse
            .iter()
            .map(|row| row.iter().enumerate().filter_map(row_response).collect())
            .collect();
        let remainders = inverse
            .iter()
            .map(|row| row.iter().enumerate().filter_map(row_remainder).collect())
            .collect();
        Some(Self {
            responses,
            remainders,
        })
    }

    /// Node values of every component from its initial values and remainders.
    #[inline]
    pub(super) fn solve(
        &self,
        initial: &[f64],
        remainders: &[NodeValues],
        states: &mut [NodeValues],
    ) {
        let zero = Lanes([0.0; NODES]);
        let rows = self.responses.iter().zip(&self.remainders);
        for (state, (responses, blocks)) in states.iter_mut().zip(rows) {
            let mut sum = zero;
            for (column, response) in responses {
                sum = response.mul_add(Lanes::splat(initial[*column]), sum);
            }
            for (column, block) in blocks {
                if remainders[*column] != zero {
                    sum = block.apply_add(remainders[*column], sum);
                }
            }
            *state = sum;
        }
    }

    /// Largest of the last Legendre modes of the fundamental matrix, relative to each entry.
    pub(super) fn fundamental_tail(&self) -> f64 {
        let relative = |response: &NodeValues| {
            GAUSS.tail(*response) / response.magnitude().max(f64::MIN_POSITIVE)
        };
        self.responses
            .iter()
            .flatten()
            .map(|(_, response)| relative(response))
            .fold(0.0, f64::max)
    }
}

/// `I − h A⊗J`.
fn collocation_matrix(jacobian: &[NodeValues], length: f64, dimension: usize) -> BlockMatrix {
    let entry = |row: usize, column: usize| {
        let slopes = jacobian[row * dimension + column];
        let vanishes = slopes == Lanes([0.0; NODES]);
        if vanishes {
            return (row == column).then(Block::identity);
        }
        let scaled = |j: usize| GAUSS.integration[j] * Lanes::splat(-length * slopes.0[j]);
        let mut block = Block(std::array::from_fn(scaled));
        if row == column {
            (0..NODES).for_each(|node| block.0[node].0[node] += 1.0);
        }
        Some(block)
    };
    (0..dimension)
        .map(|row| (0..dimension).map(|column| entry(row, column)).collect())
        .collect()
}

/// Inverse of a matrix of blocks by block elimination along the diagonal.
fn inverse(mut matrix: BlockMatrix) -> Option<BlockMatrix> {
    let dimension = matrix.len();
    let unit = |row: usize, column: usize| (row == column).then(Block::identity);
    let mut inverse: BlockMatrix = (0..dimension)
        .map(|row| (0..dimension).map(|column| unit(row, column)).collect())
        .collect();
    for pivot in 0..dimension {
        let block = matrix[pivot][pivot].as_ref()?;
        if *block != Block::identity() {
            let scale = block.inverse()?;
            scale_row(&mut matrix[pivot][pivot + 1..], &scale);
            scale_row(&mut inverse[pivot], &scale);
        }
        for row in (0..dimension).filter(|&row| row != pivot) {
            if let Some(factor) = matrix[row][pivot] {
                subtract_row(&mut matrix, row, pivot, &factor, pivot + 1);
                subtract_row(&mut inverse, row, pivot, &factor, 0);
            }
        }
    }
    Some(inverse)
}

fn scale_row(row: &mut [Option<Block>], factor: &Block) {
    let identity = Block::identity();
    for block in row.iter_mut().flatten() {
        *block = if *block == identity {
            *factor
        } else {
            factor.times(block)
        };
    }
}

/// `row −= factor · pivot` in the columns from `first` on.
fn subtract_row(matrix: &mut BlockMatrix, row: usize, pivot: usize, factor: &Block, first: usize) {
    let identity = Block::identity();
    let pivot_row = matrix[pivot].clone();
    let columns = pivot_row.iter().zip(&mut matrix[row]).skip(first);
    for (block, target) in columns.filter_map(|(block, target)| Some((block.as_ref()?, target))) {
        let product = if *block == identity {
            *factor
        } else {
            factor.times(block)
        };
        *target = Some(match target {
            Some(old) => old.minus(&product),
            None => product.negative(),
        });
    }
}
