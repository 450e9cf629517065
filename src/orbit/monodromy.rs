//! Monodromy of the free flow on a section, and its multipliers.

use nalgebra::{DMatrix, DVector};

use crate::flow::{Field, Integrator, flow_with_jacobian};
use crate::model::Model;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, Scalar};

use super::OrbitError;
use super::geometry::{Geometry, LocalGeometry};
use super::point::GrazingPoint;
use super::section::{PoincareSection, PoincareSectionKind};

/// Derivative of the period's flow in the full state.
pub(super) fn full_monodromy<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    period: S,
) -> Result<DMatrix<S>, OrbitError> {
    let inputs: Vec<usize> = (0..state.len()).collect();
    let (_, jacobian) = flow_with_jacobian(field, state, parameters, period, &inputs)?;
    Ok(jacobian)
}

/// The full state where the orbit through `graze` meets a section: the free flow from the graze to
/// its phase.
pub(super) fn section_point(
    model: &Model,
    field: &Field,
    geometry: &Geometry,
    section: &PoincareSection,
    graze: &GrazingPoint,
) -> Result<Vec<Dd>, OrbitError> {
    let (PoincareSectionKind::Stroboscopic { phase }, Some(clock)) = (section.kind, &model.phase)
    else {
        return Ok(graze.state.clone());
    };
    let last = model.dimension() - 1;
    let advance = super::section::reduced(phase - graze.state[last], clock.period);
    let rate = geometry
        .at(&graze.state, &graze.parameters)
        .clock()
        .map_or(Dd::ONE, |(rate, _)| rate);
    if advance == Dd::ZERO {
        return Ok(graze.state.clone());
    }
    let mut state = Integrator::new(field).flow(&graze.state, &graze.parameters, advance / rate)?;
    state[last] = phase;
    Ok(state)
}

/// The monodromy restricted to a section's coordinates.
///
/// Stroboscopic: the block of the coordinates. Tangency: a column is a coordinate's unit vector
/// completed to a tangent of `h' = 0`, its image projected along the flow, `z ↦ z − f (∇h'·z)/h''`.
pub(super) fn on_section<S: Real>(
    full: &DMatrix<S>,
    section: &PoincareSection,
    local: &LocalGeometry<'_, S>,
) -> DMatrix<S> {
    let dimension = local.dimension();
    let (slopes, flow) = (local.velocity_gradient(), local.flow());
    let column = |coordinate: usize| {
        let mut vector = DVector::zeros(dimension);
        vector[coordinate] = S::one();
        if section.kind == PoincareSectionKind::Tangency {
            vector[section.eliminated] = -slopes[coordinate] / slopes[section.eliminated];
        }
        let mut image = full * vector;
        if section.kind == PoincareSectionKind::Tangency {
            let delay = dot(&slopes[..dimension], image.as_slice()) / local.acceleration();
            for (value, &velocity) in image.iter_mut().zip(&flow) {
                *value -= velocity * delay;
            }
        }
        image
    };
    let columns: Vec<_> = section.coordinates.iter().map(|&at| column(at)).collect();
    DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
        columns[column][section.coordinates[row]]
    })
}

/// Eigenvalues, the largest first.
pub(super) fn multipliers<S: Real>(matrix: &DMatrix<S>) -> Result<Vec<[f64; 2]>, OrbitError> {
    let values = eigenvalues(matrix)?;
    Ok(values.iter().map(|value| [value.re, value.im]).collect())
}

/// The scalar product.
pub(super) fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter()
        .zip(b)
        .fold(S::zero(), |sum, (&a, &b)| a.mul_add(b, sum))
}
