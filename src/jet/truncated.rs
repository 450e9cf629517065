//! The jet itself: a truncated power series in a [`JetSpace`].

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::sync::Arc;

use super::elementary::{
    self, atan2, exp, hyperbolic, power, primitive, quotient, sqrt, trigonometric,
};
use super::{HeadFunction, JetSpace};
use crate::numeric::Scalar;

impl JetSpace {
    /// `out += a b` for coefficient slices of this space.
    #[inline]
    pub fn multiply_add<S: Scalar>(&self, a: &[S], b: &[S], out: &mut [S]) {
        for (monomial, value) in out.iter_mut().enumerate() {
            let mut sum = *value;
            for &(i, j) in self.pairs(monomial) {
                sum = a[i as usize].mul_add(b[j as usize], sum);
            }
            *value = sum;
        }
    }
}

/// A truncated power series: one coefficient per monomial of its space.
///
/// Operators combine jets of the *same* space (the same `Arc`); mixing spaces is a programming error
/// and panics. Elementary functions whose head lies outside their domain give NaN coefficients, as
/// `f64` does: check with [`is_finite`](Jet::is_finite).
#[derive(Clone, Debug)]
pub struct Jet<S: Scalar> {
    space: Arc<JetSpace>,
    coefficients: Vec<S>,
}

impl<S: Scalar> Jet<S> {
    /// The zero jet.
    pub fn zero(space: &Arc<JetSpace>) -> Self {
        Self {
            space: Arc::clone(space),
            coefficients: vec![S::zero(); space.len()],
        }
    }

    /// A constant.
    pub fn constant(space: &Arc<JetSpace>, value: S) -> Self {
        let mut jet = Self::zero(space);
        jet.coefficients[0] = value;
        jet
    }

    /// `value + x_variable` (the constant alone if the space keeps no linear term of that weight).
    pub fn variable(space: &Arc<JetSpace>, variable: usize, value: S) -> Self {
        let mut jet = Self::constant(space, value);
        if let Some(monomial) = space.linear_monomial(variable) {
            jet.coefficients[monomial] = S::one();
        }
        jet
    }

    /// A jet from its coefficients, in the space's order of monomials.
    ///
    /// # Panics
    ///
    /// If the number of coefficients is not [`JetSpace::len`].
    pub fn from_coefficients(space: &Arc<JetSpace>, coefficients: Vec<S>) -> Self {
        assert_eq!(
            coefficients.len(),
            space.len(),
            "a jet has one coefficient per monomial of its space"
        );
        Self {
            space: Arc::clone(space),
            coefficients,
        }
    }

    /// The space.
    pub fn space(&self) -> &Arc<JetSpace> {
        &self.space
    }

    /// All coefficients, by number of the monomial.
    pub fn coefficients(&self) -> &[S] {
        &self.coefficients
    }

    /// All coefficients, to be changed.
    pub fn coefficients_mut(&mut self) -> &mut [S] {
        &mut self.coefficients
    }

