//! The direction `β` in which the discontinuity mapping of a graze stretches.

use super::outcome::OrbitError;
use super::section::{LocalGeometry, dot};
use crate::flow::{Field, Integrator};
use crate::model::{Model, Response};
use crate::numeric::{Dd, Real, Scalar};

/// A difference of contact and free field below this share of either is none.
const NO_JUMP: f64 = 1e-13;

/// The cause of `β` at a graze; decided once per orbit, in double-double.
#[derive(Clone, Debug)]
pub(super) enum Stretch {
    /// The reset of a rigid surface.
    Reset,
    /// The jump of a contact field that ends at the surface: `D` begins with `y`.
    Jump,
    /// The first power of time, along the free flow, with which contact and free field differ.
    Difference {
        /// The free field, watching the contact field and then itself.
        watching: Box<Field>,
        /// The power.
        power: usize,
    },
    /// Contact and free field do not differ.
    None,
}

impl Stretch {
    /// The stretch of a surface at a grazing point.
    pub(super) fn of(
        model: &Model,
        surface: usize,
        local: &LocalGeometry<'_, Dd>,
        state: &[Dd],
        parameters: &[Dd],
    ) -> Result<Self, OrbitError> {
        let Response::Contact { field, .. } = &model.surfaces[surface].response else {
            return Ok(Self::Reset);
        };
        if jump_per_speed(local).is_some() {
            return Ok(Self::Jump);
        }
        let watched: Vec<_> = field.iter().chain(&model.flow).copied().collect();
        let watching = Box::new(Field::free(model, &watched));
        let power = first_difference(&watching, state, parameters)?;
        Ok(power.map_or(Self::None, |power| Self::Difference { watching, power }))
    }

    /// `β` at a point; nothing where no contact is felt.
    ///
    /// Where `D` begins with `y`, `β = sqrt(h''/2) ∂D/∂y`; else its direction is that of the
    /// difference's leading power, and its length such that `∇h'·β = h''` (of a contact that
    /// acts along the surface alone, `h''/|∇h'|`).
    pub(super) fn direction<S: Real>(
        &self,
        local: &LocalGeometry<'_, S>,
        state: &[S],
        parameters: &[S],
    ) -> Result<Option<Vec<S>>, OrbitError> {
        let per_speed = match self {
            Self::Reset => local.reset().map(|(_, jacobian)| reset_stretch(local, &jacobian)),
            Self::Jump => jump(local).map(|(jump, time)| scaled(&jump, time)),
            Self::Difference { watching, power } => {
                let mut integrator = Integrator::<S>::new(watching);
                let step = integrator.step(state, parameters)?;
                let of = |watched| step.watched_coefficients(watched)[*power];
                let components = 0..local.dimension();
                let difference: Vec<S> = components
                    .map(|component| of(component) - of(local.dimension() + component))
                    .collect();
                Some(outwards(local, &difference))
            }
            Self::None => None,
        };
        Ok(per_speed.map(|stretch| scaled(&stretch, local.acceleration())))
    }
}

/// A vector scaled such that `∇h'·v = 1`, or to the length `1/|∇h'|` where it points along the
/// surface.
fn outwards<S: Real>(local: &LocalGeometry<'_, S>, vector: &[S]) -> Vec<S> {
    let velocity = local.velocity_gradient();
    let velocity = &velocity[..local.dimension()];
    let normal = dot(velocity, vector);
    let lengths = (dot(velocity, velocity) * dot(vector, vector)).sqrt();
    let along = normal.magnitude() <= NO_JUMP * lengths.magnitude();
    scaled(vector, S::one() / if along { lengths } else { normal })
}

/// The first power of time with which the contact field differs from the free one; of those an
/// `f64` integrator sees.
fn first_difference(
    watching: &Field,
    state: &[Dd],
    parameters: &[Dd],
) -> Result<Option<usize>, OrbitError> {
    let order = Integrator::<f64>::new(watching).order();
    let mut integrator = Integrator::<Dd>::new(watching);
    let step = integrator.step(state, parameters)?;
    let count = watching.dimension();
    let mut largest = 0.0_f64;
    for power in 0..order {
        let mut most = 0.0_f64;
        for component in 0..count {
            let at = |watched| step.watched_coefficients(watched)[power];
            let (contact, free) = (at(component), at(count + component));
            largest = largest.max(contact.magnitude()).max(free.magnitude());
            most = most.max((contact - free).magnitude());
        }
        if most > NO_JUMP * largest {
            return Ok(Some(power));
        }
    }
    Ok(None)
}

/// `β` of a reset with Jacobian `G`: `e − G e` with `∇h·e = 0`, `∇h'·e = 1`.
fn reset_stretch<S: Real>(local: &LocalGeometry<'_, S>, jacobian: &[Vec<S>]) -> Vec<S> {
    let dimension = local.dimension();
    let (event, velocity) = (local.event_gradient(), local.velocity_gradient());
    let (event, velocity) = (&event[..dimension], &velocity[..dimension]);
    let overlap = dot(event, velocity) / dot(event, event);
    let direction: Vec<S> = velocity.iter().zip(event).map(|(&b, &a)| b - a * overlap).collect();
    let direction = scaled(&direction, S::one() / dot(velocity, &direction));
    let image = jacobian.iter().map(|row| dot(row, &direction));
    direction.iter().zip(image).map(|(&e, g)| e - g).collect()
}

/// The jump `f_c − f` of a contact field that ends at the surface, and `2/a_c` with `a_c =
/// ∇h'·f_c`: the contact lasts twice the approach speed over the acceleration.
fn jump<S: Real>(local: &LocalGeometry<'_, S>) -> Option<(Vec<S>, S)> {
    let field = local.contact()?;
    let velocity = local.velocity_gradient();
    let acceleration = dot(&velocity[..local.dimension()], &field);
    let flow = local.flow();
    let jump = field.iter().zip(&flow).map(|(&c, &f)| c - f).collect();
    Some((jump, S::from_f64(2.0) / acceleration))
}

/// The jump's stretch per unit of approach speed; nothing where the fields agree at the graze, or
/// the contact does not push.
fn jump_per_speed(local: &LocalGeometry<'_, Dd>) -> Option<Vec<Dd>> {
    let (jump, time) = jump(local)?;
    let largest = |vector: &[Dd]| vector.iter().fold(0.0_f64, |m, v| m.max(v.magnitude()));
    let jumps = largest(&jump) > NO_JUMP * largest(&local.flow());
    (jumps && time > Dd::ZERO).then(|| scaled(&jump, time))
}

fn scaled<S: Scalar>(vector: &[S], factor: S) -> Vec<S> {
    vector.iter().map(|&value| value * factor).collect()
}
