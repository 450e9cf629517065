//! The rate of a core: a loop of products and sums in registers and of nothing else.

use std::hint::black_box;

use pulp::{Simd, WithSimd};

/// Products and sums in registers, in enough independent chains to hide the latency.
pub(crate) struct Floor {
    pub(crate) is_fused: bool,
}

/// Independent chains of a floor, and steps of each.
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
