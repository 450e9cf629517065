//! Plain values of a program's outputs.

use super::program::Program;
use crate::jet::TimeSeries;
use crate::numeric::Scalar;

impl Program {
    /// Computes the value of every slot from the inputs' values, slots `0..inputs` of `tape`.
    ///
    /// `tape` holds one scalar per slot; the value of output `k` is in slot [`output(k)`](Self::output).
    /// Nothing is allocated.
    ///
    /// # Panics
    ///
    /// If `tape` is shorter than [`slots`](Self::slots).
    pub fn evaluate_values<S: Scalar>(&self, tape: &mut [S]) {
        self.advance(&TimeSeries { order: 0 }, 0, tape, &mut [S::zero()]);
    }
}
