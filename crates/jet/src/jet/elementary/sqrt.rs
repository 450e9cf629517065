//! Square root.

use super::scale;
use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `u = √a`, from `u u = a`:
///
/// ```text
/// u_0 = √a_0,   u_k = (a_k − Σ_{j=1}^{k−1} u_j u_{k−j}) / (2 u_0)
/// ```
///
/// Analytic for `a_0 > 0` only.
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(algebra: &A, degree: usize, a: &[S], u: &[S], out: &mut [S]) {
    if degree == 0 {
        return algebra.head(HeadFunction::Sqrt, &a[algebra.part(0)], out);
    }
    out.fill(S::zero());
    algebra.convolve(degree, Span::Interior, u, u, out);
    for (value, &square) in out.iter_mut().zip(&a[algebra.part(degree)]) {
        *value = square - *value;
    }
    algebra.divide_by_head(u, out);
    scale(out, S::from_f64(0.5));
}
