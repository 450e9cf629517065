//! The cheapest orders for a tolerance.

use super::ConvergenceError;
use super::data::{Choice, OrderResult};
use super::engine::{ConvergenceOptions, Sweep};
use super::errors::summarize;
use crate::analysis::NoProgress;
use crate::expansion::MapOrders;
use crate::model::{Scene, Shape};
use crate::orbit::GrazingOrbit;

/// Degrees of `P_smooth` and weights of `D` tried for a tolerance.
const HIGHEST: MapOrders = MapOrders {
    smooth_order: 8,
    contact_weight: 10,
};

/// The cheapest orders whose error on the window is at most `tolerance`, checked on fresh points; the
/// most accurate ones, and [`Choice::met`] `false`, where none is.
///
/// This is what a scene with `expansion.tolerance` gets.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no point to compare at.
pub fn choose_orders(
    scene: &Scene,
    orbit: &GrazingOrbit,
    tolerance: f64,
) -> Result<Choice, ConvergenceError> {
    let options = ConvergenceOptions {
        highest: HIGHEST,
        shapes: vec![match scene.emit.shape {
            Shape::Flown => Shape::Flown,
            _ => Shape::Factored,
        }],
        tolerance,
        ..ConvergenceOptions::of(scene)
    };
    let sweep = Sweep::new(scene, orbit, &options, &NoProgress)?;
    let results = sweep.errors(&NoProgress)?;
    choose(&sweep, &results, tolerance)
}

/// The cheapest of measured maps that also meets the tolerance on fresh points.
pub(super) fn choose(
    sweep: &Sweep<'_>,
    results: &[OrderResult],
    tolerance: f64,
) -> Result<Choice, ConvergenceError> {
    let fresh = sweep.fresh_truth()?;
    let within = |error: Option<f64>| error.is_some_and(|error| error <= tolerance);
    let mut candidates: Vec<_> = results
        .iter()
        .filter(|result| within(result.error.max))
        .collect();
    candidates.sort_by_key(|result| (result.operations, result.coefficients));
    let describe = |result: &OrderResult, met, fresh_error| Choice {
        tolerance,
        met,
        smooth_order: result.smooth_order,
        contact_weight: result.contact_weight,
        shape: result.shape,
        error: result.error.max,
        fresh_error,
    };
    for result in candidates {
        let fresh_error = summarize(&sweep.lowered(result.orders(), result.shape)?, &fresh).max;
        if within(fresh_error) {
            return Ok(describe(result, true, fresh_error));
        }
    }
    let size = |result: &&OrderResult| result.error.max.unwrap_or(f64::INFINITY);
    let best = results.iter().min_by(|a, b| size(a).total_cmp(&size(b)));
    let best = best.ok_or(ConvergenceError::NoTruth { tried: 0 })?;
    let fresh_error = summarize(&sweep.lowered(best.orders(), best.shape)?, &fresh).max;
    Ok(describe(best, false, fresh_error))
}
