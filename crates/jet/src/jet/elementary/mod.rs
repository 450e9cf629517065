//! The elementary functions as recurrences over any [graded algebra](super::Graded).
//!
//! Each file holds one function `part`, which gives the part of degree `k` of the result from parts
//! of degree at most `k` of the operands and below `k` of the result. `E` is the Euler derivation,
//! `(Ea)_k = k a_k`; where a recurrence needs `Ea`, the caller supplies it as an element.

pub mod atan2;
pub mod exp;
pub mod hyperbolic;
pub mod power;
pub mod primitive;
pub mod quotient;
pub mod sqrt;
pub mod trigonometric;

use super::Graded;
use crate::numeric::Scalar;

/// `out = Σ_{j=0}^{k} a_j b_{k−j}`.
#[inline(always)]
pub fn product_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    b: &[S],
    out: &mut [S],
) {
    algebra.scaled_convolution(degree, super::Span::Full, (a, b), S::one(), out);
}

/// Divides every scalar of a part by a number.
#[inline(always)]
pub fn scale<S: Scalar>(part: &mut [S], factor: S) {
    for value in part {
        *value *= factor;
    }
}
