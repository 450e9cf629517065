//! Exponential.

use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `u = exp a`, from `Eu = (Ea) u`:
///
/// ```text
/// u_0 = exp a_0,   u_k = (1/k) Σ_{j=1}^{k} (Ea)_j u_{k−j}
/// ```
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    u: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(HeadFunction::Exp, &a[algebra.part(0)], out);
    }
    let factor = S::one() / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, u), factor, out);
}
