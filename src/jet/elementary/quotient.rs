//! Quotient `u = a / b`.

use crate::jet::{Graded, Span};
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
    out.fill(S::zero());
    algebra.convolve(degree, Span::WithoutFirst, b, u, out);
    for (value, &numerator) in out.iter_mut().zip(&a[algebra.part(degree)]) {
        *value = numerator - *value;
    }
    algebra.divide_by_head(b, out);
}
