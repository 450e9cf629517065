//! Equations in the units of what they are about.
//!
//! One idea: tolerances and conditions mean something for numbers of order one. States, their
//! closure and the event functions are measured in a length of the orbit, each adjusted parameter
//! in its own size; a unit is a coarse power of two, so that numbers near one are computed with as
//! they are, and all others exactly as if they were.

use nalgebra::DMatrix;

use super::OrbitError;
use super::newton::{Equations, NewtonFailure, Root, Solve};
use crate::numeric::Dd;

/// Units are powers of `2^COARSENESS`.
const COARSENESS: i32 = 10;

/// The power of `2^10` nearest to a size; 1 for zero and for what is not finite.
pub(super) fn unit_of(size: f64) -> f64 {
    if size > 0.0 && size.is_finite() {
        let steps = (size.log2() / f64::from(COARSENESS)).round();
        // A unit that is not a normal number would not be exact.
        2f64.powi(COARSENESS * steps.clamp(-100.0, 100.0) as i32)
    } else {
        1.0
    }
}

/// A system of equations whose unknowns and residuals are in units of their own.
#[derive(Clone, Debug)]
pub(super) struct Scaled<'a, E> {
    pub(super) equations: &'a E,
    /// One per unknown.
    pub(super) units: Vec<f64>,
    /// Of all residuals.
    pub(super) residual_unit: f64,
}

impl<E: Equations> Scaled<'_, E> {
    /// The outcome of a Newton iteration on the scaled system, from and to the units of the system
    /// itself.
    pub(super) fn solve(
        &self,
        start: &[f64],
        solve: impl Fn(&Self, &[f64]) -> Result<Solve<Vec<f64>>, OrbitError>,
    ) -> Result<Solve<Vec<f64>>, OrbitError> {
        Ok(match solve(self, &self.in_units(start))? {
            Solve::Root(root) => Solve::Root(self.without_units(&root)),
            Solve::Failed(failure) => Solve::Failed(self.failure_back(failure)),
        })
    }

    /// As [`solve`](Self::solve), for a refinement.
    pub(super) fn refine(
        &self,
        start: &[f64],
        refine: impl Fn(&Self, &[f64]) -> Result<Solve<Root>, OrbitError>,
    ) -> Result<Solve<Root>, OrbitError> {
        Ok(match refine(self, &self.in_units(start))? {
            Solve::Root(root) => Solve::Root(Root {
                unknowns: self.without_units_dd(&root.unknowns),
                residual: root.residual * self.residual_unit,
            }),
            Solve::Failed(failure) => Solve::Failed(self.failure_back(failure)),
        })
    }

    /// Unknowns in their units.
    pub(super) fn in_units(&self, unknowns: &[f64]) -> Vec<f64> {
        let pairs = unknowns.iter().zip(&self.units);
        pairs.map(|(value, unit)| value / unit).collect()
    }

    fn without_units(&self, unknowns: &[f64]) -> Vec<f64> {
        let pairs = unknowns.iter().zip(&self.units);
        pairs.map(|(value, unit)| value * unit).collect()
    }

    fn without_units_dd(&self, unknowns: &[Dd]) -> Vec<Dd> {
        let pairs = unknowns.iter().zip(&self.units);
        pairs
            .map(|(&value, &unit)| value * Dd::from(unit))
            .collect()
    }

    fn failure_back(&self, mut failure: NewtonFailure) -> NewtonFailure {
        failure.unknowns = self.without_units(&failure.unknowns);
        for residual in &mut failure.history {
            *residual *= self.residual_unit;
        }
        failure
    }

    fn residuals_in_units(&self, residual: Vec<f64>) -> Vec<f64> {
        let values = residual.into_iter();
        values.map(|value| value / self.residual_unit).collect()
    }
}

impl<E: Equations> Equations for Scaled<'_, E> {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (residual, mut jacobian) = self.equations.linearised(&self.without_units(unknowns))?;
        for (mut column, unit) in jacobian.column_iter_mut().zip(&self.units) {
            column *= unit / self.residual_unit;
        }
        Ok((self.residuals_in_units(residual), jacobian))
    }

    fn residual(&self, unknowns: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let residual = self.equations.residual(&self.without_units(unknowns))?;
        Ok(self.residuals_in_units(residual))
    }

    fn residual_dd(&self, unknowns: &[Dd]) -> Result<Vec<Dd>, OrbitError> {
        let residual = self
            .equations
            .residual_dd(&self.without_units_dd(unknowns))?;
        let unit = Dd::from(1.0 / self.residual_unit);
        Ok(residual.into_iter().map(|value| value * unit).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_near_one_have_the_unit_one() {
        for size in [0.04, 1.0, 31.0, 0.0, f64::NAN] {
            assert_eq!(unit_of(size), 1.0, "{size}");
        }
        assert_eq!(unit_of(1e15), 2f64.powi(50));
        assert_eq!(unit_of(1e-15), 2f64.powi(-50));
    }
}
