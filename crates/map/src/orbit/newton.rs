//! Newton's method in two stages: damped in `f64`, then refined with residuals in double-double.
//!
//! A correction needs few digits, a residual needs all of them. The `f64` Jacobian therefore serves
//! both stages; the second is iterative refinement and ends at the roundoff of double-double.
//!
//! Tolerances and condition numbers presuppose numbers of order one. [`Scaled`] equations measure
//! states, their closure and the event functions in a length of the orbit, states that are far
//! smaller in one of their own, and each adjusted parameter in its own size. A unit is a coarse
//! power of two: numbers near one keep their unit, and all others are scaled without rounding.

use nalgebra::{DMatrix, DVector};

use super::outcome::OrbitError;
use crate::numeric::{Dd, NewtonOutcome, Real, converted, damped_newton};

/// A square system of equations.
pub(super) trait Equations {
    /// Residuals and Jacobian.
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError>;
    /// Residuals, in `f64` or double-double.
    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError>;
}

/// Result of a Newton iteration: a root, or a failure to find one.
pub(super) type Solved<T> = Result<Result<T, NewtonFailure>, OrbitError>;

/// Record of an iteration that found no root.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NewtonFailure {
    /// The last iterate.
    pub(super) unknowns: Vec<f64>,
    /// Largest residual at every iterate.
    pub(super) history: Vec<f64>,
    /// Smallest over largest singular value of the Jacobian with scaled columns, if that was too
    /// small.
    pub(super) singular: Option<f64>,
}

/// A root with its residual.
#[derive(Clone, Debug)]
pub(super) struct Root {
    /// The unknowns.
    pub(super) unknowns: Vec<Dd>,
    /// Largest residual.
    pub(super) residual: f64,
}

const MAX_ITERATIONS: usize = 60;
const MAX_HALVINGS: usize = 10;
/// Reciprocal condition numbers of a scaled Jacobian below this are roundoff.
const SINGULAR: f64 = 1e-11;

/// A column of a Jacobian smaller than this, relative to the largest entry, is roundoff and is not
/// scaled up.
const ROUNDOFF: f64 = 1e-11;

/// Reason why no step can be computed at an iterate.
enum NoStep {
    /// The iterate is a root.
    AtRoot,
    /// Residuals are not finite, or the Jacobian is singular, with its reciprocal condition number.
    Failed(Option<f64>),
    /// The equations cannot be set up at the iterate.
    Error(OrbitError),
}

/// Damped Newton in `f64`, to a stall below `tolerance`. A step must lower the residual by at least
/// a quarter of the decrease that a linear system would show.
pub(super) fn solve(system: &impl Equations, start: &[f64], tolerance: f64) -> Solved<Vec<f64>> {
    let mut history = Vec::new();
    let step = |unknowns: &Vec<f64>| {
        let (residual, jacobian) = match system.linearised(unknowns) {
            Ok(linearised) => linearised,
            Err(OrbitError::Flow(_)) if history.is_empty() => {
                (vec![f64::INFINITY], DMatrix::zeros(0, 0))
            }
            Err(error) => return Err(NoStep::Error(error)),
        };
        let size = norm(&residual);
        history.push(size);
        if !size.is_finite() {
            return Err(NoStep::Failed(None));
        }
        match newton_step(&jacobian, &residual) {
            Ok(step) => Ok((step, size)),
            Err(_) if size == 0.0 => Err(NoStep::AtRoot),
            Err(condition) => Err(NoStep::Failed(Some(condition))),
        }
    };
    let moved = |unknowns: &Vec<f64>, (step, size): &(Vec<f64>, f64), share: f64| {
        let pairs = unknowns.iter().zip(step);
        let next: Vec<f64> = pairs.map(|(value, step)| value - share * step).collect();
        let trial = system.residual(&next).map_or(f64::INFINITY, |residual| norm(&residual));
        (trial <= (1.0 - 0.25 * share) * size).then_some(next)
    };
    let is_root = |unknowns: &Vec<f64>, (step, size): &(Vec<f64>, f64)| {
        let pairs = step.iter().zip(unknowns);
        let relative = pairs.map(|(step, value)| step.abs() / value.abs().max(1.0));
        *size <= tolerance && relative.fold(0.0, f64::max) < 1e-13
    };
    let outcome =
        damped_newton(start.to_vec(), [MAX_ITERATIONS, MAX_HALVINGS], step, moved, is_root);
    let (unknowns, singular) = match outcome {
        NewtonOutcome::Root(unknowns) => return Ok(Ok(unknowns)),
        NewtonOutcome::NotNearer { at, step: (_, size) } if size <= tolerance => return Ok(Ok(at)),
        NewtonOutcome::NotNearer { at, .. } | NewtonOutcome::StepLimit(at) => (at, None),
        NewtonOutcome::NoStep { at, reason, .. } => match reason {
            NoStep::AtRoot => return Ok(Ok(at)),
            NoStep::Failed(singular) => (at, singular),
            NoStep::Error(error) => return Err(error),
        },
    };
    Ok(Err(NewtonFailure { unknowns, history, singular }))
}

