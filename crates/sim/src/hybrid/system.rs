//! A model lowered for direct simulation: one field per regime, one program per reset.

use std::sync::OnceLock;

use super::affine::AffineSystem;
use super::variation::Linearisation;
use crate::flow::{Field, InputKind, Program};
use crate::model::{
    Binary, ExpressionGraph, Model, Node, NodeId, Response, Surface, Unary, stick_field,
};
use crate::numeric::Dd;

/// A model compiled for direct simulation, shared by any number of
/// [`Simulator`](super::Simulator)s.
///
/// Fields are lowered once: the free field, the contact field of each compliant surface, the stick
/// field of each rigid surface, each with the functions that are watched along it.
#[derive(Clone, Debug)]
pub struct HybridSystem {
    pub(super) dimension: usize,
    pub(super) parameters: usize,
    pub(super) phase: Option<PhaseClock>,
    pub(super) free: RegimeField,
    pub(super) surfaces: Vec<SurfaceLaw>,
    /// The affine expressions, if free flight is affine.
    pub(super) affine: Option<AffineSystem>,
    model: Box<Model>,
    /// Lowered when first needed.
    linearisation: OnceLock<Box<Linearisation>>,
}

/// Method by which a system is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlowMethod {
    /// The exact flow of affine fields; a resting contact, and a contact with another law, by
    /// Taylor's method.
    ExactAffine,
    /// Taylor's method.
    Taylor,
}

/// The forcing phase: its index in the full state, its period, and its rate.
#[derive(Clone, Debug)]
pub(super) struct PhaseClock {
    pub(super) component: usize,
    pub(super) period: Dd,
    pub(super) rate: Program,
}

/// One surface, lowered.
#[derive(Clone, Debug)]
pub(super) struct SurfaceLaw {
    /// `h, h', h'', h'''` along the free flow, then `x_i ∂h/∂x_i`: the size of the gap's terms.
    pub(super) sensor: Program,
    /// `h` and `h'` along the free flow, then the rates of the free flow.
    pub(super) landing: Program,
    pub(super) law: Law,
}

/// The response at a surface, lowered.
#[derive(Clone, Debug)]
pub(super) enum Law {
    /// Reset, and the stick field if there is one.
    Rigid { reset: Program, stick: Option<RegimeField> },
    /// Contact field, and the release function: `ρ` and its derivative along the free flow, the
    /// rates of the free flow, and `x_i ∂ρ/∂x_i`, the size of its terms; then its slopes, and a
    /// contact field that may have no series on the surface.
    Compliant {
        contact: RegimeField,
        release: Program,
        slopes: Box<ReleaseSlopes>,
        rough: Option<Box<RoughField>>,
    },
}

/// A contact field that may have no series on the surface.
#[derive(Clone, Debug)]
pub(super) struct RoughField {
    /// The rates.
    pub(super) rates: Program,
    /// The rates times one more parameter, a unit of time: near the surface the coefficients of a
    /// series in whole units overflow.
    pub(super) scaled: Field,
}

/// Slopes of a release function `ρ`, which give its sign at the beginning of a contact.
#[derive(Clone, Debug)]
pub(super) struct ReleaseSlopes {
    /// `∂ρ/∂h'`, `∂ρ/∂h`, `∂h/∂x_j` for the component `j` that moves the gap, the derivative of
    /// `h'` along the contact field, then `x_i ∂/∂x_i (∂ρ/∂h')`, the size of the terms of the first
    /// slope.
    pub(super) program: Program,
    /// Whether `ρ` depends on `h'`.
    pub(super) by_velocity: bool,
    /// Component of the state that moves the gap.
    pub(super) gap_component: Option<usize>,
}

/// A field with its watched functions, each followed by its derivative along the field.
#[derive(Clone, Debug)]
pub(super) struct RegimeField {
    pub(super) field: Field,
    pub(super) watches: Vec<Watch>,
}

/// Meaning of the zero of a watched function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Watch {
    /// Gap of a surface: contact begins.
    Gap { surface: usize },
    /// Release function: the present contact or sticking ends.
    Release,
}

