//! The elementary functions as recurrences over any [graded algebra](Graded).
//!
//! Each function gives the part of degree `k` of the result from parts of degree at most `k` of the
//! operands and below `k` of the result. `E` is the Euler derivation, `(Ea)_k = k a_k`; where a
//! recurrence needs `Ea`, the caller supplies it as an element.

use super::{Graded, HeadFunction, Span};
use crate::numeric::Scalar;

/// Part of degree `k` of a product:
///
/// ```text
/// (a b)_k = Σ_{j=0}^{k} a_j b_{k−j}
/// ```
#[inline(always)]
pub fn product_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    b: &[S],
    out: &mut [S],
) {
    algebra.scaled_convolution(degree, Span::Full, (a, b), S::one(), out);
}

/// Part of degree `k` of `u = a / b`, from `u b = a`:
///
/// ```text
/// u_k = (a_k − Σ_{j=1}^{k} b_j u_{k−j}) / b_0
/// ```
///
/// `b_0` must be invertible.
#[inline(always)]
pub fn quotient_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    b: &[S],
    u: &[S],
    out: &mut [S],
) {
    algebra.quotient_part(degree, (a, b), u, out);
}

/// Part of degree `k` of `u = √a`, from `u u = a`:
///
/// ```text
/// u_0 = √a_0,   u_k = (a_k − Σ_{j=1}^{k−1} u_j u_{k−j}) / (2 u_0)
/// ```
///
/// Analytic for `a_0 > 0` only.
#[inline(always)]
pub fn sqrt_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    u: &[S],
    out: &mut [S],
) {
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

/// Part of degree `k` of `u = f(a)` where `Eu = ±(Ea) v` with a partner `v`:
///
/// ```text
/// u_0 = f(a_0),   u_k = ±(1/k) Σ_{j=1}^{k} (Ea)_j v_{k−j}
/// ```
///
/// The partner of `exp` is itself, those of `sin`, `cos` and of `sinh`, `cosh` are each other; the
/// sign is `−` for `cos`.
#[inline(always)]
pub fn exponential_part<S: Scalar, A: Graded<S>>(
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
    let sign = match function {
        HeadFunction::Cos => -S::one(),
        _ => S::one(),
    };
    let factor = sign / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, partner), factor, out);
}

/// Part of degree `k` of `u = f(a)` where `w Eu = Ea`, a logarithm or an inverse circular function:
///
/// ```text
/// u_0 = f(a_0),   u_k = ((Ea)_k − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}) / (k w_0)
/// ```
///
/// with `w = a` for `log`, `1 + a²` for `atan`, `√(1 − a²)` for `asin` and `−√(1 − a²)` for `acos`.
/// Analytic where `w_0` is invertible.
#[inline(always)]
pub fn primitive_part<S: Scalar, A: Graded<S>>(
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

/// Part of degree `k` of `u = a^r`, from `a Eu = r (Ea) u`:
///
/// ```text
/// u_0 = a_0^r,   u_k = (r Σ_{j=1}^{k} (Ea)_j u_{k−j} − Σ_{j=1}^{k−1} (Eu)_j a_{k−j}) / (k a_0)
/// ```
///
/// Analytic for `a_0 > 0` only.
#[allow(clippy::too_many_arguments, reason = "one per symbol of the recurrence")]
#[inline(always)]
pub fn power_part<S: Scalar, A: Graded<S>>(
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
    scale(out, -exponent);
    algebra.convolve(degree, Span::Interior, euler_u, a, out);
    scale(out, -S::one() / S::from_f64(degree as f64));
    algebra.divide_by_head(a, out);
}

/// Part of degree `k` of `u = atan2(y, x)`, from `w Eu = x Ey − y Ex` with `w = x² + y²`:
///
/// ```text
/// u_0 = atan2(y_0, x_0)
/// u_k = (Σ_{j=1}^{k} (Ey)_j x_{k−j} − Σ_{j=1}^{k} (Ex)_j y_{k−j} − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}) / (k w_0)
/// ```
///
/// Analytic where `w_0` is invertible.
#[allow(clippy::too_many_arguments, reason = "one per symbol of the recurrence")]
#[inline(always)]
pub fn atan2_part<S: Scalar, A: Graded<S>>(
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

/// Multiplies every scalar of a part by a number.
#[inline(always)]
pub fn scale<S: Scalar>(part: &mut [S], factor: S) {
    for value in part {
        *value *= factor;
    }
}
