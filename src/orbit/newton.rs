//! Newton's method in two stages: damped in `f64`, then refined with residuals in double-double.
//!
//! One idea: a correction needs few digits, a residual needs all of them. The `f64` Jacobian
//! therefore serves both stages; the second is iterative refinement and ends at the roundoff of
//! double-double.

use nalgebra::{DMatrix, DVector};

use crate::numeric::{Dd, Scalar};

use super::OrbitError;

/// A square system of equations.
pub(super) trait Equations {
    /// Residuals and Jacobian.
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError>;
    /// Residuals.
    fn residual(&self, unknowns: &[f64]) -> Result<Vec<f64>, OrbitError>;
    /// Residuals in double-double.
    fn residual_dd(&self, unknowns: &[Dd]) -> Result<Vec<Dd>, OrbitError>;
}

/// How a Newton iteration ended.
#[derive(Clone, Debug)]
pub(super) enum Solve<T> {
    /// At a root.
    Root(T),
    /// Before one.
    Failed(NewtonFailure),
}

/// Why an iteration found no root.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NewtonFailure {
    /// The last iterate.
    pub(super) unknowns: Vec<f64>,
    /// Largest residual at every iterate.
    pub(super) history: Vec<f64>,
    /// Smallest over largest singular value of the Jacobian with its columns scaled, where it was
    /// too small.
    pub(super) singular: Option<f64>,
}

/// A root with its residual and the Jacobian there.
#[derive(Clone, Debug)]
pub(super) struct Root {
    /// The unknowns.
    pub(super) unknowns: Vec<Dd>,
    /// Largest residual.
    pub(super) residual: f64,
}

const MAX_ITERATIONS: usize = 60;
const MAX_HALVINGS: usize = 10;
/// Below this the reciprocal condition of a scaled Jacobian is roundoff.
const SINGULAR: f64 = 1e-11;

/// A column of a Jacobian smaller than this, relative to its largest entry, is roundoff and is not
/// scaled up.
const ROUNDOFF: f64 = 1e-11;

