//! First variations along a trajectory, through events, with respect to the state and to
//! parameters.
//!
//! One idea: between events a variation follows the linearised field of the regime. An event acts
//! on the variation through the time at which it happens. With `g` the function that is zero at the
//! event, `R` the reset (the identity if only the field changes), and `f⁻`, `f⁺` the fields before
//! and after,
//!
//! ```text
//! δt = −δg(δx, δp) / δg(f⁻, 0),     δx⁺ = δR(δx + f⁻ δt, δp) − f⁺ δt
//! ```
//!
//! (the saltation matrix). No difference quotients are used, so that derivatives have the digits of
//! the return itself for orbits of any size. Here parameters are components with rate zero: one
//! field serves variations with respect to states and to parameters.

use super::motion::{Evaluator, Regime};
use super::system::has_branch_point;
use crate::flow::{Field, InputKind, Integrator, Program};
use crate::model::{Binary, ExpressionGraph, Model, Node, NodeId, Response, Unary};
use crate::numeric::Real;

/// A direction in which a section point and the parameters are varied, or the variation that
/// follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation<S> {
    /// Variation of the full state.
    pub state: Vec<S>,
    /// Variation of all parameters of the model.
    pub parameters: Vec<S>,
}

/// An event at a surface: a change of the state or of the field.
#[derive(Clone, Debug)]
pub(super) struct Change<S> {
    pub(super) kind: ChangeKind,
    pub(super) surface: usize,
    pub(super) time: S,
    /// States just before and just after the event.
    pub(super) states: [Vec<S>; 2],
    pub(super) regimes: [Regime; 2],
}

/// Kinds of changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangeKind {
    /// Impact: a reset, when the gap is zero.
    Impact,
    /// Beginning of a compliant contact, when the gap is zero.
    Begin,
    /// End of a compliant contact, when its release function is zero.
    Release,
    /// Completion of a chatter, or beginning or end of a rest: no variation is known.
    Rest,
}

/// The linearised fields and events of a model.
#[derive(Clone, Debug)]
pub(super) struct Linearisation {
    pub(super) dimension: usize,
    parameters: usize,
    pub(super) phase: Option<usize>,
    pub(super) free: VariedField,
    pub(super) surfaces: Vec<VariedSurface>,
}

/// A field with its variation, the rates alone, and the variation of the rates.
#[derive(Clone, Debug)]
pub(super) struct VariedField {
    flow: Field,
    rates: Program,
    pub(super) slopes: Program,
    /// Whether the field may jump at a corner, where no variation is known.
    jumps: bool,
    /// The field with its variation in a graded time, if it may have no series on the surface.
    pub(super) graded: Option<Field>,
}

/// Variations of the expressions of a surface.
#[derive(Clone, Debug)]
pub(super) struct VariedSurface {
    pub(super) gap: Program,
    pub(super) normal_velocity: Program,
    /// The gap and the normal velocity themselves.
    pub(super) motion: Program,
    reset: Option<Program>,
    /// The contact field, and the variation of the release function.
    pub(super) contact: Option<(VariedField, Program)>,
}

/// Expressions of a model and of its variations: inputs are the state, the parameters, and the
/// variations of both.
struct VariationLowering<'m> {
    graph: ExpressionGraph,
    model: &'m Model,
}

impl VariationLowering<'_> {
    fn inputs(&self) -> usize {
        self.model.dimension() + self.model.parameters.len()
    }

    /// The variation of an expression.
    fn varied(&mut self, node: NodeId) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for input in 0..self.inputs() {
            let slope = self.graph.derivative(node, input);
            let change = self.graph.input(self.inputs() + input);
            let term = self.graph.mul(slope, change);
            sum = self.graph.add(sum, term);
        }
        sum
    }

    fn program(&self, outputs: &[NodeId]) -> Program {
        Program::new(&self.graph, outputs, &vec![InputKind::Variable; 2 * self.inputs()])
    }

    fn variation(&mut self, node: NodeId) -> Program {
        let varied = self.varied(node);
        self.program(&[varied])
    }

    fn field(&mut self, rates: &[NodeId]) -> VariedField {
        let still = vec![self.graph.number(0.0); self.model.parameters.len()];
        let varied: Vec<NodeId> = rates.iter().map(|&rate| self.varied(rate)).collect();
        let all = [rates, &still, &varied, &still].concat();
        VariedField {
            flow: Field::new(&self.graph, &all, &[], &[]),
            rates: self.program(rates),
            slopes: self.program(&varied),
            jumps: may_jump(&self.graph, rates),
            graded: None,
        }
    }

    /// Field of a contact, graded if the law is not analytic on the surface.
    fn contact_field(&mut self, rates: &[NodeId], release: NodeId) -> VariedField {
        let field = self.field(rates);
        let law = [rates, &[release]].concat();
        let is_rough = has_branch_point(&self.graph, &law);
        VariedField { graded: is_rough.then(|| self.graded_field(rates)), ..field }
    }

    /// Field with its variation in a graded time; see [`rough_variation`](super::rough_variation).
    fn graded_field(&mut self, rates: &[NodeId]) -> Field {
        let [away, side] = [0, 1].map(|at| self.graph.input(2 * self.inputs() + at));
        let still = self.graph.number(0.0);
        let held = vec![still; self.model.parameters.len()];
        let varied: Vec<NodeId> = rates.iter().map(|&rate| self.varied(rate)).collect();
        let graded = [rates, &held, &varied, &held].concat();
        let mut graded: Vec<_> = graded.iter().map(|&rate| self.graph.mul(rate, away)).collect();
        graded.extend([self.graph.mul(side, away), still]);
        Field::new(&self.graph, &graded, &[], &[])
    }
}

