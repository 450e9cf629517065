//! Quotient `u = a / b`.

use crate::jet::Graded;
use crate::numeric::Scalar;

/// Part of degree `k` of `u = a / b`, from `u b = a`:
///
/// ```text
/// u_k = (a_k − Σ_{j=1}^{k} b_j u_{k−j}) / b_0
/// ```
///
/// `b_0` must be invertible.
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    b: &[S],
    u: &[S],
    out: &mut [S],
) {
    algebra.quotient_part(degree, (a, b), u, out);
}
