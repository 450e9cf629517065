//! The product of two jets as a pass over the space's product table.

use std::ops::Range;

use super::convolution::{Convolution, Factor};
use super::{JetSpace, Span};
use crate::numeric::Scalar;

impl JetSpace {
    /// `out += a b` for coefficient slices of this space.
    ///
    /// # Panics
    ///
    /// If a slice is shorter than the space.
    #[inline]
    pub fn multiply_add<S: Scalar>(&self, a: &[S], b: &[S], out: &mut [S]) {
        S::dispatch(Convolution {
            table: self.table(),
            runs: self.table().runs(0..self.order() + 1),
            span: Span::Full,
            a: Factor::full(&a[..self.len()]),
            b: Factor::full(&b[..self.len()]),
            first: 0,
            out,
            keep: |_: &Range<usize>| true,
        });
    }

    /// [`Graded::convolve`](super::Graded::convolve), for the runs of monomials that `keep` takes, `out` beginning at
    /// the monomial `first`.
    #[inline]
    pub(crate) fn convolve_runs<S: Scalar>(
        &self,
        degree: usize,
        span: Span,
        (a, b): (&[S], &[S]),
        (first, out): (usize, &mut [S]),
        keep: impl Fn(&Range<usize>) -> bool,
    ) {
        S::dispatch(Convolution {
            table: self.table(),
            runs: self.table().runs(degree..degree + 1),
            span,
            a: Factor::full(a),
            b: Factor::full(b),
            first,
            out,
            keep,
        });
    }

    /// The runs of one degree: neighbouring monomials that differ in their last two variables only.
    pub(crate) fn runs(&self, degree: usize) -> impl Iterator<Item = Range<usize>> {
        let runs = self.table().runs(degree..degree + 1).iter();
        runs.map(|run| run.monomials.clone())
    }

    /// `out = a b` in the degrees from `low_a + low_b` to `order`, where `a` has no term below degree
    /// `low_a` nor `b` below `low_b`; other coefficients of `out` are left alone.
    ///
    /// Only the products of terms that can differ from zero are formed.
    pub(super) fn multiply_between<S: Scalar>(
        &self,
        (a, low_a): (&[S], usize),
        (b, low_b): (&[S], usize),
        order: usize,
        out: &mut [S],
    ) {
        if low_a + low_b > order {
            return;
        }
        let kept = self.degree_start(low_a + low_b)..self.degree_start(order + 1);
        let first = kept.start;
        let out = &mut out[kept];
        out.fill(S::zero());
        let factor = |coefficients, low| Factor {
            coefficients,
            first: self.degree_start(low) as u32,
        };
        S::dispatch(Convolution {
            table: self.table(),
            runs: self.table().runs(low_a + low_b..order + 1),
            span: Span::Full,
            a: factor(a, low_a),
            b: factor(b, low_b),
            first,
            out,
            keep: |_: &Range<usize>| true,
        });
    }
}
