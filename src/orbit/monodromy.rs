//! Monodromy of the free flow on a section, its multipliers, and `xi_n`.

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

/// How many `xi_n` are computed.
pub(super) const XI_COUNT: usize = 6;

/// A contact field nearer to the free field than this share of it begins as the free field does.
const NO_JUMP: f64 = 1e-13;

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

/// `xi_1 … xi_count` from the monodromy in the full state at the graze; empty where `D` has no term linear in `y`, or
/// a contact ends elsewhere than at the surface.
pub(super) fn xi<S: Real>(full: &Rows<S>, local: &LocalGeometry<'_, S>, count: usize) -> Vec<S> {
    let Some(kick) = kick_per_speed(local) else {
        return Vec::new();
    };
    let slopes = &local.event_gradient()[..local.dimension()];
    let mut vector: Vec<S> = kick
        .iter()
        .map(|&value| value * local.acceleration())
        .collect();
    (0..count)
        .map(|_| {
            vector = apply(full, &vector);
            dot(slopes, &vector)
        })
        .collect()
}

/// What a contact adds to the state per unit of approach speed, at speed 0.
fn kick_per_speed<S: Real>(local: &LocalGeometry<'_, S>) -> Option<Vec<S>> {
    match local.reset() {
        Some((_, jacobian)) => Some(reset_kick(local, &jacobian)),
        None => contact_kick(local),
    }
}

/// Of a reset with Jacobian `G`: `e − G e` with `∇h·e = 0`, `∇h'·e = 1`.
fn reset_kick<S: Real>(local: &LocalGeometry<'_, S>, jacobian: &Rows<S>) -> Vec<S> {
    let dimension = local.dimension();
    let (event, velocity) = (local.event_gradient(), local.velocity_gradient());
    let (event, velocity) = (&event[..dimension], &velocity[..dimension]);
    let overlap = dot(event, velocity) / dot(event, event);
    let direction: Vec<S> = velocity
        .iter()
        .zip(event)
        .map(|(&b, &a)| b - a * overlap)
        .collect();
    let length = dot(velocity, &direction);
    let direction: Vec<S> = direction.iter().map(|&value| value / length).collect();
    let image = apply(jacobian, &direction);
    direction.iter().zip(&image).map(|(&e, &g)| e - g).collect()
}

/// Of a contact field `f_c` that ends at the surface: `(f_c − f) · 2/a_c` with `a_c = ∇h'·f_c`, the contact lasting twice
/// the approach speed over the acceleration; nothing where the fields agree at the graze, or the contact does not push.
fn contact_kick<S: Real>(local: &LocalGeometry<'_, S>) -> Option<Vec<S>> {
    let field = local.contact()?;
    let velocity = local.velocity_gradient();
    let acceleration = dot(&velocity[..local.dimension()], &field);
    let flow = local.flow();
    let jump: Vec<S> = field.iter().zip(&flow).map(|(&c, &f)| c - f).collect();
    let largest = |vector: &[S]| vector.iter().fold(0.0_f64, |m, v| m.max(v.magnitude()));
    let jumps = largest(&jump) > NO_JUMP * largest(&flow);
    let time = S::from_f64(2.0) / acceleration;
    (jumps && acceleration > S::zero()).then(|| jump.iter().map(|&value| value * time).collect())
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

fn apply<S: Scalar>(rows: &Rows<S>, vector: &[S]) -> Vec<S> {
    rows.iter().map(|row| dot(row, vector)).collect()
}

fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter()
        .zip(b)
        .fold(S::zero(), |sum, (&a, &b)| a.mul_add(b, sum))
}
