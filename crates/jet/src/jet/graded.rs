//! Graded algebras: the common structure of jets, time series, and jets in time.
//!
//! An element of a graded algebra is a sum `a = a_0 + a_1 + … + a_n` of *parts*, the product obeys
//! `(ab)_k = Σ_j a_j b_{k−j}`, and the Euler derivation `(Ea)_k = k a_k` obeys Leibniz' rule. Every
//! elementary function satisfies a first-order equation under any such derivation. Its parts
//! therefore follow one by one from lower parts by one recurrence for all kinds of parts: numbers
//! (Taylor coefficients in time), homogeneous polynomials (jets, by degree), or whole jets (Taylor
//! coefficients in time of a jet). See docs/mathematics/recurrences.md.

use std::ops::Range;
use std::sync::Arc;

use super::{Jet, JetSpace};
use crate::numeric::Scalar;

/// Range of the terms of `Σ_j a_j b_{k−j}` in a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// `j = 0..=k`.
    Full,
    /// `j = 1..=k`: without `a_0 b_k`.
    WithoutFirst,
    /// `j = 0..=k−1`: without `a_k b_0`.
    WithoutLast,
    /// `j = 1..=k−1`.
    Interior,
}

impl Span {
    /// Whether the span leaves out the term `j = 0`.
    #[inline(always)]
    pub(super) fn leaves_first(self) -> bool {
        matches!(self, Span::WithoutFirst | Span::Interior)
    }

    /// Whether the span leaves out the term `j = k`.
    #[inline(always)]
    pub(super) fn leaves_last(self) -> bool {
        matches!(self, Span::WithoutLast | Span::Interior)
    }

    /// Range of the span in an ordered list of terms (first: `j = 0`, last: `j = k`).
    #[inline(always)]
    pub fn range(self, terms: usize) -> Range<usize> {
        match self {
            Span::Full => 0..terms,
            Span::WithoutFirst => 1..terms,
            Span::WithoutLast => 0..terms - 1,
            Span::Interior => 1..(terms - 1).max(1),
        }
    }
}

/// Elementary function of a head (part of degree 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadFunction {
    /// Square root.
    Sqrt,
    /// Exponential.
    Exp,
    /// Logarithm.
    Log,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Arc sine.
    Asin,
    /// Arc cosine.
    Acos,
    /// Arc tangent.
    Atan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Derivative of the hyperbolic tangent, `1/cosh²`.
    SechSquared,
    /// Reciprocal of the hyperbolic cosine, `1/cosh`.
    Sech,
    /// Logistic function, `1/(1 + e^{−a})`.
    Logistic,
    /// Logistic function of the negative, `1/(1 + e^a)`.
    LogisticOfNegative,
    /// Integral of the logistic function, `ln(1 + e^a)`.
    Softplus,
    /// Integral of the hyperbolic tangent, `ln cosh a`.
    LogCosh,
}

/// A graded algebra over the scalars `S`, its elements stored as flat slices.
pub trait Graded<S: Scalar> {
    /// Highest degree kept.
    fn order(&self) -> usize;

    /// Number of scalars in one element.
    fn element_len(&self) -> usize;

    /// Range of the scalars of one degree's part in an element.
    fn part(&self, degree: usize) -> Range<usize>;

    /// Adds `Σ_j a_j b_{degree−j}` over the span to `out`, a slice of the part's length.
    fn convolve(&self, degree: usize, span: Span, a: &[S], b: &[S], out: &mut [S]);

    /// `out = factor · Σ_j a_j b_{degree−j}` over the span.
    #[inline(always)]
    fn scaled_convolution(
        &self,
        degree: usize,
        span: Span,
        (a, b): (&[S], &[S]),
        factor: S,
        out: &mut [S],
    ) {
        out.fill(S::zero());
        self.convolve(degree, span, a, b, out);
        for value in out {
            *value *= factor;
        }
    }

    /// `out = (a_degree − Σ_{j=1}^{degree} b_j u_{degree−j}) / b_0`.
    #[inline(always)]
    fn quotient_part(&self, degree: usize, (a, b): (&[S], &[S]), u: &[S], out: &mut [S]) {
        out.fill(S::zero());
        self.convolve(degree, Span::WithoutFirst, b, u, out);
        for (value, &numerator) in out.iter_mut().zip(&a[self.part(degree)]) {
            *value = numerator - *value;
        }
        self.divide_by_head(b, out);
    }

