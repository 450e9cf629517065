//! Derivatives of the flow of a period: the monodromy on a section, its multipliers, and the
//! conditions `xi_n` of a grazing bifurcation with the direction `β` in which the discontinuity
//! mapping of a graze stretches.

use nalgebra::{DMatrix, DVector};

use super::grazing_orbit::{GrazingConditions, GrazingPoint, Touch};
use super::outcome::OrbitError;
use super::piecewise::PiecewiseFlow;
use super::section::{Geometry, LocalGeometry, PoincareSection, PoincareSectionKind, dot, reduced};
use super::system::ExtendedSystem;
use crate::flow::{Field, Integrator};
use crate::model::{Model, Node, NodeId, Response};
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, Scalar};

/// Derivative of the flow over one period in the full state.
pub(super) fn full_monodromy<S: Real>(
    system: &ExtendedSystem,
    state: &[S],
    parameters: &[S],
    period: S,
) -> Result<DMatrix<S>, OrbitError> {
    let inputs: Vec<usize> = (0..state.len()).collect();
    let (_, jacobian) = system.flow_with_jacobian(state, parameters, period, &inputs)?;
    Ok(jacobian)
}

/// Full state at the section point of the orbit through `graze`: the last point at the section's
/// phase before the next graze, by the flow from the graze. One period has `periods` of the
/// forcing.
pub(super) fn section_point(
    (model, periods): (&Model, usize),
    flow: &PiecewiseFlow,
    geometry: &Geometry,
    section: &PoincareSection,
    graze: &GrazingPoint,
) -> Result<Vec<Dd>, OrbitError> {
    let (PoincareSectionKind::Stroboscopic { phase }, Some(clock)) = (section.kind, &model.phase)
    else {
        return Ok(graze.state.clone());
    };
    let last = model.dimension() - 1;
    let advance = reduced(phase - graze.state[last], clock.period);
    let rate =
        geometry.at(&graze.state, &graze.parameters).clock().map_or(Dd::ONE, |(rate, _)| rate);
    if advance == Dd::ZERO {
        return Ok(graze.state.clone());
    }
    let all = advance + clock.period * Dd::from(periods as f64 - 1.0);
    let mut state = flow.flow(&graze.state, &graze.parameters, all / rate)?;
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

/// The monodromy up to shifts along the flow `f`, on all coordinates but one,
/// `M_ik − f_i M_jk/f_j`.
///
/// Its eigenvalues are the multipliers, whatever the section. The coordinate `j` left out is the
/// phase, or that of the largest velocity without one; unlike the projection on a tangency
/// section, nothing is singular where `h''` vanishes.
pub(super) fn across_flow<S: Real>(full: &DMatrix<S>, local: &LocalGeometry<'_, S>) -> DMatrix<S> {
    let (dimension, flow) = (local.dimension(), local.flow());
    let fastest = (0..dimension).max_by(|&a, &b| {
        let [a, b] = [a, b].map(|at| flow[at].abs().to_f64());
        a.total_cmp(&b)
    });
    let along = match local.clock() {
        Some(_) => dimension - 1,
        None => fastest.unwrap_or_default(),
    };
    let kept: Vec<usize> = (0..dimension).filter(|&at| at != along).collect();
    DMatrix::from_fn(kept.len(), kept.len(), |row, column| {
        let (row, column) = (kept[row], kept[column]);
        full[(row, column)] - flow[row] / flow[along] * full[(along, column)]
    })
}

/// Eigenvalues `[re, im]`, the largest first.
pub(super) fn multipliers<S: Real>(matrix: &DMatrix<S>) -> Result<Vec<[f64; 2]>, OrbitError> {
    let values = eigenvalues(matrix)?;
    Ok(values.iter().map(|value| [value.re, value.im]).collect())
}

/// Multipliers of the periodic orbit through a full state, the largest first.
pub(super) fn orbit_multipliers(
    system: &ExtendedSystem,
    state: &[f64],
    parameters: &[f64],
    period: f64,
) -> Result<Vec<[f64; 2]>, OrbitError> {
    let full = full_monodromy(system, state, parameters, period)?;
    multipliers(&across_flow(&full, &system.geometry(0).at(state, parameters)))
}

/// Derivatives of the flow from every passage to the next; the last leg ends at the first
/// passage of the next period.
pub(super) fn legs<S: Real>(
    system: &ExtendedSystem,
    touches: &[Touch<S>],
    parameters: &[S],
    period: S,
) -> Result<Vec<DMatrix<S>>, OrbitError> {
    let arrivals = touches.iter().skip(1).map(|touch| touch.time);
    let arrivals = arrivals.chain([period]);
    let leg = |(touch, arrival): (&Touch<S>, S)| {
        let inputs: Vec<usize> = (0..touch.state.len()).collect();
        let duration = arrival - touch.time;
        let (_, jacobian) =
            system.flow_with_jacobian(&touch.state, parameters, duration, &inputs)?;
        Ok(jacobian)
    };
    touches.iter().zip(arrivals).map(leg).collect()
}

/// Derivative of the flow over one period at the first passage: the product of all legs.
pub(super) fn round<S: Real>(legs: &[DMatrix<S>]) -> DMatrix<S> {
    let whole = legs.iter().skip(1);
    whole.fold(legs[0].clone(), |so_far, leg| leg * so_far)
}

/// Factors of the conditions `xi_n` between all passages.
pub(super) struct ConditionFactors<S> {
    /// Gradient `∇h` at every passage.
    slopes: Vec<Vec<S>>,
    /// Direction `β` at every passage; `None` if contact has no effect.
    stretches: Vec<Option<Vec<S>>>,
    /// Derivatives of the flow from every passage to the next.
    legs: Vec<DMatrix<S>>,
}

impl<S: Real> ConditionFactors<S> {
    /// The factors of an orbit.
    pub(super) fn new(
        system: &ExtendedSystem,
        stretches: &[Stretch],
        touches: &[Touch<S>],
        legs: &[DMatrix<S>],
        parameters: &[S],
    ) -> Result<Self, OrbitError> {
        let dimension = system.dimension;
        let (mut slopes, mut directions) = (Vec::new(), Vec::new());
        for (passage, (touch, stretch)) in touches.iter().zip(stretches).enumerate() {
            let local = system.geometry(passage).at(&touch.state, parameters);
            slopes.push(local.event_gradient()[..dimension].to_vec());
            directions.push(stretch.direction(&local, &touch.state, parameters)?);
        }
        Ok(Self { slopes, stretches: directions, legs: legs.to_vec() })
    }

    /// Conditions between all passages, `count` for each pair.
    pub(super) fn conditions(&self, count: usize) -> Vec<GrazingConditions<S>> {
        let passages = self.slopes.len();
        let mut found = Vec::new();
        for (from, direction) in self.stretches.iter().enumerate() {
            let mut values = vec![Vec::new(); passages];
            if let Some(direction) = direction {
                let mut stretch = DVector::from_column_slice(direction);
                for leg in (from..).take(count * passages) {
                    stretch = &self.legs[leg % passages] * stretch;
                    let to = (leg + 1) % passages;
                    values[to].push(dot(&self.slopes[to], stretch.as_slice()));
                }
            }
            let from_here = values.into_iter().enumerate();
            found.extend(from_here.map(|(to, values)| GrazingConditions { from, to, values }));
        }
        found
    }
}

impl ConditionFactors<f64> {
    /// Scale of the rounding of each condition: the sum of its changes if the entries of each leg
    /// in turn change by the leg's largest entry. States are measured in their `reach`.
    pub(super) fn sizes(&self, count: usize, reach: &[f64]) -> Vec<GrazingConditions<f64>> {
        let passages = self.slopes.len();
        let largest: Vec<f64> = self.legs.iter().map(|leg| largest(leg, reach)).collect();
        let mut found = Vec::new();
        for (from, direction) in self.stretches.iter().enumerate() {
            let mut values = vec![Vec::new(); passages];
            let mut carried = Vec::new();
            let mut stretch = direction.as_deref().map(DVector::from_column_slice);
            for last in (from..).take(count * passages) {
                let Some(before) = stretch else { break };
                stretch = Some(&self.legs[last % passages] * &before);
                let lengths = before.iter().zip(reach).map(|(value, reach)| (value / reach).abs());
                carried.push(lengths.sum::<f64>());
                let to = (last + 1) % passages;
                let mut slopes = DVector::from_column_slice(&self.slopes[to]).transpose();
                let mut size = 0.0;
                for (number, before) in (from..last + 1).zip(&carried).rev() {
                    let after =
                        slopes.iter().zip(reach).map(|(value, reach)| (value * reach).abs());
                    size += after.sum::<f64>() * largest[number % passages] * before;
                    slopes *= &self.legs[number % passages];
                }
                values[to].push(size);
            }
            let from_here = values.into_iter().enumerate();
            found.extend(from_here.map(|(to, values)| GrazingConditions { from, to, values }));
        }
        found
    }
}

/// Largest entry of a derivative of the flow, with states measured in their `reach`.
fn largest(leg: &DMatrix<f64>, reach: &[f64]) -> f64 {
    let columns = leg.column_iter().zip(reach);
    let entries = columns.flat_map(|(column, length)| {
        let entries: Vec<f64> =
            column.iter().zip(reach).map(|(entry, reach)| (entry * length / reach).abs()).collect();
        entries
    });
    entries.fold(0.0, f64::max)
}

/// A difference of contact and free field below this share of either counts as none.
const NO_JUMP: f64 = 1e-13;

/// Origin of the direction `β` in which a contact at a graze moves the state: the reset, or a
/// difference of contact and free field. Determined once per orbit, in double-double.
#[derive(Clone, Debug)]
pub(super) enum Stretch {
    /// The reset of a rigid surface.
    Reset,
    /// The jump of a contact field that ends at the surface: `D` begins with `y`.
    Jump,
    /// A difference of contact and free field that begins with a power of time along the free flow.
    Difference {
        /// The free field, with the components of the contact field and of the free field watched.
        watching: Box<Field>,
        /// The first power of time at which they differ.
        power: usize,
    },
    /// A difference of contact and free field that is no series in time where the contact begins,
    /// as that of a force `k d^p`.
    Rough {
        /// Power of the depth variable `y` with which the difference begins, `2p` for such a force.
        power: f64,
        /// The contact field.
        field: Vec<NodeId>,
    },
    /// Contact and free field do not differ.
    None,
}

impl Stretch {
    /// Origin of `β` for a surface at a grazing point.
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
        if is_rough(model, field, state, parameters) {
            return Ok(match rough_power(model, field, local, state, parameters) {
                None => Self::None,
                Some(0.0) => Self::Jump,
                Some(power) => Self::Rough { power, field: field.clone() },
            });
        }
        if jump_per_speed(local).is_some() {
            return Ok(Self::Jump);
        }
        let watched: Vec<_> = field.iter().chain(&model.flow).copied().collect();
        let watching = Box::new(Field::free(model, &watched));
        let power = first_difference(&watching, state, parameters)?;
        Ok(power.map_or(Self::None, |power| Self::Difference { watching, power }))
    }

    /// Direction `β` at a point; `None` if contact has no effect.
    ///
    /// If `D` begins with `y`, `β = sqrt(h''/2) ∂D/∂y`. Otherwise `β` has the direction of the
    /// leading power of the difference, and a length such that `∇h'·β = h''` (`h''/|∇h'|` if the
    /// contact acts along the surface only).
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
            Self::Rough { field, .. } => {
                let depth = S::from_f64(S::ROUNDOFF.sqrt()) * size_of(state);
                let difference = local.difference_at(field, state, parameters, depth);
                Some(outwards(local, &difference))
            }
            Self::None => None,
        };
        Ok(per_speed.map(|stretch| scaled(&stretch, local.acceleration())))
    }
}