impl HybridSystem {
    /// Lowers a model. If its free flight and its event functions are affine in the states, with a
    /// force trigonometric in the phase, the flight is exact.
    pub fn new(model: &Model) -> Self {
        Self { affine: AffineSystem::new(model), ..Self::without_exact_flow(model) }
    }

    /// Lowers a model that is flown by Taylor's method, for all fields: slower for affine ones, for
    /// which it is an independent check.
    pub fn without_exact_flow(model: &Model) -> Self {
        let mut lowering = SystemLowering { graph: model.graph.clone(), model };
        let surfaces: Vec<_> =
            (0..model.surfaces.len()).map(|surface| lowering.surface(surface)).collect();
        let free =
            lowering.regime(&model.flow, None, &(0..model.surfaces.len()).collect::<Vec<_>>());
        let phase = model.phase.as_ref().map(|phase| PhaseClock {
            component: model.dimension() - 1,
            period: phase.period,
            rate: lowering.program(&[phase.rate]),
        });
        Self {
            dimension: model.dimension(),
            parameters: model.parameters.len(),
            phase,
            free,
            surfaces,
            affine: None,
            model: Box::new(model.clone()),
            linearisation: OnceLock::new(),
        }
    }

    /// The linearised fields and events.
    pub(super) fn linearisation(&self) -> &Linearisation {
        self.linearisation.get_or_init(|| Box::new(Linearisation::new(&self.model)))
    }

    /// Method by which free flight is computed.
    pub fn method(&self) -> FlowMethod {
        match self.affine {
            Some(_) => FlowMethod::ExactAffine,
            None => FlowMethod::Taylor,
        }
    }

    /// Number of components of the full state.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Number of surfaces.
    pub fn surfaces(&self) -> usize {
        self.surfaces.len()
    }
}

/// A model with a copy of its graph, to which new expressions are added.
struct SystemLowering<'m> {
    graph: ExpressionGraph,
    model: &'m Model,
}

