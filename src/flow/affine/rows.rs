//! Rows over the extended state that are multiplied with it together, such as the coefficients of a power series.

use crate::numeric::Scalar;

/// Rows that are formed together where nothing else is said, for the processor's lanes.
const BLOCK: usize = 4;

/// Rows over the extended state.
///
/// They stand in blocks, in each block all columns one after another.
#[derive(Clone, Debug)]
pub struct RowTable<S, const N: usize = BLOCK> {
    columns: usize,
    blocks: Vec<[S; N]>,
}

/// Length of series of a degree, whole blocks.
pub(super) fn padded(coefficients: usize) -> usize {
    coefficients.div_ceil(BLOCK) * BLOCK
}

impl<S: Scalar, const N: usize> RowTable<S, N> {
    /// From its rows; padded with zeros to whole blocks.
    pub fn new(rows: &[Vec<S>], columns: usize) -> Self {
        Self::padded(rows, rows.len(), columns)
    }

    /// From its rows, as many as these; padded with zeros.
    pub(super) fn padded(rows: &[Vec<S>], count: usize, columns: usize) -> Self {
        let value = |row: usize, column: usize| rows.get(row).map_or(S::zero(), |row| row[column]);
        Self::from_fn(count, columns, value)
    }

    /// From the entries of a number of rows; padded with zeros to whole blocks.
    pub(super) fn from_fn(rows: usize, columns: usize, value: impl Fn(usize, usize) -> S) -> Self {
        let mut blocks = Vec::with_capacity(rows.div_ceil(N) * columns);
        for first in (0..rows).step_by(N) {
            for column in 0..columns {
                let entry = |row: usize| match first + row < rows {
                    true => value(first + row, column),
                    false => S::zero(),
                };
                blocks.push(std::array::from_fn(entry));
            }
        }
        Self { columns, blocks }
    }

    /// The product of every row with the extended state, into `out`, of the padded length.
    #[inline(always)]
    pub(super) fn combine(&self, extended: &[S], out: &mut [S]) {
        let extended = &extended[..self.columns];
        let (out, _) = out.as_chunks_mut::<N>();
        for (out, block) in out.iter_mut().zip(self.blocks.chunks_exact(self.columns)) {
            *out = products(extended, block);
        }
    }

    /// The products of the first rows with the extended state, as many as `out` holds.
    #[inline(always)]
    pub fn multiply(&self, extended: &[S], out: &mut [S]) {
        let extended = &extended[..self.columns];
        let blocks = self.blocks.chunks_exact(self.columns);
        for (out, block) in out.chunks_mut(N).zip(blocks) {
            for (out, product) in out.iter_mut().zip(products(extended, block)) {
                *out = product;
            }
        }
    }
}

#[inline(always)]
fn products<S: Scalar, const N: usize>(extended: &[S], block: &[[S; N]]) -> [S; N] {
    let mut sum = [S::zero(); N];
    for (&y, coefficients) in extended.iter().zip(block) {
        for lane in 0..N {
            sum[lane] = y.mul_add(coefficients[lane], sum[lane]);
        }
    }
    sum
}
