//! Sine and cosine, computed as a pair.

use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of `s = sin a`, from `Es = (Ea) c` with `c = cos a`:
///
/// ```text
/// s_0 = sin a_0,   s_k = (1/k) Σ_{j=1}^{k} (Ea)_j c_{k−j}
/// ```
#[inline(always)]
pub fn sine_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    cosine: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(HeadFunction::Sin, &a[algebra.part(0)], out);
    }
    let factor = S::one() / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, cosine), factor, out);
}

/// Part of degree `k` of `c = cos a`, from `Ec = −(Ea) s` with `s = sin a`:
///
/// ```text
/// c_0 = cos a_0,   c_k = −(1/k) Σ_{j=1}^{k} (Ea)_j s_{k−j}
/// ```
#[inline(always)]
pub fn cosine_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    euler_a: &[S],
    sine: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(HeadFunction::Cos, &a[algebra.part(0)], out);
    }
    let factor = -S::one() / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, sine), factor, out);
}
