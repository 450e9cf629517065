//! The elementary functions as recurrences over any [graded algebra](Graded).
//!
//! Each function gives the part of degree `k` of the result from parts of degree at most `k` of the
//! operands and below `k` of the result. `E` is the Euler derivation, `(Ea)_k = k a_k`; where a
//! recurrence needs `Ea`, the caller supplies it as an element.
//!
//! The elementary functions of a jet follow by these recurrences in degree. Functions of a head
//! outside their domain give coefficients that are not finite, as `f64` does: √ and real powers of
//! a head `≤ 0` (not analytic there), `ln` of a head `≤ 0`, `asin` and `acos` for `|head| ≥ 1`.

use std::sync::Arc;

use super::{Graded, HeadFunction, Jet, JetSpace, Span};
use crate::interruption;
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

/// Sign of `Eu = ±(Ea) v` for a function `u = f(a)` with a partner `v`, as in
/// [`exponential_part`].
pub fn partner_sign(function: HeadFunction) -> f64 {
    match function {
        HeadFunction::Cos | HeadFunction::Sech | HeadFunction::LogisticOfNegative => -1.0,
        _ => 1.0,
    }
}

/// Part of degree `k` of `u = f(a)` where `Eu = ±(Ea) v` with a partner `v`:
///
/// ```text
/// u_0 = f(a_0),   u_k = ±(1/k) Σ_{j=1}^{k} (Ea)_j v_{k−j}
/// ```
///
/// The partner of `exp` is itself, those of `sin`, `cos` and of `sinh`, `cosh` are each other, that
/// of `tanh` is `1/cosh²`, of `1/cosh` its product with `tanh`, of the logistic function its
/// product with that of the negative; the integrals of `tanh` and of the logistic function have
/// these as partners. The sign is `−` for `cos`, `1/cosh` and the logistic function of the
/// negative.
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
    let factor = S::from_f64(partner_sign(function)) / S::from_f64(degree as f64);
    algebra.scaled_convolution(degree, Span::WithoutFirst, (euler_a, partner), factor, out);
}

/// Part of degree `k` of `w = 1/cosh² a`, from `w = 1 − u²` with `u = tanh a`:
///
/// ```text
/// w_0 = 1/cosh² a_0,   w_k = −Σ_{j=0}^{k} u_j u_{k−j}
/// ```
///
/// NOTE: `w_0` is computed directly, not as `1 − u_0²`, which cancels where the tangent is flat.
#[inline(always)]
pub fn sech_squared_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    degree: usize,
    a: &[S],
    u: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(HeadFunction::SechSquared, &a[algebra.part(0)], out);
    }
    algebra.scaled_convolution(degree, Span::Full, (u, u), -S::one(), out);
}

