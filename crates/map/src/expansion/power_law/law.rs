//! The law of a contact with powers of the penetration, with the powers as inputs of their own.

use crate::expansion::error::{ContactLawError, PowerProblem};
use crate::flow::{InputKind, Program, evaluate};
use crate::jet::Jet;
use crate::model::{Binary, ExpressionGraph, Model, Node, NodeId, Unary};
use crate::numeric::{Dd, Scalar};

/// A contact law in which each class of powers `d^β`, `β` modulo 1, is one input.
#[derive(Clone, Debug)]
pub struct PowerLaw {
    /// Program over jets. Inputs: full state, parameters, one power `d^β` per class. Outputs:
    /// those of [`Output`] after the rates of the full state.
    pub(super) program: Program,
    /// Smallest exponent `β` of each class.
    pub(super) exponents: Vec<Dd>,
    /// Length of the full state.
    pub(super) dimension: usize,
}

/// Outputs of a law after the rates of the state.
#[derive(Clone, Copy, Debug)]
pub(super) enum Output {
    /// `h'` along the contact.
    Velocity,
    /// `h''` along the contact.
    Acceleration,
    /// Release function.
    Release,
    /// Rate of the release function along the contact, at constant powers.
    ReleaseRate,
}

impl PowerLaw {
    /// Number of an output among those of the program.
    pub(super) fn place(&self, output: Output) -> usize {
        self.dimension + output as usize
    }

    /// Outputs at a state on the surface, where every power vanishes.
    pub(super) fn on_surface<S: Scalar>(
        &self,
        state: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Vec<Jet<S>> {
        let space = state[0].space();
        let powers = self.exponents.iter().map(|_| Jet::zero(space));
        let inputs: Vec<_> = state.iter().chain(parameters).cloned().chain(powers).collect();
        evaluate(&self.program, space, &inputs)
    }
}

/// A power of the penetration, found in a law.
struct Found {
    node: NodeId,
    /// Positive factor `κ` of the base `κ d`.
    factor: NodeId,
    exponent: Dd,
}

/// A law whose powers of the penetration are replaced by inputs, with the graph that holds it.
pub(in crate::expansion) struct Rewritten {
    /// The graph.
    pub(in crate::expansion) graph: ExpressionGraph,
    /// Rates of the full state, then the release function.
    pub(in crate::expansion) outputs: Vec<NodeId>,
    /// Smallest exponent of each class of powers.
    exponents: Vec<Dd>,
}

/// Distance of a base from 0, relative to the inputs, within which it counts as the penetration.
const ON_THE_SURFACE: f64 = 1e-13;

/// Relative difference of `κ d` and a base up to which they are equal.
const SAME: f64 = 1e-20;

impl Rewritten {
    /// Replaces the powers of the penetration in the contact law of a surface; `None` if there is
    /// none. `outputs` are the rates and the release function, `graze` the full state and the
    /// parameters at the graze.
    ///
    /// # Errors
    ///
    /// [`ContactLawError::Power`] for an exponent that an active parameter moves, or a base that
    /// vanishes at the graze and is not proportional to the penetration.
    pub(in crate::expansion) fn new(
        model: &Model,
        surface: usize,
        outputs: &[NodeId],
        graze: &[Dd],
        active: &[usize],
    ) -> Result<Option<Self>, ContactLawError> {
        let mut search = Search { graph: model.graph.clone(), model, surface, graze, active };
        let found = search.powers(outputs)?;
        if found.is_empty() {
            return Ok(None);
        }
        let mut graph = search.graph;
        let mut exponents: Vec<Dd> = Vec::new();
        for power in &found {
            match exponents.iter_mut().find(|known| is_whole(power.exponent - **known)) {
                Some(known) if power.exponent < *known => *known = power.exponent,
                Some(_) => {}
                None => exponents.push(power.exponent),
            }
        }
        let penetration = graph.neg(model.surfaces[surface].event);
        let stand = found.into_iter().map(|power| {
            let class = exponents.iter().position(|&known| is_whole(power.exponent - known));
            let class = class.unwrap_or_default();
            let input = graph.input(graze.len() + class);
            let whole = graph.power_real(penetration, power.exponent - exponents[class]);
            let factor = graph.power_real(power.factor, power.exponent);
            let product = graph.mul(whole, input);
            (power.node, graph.mul(factor, product))
        });
        let stand: Vec<(NodeId, NodeId)> = stand.collect();
        let outputs = graph.substituted(outputs, |node| {
            stand.iter().find(|(replaced, _)| *replaced == node).map(|&(_, stand)| stand)
        });
        Ok(Some(Self { graph, outputs, exponents }))
    }

