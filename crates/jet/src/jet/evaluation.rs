//! Values and gradients of jets, read as polynomials.
//!
//! One idea: every monomial is its parent times one variable, so all of them cost one product each,
//! and the gradient is the same pass run backwards (reverse accumulation).

use super::{Jet, JetSpace};
use crate::numeric::Scalar;

impl JetSpace {
    /// Values of all monomials at a point, into `values` (resized to the space's length).
    ///
    /// Several jets of one space at one point share them: each value is then
    /// [`Jet::evaluate_on`] these monomials.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per variable.
    pub fn monomials_at<S: Scalar>(&self, point: &[S], values: &mut Vec<S>) {
        assert_eq!(
            point.len(),
            self.variables(),
            "a point has one coordinate per variable"
        );
        values.clear();
        values.push(S::one());
        for monomial in 1..self.len() {
            let (parent, variable) = self.parent(monomial);
            values.push(values[parent] * point[variable]);
        }
    }
}

impl<S: Scalar> Jet<S> {
    /// Number of coefficients that are not zero.
    pub fn nonzero(&self) -> usize {
        let values = self.coefficients.iter();
        values.filter(|&&value| value != S::zero()).count()
    }

    /// Value at a point, one coordinate per variable.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per variable.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let space = JetSpace::uniform(2, 2)?;
    /// let (x, y) = (Jet::variable(&space, 0, 1.0), Jet::variable(&space, 1, 0.0));
    /// assert_eq!((&x * &y).evaluate(&[2.0, 5.0]), 15.0); // (1 + 2) · 5
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn evaluate(&self, point: &[S]) -> S {
        let mut monomials = Vec::with_capacity(self.space.len());
        self.space.monomials_at(point, &mut monomials);
        self.evaluate_on(&monomials)
    }

    /// Value at the point whose monomials [`JetSpace::monomials_at`] gave.
    ///
    /// Small terms are added first.
    pub fn evaluate_on(&self, monomials: &[S]) -> S {
        let terms = self.coefficients.iter().zip(monomials).rev();
        terms.fold(S::zero(), |sum, (&coefficient, &monomial)| {
            coefficient.mul_add(monomial, sum)
        })
    }

    /// Value at a point and the derivative by each variable there, into `gradient`.
    ///
    /// # Panics
    ///
    /// If the point or the gradient has not one entry per variable.
    pub fn evaluate_with_gradient(&self, point: &[S], gradient: &mut [S]) -> S {
        assert_eq!(
            gradient.len(),
            self.space.variables(),
            "a gradient has one entry per variable"
        );
        let mut monomials = Vec::with_capacity(self.space.len());
        self.space.monomials_at(point, &mut monomials);
        gradient.fill(S::zero());
        let mut adjoints = self.coefficients.clone();
        for monomial in (1..self.space.len()).rev() {
            let (parent, variable) = self.space.parent(monomial);
            let adjoint = adjoints[monomial];
            gradient[variable] = adjoint.mul_add(monomials[parent], gradient[variable]);
            adjoints[parent] = adjoint.mul_add(point[variable], adjoints[parent]);
        }
        self.evaluate_on(&monomials)
    }
}
