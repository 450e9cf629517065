//! Real powers.

use crate::jet::{Graded, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `u = a^r`, from `a Eu = r (Ea) u`:
///
/// ```text
/// u_0 = a_0^r,   u_k = (r Σ_{j=1}^{k} (Ea)_j u_{k−j} − Σ_{j=1}^{k−1} (Eu)_j a_{k−j}) / (k a_0)
/// ```
///
/// Analytic for `a_0 > 0` only.
#[allow(
    clippy::too_many_arguments,
    reason = "one per symbol of the recurrence"
)]
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    exponent: S,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    u: &[S],
    euler_u: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head_power(&a[algebra.part(0)], exponent, out);
    }
    out.fill(S::zero());
    algebra.convolve(degree, Span::WithoutFirst, euler_a, u, out);
    super::scale(out, -exponent);
    algebra.convolve(degree, Span::Interior, euler_u, a, out);
    super::scale(out, -S::one() / S::from_f64(degree as f64));
    algebra.divide_by_head(a, out);
}