    /// Adds `a_0 b_degree` to `out`, for an element `a` of which only the head is non-zero; `part`
    /// is `b_degree`.
    fn multiply_by_head(&self, degree: usize, a: &[S], part: &[S], out: &mut [S]);

    /// Divides a part of any degree by the head of the element `b`.
    fn divide_by_head(&self, b: &[S], part: &mut [S]);

    /// Head of `f(a)` from the head of `a`, both of the head's length: unless overridden, one
    /// scalar.
    fn head(&self, function: HeadFunction, a: &[S], out: &mut [S]) {
        out[0] = scalar_head(function, a[0]);
    }

    /// Head of `a^exponent`, both heads as in [`head`](Self::head).
    fn head_power(&self, a: &[S], exponent: S, out: &mut [S]) {
        out[0] = a[0].powf(exponent);
    }

    /// Head of `atan2(y, x)`, all heads as in [`head`](Self::head).
    fn head_atan2(&self, y: &[S], x: &[S], out: &mut [S]) {
        out[0] = y[0].atan2(x[0]);
    }
}

/// Applies a head function to one scalar.
#[inline]
pub fn scalar_head<S: Scalar>(function: HeadFunction, a: S) -> S {
    match function {
        HeadFunction::Sqrt => a.sqrt(),
        HeadFunction::Exp => a.exp(),
        HeadFunction::Log => a.ln(),
        HeadFunction::Sin => a.sin_cos().0,
        HeadFunction::Cos => a.sin_cos().1,
        HeadFunction::Asin => a.asin(),
        HeadFunction::Acos => a.acos(),
        HeadFunction::Atan => a.atan(),
        HeadFunction::Sinh => a.sinh_cosh().0,
        HeadFunction::Cosh => a.sinh_cosh().1,
        HeadFunction::Tanh => a.tanh(),
        HeadFunction::SechSquared => a.sech_squared(),
        HeadFunction::Sech => a.sech(),
        HeadFunction::Logistic => a.logistic(),
        HeadFunction::LogisticOfNegative => (-a).logistic(),
        HeadFunction::Softplus => a.softplus(),
        HeadFunction::LogCosh => a.ln_cosh(),
    }
}

impl<S: Scalar> Graded<S> for JetSpace {
    fn order(&self) -> usize {
        self.order()
    }

    fn element_len(&self) -> usize {
        self.len()
    }

    fn part(&self, degree: usize) -> Range<usize> {
        self.degree_range(degree)
    }

    #[inline]
    fn convolve(&self, degree: usize, span: Span, a: &[S], b: &[S], out: &mut [S]) {
        self.convolve_part(self.whole_part(degree, out), span, (a, b));
    }

    #[inline]
    fn scaled_convolution(
        &self,
        degree: usize,
        span: Span,
        (a, b): (&[S], &[S]),
        factor: S,
        out: &mut [S],
    ) {
        self.scaled_part(self.whole_part(degree, out), span, (a, b), factor);
    }

    #[inline]
    fn quotient_part(&self, degree: usize, (a, b): (&[S], &[S]), u: &[S], out: &mut [S]) {
        self.quotient_part_of(self.whole_part(degree, out), (a, b), u);
    }

    fn multiply_by_head(&self, _degree: usize, a: &[S], part: &[S], out: &mut [S]) {
        for (value, &factor) in out.iter_mut().zip(part) {
            *value = a[0].mul_add(factor, *value);
        }
    }

    fn divide_by_head(&self, b: &[S], part: &mut [S]) {
        let inverse = S::one() / b[0];
        for value in part {
            *value *= inverse;
        }
    }
}

/// Taylor series in time with number coefficients, cut at an order.
#[derive(Clone, Copy, Debug)]
pub struct TimeSeries {
    /// Highest power of time kept.
    pub order: usize,
}

impl<S: Scalar> Graded<S> for TimeSeries {
    fn order(&self) -> usize {
        self.order
    }

    fn element_len(&self) -> usize {
        self.order + 1
    }

    fn part(&self, degree: usize) -> Range<usize> {
        degree..degree + 1
    }