impl Linearisation {
    pub(super) fn new(model: &Model) -> Self {
        let mut lowering = VariationLowering { graph: model.graph.clone(), model };
        let free = lowering.field(&model.flow);
        let surfaces = model.surfaces.iter().map(|surface| {
            let (reset, contact) = match &surface.response {
                Response::Impact { reset } => {
                    let varied: Vec<_> = reset.iter().map(|&node| lowering.varied(node)).collect();
                    (Some(lowering.program(&varied)), None)
                }
                Response::Contact { field, release } => {
                    let field = lowering.contact_field(field, *release);
                    (None, Some((field, lowering.variation(*release))))
                }
            };
            VariedSurface {
                gap: lowering.variation(surface.event),
                normal_velocity: lowering.variation(surface.normal_velocity),
                motion: lowering.program(&[surface.event, surface.normal_velocity]),
                reset,
                contact,
            }
        });
        let surfaces = surfaces.collect();
        Self {
            dimension: model.dimension(),
            parameters: model.parameters.len(),
            phase: model.phase.is_some().then(|| model.dimension() - 1),
            free,
            surfaces,
        }
    }

    /// Field of a regime; `None` for a rest.
    pub(super) fn field(&self, regime: Regime) -> Option<&VariedField> {
        match regime {
            Regime::Free => Some(&self.free),
            Regime::Contact { surface } => Some(&self.surfaces[surface].contact.as_ref()?.0),
            Regime::Stick { .. } => None,
        }
    }
}

/// Whether expressions may jump when an operation changes its branch: `sign` and the cut of `atan2`
/// may; `abs`, `min` and `max` have corners only.
fn may_jump(graph: &ExpressionGraph, rates: &[NodeId]) -> bool {
    let operations = graph.nodes().iter().zip(graph.needed_by(rates));
    operations.filter(|(_, needed)| *needed).any(|(node, _)| {
        matches!(node, Node::Unary(Unary::Sign, _) | Node::Binary(Binary::Atan2, ..))
    })
}

/// A linearisation at parameters.
pub(super) struct At<'l, S> {
    pub(super) of: &'l Linearisation,
    pub(super) parameters: &'l [S],
}

impl<S: Real> At<'_, S> {
    pub(super) fn values(&self, program: &Program, state: &[S], change: &Variation<S>) -> Vec<S> {
        let inputs = [state, self.parameters, &change.state, &change.parameters].concat();
        Evaluator::new(program, program.outputs()).evaluate(&inputs, &[]).to_vec()
    }

    pub(super) fn value(&self, program: &Program, state: &[S], change: &Variation<S>) -> S {
        self.values(program, state, change)[0]
    }

    /// Variation of the state only.
    pub(super) fn of_state(&self, state: Vec<S>) -> Variation<S> {
        Variation { state, parameters: vec![S::zero(); self.of.parameters] }
    }

    pub(super) fn rates(&self, field: &VariedField, state: &[S]) -> Vec<S> {
        self.values(&field.rates, state, &self.of_state(vec![S::zero(); self.of.dimension]))
    }

    /// Carries variations along a field from a state for a time of either sign.
    pub(super) fn carry(
        &self,
        field: &VariedField,
        state: &[S],
        duration: S,
        changes: &mut [Variation<S>],
    ) -> Option<()> {
        let start = self.of.dimension + self.of.parameters;
        let mut integrator = Integrator::new(&field.flow);
        for change in changes {
            let from = [state, self.parameters, &change.state, &change.parameters];
            let mut end = from.concat();
            let carried = integrator.carry(&mut end, &[], duration);
            if carried.not_finite
                || carried.remaining != S::zero()
                || (field.jumps && carried.corners > 0)
            {
                return None;
            }
            change.state.copy_from_slice(&end[start..start + self.of.dimension]);
        }
        Some(())
    }

    /// Moves variations along the field to the zero of a function; returns the time that takes.
    pub(super) fn meet(
        &self,
        function: &Program,
        (state, rates): (&[S], &[S]),
        changes: &mut [Variation<S>],
    ) -> Vec<S> {
        let slope = self.value(function, state, &self.of_state(rates.to_vec()));
        let delays = changes.iter_mut().map(|change| {
            let delay = -(self.value(function, state, change) / slope);
            self.delay(change, rates, delay);
            delay
        });
        delays.collect()
    }

    pub(super) fn delay(&self, change: &mut Variation<S>, rates: &[S], by: S) {
        for (value, &rate) in change.state.iter_mut().zip(rates) {
            *value += rate * by;
        }
    }

    /// Carries variations through an event; `None` if no variation is known there.
    pub(super) fn pass(&self, event: &Change<S>, changes: &mut [Variation<S>]) -> Option<()> {
        let surface = &self.of.surfaces[event.surface];
        let beside = self.beside(event);
        let function = match event.kind {
            ChangeKind::Impact | ChangeKind::Begin => &surface.gap,
            // The release function may have no slope on the surface.
            ChangeKind::Release if beside.is_some() => &surface.gap,
            ChangeKind::Release => &surface.contact.as_ref()?.1,
            ChangeKind::Rest => return None,
        };
        let [before, after] = &event.states;
        let [from, to] = event.regimes.map(|regime| self.of.field(regime));
        let (from, to) = match beside {
            Some(rates) => rates,
            None => (self.rates(from?, before), self.rates(to?, after)),
        };
        let delays = self.meet(function, (before, &from), changes);
        for (change, delay) in changes.iter_mut().zip(delays) {
            if event.kind == ChangeKind::Impact {
                change.state = self.values(surface.reset.as_ref()?, before, change);
            }
            self.delay(change, &to, -delay);
        }
        Some(())
    }
}