    /// Lowers the law; `kinds` are those of the full state and the parameters.
    ///
    /// # Errors
    ///
    /// [`ContactLawError::Power`] if a power acts on the rate of the gap itself.
    pub(in crate::expansion) fn lowered(
        mut self,
        model: &Model,
        surface: usize,
        mut kinds: Vec<InputKind>,
    ) -> Result<PowerLaw, ContactLawError> {
        let surface = &model.surfaces[surface];
        let (rates, release) = self.outputs.split_at(model.dimension());
        let (rates, release) = (rates.to_vec(), release[0]);
        let velocity = self.graph.lie_derivative(surface.event, &rates);
        let first_power = kinds.len();
        if self.graph.dependencies(velocity).iter().any(|&input| input >= first_power) {
            return Err(ContactLawError::Power {
                surface: surface.name.clone(),
                exponent: self.exponents[0].to_f64(),
                problem: PowerProblem::OnRate,
            });
        }
        let acceleration = self.graph.lie_derivative(velocity, &rates);
        let release_rate = self.graph.lie_derivative(release, &rates);
        kinds.extend(self.exponents.iter().map(|_| InputKind::Variable));
        let mut outputs = rates;
        outputs.extend([velocity, acceleration, release, release_rate]);
        Ok(PowerLaw {
            program: Program::new(&self.graph, &outputs, &kinds),
            exponents: self.exponents,
            dimension: model.dimension(),
        })
    }

    /// Inputs at the graze, where every power vanishes.
    pub(in crate::expansion) fn inputs(&self, graze: &[Dd]) -> Vec<Dd> {
        graze.iter().copied().chain(self.exponents.iter().map(|_| Dd::ZERO)).collect()
    }
}

fn is_whole(value: Dd) -> bool {
    value.lo == 0.0 && value.hi.fract() == 0.0
}

/// Search for powers of the penetration.
struct Search<'a> {
    graph: ExpressionGraph,
    model: &'a Model,
    surface: usize,
    graze: &'a [Dd],
    active: &'a [usize],
}

