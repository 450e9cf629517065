//! Monodromy of the free flow on a section, and its multipliers.

use nalgebra::DMatrix;

use crate::flow::{Field, Integrator, flow_with_jacobian};
use crate::model::Model;
use crate::numeric::{Dd, Real, Scalar};

use super::OrbitError;
use super::geometry::{Geometry, LocalGeometry};
use super::point::GrazingPoint;
use super::section::{PoincareSection, PoincareSectionKind};

/// A square matrix by rows.
pub(super) type Rows<S> = Vec<Vec<S>>;

/// Derivative of the period's flow in the full state.
pub(super) fn full_monodromy<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    period: S,
) -> Result<Rows<S>, OrbitError> {
    let inputs: Vec<usize> = (0..state.len()).collect();
    let (_, jacobian) = flow_with_jacobian(field, state, parameters, period, &inputs)?;
    Ok(jacobian
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect())
}

/// The full state where the orbit through `graze` meets a section: the free flow from the graze to its phase.
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
/// Stroboscopic: the block of the coordinates. Tangency: a column is a coordinate's unit vector completed to a tangent
/// of `h' = 0`, its image projected along the flow, `z ↦ z − f (∇h'·z)/h''`.
pub(super) fn on_section<S: Real>(
    full: &Rows<S>,
    section: &PoincareSection,
    local: &LocalGeometry<'_, S>,
) -> Rows<S> {
    let dimension = local.dimension();
    let (slopes, flow) = (local.velocity_gradient(), local.flow());
    let column = |coordinate: usize| {
        let mut vector = vec![S::zero(); dimension];
        vector[coordinate] = S::one();
        if section.kind == PoincareSectionKind::Tangency {
            vector[section.eliminated] = -slopes[coordinate] / slopes[section.eliminated];
        }
        let mut image = apply(full, &vector);
        if section.kind == PoincareSectionKind::Tangency {
            let delay = dot(&slopes[..dimension], &image) / local.acceleration();
            for (value, &velocity) in image.iter_mut().zip(&flow) {
                *value -= velocity * delay;
            }
        }
        image
    };
    let columns: Rows<S> = section
        .coordinates
        .iter()
        .map(|&coordinate| column(coordinate))
        .collect();
    let row = |&component: &usize| columns.iter().map(|column| column[component]).collect();
    section.coordinates.iter().map(row).collect()
}

/// Eigenvalues, the largest first; of a 2×2 matrix by the quadratic formula in the scalar itself.
pub(super) fn multipliers<S: Real>(matrix: &Rows<S>) -> Vec<[f64; 2]> {
    let mut values = match matrix.as_slice() {
        [row] => vec![[row[0].to_f64(), 0.0]],
        [first, second] => quadratic(
            first[0] + second[1],
            first[0] * second[1] - first[1] * second[0],
        ),
        rows => general(rows),
    };
    values.sort_by(|a, b| {
        b[0].hypot(b[1])
            .total_cmp(&a[0].hypot(a[1]))
            .then(b[1].total_cmp(&a[1]))
    });
    values
}

fn quadratic<S: Real>(trace: S, determinant: S) -> Vec<[f64; 2]> {
    let half = trace * S::from_f64(0.5);
    let discriminant = half * half - determinant;
    let root = discriminant.abs().sqrt();
    if discriminant < S::zero() {
        let (re, im) = (half.to_f64(), root.to_f64());
        return vec![[re, im], [re, -im]];
    }
    let large = if half < S::zero() {
        half - root
    } else {
        half + root
    };
    let small = if large == S::zero() {
        large
    } else {
        determinant / large
    };
    vec![[large.to_f64(), 0.0], [small.to_f64(), 0.0]]
}

fn general<S: Real>(rows: &[Vec<S>]) -> Vec<[f64; 2]> {
    let matrix = DMatrix::from_fn(rows.len(), rows.len(), |row, column| {
        rows[row][column].to_f64()
    });
    matrix
        .complex_eigenvalues()
        .iter()
        .map(|value| [value.re, value.im])
        .collect()
}

/// A matrix times a vector.
pub(super) fn apply<S: Scalar>(rows: &[Vec<S>], vector: &[S]) -> Vec<S> {
    rows.iter().map(|row| dot(row, vector)).collect()
}

/// The product of two square matrices.
pub(super) fn product<S: Scalar>(left: &Rows<S>, right: &Rows<S>) -> Rows<S> {
    let columns = right.len();
    let column = |at: usize| right.iter().map(|row| row[at]).collect::<Vec<S>>();
    let columns: Rows<S> = (0..columns).map(column).collect();
    let row = |row: &Vec<S>| columns.iter().map(|column| dot(row, column)).collect();
    left.iter().map(row).collect()
}

/// The scalar product.
pub(super) fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter()
        .zip(b)
        .fold(S::zero(), |sum, (&a, &b)| a.mul_add(b, sum))
}