impl SystemLowering<'_> {
    fn program(&self, outputs: &[NodeId]) -> Program {
        let inputs =
            vec![InputKind::Variable; self.model.dimension() + self.model.parameters.len()];
        Program::new(&self.graph, outputs, &inputs)
    }

    fn surface(&mut self, index: usize) -> SurfaceLaw {
        let surface = &self.model.surfaces[index];
        let sensor = self.sensor(surface);
        let landing = self.landing(surface.event);
        let landing = self.program(&landing);
        let others: Vec<_> =
            (0..self.model.surfaces.len()).filter(|&other| other != index).collect();
        let law = match &surface.response {
            Response::Impact { reset } => {
                let stick = stick_field(&mut self.graph, self.model, surface);
                let pressing = self.graph.neg(surface.normal_acceleration);
                let stick = stick.map(|field| self.regime(&field, Some(pressing), &others));
                Law::Rigid { reset: self.program(reset), stick }
            }
            Response::Contact { field, release } => {
                let mut outputs = self.landing(*release);
                outputs.extend(self.terms(*release));
                let contact = self.regime(field, Some(*release), &others);
                let slopes = Box::new(self.release_slopes(surface, field, *release));
                let law = field.iter().chain([release]).copied();
                let is_rough = has_branch_point(&self.graph, &law.collect::<Vec<_>>());
                Law::Compliant {
                    contact,
                    release: self.program(&outputs),
                    slopes,
                    rough: is_rough.then(|| Box::new(self.rough_field(field))),
                }
            }
        };
        SurfaceLaw { sensor, landing, law }
    }

    fn rough_field(&mut self, field: &[NodeId]) -> RoughField {
        let parameters = self.model.parameters.len() + 1;
        let unit = self.graph.input(self.model.dimension() + parameters - 1);
        let scaled: Vec<_> = field.iter().map(|&rate| self.graph.mul(rate, unit)).collect();
        let kinds = vec![InputKind::Variable; parameters];
        let rates = self.program(field);
        RoughField { rates, scaled: Field::new(&self.graph, &scaled, &[], &kinds) }
    }

    fn sensor(&mut self, surface: &Surface) -> Program {
        let jerk = self.graph.lie_derivative(surface.normal_acceleration, &self.model.flow);
        let mut outputs =
            vec![surface.event, surface.normal_velocity, surface.normal_acceleration, jerk];
        outputs.extend(self.terms(surface.event));
        self.program(&outputs)
    }

    /// A function, its derivative along the free flow, and the rates of that flow.
    fn landing(&mut self, function: NodeId) -> Vec<NodeId> {
        let flow = &self.model.flow;
        let slope = self.graph.lie_derivative(function, flow);
        [function, slope].iter().chain(flow).copied().collect()
    }

    /// `x_i ∂u/∂x_i` of a function `u`: the sizes of its terms.
    fn terms(&mut self, function: NodeId) -> Vec<NodeId> {
        let term = |component| {
            let slope = self.graph.derivative(function, component);
            let state = self.graph.input(component);
            self.graph.mul(slope, state)
        };
        (0..self.model.dimension()).map(term).collect()
    }

    /// Slopes of a release function along a component that moves only `h'`, and along one that
    /// moves `h`; 0 if there is none.
    fn release_slopes(
        &mut self,
        surface: &Surface,
        field: &[NodeId],
        release: NodeId,
    ) -> ReleaseSlopes {
        let zero = self.graph.number(0.0);
        let gap_component = (0..self.model.dimension()).find(|&i| self.moves(surface.event, i));
        let velocity_component = (0..self.model.dimension())
            .find(|&i| !self.moves(surface.event, i) && self.moves(surface.normal_velocity, i));
        let mut slope = |quantity, component: Option<usize>| match component {
            Some(component) => {
                let slope = self.graph.derivative(release, component);
                let moves = self.graph.derivative(quantity, component);
                self.graph.div(slope, moves)
            }
            None => zero,
        };
        let by_velocity = slope(surface.normal_velocity, velocity_component);
        let by_gap = slope(surface.event, gap_component);
        let moves = gap_component.map_or(zero, |i| self.graph.derivative(surface.event, i));
        let push = self.graph.lie_derivative(surface.normal_velocity, field);
        let mut outputs = vec![by_velocity, by_gap, moves, push];
        outputs.extend(self.terms(by_velocity));
        ReleaseSlopes {
            program: self.program(&outputs),
            by_velocity: !self.graph.is_zero(by_velocity),
            gap_component,
        }
    }

    /// Whether a function depends on a component of the state.
    fn moves(&mut self, function: NodeId, component: usize) -> bool {
        let slope = self.graph.derivative(function, component);
        !self.graph.is_zero(slope)
    }

    fn regime(
        &mut self,
        derivatives: &[NodeId],
        release: Option<NodeId>,
        surfaces: &[usize],
    ) -> RegimeField {
        let gaps = surfaces
            .iter()
            .map(|&surface| (Watch::Gap { surface }, self.model.surfaces[surface].event));
        let watched: Vec<_> =
            release.map(|node| (Watch::Release, node)).into_iter().chain(gaps).collect();
        let mut nodes = Vec::new();
        for &(_, node) in &watched {
            nodes.push(node);
            nodes.push(self.graph.lie_derivative(node, derivatives));
        }
        let parameters = vec![InputKind::HeadOnly; self.model.parameters.len()];
        RegimeField {
            field: Field::new(&self.graph, derivatives, &nodes, &parameters),
            watches: watched.into_iter().map(|(watch, _)| watch).collect(),
        }
    }
}

/// Whether an operation in some expressions is not analytic for all arguments for which it is
/// defined.
pub(super) fn has_branch_point(graph: &ExpressionGraph, outputs: &[NodeId]) -> bool {
    let operations = graph.nodes().iter().zip(graph.needed_by(outputs));
    operations.filter(|(_, needed)| *needed).any(|(node, _)| match node {
        Node::PowerReal(..) | Node::Binary(Binary::Min | Binary::Max, ..) => true,
        Node::Unary(function, _) => {
            matches!(function, Unary::Abs | Unary::Sign | Unary::Sqrt | Unary::Log)
        }
        _ => false,
    })
}
