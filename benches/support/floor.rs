//! Rate of a core: a loop of nothing but products and sums in registers.

use std::hint::black_box;

use pulp::{Simd, WithSimd};

/// Loop of products and sums in registers, in enough independent chains to hide the latency.
pub(crate) struct Floor {
    pub(crate) is_fused: bool,
}

/// Number of independent chains of the loop, and number of steps of each.
pub(crate) const CHAINS: usize = 16;
pub(crate) const ROUNDS: usize = 1000;

impl WithSimd for Floor {
    /// Lanes of a register.
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let factor = black_box(simd.splat_f64s(0.999));
        let mut sums = [factor; CHAINS];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = if self.is_fused {
                    simd.mul_add_f64s(*sum, factor, factor)
                } else {
                    simd.add_f64s(simd.mul_f64s(*sum, factor), factor)
                };
            }
        }
        black_box(sums);
        S::F64_LANES
    }
}
