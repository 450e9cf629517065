//! The half-period symmetry `(x, theta) -> (-x, theta + period/2)`: mirror images, and whether a
//! model has it.

use crate::model::Model;
use crate::numeric::{Dd, Real, Scalar};

use super::OrbitError;
use super::geometry::Geometry;
use super::section::reduced;

/// Largest departure from the symmetry, relative to the largest rate of a state, that is rounding
/// in double-double.
const ROUNDING: f64 = 1e-24;

/// The mirror image of a full state, its phase in `[0, period)`.
pub(super) fn mirrored<S: Real>(model: &Model, state: &[S]) -> Vec<S> {
    let mut image: Vec<S> = state.iter().map(|&value| -value).collect();
    if let (Some(clock), Some(phase), Some(&value)) = (&model.phase, image.last_mut(), state.last())
    {
        let shifted = value.to_dd() + clock.period * Dd::from(0.5);
        *phase = S::from_dd(reduced(shifted, clock.period));
    }
    image
}

/// Checks `f(-x, theta + period/2) = -f(x, theta)` at full states where the field is finite.
///
/// # Errors
///
/// [`OrbitError::NotSymmetric`] with the largest departure.
pub(super) fn check_field(
    model: &Model,
    geometry: &Geometry,
    points: &[Vec<Dd>],
    parameters: &[Dd],
) -> Result<(), OrbitError> {
    let rates = |state: &[Dd]| geometry.at(state, parameters).flow();
    let mut largest = 0.0_f64;
    let mut worst: Option<(f64, OrbitError)> = None;
    for point in points {
        let image = mirrored(model, point);
        let pairs = rates(point).into_iter().zip(rates(&image));
        for (component, (here, there)) in pairs.enumerate().take(model.states.len()) {
            let departure = (here + there).magnitude();
            if !departure.is_finite() {
                continue;
            }
            largest = largest.max(here.magnitude());
            if worst.as_ref().is_none_or(|(most, _)| departure > *most) {
                let error = OrbitError::NotSymmetric {
                    component: model.states[component].clone(),
                    phase: point.last().map_or(f64::NAN, |phase| phase.to_f64()),
                    rate: here.to_f64(),
                    mirrored: there.to_f64(),
                };
                worst = Some((departure, error));
            }
        }
    }
    match worst {
        Some((departure, error)) if departure > ROUNDING * largest => Err(error),
        _ => Ok(()),
    }
}