/// Refines an `f64` root until the double-double residuals stop falling; they must end below
/// `tolerance`.
pub(super) fn refine(system: &impl Equations, start: &[f64], tolerance: f64) -> Solved<Root> {
    let (_, jacobian) = system.linearised(start)?;
    let inverse = match inverse(&jacobian) {
        Ok(inverse) => inverse,
        Err(condition) => {
            let (unknowns, history, singular) = (start.to_vec(), Vec::new(), Some(condition));
            return Ok(Err(NewtonFailure { unknowns, history, singular }));
        }
    };
    let mut unknowns: Vec<Dd> = converted(start);
    let mut residual = system.residual(&unknowns)?;
    let mut history = vec![norm(&residual)];
    let mut best = Root { unknowns: unknowns.clone(), residual: history[0] };
    for _ in 0..MAX_ITERATIONS {
        let leading =
            DVector::from_iterator(residual.len(), residual.iter().map(|value| value.to_f64()));
        let step = &inverse * leading;
        for (value, &step) in unknowns.iter_mut().zip(step.iter()) {
            *value -= Dd::from(step);
        }
        residual = system.residual(&unknowns)?;
        let size = norm(&residual);
        history.push(size);
        let stalled = size.is_nan() || size > 0.5 * best.residual;
        if size < best.residual {
            best = Root { unknowns: unknowns.clone(), residual: size };
        }
        if stalled {
            break;
        }
    }
    if best.residual <= tolerance {
        return Ok(Ok(best));
    }
    let unknowns = converted(&best.unknowns);
    Ok(Err(NewtonFailure { unknowns, history, singular: None }))
}

/// Step `J⁻¹ r`, or the reciprocal condition number of a singular `J`.
fn newton_step(jacobian: &DMatrix<f64>, residual: &[f64]) -> Result<Vec<f64>, f64> {
    let step = inverse(jacobian)? * DVector::from_column_slice(residual);
    Ok(step.iter().copied().collect())
}

/// Inverse by singular value decomposition, or the reciprocal condition number if it is roundoff.
///
/// NOTE: columns are scaled (the unknowns have units of their own) unless they are roundoff. Rows
/// are not: the closure's rows are differences `M − I`, and scaling would blow up a row that
/// consists of roundoff only.
fn inverse(jacobian: &DMatrix<f64>) -> Result<DMatrix<f64>, f64> {
    let mut scaled = jacobian.clone();
    let largest = scaled.amax();
    let factor = |size: f64| {
        if size > ROUNDOFF * largest { 1.0 / size } else { 1.0 / largest }
    };
    let columns: Vec<f64> = scaled.column_iter().map(|column| factor(column.amax())).collect();
    for (mut column, &factor) in scaled.column_iter_mut().zip(&columns) {
        column *= factor;
    }
    if !scaled.iter().all(|value| value.is_finite()) {
        return Err(0.0);
    }
    let singular = scaled.svd(true, true);
    let (high, low) = (singular.singular_values.max(), singular.singular_values.min());
    let condition = if high > 0.0 { low / high } else { 0.0 };
    if condition < SINGULAR {
        return Err(condition);
    }
    let mut inverse = singular.pseudo_inverse(0.0).map_err(|_| condition)?;
    for (mut row, &factor) in inverse.row_iter_mut().zip(&columns) {
        row *= factor;
    }
    Ok(inverse)
}