    /// The constant term.
    pub fn head(&self) -> S {
        self.coefficients[0]
    }

    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        self.coefficients.iter().all(|value| value.is_finite())
    }

    /// The jet times a number.
    pub fn scale(&self, factor: S) -> Self {
        self.map(|value| value * factor)
    }

    /// The jet plus a number.
    pub fn add_constant(&self, value: S) -> Self {
        let mut sum = self.clone();
        sum.coefficients[0] += value;
        sum
    }

    fn map(&self, f: impl Fn(S) -> S) -> Self {
        Self {
            space: Arc::clone(&self.space),
            coefficients: self.coefficients.iter().map(|&value| f(value)).collect(),
        }
    }

    /// `Ea`: every coefficient times its degree.
    fn euler(&self) -> Self {
        let mut euler = self.clone();
        for degree in 0..=self.space.order() {
            elementary::scale(
                &mut euler.coefficients[self.space.degree_range(degree)],
                S::from_f64(degree as f64),
            );
        }
        euler
    }

    /// Builds a jet degree by degree; `part(k, u, out)` sees the result's lower parts in `u`.
    fn build(space: &Arc<JetSpace>, mut part: impl FnMut(usize, &[S], &mut [S])) -> Self {
        let mut result = Self::zero(space);
        let mut scratch = vec![S::zero(); space.len()];
        for degree in 0..=space.order() {
            let range = space.degree_range(degree);
            part(degree, &result.coefficients, &mut scratch[range.clone()]);
            result.coefficients[range.clone()].copy_from_slice(&scratch[range]);
        }
        result
    }

    /// Builds a jet `u` degree by degree beside its Euler derivative `Eu`.
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

    /// Square root.
    pub fn sqrt(&self) -> Self {
        Self::build(&self.space, |k, u, out| {
            sqrt::part(&*self.space, k, &self.coefficients, u, out)
        })
    }

    /// Exponential.
    pub fn exp(&self) -> Self {
        let euler = self.euler();
        Self::build(&self.space, |k, u, out| {
            exp::part(
                &*self.space,
                k,
                &self.coefficients,
                &euler.coefficients,
                u,
                out,
            )
        })
    }

    /// Natural logarithm.
    pub fn ln(&self) -> Self {
        self.primitive(HeadFunction::Log, self)
    }

    /// Sine and cosine.
    pub fn sin_cos(&self) -> (Self, Self) {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler());
        self.build_pair(
            |k, cosine, out| {
                trigonometric::sine_part(space, k, a, &euler.coefficients, cosine, out)
            },
            |k, sine, out| trigonometric::cosine_part(space, k, a, &euler.coefficients, sine, out),
        )
    }

    /// Hyperbolic sine and cosine.
    pub fn sinh_cosh(&self) -> (Self, Self) {
        let (space, a, euler) = (&*self.space, &self.coefficients, self.euler());
        self.build_pair(
            |k, cosh, out| hyperbolic::sinh_part(space, k, a, &euler.coefficients, cosh, out),
            |k, sinh, out| hyperbolic::cosh_part(space, k, a, &euler.coefficients, sinh, out),
        )
    }

    /// Builds two jets side by side, each part of one from lower parts of the other.
    fn build_pair(
        &self,
        first: impl Fn(usize, &[S], &mut [S]),
        second: impl Fn(usize, &[S], &mut [S]),
    ) -> (Self, Self) {
        let (mut u, mut v) = (Self::zero(&self.space), Self::zero(&self.space));
        let mut scratch = vec![S::zero(); self.space.len()];
        for degree in 0..=self.space.order() {
            let range = self.space.degree_range(degree);
            first(degree, &v.coefficients, &mut scratch[range.clone()]);
            u.coefficients[range.clone()].copy_from_slice(&scratch[range.clone()]);
            second(degree, &u.coefficients, &mut scratch[range.clone()]);
            v.coefficients[range.clone()].copy_from_slice(&scratch[range]);
        }
        (u, v)
    }

    /// Tangent.
    pub fn tan(&self) -> Self {
        let (sine, cosine) = self.sin_cos();
        &sine / &cosine
    }

    /// Hyperbolic tangent.
    pub fn tanh(&self) -> Self {
        let (sinh, cosh) = self.sinh_cosh();
        &sinh / &cosh
    }

    /// Arc sine.
    pub fn asin(&self) -> Self {
        self.primitive(
            HeadFunction::Asin,
            &(-&(self * self)).add_constant(S::one()).sqrt(),
        )
    }

    /// Arc cosine.
    pub fn acos(&self) -> Self {
        self.primitive(
            HeadFunction::Acos,
            &-&(-&(self * self)).add_constant(S::one()).sqrt(),
        )
    }

    /// Arc tangent.
    pub fn atan(&self) -> Self {
        self.primitive(HeadFunction::Atan, &(self * self).add_constant(S::one()))
    }

    /// `u = f(a)` with `w Eu = Ea`.
    fn primitive(&self, function: HeadFunction, w: &Self) -> Self {
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            primitive::part(
                &*self.space,
                function,
                k,
                &self.coefficients,
                &w.coefficients,
                euler_u,
                out,
            );
        })
    }

    /// Angle of the point `(x, self)`.
    pub fn atan2(&self, x: &Self) -> Self {
        let (euler_y, euler_x) = (self.euler(), x.euler());
        let w = &(self * self) + &(x * x);
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            let (y, x, w) = (&self.coefficients, &x.coefficients, &w.coefficients);
            atan2::part(
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

    /// Real power, for a positive head.
    pub fn power_real(&self, exponent: S) -> Self {
        let euler = self.euler();
        Self::build_with_euler(&self.space, |k, u, euler_u, out| {
            power::part(
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
        }
    }

    fn assert_same_space(&self, other: &Self) {
        assert!(
            Arc::ptr_eq(&self.space, &other.space),
            "jets of different spaces cannot be combined"
        );
    }
}

impl<S: Scalar> AddAssign<&Jet<S>> for Jet<S> {
    fn add_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients.iter_mut().zip(&other.coefficients) {
            *value += term;
        }
    }
}

impl<S: Scalar> SubAssign<&Jet<S>> for Jet<S> {
    fn sub_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients.iter_mut().zip(&other.coefficients) {
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
        let mut product = Jet::zero(&self.space);
        self.space.multiply_add(
            &self.coefficients,
            &other.coefficients,
            &mut product.coefficients,
        );
        product
    }
}

impl<S: Scalar> Div for &Jet<S> {
    type Output = Jet<S>;
    fn div(self, other: Self) -> Jet<S> {
        self.assert_same_space(other);
        Jet::build(&self.space, |k, u, out| {
            quotient::part(
                &*self.space,
                k,
                &self.coefficients,
                &other.coefficients,
                u,
                out,
            );
        })
    }
}
