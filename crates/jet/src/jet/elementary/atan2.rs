//! Angle of a point.

use super::scale;
use crate::jet::{Graded, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `u = atan2(y, x)`, from `w Eu = x Ey − y Ex` with `w = x² + y²`:
///
/// ```text
/// u_0 = atan2(y_0, x_0)
/// u_k = (Σ_{j=1}^{k} (Ey)_j x_{k−j} − Σ_{j=1}^{k} (Ex)_j y_{k−j} − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}) / (k w_0)
/// ```
///
/// Analytic where `w_0` is invertible.
#[allow(
    clippy::too_many_arguments,
    reason = "one per symbol of the recurrence"
)]
#[inline(always)]
pub fn part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    y: &[S],
    x: &[S],
    euler_y: &[S],
    euler_x: &[S],
    w: &[S],
    euler_u: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head_atan2(&y[algebra.part(0)], &x[algebra.part(0)], out);
    }
    out.fill(S::zero());
    algebra.convolve(degree, Span::WithoutFirst, euler_x, y, out);
    algebra.convolve(degree, Span::Interior, euler_u, w, out);
    scale(out, -S::one());
    algebra.convolve(degree, Span::WithoutFirst, euler_y, x, out);
    scale(out, S::one() / S::from_f64(degree as f64));
    algebra.divide_by_head(w, out);
}