/// A vector scaled such that `∇h'·v = 1`, or to the length `1/|∇h'|` if it points along the
/// surface.
fn outwards<S: Real>(local: &LocalGeometry<'_, S>, vector: &[S]) -> Vec<S> {
    let velocity = local.velocity_gradient();
    let velocity = &velocity[..local.dimension()];
    let normal = dot(velocity, vector);
    let lengths = (dot(velocity, velocity) * dot(vector, vector)).sqrt();
    let along = normal.magnitude() <= NO_JUMP * lengths.magnitude();
    scaled(vector, S::one() / if along { lengths } else { normal })
}

/// Value of an argument, relative to the state and the parameters, that counts as 0.
const VANISHING: f64 = 1e-13;
/// Pairs of depths, relative to the state's size, at which a difference of fields is compared: the
/// smallest ones at which it is resolved.
const DEPTHS: [[f64; 2]; 4] = [[1e-18, 1e-20], [1e-12, 1e-14], [1e-7, 1e-8], [1e-4, 1e-5]];
/// Least difference of fields that is resolved, relative to the free field: far above the rounding
/// of double-double.
const RESOLVED: f64 = 1e-27;
/// Distance of a measured power from one that the law can have, up to which it is that one.
const SAME_POWER: f64 = 1e-2;
/// Step to which another measured power, as of a parameter, is rounded.
const DIGITS: f64 = 1e-9;

