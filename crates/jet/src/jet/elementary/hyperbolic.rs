//! Hyperbolic sine and cosine, computed as a pair.

use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `s = sinh a`, from `Es = (Ea) c` with `c = cosh a`:
///
/// ```text
/// s_0 = sinh a_0,   s_k = (1/k) Σ_{j=1}^{k} (Ea)_j c_{k−j}
/// ```
#[inline(always)]
pub fn sinh_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    cosh: &[S],
    out: &mut [S],
) {
    pair_part(algebra, HeadFunction::Sinh, degree, a, euler_a, cosh, out);
}

/// Part of degree `k` of `c = cosh a`, from `Ec = (Ea) s` with `s = sinh a`:
///
/// ```text
/// c_0 = cosh a_0,   c_k = (1/k) Σ_{j=1}^{k} (Ea)_j s_{k−j}
/// ```
#[inline(always)]
pub fn cosh_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    sinh: &[S],
    out: &mut [S],
) {
    pair_part(algebra, HeadFunction::Cosh, degree, a, euler_a, sinh, out);
}

#[inline(always)]
fn pair_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    function: HeadFunction,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    partner: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(function, &a[algebra.part(0)], out);
    }
    let factor = S::one() / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, partner), factor, out);
}
