//! Derivative and integral of a jet by one of its variables.

use super::Jet;
use crate::numeric::Scalar;

impl<S: Scalar> Jet<S> {
    /// Derivative by a variable, in the same space.
    ///
    /// ```text
    /// (∂a/∂x_v)_e = (e_v + 1) a_{e + 1_v}
    /// ```
    ///
    /// NOTE: the derivative of a series known to the order is known only to the order less the
    /// variable's weight; the coefficients above are zero, not those of the true derivative.
    ///
    /// # Panics
    ///
    /// If the space has no such variable.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let x = Jet::variable(&JetSpace::uniform(1, 4)?, 0, 0.0);
    /// assert_eq!(x.power_integer(3).derivative(0), (&x * &x).scale(3.0));
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn derivative(&self, variable: usize) -> Self {
        let mut derivative = Self::zero(&self.space);
        self.for_each_neighbour(variable, |lower, upper, exponent| {
            derivative.coefficients[lower] =
                self.coefficients[upper] * S::from_f64(f64::from(exponent));
        });
        derivative
    }

    /// Integral by a variable from 0, to the order of the space.
    ///
    /// ```text
    /// (∫a dx_v)_{e + 1_v} = a_e / (e_v + 1)
    /// ```
    ///
    /// # Panics
    ///
    /// If the space has no such variable.
    pub fn integral(&self, variable: usize) -> Self {
        let mut integral = Self::zero(&self.space);
        self.for_each_neighbour(variable, |lower, upper, exponent| {
            integral.coefficients[upper] =
                self.coefficients[lower] / S::from_f64(f64::from(exponent));
        });
        integral
    }

    /// Visits every pair `upper = lower · x_variable` of kept monomials, with the exponent in
    /// `upper`.
    fn for_each_neighbour(&self, variable: usize, mut visit: impl FnMut(usize, usize, u8)) {
        assert!(
            variable < self.space.variables(),
            "no variable {variable} in this space"
        );
        let mut divisor = vec![0u8; self.space.variables()];
        for upper in 1..self.space.len() {
            let exponents = self.space.exponents(upper);
            if exponents[variable] > 0 {
                divisor.copy_from_slice(exponents);
                divisor[variable] -= 1;
                let lower = self
                    .space
                    .monomial(&divisor)
                    .expect("a divisor of a kept monomial is kept");
                visit(lower, upper, exponents[variable]);
            }
        }
    }
}
