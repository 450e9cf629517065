//! Rows of power series over the extended state, combined into one series.

use crate::numeric::Scalar;

/// Coefficients that are formed together, for the processor's lanes.
const BLOCK: usize = 4;

/// One power series per component of the extended state.
///
/// Coefficients stand in blocks of [`BLOCK`] powers, in each block all components one after another.
#[derive(Clone, Debug)]
pub(super) struct SeriesRow<S> {
    columns: usize,
    blocks: Vec<[S; BLOCK]>,
}

/// Length of series of a degree, whole blocks.
pub(super) fn padded(coefficients: usize) -> usize {
    coefficients.div_ceil(BLOCK) * BLOCK
}

impl<S: Scalar> SeriesRow<S> {
    /// From the coefficient of each power, `coefficients[power][column]`; padded with zeros.
    pub(super) fn new(coefficients: &[Vec<S>], columns: usize) -> Self {
        let mut blocks = Vec::new();
        for block in coefficients.chunks(BLOCK) {
            for column in 0..columns {
                let value = |power: usize| block.get(power).map_or(S::zero(), |row| row[column]);
                blocks.push(std::array::from_fn(value));
            }
        }
        Self { columns, blocks }
    }

    /// Coefficients of the series `Σ y_j c_j` into `out`, of the padded length.
    #[inline]
    pub(super) fn combine(&self, extended: &[S], out: &mut [S]) {
        let extended = &extended[..self.columns];
        let (out, _) = out.as_chunks_mut::<BLOCK>();
        for (out, block) in out.iter_mut().zip(self.blocks.chunks_exact(self.columns)) {
            let mut sum = [S::zero(); BLOCK];
            for (&y, coefficients) in extended.iter().zip(block) {
                for lane in 0..BLOCK {
                    sum[lane] = y.mul_add(coefficients[lane], sum[lane]);
                }
            }
            *out = sum;
        }
    }
}
