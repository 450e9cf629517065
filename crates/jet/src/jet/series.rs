//! Taylor series in time whose coefficients are jets: jet transport by Taylor's method.

use std::ops::Range;
use std::sync::Arc;

use super::{Graded, HeadFunction, Jet, JetSpace, Span};
use crate::numeric::Scalar;

/// Series in time over a [`JetSpace`]: a part is a whole jet, its degree the power of time.
///
/// Where a series is to be summed at a time without constant term, its coefficients are needed to
/// ever lower degrees: products are formed as far as asked for, and what lies beyond means nothing.
#[derive(Clone, Debug)]
pub struct JetSeries {
    space: Arc<JetSpace>,
    /// Degree to which the coefficient of each power of time is needed, falling.
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
        Self {
            space: Arc::clone(space),
            kept,
        }
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
            let (left, right) = (
                &a[Graded::<S>::part(self, j)],
                &b[Graded::<S>::part(self, degree - j)],
            );
            self.space
                .multiply_add_to(left, right, self.kept[degree], out);
        }
    }

    fn multiply_by_head(&self, degree: usize, a: &[S], part: &[S], out: &mut [S]) {
        let head = &a[Graded::<S>::part(self, 0)];
        self.space
            .multiply_add_to(head, part, self.kept[degree], out);
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
