//! Poincaré sections through a grazing orbit, and the event function, normal velocity, reset and
//! clock of a scene with their gradients.

use serde::{Deserialize, Serialize};

use super::outcome::OrbitError;
use crate::model::{ExpressionGraph, Model, NodeId, Response, Scene, Section, StroboscopicPhase};
use crate::numeric::{Dd, Real, Scalar};

/// A Poincaré section with its coordinates: the full state without one component.
///
/// On the tangency section `h' = 0` the component with the largest `|∂h'/∂x_i|` at the grazing
/// point is eliminated (the normal velocity; one degree of freedom has the coordinates `x, theta`).
/// On a stroboscopic section the phase is eliminated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoincareSection {
    /// Kind of the section.
    pub kind: PoincareSectionKind,
    /// Components of the full state that are coordinates, increasing.
    pub coordinates: Vec<usize>,
    /// Component of the full state that is eliminated.
    pub eliminated: usize,
}

/// Kind of a Poincaré section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoincareSectionKind {
    /// Tangency: `h' = 0` near the grazing point.
    Tangency,
    /// A fixed phase.
    Stroboscopic {
        /// The phase, in `[0, period)`.
        phase: Dd,
    },
}

/// Rigid surfaces (indices) that a full state is beyond, with its gaps.
pub fn rigid_stops_beyond<S: Real>(
    model: &Model,
    state: &[S],
    parameters: &[S],
) -> impl Iterator<Item = (usize, S)> {
    let inputs: Vec<S> = state.iter().chain(parameters).copied().collect();
    let mut values = Vec::new();
    model.graph.evaluate(&inputs, &mut values);
    model.surfaces.iter().enumerate().filter_map(move |(number, surface)| {
        let is_rigid = matches!(surface.response, Response::Impact { .. });
        let gap = values[surface.event.index()];
        (is_rigid && gap < S::zero()).then_some((number, gap))
    })
}

impl PoincareSection {
    /// The section that a scene requests, through an orbit that grazes `surface` at a full state.
    ///
    /// # Errors
    ///
    /// [`OrbitError::StroboscopicWithoutPhase`] if the scene requests a stroboscopic section of a
    /// model without a phase.
    pub fn of(
        scene: &Scene,
        surface: usize,
        state: &[Dd],
        parameters: &[Dd],
    ) -> Result<Self, OrbitError> {
        let model = &scene.model;
        let phase = match scene.section {
            Section::Tangency => return Ok(Self::tangency(model, surface, state, parameters)),
            Section::Stroboscopic(StroboscopicPhase::Grazing) => state[model.dimension() - 1],
            Section::Stroboscopic(StroboscopicPhase::At(phase)) => phase,
        };
        let clock = model.phase.as_ref().ok_or(OrbitError::StroboscopicWithoutPhase)?;
        let kind = PoincareSectionKind::Stroboscopic { phase: reduced(phase, clock.period) };
        Ok(Self::without(kind, model.dimension(), model.dimension() - 1))
    }

    /// The section `h' = 0` at a grazing point.
    pub(super) fn tangency(model: &Model, surface: usize, state: &[Dd], parameters: &[Dd]) -> Self {
        let geometry = Geometry::new(model, surface);
        let slopes = geometry.at(state, parameters).velocity_gradient();
        let steepest = (0..model.dimension())
            .max_by(|&a, &b| {
                slopes[a].magnitude().total_cmp(&slopes[b].magnitude()).then(b.cmp(&a))
            })
            .unwrap_or(0);
        Self::without(PoincareSectionKind::Tangency, model.dimension(), steepest)
    }

    fn without(kind: PoincareSectionKind, dimension: usize, eliminated: usize) -> Self {
        Self {
            kind,
            coordinates: (0..dimension).filter(|&component| component != eliminated).collect(),
            eliminated,
        }
    }

    /// Names of the coordinates.
    pub fn coordinate_names<'a>(&self, model: &'a Model) -> Vec<&'a str> {
        let names = model.full_state_names();
        self.coordinates.iter().map(|&component| names[component]).collect()
    }
}

/// Phase reduced to `[0, period)`.
pub(super) fn reduced(phase: Dd, period: Dd) -> Dd {
    let rest = phase - (phase / period).floor() * period;
    if rest < period { rest } else { rest - period }
}

/// Expressions that an orbit needs at a point, with their gradients in the inputs (full state,
/// parameters).
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    graph: ExpressionGraph,
    dimension: usize,
    flow: Vec<NodeId>,
    event: Sloped,
    velocity: Sloped,
    acceleration: NodeId,
    clock: Option<Sloped>,
    reset: Option<Vec<Sloped>>,
    /// Contact field of a compliant surface whose contact ends at the surface.
    contact: Option<Vec<NodeId>>,
}

/// An expression and its gradient.
#[derive(Clone, Debug)]
struct Sloped {
    node: NodeId,
    slopes: Vec<NodeId>,
}

impl Sloped {
    fn new(graph: &mut ExpressionGraph, node: NodeId, inputs: usize) -> Self {
        Self { node, slopes: (0..inputs).map(|input| graph.derivative(node, input)).collect() }
    }
}