impl Search<'_> {
    fn powers(&mut self, outputs: &[NodeId]) -> Result<Vec<Found>, ContactLawError> {
        let mut values = Vec::new();
        self.graph.evaluate(self.graze, &mut values);
        let size = self.graze.iter().fold(1.0_f64, |size, value| size.max(value.magnitude()));
        let mut found = Vec::new();
        for node in self.graph.under(outputs) {
            let Some((base, exponent)) = self.power(node) else { continue };
            let base = self.without_corner(base);
            if values[base.index()].magnitude() > ON_THE_SURFACE * size {
                continue;
            }
            let (exponent, is_fixed) = match exponent {
                Exponent::Number(value) => (value, true),
                Exponent::Node(node) => (values[node.index()], self.is_fixed(node)),
            };
            if exponent <= Dd::ZERO {
                continue;
            }
            let surface = &self.model.surfaces[self.surface].name;
            let refused = |problem| {
                let (surface, exponent) = (surface.clone(), exponent.to_f64());
                ContactLawError::Power { surface, exponent, problem }
            };
            if !is_fixed {
                return Err(refused(PowerProblem::ActiveExponent));
            }
            let Some(factor) = self.factor(base) else {
                return Err(refused(PowerProblem::OtherBase));
            };
            found.push(Found { node, factor, exponent });
        }
        Ok(found)
    }

    /// Base and exponent of a power that is not analytic at 0.
    fn power(&self, node: NodeId) -> Option<(NodeId, Exponent)> {
        match self.graph.node(node) {
            Node::PowerReal(base, exponent) => Some((base, Exponent::Number(exponent))),
            Node::Unary(Unary::Sqrt, base) => Some((base, Exponent::Number(Dd::from_f64(0.5)))),
            Node::Unary(Unary::Exp, argument) => {
                let Node::Binary(Binary::Mul, a, b) = self.graph.node(argument) else {
                    return None;
                };
                match (self.graph.node(a), self.graph.node(b)) {
                    (Node::Unary(Unary::Log, base), _) => Some((base, Exponent::Node(b))),
                    (_, Node::Unary(Unary::Log, base)) => Some((base, Exponent::Node(a))),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// The argument of a base `max(x, 0)` or `abs(x)`, which is `x` in contact.
    fn without_corner(&self, base: NodeId) -> NodeId {
        let is_zero = |node: NodeId| self.graph.constant_value(node) == Some(Dd::ZERO);
        match self.graph.node(base) {
            Node::Unary(Unary::Abs, x) => x,
            Node::Binary(Binary::Max, x, zero) if is_zero(zero) => x,
            Node::Binary(Binary::Max, zero, x) if is_zero(zero) => x,
            _ => base,
        }
    }

    /// Whether no state and no active parameter moves a node.
    fn is_fixed(&self, node: NodeId) -> bool {
        let dimension = self.model.dimension();
        self.graph
            .dependencies(node)
            .iter()
            .all(|&input| input >= dimension && !self.active.contains(&(input - dimension)))
    }

    /// Positive factor `κ` of a base `κ d`, free of states.
    fn factor(&mut self, base: NodeId) -> Option<NodeId> {
        let dimension = self.model.dimension();
        let event = self.model.surfaces[self.surface].event;
        if base == self.graph.neg(event) {
            return Some(self.graph.number(1.0));
        }
        let component = (0..dimension).find(|&component| {
            let slope = self.graph.derivative(event, component);
            let fixed = self.graph.dependencies(slope).iter().all(|&input| input >= dimension);
            fixed && self.graph.constant_value(slope) != Some(Dd::ZERO)
        })?;
        let of_base = self.graph.derivative(base, component);
        let of_gap = self.graph.derivative(event, component);
        let ratio = self.graph.div(of_base, of_gap);
        let factor = self.graph.neg(ratio);
        let fixed = self.graph.dependencies(factor).iter().all(|&input| input >= dimension);
        (fixed && self.is_proportional(base, event, factor)).then_some(factor)
    }

    /// Whether `base = −factor · event` at several states, with a positive factor.
    fn is_proportional(&self, base: NodeId, event: NodeId, factor: NodeId) -> bool {
        let dimension = self.model.dimension();
        let mut values = Vec::new();
        (1..=4).all(|sample| {
            let moved = self.graze.iter().enumerate().map(|(place, &value)| {
                let wave = (1.3 * f64::from(sample) + 2.1 * place as f64).sin();
                let share = if place < dimension { 0.1 } else { 1e-3 };
                value + Dd::from_f64(share * wave) * (value.abs() + Dd::from_f64(1.0))
            });
            let inputs: Vec<Dd> = moved.collect();
            self.graph.evaluate(&inputs, &mut values);
            let [base, event, factor] = [base, event, factor].map(|node| values[node.index()]);
            let difference = (base + factor * event).magnitude();
            factor > Dd::ZERO && difference <= SAME * (base.magnitude() + factor.magnitude())
        })
    }
}

/// Exponent of a power.
enum Exponent {
    Number(Dd),
    Node(NodeId),
}
