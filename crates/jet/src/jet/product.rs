//! The product of two jets, and the parts of one degree of products and quotients, computed in one
//! pass over the space's product table.

use std::ops::Range;

mod convolution;
pub(super) mod table;

use convolution::{Convolution, Factor, Finish, FullProduct};
use table::SmallProduct;

use super::{JetSpace, Selection, Span};
use crate::interruption;
use crate::numeric::Scalar;

/// A part of one degree: neighbouring runs by their numbers, and their coefficients.
pub struct PartOf<'a, S> {
    /// Numbers of the runs.
    pub runs: Range<usize>,
    /// Coefficients of the runs, one run after the other.
    pub out: &'a mut [S],
    /// Runs that can differ from zero; `None` for all.
    pub selection: Option<Selection<'a>>,
}

impl JetSpace {
    /// `out = a b` for coefficient slices of this space.
    ///
    /// # Panics
    ///
    /// If a slice is shorter than the space.
    #[inline]
    pub fn multiply<S: Scalar>(&self, a: &[S], b: &[S], out: &mut [S]) {
        self.product::<S, true>(a, b, out);
    }

    /// `out += a b` for coefficient slices of this space.
    ///
    /// # Panics
    ///
    /// If a slice is shorter than the space.
    #[inline]
    pub fn multiply_add<S: Scalar>(&self, a: &[S], b: &[S], out: &mut [S]) {
        self.product::<S, false>(a, b, out);
    }

    #[inline(never)]
    fn product<S: Scalar, const SET: bool>(&self, a: &[S], b: &[S], out: &mut [S]) {
        if let Some(space) = self.small() {
            let (a, b, out) = (&a[..self.len()], &b[..self.len()], &mut out[..self.len()]);
            S::dispatch(SmallProduct::<S, SET> { space, a, b, out });
            return;
        }
        interruption::check();
        S::dispatch(FullProduct::<S, SET> {
            table: self.table(),
            a: &a[..self.len()],
            b: &b[..self.len()],
            out,
        });
    }

    /// `out += a b` in the degrees up to `order`.
    pub(super) fn multiply_add_to<S: Scalar>(&self, a: &[S], b: &[S], order: usize, out: &mut [S]) {
        if order >= self.order() {
            self.multiply_add(a, b, out);
            return;
        }
        let kept = PartOf {
            runs: self.table().run_numbers(0..order + 1),
            out: &mut out[..self.degree_start(order + 1)],
            selection: None,
        };
        self.convolution(kept, Factor::full(a), Factor::full(b)).form();
    }

    /// Description of the product of two factors that is added to some runs.
    #[inline]
    fn convolution<'a, S: Scalar>(
        &'a self,
        part: PartOf<'a, S>,
        a: Factor<'a, S>,
        b: Factor<'a, S>,
    ) -> Convolution<'a, S> {
        Convolution {
            table: self.table(),
            runs: &self.table().all_runs()[part.runs],
            span: Span::Full,
            a,
            b,
            finish: Finish::Add,
            out: part.out,
            selection: part.selection,
        }
    }

    /// [`Graded::convolve`](super::Graded::convolve) for some runs.
    #[inline]
    pub fn convolve_part<S: Scalar>(&self, part: PartOf<'_, S>, span: Span, (a, b): (&[S], &[S])) {
        self.finish_part(part, span, (a, b), Finish::Add);
    }

    /// [`Graded::scaled_convolution`](super::Graded::scaled_convolution) for some runs.
    #[inline]
    pub fn scaled_part<S: Scalar>(
        &self,
        part: PartOf<'_, S>,
        span: Span,
        (a, b): (&[S], &[S]),
        factor: S,
    ) {
        self.finish_part(part, span, (a, b), Finish::Scale(factor));
    }

    /// [`Graded::quotient_part`](super::Graded::quotient_part) for some runs.
    #[inline]
    pub fn quotient_part_of<S: Scalar>(&self, part: PartOf<'_, S>, (a, b): (&[S], &[S]), u: &[S]) {
        let finish = Finish::Subtract { from: a, factor: S::one() / b[0] };
        self.finish_part(part, Span::WithoutFirst, (b, u), finish);
    }

    #[inline]
    fn finish_part<S: Scalar>(
        &self,
        part: PartOf<'_, S>,
        span: Span,
        (a, b): (&[S], &[S]),
        finish: Finish<'_, S>,
    ) {
        Convolution { span, finish, ..self.convolution(part, Factor::full(a), Factor::full(b)) }
            .form();
    }

    /// A part of one degree with all its runs.
    #[inline]
    pub(super) fn whole_part<'a, S>(&self, degree: usize, out: &'a mut [S]) -> PartOf<'a, S> {
        PartOf { runs: self.runs(degree), out, selection: None }
    }

    /// The numbers of the runs of one degree.
    pub fn runs(&self, degree: usize) -> Range<usize> {
        self.table().run_numbers(degree..degree + 1)
    }

    /// The monomials of a run: neighbours that differ in their last two variables only.
    pub fn run(&self, number: usize) -> Range<usize> {
        self.table().all_runs()[number].monomials.clone()
    }

    /// `out = a b` in the degrees from `low_a + low_b` to `order`, where `a` has no term below
    /// degree `low_a` nor `b` below `low_b`; other coefficients of `out` are not changed.
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
        interruption::check();
        let degrees = low_a + low_b..order + 1;
        let kept = self.degree_start(degrees.start)..self.degree_start(degrees.end);
        let out = &mut out[kept];
        out.fill(S::zero());
        let part = PartOf { runs: self.table().run_numbers(degrees), out, selection: None };
        let factor =
            |coefficients, low| Factor { coefficients, first: self.degree_start(low) as u32 };
        self.convolution(part, factor(a, low_a), factor(b, low_b)).form();
    }
}

/// Compiles the large generic functions here, once, for the scalars that other packages use.
///
/// NOTE: instances of generic functions that are never inlined are shared with dependants, which
/// would otherwise compile them again.
macro_rules! compile_for {
    ($($instances:ident: $scalar:ty),*) => {$(
        #[cfg(not(test))]
        #[used]
        static $instances: (
            [fn(&JetSpace, &[$scalar], &[$scalar], &mut [$scalar]); 2],
            fn(Convolution<'static, $scalar>),
        ) = (
            [JetSpace::product::<$scalar, true>, JetSpace::product::<$scalar, false>],
            Convolution::<$scalar>::form,
        );
    )*};
}

compile_for!(IN_F64: f64, IN_DOUBLE_DOUBLE: crate::numeric::Dd);