/// Part of degree `k` of `u = f(a)` where `w Eu = Eb`, a logarithm or an inverse circular function:
///
/// ```text
/// u_0 = f(a_0),   u_k = ((Eb)_k − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}) / (k w_0)
/// ```
///
/// with `b = a` and `w = a` for `log`, `√(1 − a²)` for `asin`, `−√(1 − a²)` for `acos`; with
/// `b = s² a` and `w = s² + (s a)²` for `atan`, where the number `s` prevents overflow of the
/// square. Analytic if `w_0` is invertible.
#[inline(always)]
pub fn primitive_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    function: HeadFunction,
    degree: usize,
    (a, b): (&[S], &[S]),
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
    for (value, &term) in out.iter_mut().zip(&b[algebra.part(degree)]) {
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
/// k w_0 u_k = Σ_{j=1}^{k} ((Ey)_j x_{k−j} − (Ex)_j y_{k−j}) − Σ_{j=1}^{k−1} (Eu)_j w_{k−j}
/// ```
///
/// Analytic if `w_0` is invertible.
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

impl<S: Scalar> Jet<S> {
    /// `Ea`: every coefficient times its degree.
    fn euler(&self) -> Self {
        let mut euler = self.clone();
        for degree in 0..=self.space.order() {
            scale(
                &mut euler.coefficients[self.space.degree_range(degree)],
                S::from_f64(degree as f64),
            );
        }
        euler
    }

    /// Builds a jet degree by degree: `part(k, u, out)` writes the part of degree `k` to `out`, and
    /// reads the parts of lower degrees from `u`.
    pub(super) fn build(
        space: &Arc<JetSpace>,
        mut part: impl FnMut(usize, &[S], &mut [S]),
    ) -> Self {
        interruption::check();
        let mut result = Self::zero(space);
        let mut scratch = vec![S::zero(); space.len()];
        for degree in 0..=space.order() {
            let range = space.degree_range(degree);
            part(degree, &result.coefficients, &mut scratch[range.clone()]);
            result.coefficients[range.clone()].copy_from_slice(&scratch[range]);
        }
        result
    }

    /// Builds a jet `u` degree by degree together with its Euler derivative `Eu`.
    fn build_with_euler(
        space: &Arc<JetSpace>,
        mut part: impl FnMut(usize, &[S], &[S], &mut [S]),
    ) -> Self {
        let mut euler = vec![S::zero(); space.len()];
        Self::build(space, |degree, u, out| {
            part(degree, u, &euler, out);
            let range = space.degree_range(degree);
            for (target, &value) in euler[range].iter_mut().zip(out.iter()) {
                *target = value * S::from_f64(degree as f64);
            }
        })
    }

    /// Square root, to the order of the space; analytic for a positive head.
    ///
    /// ```text
    /// u_0 = √a_0,   u_k = (a_k − Σ_{j=1}^{k−1} u_j u_{k−j}) / (2 u_0)
    /// ```
    pub fn sqrt(&self) -> Self {
        Self::build(&self.space, |k, u, out| sqrt_part(&*self.space, k, &self.coefficients, u, out))
    }

    /// Exponential: `k u_k = Σ_{j=1}^{k} j a_j u_{k−j}`.
    pub fn exp(&self) -> Self {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler());
        Self::build(&self.space, |k, u, out| {
            exponential_part(space, HeadFunction::Exp, k, a, &euler.coefficients, u, out)
        })
    }

    /// Natural logarithm, for a positive head: `a Eu = Ea` with the Euler derivation `E`.
    pub fn ln(&self) -> Self {
        self.primitive(HeadFunction::Log, self, self)
    }

    /// Sine and cosine: `k s_k = Σ_{j=1}^{k} j a_j c_{k−j}` and `k c_k = −Σ_{j=1}^{k} j a_j
    /// s_{k−j}`.
    pub fn sin_cos(&self) -> (Self, Self) {
        self.pair(HeadFunction::Sin, HeadFunction::Cos)
    }

    /// Hyperbolic sine and cosine: `k s_k = Σ_{j=1}^{k} j a_j c_{k−j}` and likewise `c` from `s`.
    pub fn sinh_cosh(&self) -> (Self, Self) {
        self.pair(HeadFunction::Sinh, HeadFunction::Cosh)
    }

    /// Two functions computed together, each part of one from lower parts of the other.
    fn pair(&self, first: HeadFunction, second: HeadFunction) -> (Self, Self) {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler());
        let (mut u, mut v) = (Self::zero(&self.space), Self::zero(&self.space));
        let mut scratch = vec![S::zero(); space.len()];
        for degree in 0..=space.order() {
            let (range, euler) = (space.degree_range(degree), &euler.coefficients);
            let part = &mut scratch[range.clone()];
            exponential_part(space, first, degree, a, euler, &v.coefficients, part);
            u.coefficients[range.clone()].copy_from_slice(part);
            exponential_part(space, second, degree, a, euler, &u.coefficients, part);
            v.coefficients[range].copy_from_slice(part);
        }
        (u, v)
    }

    /// Sine.
    pub fn sin(&self) -> Self {
        self.sin_cos().0
    }

    /// Cosine.
    pub fn cos(&self) -> Self {
        self.sin_cos().1
    }

    /// Tangent, `sin / cos`.
    pub fn tan(&self) -> Self {
        let (sine, cosine) = self.sin_cos();
        &sine / &cosine
    }

    /// Hyperbolic tangent: `Eu = w Ea` with `w = 1 − u²`.
    pub fn tanh(&self) -> Self {
        self.tanh_and_slope().0
    }

    /// The hyperbolic tangent `u` and its derivative `w = 1/cosh²`, computed together.
    fn tanh_and_slope(&self) -> (Self, Self) {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler().coefficients);
        let (mut u, mut w) = (Self::zero(&self.space), Self::zero(&self.space));
        let mut scratch = vec![S::zero(); space.len()];
        for degree in 0..=space.order() {
            let range = space.degree_range(degree);
            let part = &mut scratch[range.clone()];
            let tanh = HeadFunction::Tanh;
            exponential_part(space, tanh, degree, a, &euler, &w.coefficients, part);
            u.coefficients[range.clone()].copy_from_slice(part);
            sech_squared_part(space, degree, a, &u.coefficients, part);
            w.coefficients[range].copy_from_slice(part);
        }
        (u, w)
    }

    /// Reciprocal `u` of the hyperbolic cosine: `Eu = −u t Ea` with `t = tanh a`.
    pub fn sech(&self) -> Self {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler().coefficients);
        let (tanh, mut slope) = (self.tanh(), Self::zero(&self.space));
        Self::build(&self.space, |k, u, out| {
            if let Some(below) = k.checked_sub(1) {
                let range = space.degree_range(below);
                let part = &mut slope.coefficients[range];
                product_part(space, below, u, &tanh.coefficients, part);
            }
            exponential_part(space, HeadFunction::Sech, k, a, &euler, &slope.coefficients, out);
        })
    }

    /// Logistic function `s = 1/(1 + e^{−a})`: `Es = s (1 − s) Ea`.
    pub fn logistic(&self) -> Self {
        self.logistic_pair().0
    }

    /// The logistic functions of the jet and of its negative, whose sum is 1.
    fn logistic_pair(&self) -> (Self, Self) {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler().coefficients);
        let (mut s, mut r) = (Self::zero(&self.space), Self::zero(&self.space));
        let mut slope = Self::zero(&self.space).coefficients;
        let mut scratch = vec![S::zero(); space.len()];
        for degree in 0..=space.order() {
            let range = space.degree_range(degree);
            let part = &mut scratch[range.clone()];
            for (function, jet) in
                [(HeadFunction::Logistic, &mut s), (HeadFunction::LogisticOfNegative, &mut r)]
            {
                exponential_part(space, function, degree, a, &euler, &slope, part);
                jet.coefficients[range.clone()].copy_from_slice(part);
            }
            product_part(space, degree, &s.coefficients, &r.coefficients, part);
            slope[range].copy_from_slice(part);
        }
        (s, r)
    }

    /// `u = f(a)` with `Eu = v Ea`, for a known derivative `v`.
    fn with_slope(&self, function: HeadFunction, slope: &Self) -> Self {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler().coefficients);
        Self::build(&self.space, |k, _, out| {
            exponential_part(space, function, k, a, &euler, &slope.coefficients, out);
        })
    }

    /// Arc sine, for a head inside `(−1, 1)`: `√(1 − a²) Eu = Ea`.
    pub fn asin(&self) -> Self {
        self.primitive(HeadFunction::Asin, self, &self.cathetus())
    }

    /// Arc cosine, for a head inside `(−1, 1)`: `−√(1 − a²) Eu = Ea`.
    pub fn acos(&self) -> Self {
        self.primitive(HeadFunction::Acos, self, &-&self.cathetus())
    }

    /// Arc tangent: `(1 + a²) Eu = Ea`, times the square of a number that prevents overflow of
    /// `a²`.
    pub fn atan(&self) -> Self {
        let factor = self.head().balance(S::one());
        let shrunk = self.scale(factor);
        let w = (&shrunk * &shrunk).add_constant(factor * factor);
        self.primitive(HeadFunction::Atan, &shrunk.scale(factor), &w)
    }

    /// `√(1 − a²)`, as `√((1 − a)(1 + a))`: no cancellation near `|a_0| = 1`.
    fn cathetus(&self) -> Self {
        (&(-self).add_constant(S::one()) * &self.add_constant(S::one())).sqrt()
    }

    /// `u = f(a)` with `w Eu = Eb`.
    fn primitive(&self, function: HeadFunction, b: &Self, w: &Self) -> Self {
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            primitive_part(
                &*self.space,
                function,
                k,
                (&self.coefficients, &b.coefficients),
                &w.coefficients,
                euler_u,
                out,
            );
        })
    }

    /// Angle of the point `(x, self)`, its head in `(−π, π]`, for a point other than the origin.
    ///
    /// With `y = self` and `w = x² + y²`: `w Eu = x Ey − y Ex`, both times a number that prevents
    /// overflow and underflow of the squares.
    ///
    /// # Panics
    ///
    /// If the two jets are not of one space.
    pub fn atan2(&self, x: &Self) -> Self {
        let factor = self.head().balance(x.head());
        let (y, x) = (&self.scale(factor), &x.scale(factor));
        let (euler_y, euler_x) = (y.euler(), x.euler());
        let w = &(y * y) + &(x * x);
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            let (y, x, w) = (&y.coefficients, &x.coefficients, &w.coefficients);
            atan2_part(
                &*self.space,
                k,
                y,
                x,
                &euler_y.coefficients,
                &euler_x.coefficients,
                w,
                euler_u,
                out,
            );
        })
    }

    /// Real power, for a positive head: `a Eu = r u Ea`.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let x = Jet::variable(&JetSpace::uniform(1, 3)?, 0, 4.0);
    /// assert_eq!(x.power_real(1.5).coefficients()[..2], [8.0, 3.0]); // x^(3/2) and its slope at 4
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn power_real(&self, exponent: S) -> Self {
        let euler = self.euler();
        Self::build_with_euler(&self.space, |k, u, euler_u, out| {
            power_part(
                &*self.space,
                exponent,
                k,
                &self.coefficients,
                &euler.coefficients,
                u,
                euler_u,
                out,
            );
        })
    }

    /// Integer power; a negative one needs an invertible head.
    pub fn power_integer(&self, exponent: i32) -> Self {
        let one = Self::constant(&self.space, S::one());
        let (mut result, mut square, mut rest) =
            (one.clone(), self.clone(), exponent.unsigned_abs());
        while rest > 0 {
            if rest & 1 == 1 {
                result = &result * &square;
            }
            rest >>= 1;
            if rest > 0 {
                square = &square * &square;
            }
        }
        if exponent < 0 { &one / &result } else { result }
    }

    /// The function named by a [`HeadFunction`].
    pub fn apply(&self, function: HeadFunction) -> Self {
        match function {
            HeadFunction::Sqrt => self.sqrt(),
            HeadFunction::Exp => self.exp(),
            HeadFunction::Log => self.ln(),
            HeadFunction::Sin => self.sin_cos().0,
            HeadFunction::Cos => self.sin_cos().1,
            HeadFunction::Asin => self.asin(),
            HeadFunction::Acos => self.acos(),
            HeadFunction::Atan => self.atan(),
            HeadFunction::Sinh => self.sinh_cosh().0,
            HeadFunction::Cosh => self.sinh_cosh().1,
            HeadFunction::Tanh => self.tanh(),
            HeadFunction::SechSquared => self.tanh_and_slope().1,
            HeadFunction::Sech => self.sech(),
            HeadFunction::Logistic => self.logistic(),
            HeadFunction::LogisticOfNegative => self.logistic_pair().1,
            HeadFunction::Softplus => self.with_slope(function, &self.logistic()),
            HeadFunction::LogCosh => self.with_slope(function, &self.tanh()),
        }
    }
}