impl Geometry {
    /// Expressions of a model at one of its surfaces.
    pub(super) fn new(model: &Model, surface: usize) -> Self {
        let mut graph = model.graph.clone();
        let (dimension, inputs) = (model.dimension(), model.dimension() + model.parameters.len());
        let surface = &model.surfaces[surface];
        let reset = match &surface.response {
            Response::Impact { reset } => {
                Some(reset.iter().map(|&node| Sloped::new(&mut graph, node, dimension)).collect())
            }
            Response::Contact { .. } => None,
        };
        let contact = match &surface.response {
            Response::Contact { field, release } if *release == surface.event => {
                Some(field.clone())
            }
            _ => None,
        };
        Self {
            dimension,
            flow: model.flow.clone(),
            event: Sloped::new(&mut graph, surface.event, inputs),
            velocity: Sloped::new(&mut graph, surface.normal_velocity, inputs),
            acceleration: surface.normal_acceleration,
            clock: model.phase.as_ref().map(|phase| Sloped::new(&mut graph, phase.rate, inputs)),
            reset,
            contact,
            graph,
        }
    }

    /// Evaluates all expressions at a point.
    pub(super) fn at<S: Scalar>(&self, state: &[S], parameters: &[S]) -> LocalGeometry<'_, S> {
        let inputs: Vec<S> = state.iter().chain(parameters).copied().collect();
        let mut values = Vec::new();
        self.graph.evaluate(&inputs, &mut values);
        LocalGeometry { geometry: self, values }
    }
}

/// Values of a [`Geometry`] at one point.
#[derive(Clone, Debug)]
pub(super) struct LocalGeometry<'a, S> {
    geometry: &'a Geometry,
    values: Vec<S>,
}

impl<S: Scalar> LocalGeometry<'_, S> {
    fn value(&self, node: NodeId) -> S {
        self.values[node.index()]
    }

    fn values(&self, nodes: &[NodeId]) -> Vec<S> {
        nodes.iter().map(|&node| self.value(node)).collect()
    }

    /// Free field at the point.
    pub(super) fn flow(&self) -> Vec<S> {
        self.values(&self.geometry.flow)
    }

    /// Event function `h`.
    pub(super) fn event(&self) -> S {
        self.value(self.geometry.event.node)
    }

    /// Normal velocity `h'`.
    pub(super) fn velocity(&self) -> S {
        self.value(self.geometry.velocity.node)
    }

    /// Normal acceleration `h''`.
    pub(super) fn acceleration(&self) -> S {
        self.value(self.geometry.acceleration)
    }

    /// Gradient of `h` in the full state, then the parameters.
    pub(super) fn event_gradient(&self) -> Vec<S> {
        self.values(&self.geometry.event.slopes)
    }

    /// Gradient of `h'` in the full state, then the parameters.
    pub(super) fn velocity_gradient(&self) -> Vec<S> {
        self.values(&self.geometry.velocity.slopes)
    }

    /// Rate of the phase and its gradient, if there is a phase.
    pub(super) fn clock(&self) -> Option<(S, Vec<S>)> {
        let clock = self.geometry.clock.as_ref()?;
        Some((self.value(clock.node), self.values(&clock.slopes)))
    }

    /// State after the reset and the reset's Jacobian in the full state, for a rigid surface.
    pub(super) fn reset(&self) -> Option<(Vec<S>, Vec<Vec<S>>)> {
        let reset = self.geometry.reset.as_ref()?;
        let image = reset.iter().map(|component| self.value(component.node)).collect();
        Some((image, reset.iter().map(|component| self.values(&component.slopes)).collect()))
    }

    /// Contact field, for a compliant surface whose contact ends at the surface.
    pub(super) fn contact(&self) -> Option<Vec<S>> {
        self.geometry.contact.as_ref().map(|field| self.values(field))
    }

    /// Difference of a contact field and the free field beside the grazing point `state`: at a
    /// penetration `depth` on the way in, where the approach would reach twice that depth.
    pub(super) fn difference_at(
        &self,
        field: &[NodeId],
        state: &[S],
        parameters: &[S],
        depth: S,
    ) -> Vec<S> {
        let dimension = self.dimension();
        let (event, velocity) = (self.event_gradient(), self.velocity_gradient());
        let (event, velocity) = (&event[..dimension], &velocity[..dimension]);
        let rate = (S::from_f64(2.0) * self.acceleration() * depth).sqrt();
        let [along, across] = duals(event, velocity);
        let moved = state.iter().zip(along.iter().zip(&across));
        let moved = moved.map(|(&at, (&along, &across))| at - depth * along - rate * across);
        let there = self.geometry.at(&moved.collect::<Vec<_>>(), parameters);
        let fields = there.values(field).into_iter().zip(there.flow());
        fields.map(|(contact, free)| contact - free).collect()
    }

    /// Length of the full state.
    pub(super) fn dimension(&self) -> usize {
        self.geometry.dimension
    }
}

/// Vectors in the plane of two others, each with the product 1 with its own and 0 with the other.
fn duals<S: Scalar>(a: &[S], b: &[S]) -> [Vec<S>; 2] {
    let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
    let area = aa * bb - ab * ab;
    let pairs = || a.iter().zip(b);
    [
        pairs().map(|(&a, &b)| (a * bb - b * ab) / area).collect(),
        pairs().map(|(&a, &b)| (b * aa - a * ab) / area).collect(),
    ]
}

/// Scalar product of two vectors.
pub(super) fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::zero(), |sum, (&a, &b)| a.mul_add(b, sum))
}
