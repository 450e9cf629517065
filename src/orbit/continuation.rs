//! Pseudo-arclength continuation of the extended system: tangent, predictor, corrector.

use nalgebra::{DMatrix, DVector};

use crate::numeric::Dd;

use super::OrbitError;
use super::newton::{Equations, Root, Solve, refine, solve};
use super::system::{ExtendedSystem, Matching};

/// Largest residual a corrector may stall at.
const TOLERANCE: f64 = 1e-9;

/// The extended system in two parameters, on the plane through `origin` across `normal`.
#[derive(Clone, Debug)]
struct Bordered {
    system: ExtendedSystem,
    origin: Vec<f64>,
    normal: Vec<f64>,
}

impl Equations for Bordered {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.system.differentiate(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok((residual, bordered(&jacobian, &self.normal)))
    }

    fn residual(&self, unknowns: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let mut residual = self.system.evaluate(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok(residual)
    }

    fn residual_dd(&self, unknowns: &[Dd]) -> Result<Vec<Dd>, OrbitError> {
        let mut residual = self.system.evaluate(unknowns)?;
        let terms = unknowns.iter().zip(&self.origin).zip(&self.normal);
        residual.push(
            terms
                .map(|((&value, &origin), &normal)| (value - Dd::from(origin)) * Dd::from(normal))
                .sum(),
        );
        Ok(residual)
    }
}

impl Bordered {
    fn offset(&self, unknowns: &[f64]) -> f64 {
        unknowns
            .iter()
            .zip(&self.origin)
            .zip(&self.normal)
            .map(|((value, origin), normal)| (value - origin) * normal)
            .sum()
    }
}

/// The point of the curve on the plane through `origin` across `normal`, or `None` where Newton's
/// method finds none.
pub(super) fn correct(
    system: &ExtendedSystem,
    origin: &[f64],
    normal: &[f64],
) -> Result<Option<Vec<f64>>, OrbitError> {
    for matching in [Matching::AtEnd, Matching::AtMiddle] {
        let equations = Bordered {
            system: system.matched(matching),
            origin: origin.to_vec(),
            normal: normal.to_vec(),
        };
        match solve(&equations, origin, TOLERANCE) {
            Ok(Solve::Root(root)) => return Ok(Some(root)),
            Ok(Solve::Failed(_)) | Err(OrbitError::Flow(_)) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// A point found by [`correct`], to the roundoff of double-double.
pub(super) fn correct_dd(
    system: &ExtendedSystem,
    point: &[f64],
    origin: &[f64],
    normal: &[f64],
) -> Result<Solve<Root>, OrbitError> {
    let equations = |matching| Bordered {
        system: system.matched(matching),
        origin: origin.to_vec(),
        normal: normal.to_vec(),
    };
    match refine(&equations(Matching::AtEnd), point, 1e-22) {
        Ok(Solve::Root(root)) => Ok(Solve::Root(root)),
        _ => refine(&equations(Matching::AtMiddle), point, 1e-22),
    }
}

/// The unit tangent of the curve at a point, on the side of `along`; `None` where it is not
/// determined.
pub(super) fn tangent(
    system: &ExtendedSystem,
    point: &[f64],
    along: &[f64],
) -> Result<Option<Vec<f64>>, OrbitError> {
    for matching in [Matching::AtEnd, Matching::AtMiddle] {
        let Ok((_, jacobian)) = system.matched(matching).differentiate(point) else {
            continue;
        };
        let mut right = DVector::zeros(point.len());
        right[point.len() - 1] = 1.0;
        if let Some(direction) = bordered(&jacobian, along).lu().solve(&right)
            && direction.iter().all(|value| value.is_finite())
        {
            let length = direction.norm();
            return Ok(Some(direction.iter().map(|value| value / length).collect()));
        }
    }
    Ok(None)
}

/// A Jacobian with one more row.
pub(super) fn bordered(jacobian: &DMatrix<f64>, normal: &[f64]) -> DMatrix<f64> {
    let rows = jacobian.nrows();
    let mut matrix = jacobian.clone().insert_row(rows, 0.0);
    for (column, &value) in normal.iter().enumerate() {
        matrix[(rows, column)] = value;
    }
    matrix
}
