//! Taylor series in time whose coefficients are jets: jet transport by Taylor's method.

use std::ops::Range;
use std::sync::Arc;

use super::{Graded, HeadFunction, Jet, JetSpace, Span};
use crate::numeric::Scalar;

/// Series in time over a [`JetSpace`]: a part is a whole jet, its degree the power of time.
#[derive(Clone, Debug)]
pub struct JetSeries {
    /// Space of the coefficients.
    pub space: Arc<JetSpace>,
    /// Highest power of time kept.
    pub order: usize,
}

impl JetSeries {
    fn jet<S: Scalar>(&self, coefficients: &[S]) -> Jet<S> {
        Jet::from_coefficients(&self.space, coefficients.to_vec())
    }
}

impl<S: Scalar> Graded<S> for JetSeries {
    fn order(&self) -> usize {
        self.order
    }

    fn element_len(&self) -> usize {
        (self.order + 1) * self.space.len()
    }

    fn part(&self, degree: usize) -> Range<usize> {
        degree * self.space.len()..(degree + 1) * self.space.len()
    }

    fn convolve(&self, degree: usize, span: Span, a: &[S], b: &[S], out: &mut [S]) {
        for j in span.range(degree + 1) {
            let (left, right) = (
                &a[Graded::<S>::part(self, j)],
                &b[Graded::<S>::part(self, degree - j)],
            );
            self.space.multiply_add(left, right, out);
        }
    }

    fn multiply_by_head(&self, _degree: usize, a: &[S], part: &[S], out: &mut [S]) {
        self.space
            .multiply_add(&a[Graded::<S>::part(self, 0)], part, out);
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