/// Largest absolute value; NaN if a value is NaN.
fn norm<S: Real>(values: &[S]) -> f64 {
    let sizes = values.iter().map(|value| value.magnitude());
    sizes.fold(0.0, |largest: f64, size| if size.is_nan() { f64::NAN } else { largest.max(size) })
}

/// Exponent step of units, which are powers of `2^COARSENESS`.
const COARSENESS: i32 = 10;

/// Power of `2^10` nearest to a size; 1 for zero and for sizes that are not finite.
pub(super) fn unit_of(size: f64) -> f64 {
    if size > 0.0 && size.is_finite() {
        let steps = (size.log2() / f64::from(COARSENESS)).round();
        // A unit outside the normal numbers would not be exact.
        2f64.powi(COARSENESS * steps.clamp(-100.0, 100.0) as i32)
    } else {
        1.0
    }
}

/// A system of equations whose unknowns and residuals are measured in units.
#[derive(Clone, Debug)]
pub(super) struct Scaled<'a, E> {
    pub(super) equations: &'a E,
    /// Unit of each unknown.
    pub(super) units: Vec<f64>,
    /// Unit of each residual.
    pub(super) residual_units: Vec<f64>,
    /// Length in which residuals are told.
    pub(super) length: f64,
}

impl<E: Equations> Scaled<'_, E> {
    /// Runs [`solve`] on the scaled system; start and root are in the system's own units.
    pub(super) fn solve(&self, start: &[f64], tolerance: f64) -> Solved<Vec<f64>> {
        let solved = solve(self, &self.in_units(start), tolerance)?;
        let root = solved.map(|root| self.without_units(&root));
        Ok(root.map_err(|failure| self.failure_back(failure)))
    }

    /// Runs [`refine`] on the scaled system, to a tolerance relative to the size of the scaled
    /// unknowns.
    pub(super) fn refine(&self, start: &[f64], tolerance: f64) -> Solved<Root> {
        let unknowns = self.in_units(start);
        let size = unknowns.iter().fold(1.0_f64, |size, value| size.max(value.abs()));
        let root = refine(self, &unknowns, tolerance * size)?.map(|root| Root {
            unknowns: self.without_units(&root.unknowns),
            residual: root.residual * self.length,
        });
        Ok(root.map_err(|failure| self.failure_back(failure)))
    }

    /// Divides unknowns by their units.
    pub(super) fn in_units(&self, unknowns: &[f64]) -> Vec<f64> {
        let pairs = unknowns.iter().zip(&self.units);
        pairs.map(|(value, unit)| value / unit).collect()
    }

    /// Multiplies scaled unknowns by their units.
    pub(super) fn without_units<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        let pairs = unknowns.iter().zip(&self.units);
        pairs.map(|(&value, &unit)| value * S::from_f64(unit)).collect()
    }

    fn failure_back(&self, mut failure: NewtonFailure) -> NewtonFailure {
        failure.unknowns = self.without_units(&failure.unknowns);
        for residual in &mut failure.history {
            *residual *= self.length;
        }
        failure
    }

    fn residuals_in_units<S: Real>(&self, residual: Vec<S>) -> Vec<S> {
        let pairs = residual.into_iter().zip(&self.residual_units);
        pairs.map(|(value, unit)| value * S::from_f64(1.0 / unit)).collect()
    }
}

impl<E: Equations> Equations for Scaled<'_, E> {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (residual, mut jacobian) = self.equations.linearised(&self.without_units(unknowns))?;
        for (mut column, unit) in jacobian.column_iter_mut().zip(&self.units) {
            for (value, residual_unit) in column.iter_mut().zip(&self.residual_units) {
                *value *= unit / residual_unit;
            }
        }
        Ok((self.residuals_in_units(residual), jacobian))
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let residual = self.equations.residual(&self.without_units(unknowns))?;
        Ok(self.residuals_in_units(residual))
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
