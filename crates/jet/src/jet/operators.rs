//! Sums, products and quotients of jets, as operators and in place.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::Jet;
use super::elementary::quotient;
use crate::numeric::Scalar;

impl<S: Scalar> Jet<S> {
    /// `out = self · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the three jets are not of one space.
    pub fn multiply_into(&self, other: &Self, out: &mut Self) {
        self.assert_same_space(other);
        self.assert_same_space(out);
        let space = self.space();
        space.multiply(
            self.coefficients(),
            other.coefficients(),
            out.coefficients_mut(),
        );
    }

    /// `out += self · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the three jets are not of one space.
    pub fn multiply_add_into(&self, other: &Self, out: &mut Self) {
        self.assert_same_space(other);
        self.assert_same_space(out);
        let space = self.space();
        space.multiply_add(
            self.coefficients(),
            other.coefficients(),
            out.coefficients_mut(),
        );
    }

    /// `self += factor · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the jets are not of one space.
    pub fn add_scaled(&mut self, factor: S, other: &Self) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value = factor.mul_add(term, *value);
        }
    }

    /// `self *= factor`, without allocating.
    pub fn scale_in_place(&mut self, factor: S) {
        super::elementary::scale(self.coefficients_mut(), factor);
    }
}

impl<S: Scalar> AddAssign<&Jet<S>> for Jet<S> {
    fn add_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value += term;
        }
    }
}

impl<S: Scalar> SubAssign<&Jet<S>> for Jet<S> {
    fn sub_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value -= term;
        }
    }
}

impl<S: Scalar> Add for &Jet<S> {
    type Output = Jet<S>;
    fn add(self, other: Self) -> Jet<S> {
        let mut sum = self.clone();
        sum += other;
        sum
    }
}

impl<S: Scalar> Sub for &Jet<S> {
    type Output = Jet<S>;
    fn sub(self, other: Self) -> Jet<S> {
        let mut difference = self.clone();
        difference -= other;
        difference
    }
}

impl<S: Scalar> Neg for &Jet<S> {
    type Output = Jet<S>;
    fn neg(self) -> Jet<S> {
        self.map(|value| -value)
    }
}

impl<S: Scalar> Mul for &Jet<S> {
    type Output = Jet<S>;
    fn mul(self, other: Self) -> Jet<S> {
        self.assert_same_space(other);
        let mut product = Jet::zero(self.space());
        self.multiply_add_into(other, &mut product);
        product
    }
}

impl<S: Scalar> Div for &Jet<S> {
    type Output = Jet<S>;
    fn div(self, other: Self) -> Jet<S> {
        self.assert_same_space(other);
        Jet::build(self.space(), |k, u, out| {
            quotient::part(
                &**self.space(),
                k,
                self.coefficients(),
                other.coefficients(),
                u,
                out,
            );
        })
    }
}
