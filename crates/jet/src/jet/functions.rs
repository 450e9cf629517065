//! The elementary functions of a jet, by the recurrences of [`elementary`](super::elementary) in
//! degree.
//!
//! Functions of a head outside their domain give coefficients that are not finite, as `f64` does:
//! √ and real powers at a head `≤ 0` (not analytic there), `ln` at `≤ 0`, `asin` and `acos` at
//! `|head| ≥ 1`.

use std::sync::Arc;

use super::elementary::{
    atan2_part, exponential_part, power_part, primitive_part, scale, sqrt_part,
};
use super::{HeadFunction, Jet, JetSpace};
use crate::numeric::Scalar;

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

    /// Builds a jet degree by degree; `part(k, u, out)` sees the result's lower parts in `u`.
    pub(super) fn build(
        space: &Arc<JetSpace>,
        mut part: impl FnMut(usize, &[S], &mut [S]),
    ) -> Self {
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
        self.primitive(HeadFunction::Log, self)
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

    /// Two functions side by side, each part of one from lower parts of the other.
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

    /// Hyperbolic tangent, `sinh / cosh`.
    pub fn tanh(&self) -> Self {
        let (sinh, cosh) = self.sinh_cosh();
        &sinh / &cosh
    }

    /// Arc sine, for a head inside `(−1, 1)`: `√(1 − a²) Eu = Ea`.
    pub fn asin(&self) -> Self {
        self.primitive(HeadFunction::Asin, &self.cathetus())
    }

    /// Arc cosine, for a head inside `(−1, 1)`: `−√(1 − a²) Eu = Ea`.
    pub fn acos(&self) -> Self {
        self.primitive(HeadFunction::Acos, &-&self.cathetus())
    }

    /// Arc tangent: `(1 + a²) Eu = Ea`.
    pub fn atan(&self) -> Self {
        self.primitive(HeadFunction::Atan, &(self * self).add_constant(S::one()))
    }

    /// `√(1 − a²)`, as `√((1 − a)(1 + a))`: no cancellation near `|a_0| = 1`.
    fn cathetus(&self) -> Self {
        (&(-self).add_constant(S::one()) * &self.add_constant(S::one())).sqrt()
    }

    /// `u = f(a)` with `w Eu = Ea`.
    fn primitive(&self, function: HeadFunction, w: &Self) -> Self {
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            primitive_part(
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

    /// Angle of the point `(x, self)`, its head in `(−π, π]`, for a point other than the origin.
    ///
    /// With `y = self` and `w = x² + y²`: `w Eu = x Ey − y Ex`.
    ///
    /// # Panics
    ///
    /// If the two jets are not of one space.
    pub fn atan2(&self, x: &Self) -> Self {
        let (euler_y, euler_x) = (self.euler(), x.euler());
        let w = &(self * self) + &(x * x);
        Self::build_with_euler(&self.space, |k, _, euler_u, out| {
            let (y, x, w) = (&self.coefficients, &x.coefficients, &w.coefficients);
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
        }
    }
}