    #[inline]
    fn convolve(&self, degree: usize, span: Span, a: &[S], b: &[S], out: &mut [S]) {
        let terms = span.range(degree + 1);
        let (a, b) = (&a[terms.clone()], &b[degree + 1 - terms.end..degree + 1 - terms.start]);
        let (mut even, mut odd) = (out[0], S::zero());
        let (pairs, rest) = a.as_chunks::<2>();
        let (last, reversed) = b.as_rchunks::<2>();
        for (&[a0, a1], &[b1, b0]) in pairs.iter().zip(reversed.iter().rev()) {
            even = a0.mul_add(b0, even);
            odd = a1.mul_add(b1, odd);
        }
        if let ([a], [b]) = (rest, last) {
            even = a.mul_add(*b, even);
        }
        out[0] = even + odd;
    }

    fn multiply_by_head(&self, _degree: usize, a: &[S], part: &[S], out: &mut [S]) {
        out[0] = a[0].mul_add(part[0], out[0]);
    }

    fn divide_by_head(&self, b: &[S], part: &mut [S]) {
        part[0] /= b[0];
    }
}

/// Series in time over a [`JetSpace`]: a part is a whole jet, its degree the power of time.
///
/// If a series is to be summed at a time without constant term, the coefficients of higher powers
/// are needed to lower degrees only. Products are formed up to those degrees; coefficients of
/// higher degrees are undefined.
#[derive(Clone, Debug)]
pub struct JetSeries {
    space: Arc<JetSpace>,
    /// Degree to which the coefficient of each power of time is needed, not increasing.
    kept: Vec<usize>,
}

impl JetSeries {
    /// Series up to a power of time, all coefficients to the order of their space.
    pub fn new(space: &Arc<JetSpace>, order: usize) -> Self {
        Self::kept_to(space, vec![space.order(); order + 1])
    }

    /// Series whose coefficients are needed to these degrees, one for each power of time.
    ///
    /// # Panics
    ///
    /// If no power is kept, or a degree exceeds that of a lower power.
    pub fn kept_to(space: &Arc<JetSpace>, kept: Vec<usize>) -> Self {
        assert!(!kept.is_empty(), "a series has its term of power 0");
        assert!(
            kept.is_sorted_by(|a, b| a >= b),
            "a coefficient follows from those of lower powers"
        );
        Self { space: Arc::clone(space), kept }
    }

    /// Space of the coefficients.
    pub fn space(&self) -> &Arc<JetSpace> {
        &self.space
    }

    /// Degree to which the coefficient of a power of time is needed.
    pub fn kept(&self, power: usize) -> usize {
        self.kept[power]
    }

    fn jet<S: Scalar>(&self, coefficients: &[S]) -> Jet<S> {
        Jet::from_coefficients(&self.space, coefficients.to_vec())
    }
}

impl<S: Scalar> Graded<S> for JetSeries {
    fn order(&self) -> usize {
        self.kept.len() - 1
    }

    fn element_len(&self) -> usize {
        self.kept.len() * self.space.len()
    }

    fn part(&self, degree: usize) -> Range<usize> {
        degree * self.space.len()..(degree + 1) * self.space.len()
    }

    fn convolve(&self, degree: usize, span: Span, a: &[S], b: &[S], out: &mut [S]) {
        for j in span.range(degree + 1) {
            let (left, right) =
                (&a[Graded::<S>::part(self, j)], &b[Graded::<S>::part(self, degree - j)]);
            self.space.multiply_add_to(left, right, self.kept[degree], out);
        }
    }

    fn multiply_by_head(&self, degree: usize, a: &[S], part: &[S], out: &mut [S]) {
        let head = &a[Graded::<S>::part(self, 0)];
        self.space.multiply_add_to(head, part, self.kept[degree], out);
    }

    fn divide_by_head(&self, b: &[S], part: &mut [S]) {
        let quotient = &self.jet(part) / &self.jet(&b[Graded::<S>::part(self, 0)]);
        part.copy_from_slice(quotient.coefficients());
    }

    fn head(&self, function: HeadFunction, a: &[S], out: &mut [S]) {
        out.copy_from_slice(self.jet(a).apply(function).coefficients());
    }

    fn head_power(&self, a: &[S], exponent: S, out: &mut [S]) {
        out.copy_from_slice(self.jet(a).power_real(exponent).coefficients());
    }

    fn head_atan2(&self, y: &[S], x: &[S], out: &mut [S]) {
        out.copy_from_slice(self.jet(y).atan2(&self.jet(x)).coefficients());
    }
}