/// Whether a contact field has a root, a logarithm or a real power of an argument that vanishes at
/// a state.
fn is_rough(model: &Model, field: &[NodeId], state: &[Dd], parameters: &[Dd]) -> bool {
    let inputs: Vec<Dd> = state.iter().chain(parameters).copied().collect();
    let mut values = Vec::new();
    model.graph.evaluate(&inputs, &mut values);
    let size = inputs.iter().fold(1.0_f64, |size, value| size.max(value.magnitude()));
    let vanishes = |node: NodeId| values[node.index()].magnitude() <= VANISHING * size;
    let singular = field.iter().flat_map(|&node| model.graph.singular_operations(node));
    singular.into_iter().any(|operation| vanishes(operation.argument))
}

/// Power of the depth variable with which the difference of contact and free field begins: the
/// lowest of its components' slopes, in logarithms, between two depths. `None` if none is known.
fn rough_power(
    model: &Model,
    field: &[NodeId],
    local: &LocalGeometry<'_, Dd>,
    state: &[Dd],
    parameters: &[Dd],
) -> Option<f64> {
    let size = size_of(state);
    let fastest = local.flow().iter().fold(0.0, |most: f64, rate| most.max(rate.magnitude()));
    let resolved = RESOLVED * fastest;
    let measured = DEPTHS.iter().find_map(|depths| {
        let [near, far] = depths
            .map(|depth| local.difference_at(field, state, parameters, Dd::from(depth) * size));
        let pairs = near.iter().zip(&far).filter(|(_, far)| far.magnitude() > resolved);
        let slopes = pairs.map(|(near, far)| {
            2.0 * (near.magnitude() / far.magnitude()).ln() / (depths[0] / depths[1]).ln()
        });
        slopes.min_by(f64::total_cmp)
    });
    let exponents = model.graph.nodes().iter().filter_map(|node| match *node {
        Node::PowerReal(_, exponent) => Some(2.0 * exponent.to_f64()),
        _ => None,
    });
    let Some(measured) = measured else { return exponents.min_by(f64::total_cmp) };
    // A power of the rate beside that of the penetration adds to it.
    let possible = exponents.flat_map(|exponent| [exponent, exponent + 1.0, exponent + 2.0]);
    let possible = possible.chain([measured.round()]);
    let apart = |power: &f64| (power - measured).abs();
    let nearest = possible.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    Some(if apart(&nearest) <= SAME_POWER { nearest } else { (measured / DIGITS).round() * DIGITS })
}

/// Size of the components of a state, at least that of a unit if all vanish.
fn size_of<S: Scalar>(state: &[S]) -> S {
    let size = state.iter().fold(0.0_f64, |size, value| size.max(value.magnitude()));
    S::from_f64(if size > 0.0 { size } else { 1.0 })
}

/// First power of time at which the contact field differs from the free one, among those that an
/// `f64` integrator uses; `None` if there is no such power.
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

/// Direction `β` of a reset with Jacobian `G`: `e − G e` with `∇h·e = 0`, `∇h'·e = 1`.
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

/// The jump's stretch per unit of approach speed; `None` if the fields agree at the graze or the
/// contact does not push.
fn jump_per_speed(local: &LocalGeometry<'_, Dd>) -> Option<Vec<Dd>> {
    let (jump, time) = jump(local)?;
    let largest = |vector: &[Dd]| vector.iter().fold(0.0_f64, |m, v| m.max(v.magnitude()));
    let jumps = largest(&jump) > NO_JUMP * largest(&local.flow());
    (jumps && time > Dd::ZERO).then(|| scaled(&jump, time))
}

fn scaled<S: Scalar>(vector: &[S], factor: S) -> Vec<S> {
    vector.iter().map(|&value| value * factor).collect()
}
