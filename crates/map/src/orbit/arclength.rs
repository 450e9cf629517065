//! Pseudo-arclength continuation: points of a solution curve on planes across it, and its tangents.
//!
//! A system of one equation fewer than unknowns has curves of solutions. A plane across the curve
//! supplies the missing equation.

use nalgebra::{DMatrix, DVector};

use super::newton::{Equations, Scaled};
use super::outcome::OrbitError;
use crate::numeric::Real;

/// A system of one equation fewer than unknowns, on the plane through `origin` with normal
/// `normal`.
pub(super) struct Bordered<'a, E> {
    pub(super) system: Scaled<'a, E>,
    pub(super) origin: &'a [f64],
    pub(super) normal: &'a [f64],
}

impl<E: Equations> Equations for Bordered<'_, E> {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.system.linearised(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok((residual, bordered(&jacobian, self.normal)))
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let mut residual = self.system.residual(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok(residual)
    }
}

impl<E> Bordered<'_, E> {
    fn offset<S: Real>(&self, unknowns: &[S]) -> S {
        let terms = unknowns.iter().zip(self.origin).zip(self.normal);
        terms
            .map(|((&value, &origin), &normal)| (value - S::from_f64(origin)) * S::from_f64(normal))
            .sum()
    }
}

/// Appends a row to a Jacobian.
pub(super) fn bordered(jacobian: &DMatrix<f64>, normal: &[f64]) -> DMatrix<f64> {
    let rows = jacobian.nrows();
    let mut matrix = jacobian.clone().insert_row(rows, 0.0);
    for (column, &value) in normal.iter().enumerate() {
        matrix[(rows, column)] = value;
    }
    matrix
}

/// Unit tangent of a curve with this Jacobian, on the side of `along`; `None` if it is not
/// determined.
pub(super) fn tangent(jacobian: &DMatrix<f64>, along: &[f64]) -> Option<Vec<f64>> {
    let mut right = DVector::zeros(along.len());
    right[along.len() - 1] = 1.0;
    let direction = bordered(jacobian, along).lu().solve(&right)?;
    let length = direction.norm();
    let is_finite = direction.iter().all(|value| value.is_finite());
    is_finite.then(|| direction.iter().map(|value| value / length).collect())
}

/// Smallest cosine of the angle by which the tangent turns in one step.
pub(super) const STRAIGHT: f64 = 0.98;

/// Largest correction of a step, relative to its length.
pub(super) const CORRECTION: f64 = 0.3;

/// Growth factor of the next step.
pub(super) const GROWTH: f64 = 1.3;

/// Scalar product of two vectors.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Distance of two points.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