/// Damped Newton in `f64`, to a stall below `tolerance`.
pub(super) fn solve(
    system: &impl Equations,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Vec<f64>>, OrbitError> {
    let mut unknowns = start.to_vec();
    let mut history = Vec::new();
    for _ in 0..MAX_ITERATIONS {
        let (residual, jacobian) = match system.linearised(&unknowns) {
            Ok(linearised) => linearised,
            Err(OrbitError::Flow(_)) if history.is_empty() => {
                (vec![f64::INFINITY], DMatrix::zeros(0, 0))
            }
            Err(error) => return Err(error),
        };
        let size = norm(&residual);
        history.push(size);
        let failure = |singular| NewtonFailure {
            unknowns: unknowns.clone(),
            history: history.clone(),
            singular,
        };
        if !size.is_finite() {
            return Ok(Solve::Failed(failure(None)));
        }
        let step = match newton_step(&jacobian, &residual) {
            Ok(step) => step,
            Err(_) if size == 0.0 => return Ok(Solve::Root(unknowns)),
            Err(condition) => return Ok(Solve::Failed(failure(Some(condition)))),
        };
        match damped(system, &unknowns, &step, size) {
            Some((next, _)) => unknowns = next,
            None if size <= tolerance => return Ok(Solve::Root(unknowns)),
            None => return Ok(Solve::Failed(failure(None))),
        }
        let relative = step
            .iter()
            .zip(&unknowns)
            .map(|(step, value)| step.abs() / value.abs().max(1.0));
        if size <= tolerance && relative.fold(0.0, f64::max) < 1e-13 {
            return Ok(Solve::Root(unknowns));
        }
    }
    Ok(Solve::Failed(NewtonFailure {
        unknowns,
        history,
        singular: None,
    }))
}

/// Refines an `f64` root until the double-double residuals stop falling; they must end below
/// `tolerance`.
pub(super) fn refine(
    system: &impl Equations,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Root>, OrbitError> {
    let (_, jacobian) = system.linearised(start)?;
    let inverse = match inverse(&jacobian) {
        Ok(inverse) => inverse,
        Err(condition) => {
            let unknowns = start.to_vec();
            return Ok(Solve::Failed(NewtonFailure {
                unknowns,
                history: Vec::new(),
                singular: Some(condition),
            }));
        }
    };
    let mut unknowns: Vec<Dd> = start.iter().map(|&value| Dd::from(value)).collect();
    let mut residual = system.residual_dd(&unknowns)?;
    let mut history = vec![norm_dd(&residual)];
    let mut best = Root {
        unknowns: unknowns.clone(),
        residual: history[0],
    };
    for _ in 0..MAX_ITERATIONS {
        let leading =
            DVector::from_iterator(residual.len(), residual.iter().map(|value| value.to_f64()));
        let step = &inverse * leading;
        for (value, &step) in unknowns.iter_mut().zip(step.iter()) {
            *value -= Dd::from(step);
        }
        residual = system.residual_dd(&unknowns)?;
        let size = norm_dd(&residual);
        history.push(size);
        let stalled = size.is_nan() || size > 0.5 * best.residual;
        if size < best.residual {
            best = Root {
                unknowns: unknowns.clone(),
                residual: size,
            };
        }
        if stalled {
            break;
        }
    }
    if best.residual <= tolerance {
        return Ok(Solve::Root(best));
    }
    let unknowns = best.unknowns.iter().map(|value| value.to_f64()).collect();
    Ok(Solve::Failed(NewtonFailure {
        unknowns,
        history,
        singular: None,
    }))
}

/// The first of the steps `1, 1/2, 1/4, …` that lowers the residual.
fn damped(
    system: &impl Equations,
    unknowns: &[f64],
    step: &[f64],
    size: f64,
) -> Option<(Vec<f64>, f64)> {
    let mut factor = 1.0;
    for _ in 0..=MAX_HALVINGS {
        let next: Vec<f64> = unknowns
            .iter()
            .zip(step)
            .map(|(value, step)| value - factor * step)
            .collect();
        let trial = system
            .residual(&next)
            .map_or(f64::INFINITY, |residual| norm(&residual));
        if trial <= (1.0 - 0.25 * factor) * size {
            return Some((next, trial));
        }
        factor *= 0.5;
    }
    None
}

/// `J⁻¹ r`, or the reciprocal condition of `J` where it is singular.
fn newton_step(jacobian: &DMatrix<f64>, residual: &[f64]) -> Result<Vec<f64>, f64> {
    let step = inverse(jacobian)? * DVector::from_column_slice(residual);
    Ok(step.iter().copied().collect())
}

/// The inverse through a singular value decomposition, or the reciprocal condition where that is
/// roundoff.
///
/// NOTE: columns are scaled (the unknowns have units of their own) unless they are roundoff; rows
/// are not, for the closure's rows are differences `M − I`, and scaling would blow up a row that is
/// nothing but their roundoff.
fn inverse(jacobian: &DMatrix<f64>) -> Result<DMatrix<f64>, f64> {
    let mut scaled = jacobian.clone();
    let largest = scaled.amax();
    let factor = |size: f64| {
        if size > ROUNDOFF * largest {
            1.0 / size
        } else {
            1.0 / largest
        }
    };
    let columns: Vec<f64> = scaled
        .column_iter()
        .map(|column| factor(column.amax()))
        .collect();
    for (mut column, &factor) in scaled.column_iter_mut().zip(&columns) {
        column *= factor;
    }
    if !scaled.iter().all(|value| value.is_finite()) {
        return Err(0.0);
    }
    let singular = scaled.svd(true, true);
    let (high, low) = (
        singular.singular_values.max(),
        singular.singular_values.min(),
    );
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

/// Largest absolute value; NaN where one is.
pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, value| {
        if value.is_nan() {
            f64::NAN
        } else {
            largest.max(value.abs())
        }
    })
}

fn norm_dd(values: &[Dd]) -> f64 {
    norm(
        &values
            .iter()
            .map(|value| value.magnitude())
            .collect::<Vec<_>>(),
    )
}
