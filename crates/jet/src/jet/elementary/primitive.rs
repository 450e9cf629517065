//! Functions whose derivative is a quotient: logarithm and the inverse circular functions.

use super::scale;
use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `u = f(a)` where `w Eu = Ea`:
///
/// ```text
/// u_0 = f(a_0),   u_k = ((Ea)_k − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}) / (k w_0)
/// ```
///
/// with `w = a` for `log`, `1 + a²` for `atan`, `√(1 − a²)` for `asin` and `−√(1 − a²)` for `acos`.
/// Analytic where `w_0` is invertible.
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    function: HeadFunction,
    degree: usize,
    a: &[S],
    w: &[S],
    euler_u: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(function, &a[algebra.part(0)], out);
    }
    out.fill(S::zero());
    algebra.convolve(degree, Span::Interior, euler_u, w, out);
    scale(out, -S::one() / S::from_f64(degree as f64));
    for (value, &term) in out.iter_mut().zip(&a[algebra.part(degree)]) {
        *value += term;
    }
    algebra.divide_by_head(w, out);
}
