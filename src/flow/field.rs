//! A smooth vector field and the functions watched along it.

use super::program::{InputKind, Operation, Program};
use super::series::SeriesProgram;
use crate::model::{ExpressionGraph, Model, NodeId};
use crate::numeric::Dd;

/// A vector field `x' = f(x, p)` with scalar functions watched along its flow, lowered to a [`Program`].
///
/// The state has [`dimension`](Field::dimension) components (the model's full state, the phase
/// included); parameters follow as inputs. The same expressions are lowered twice: for series in time,
/// where parameters are constant and a phase of constant rate is linear, and for jets, where any input
/// that is not bound may have any part.
#[derive(Clone, Debug)]
pub struct Field {
    jet_program: Program,
    time_program: Program,
    series: Box<SeriesProgram>,
    dimension: usize,
    limiting: Vec<usize>,
    parameters: usize,
    watched: usize,
    /// Per slot of the program for series.
    combinations: Vec<bool>,
}

impl Field {
    /// A field from expressions of a graph: one derivative per state component, then the watched ones.
    ///
    /// `parameters` says how each parameter of the graph (input `dimension + i`) enters: bound
    /// parameters are folded in as numbers, all others are given at every call.
    pub fn new(
        graph: &ExpressionGraph,
        derivatives: &[NodeId],
        watched: &[NodeId],
        parameters: &[InputKind],
    ) -> Self {
        let outputs: Vec<_> = derivatives.iter().chain(watched).copied().collect();
        let states = derivatives
            .iter()
            .map(|&rate| state_in_time(graph, rate, derivatives.len()));
        let in_time: Vec<_> = states
            .chain(
                parameters
                    .iter()
                    .map(|&kind| unbound_as(kind, InputKind::HeadOnly)),
            )
            .collect();
        let states = derivatives.iter().map(|_| InputKind::Variable);
        let in_jets: Vec<_> = states
            .chain(
                parameters
                    .iter()
                    .map(|&kind| unbound_as(kind, InputKind::Variable)),
            )
            .collect();
        let time_program = Program::new(graph, &outputs, &in_time);
        Self {
            jet_program: Program::new(graph, &outputs, &in_jets),
            series: Box::new(SeriesProgram::new(
                &time_program,
                &in_time,
                derivatives.len(),
            )),
            combinations: combinations(&time_program),
            limiting: limiting(&time_program, &in_time[..derivatives.len()]),
            time_program,
            dimension: derivatives.len(),
            parameters: parameters.len(),
            watched: watched.len(),
        }
    }

    /// The free field of a model, all its parameters given at every call.
    pub fn free(model: &Model, watched: &[NodeId]) -> Self {
        let parameters = vec![InputKind::Variable; model.parameters.len()];
        Self::new(&model.graph, &model.flow, watched, &parameters)
    }

    /// The free field of a model with every parameter but the `active` ones folded in at its value.
    ///
    /// `values` holds one number per parameter of the model; those of active parameters are not used.
    /// Calls still take one value per parameter of the model and ignore those of bound ones.
    pub fn free_bound(model: &Model, watched: &[NodeId], active: &[usize], values: &[Dd]) -> Self {
        Self::new(
            &model.graph,
            &model.flow,
            watched,
            &bound_but(active, values),
        )
    }

    /// Number of state components.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Number of watched functions.
    pub fn watched(&self) -> usize {
        self.watched
    }

    /// The program for jets: outputs are the derivatives, then the watched functions.
    pub fn program(&self) -> &Program {
        &self.jet_program
    }

    /// The program for series in time, with the same inputs and outputs.
    pub fn time_program(&self) -> &Program {
        &self.time_program
    }
}

impl Field {
    /// The components whose series limit a step: all but integrals of one of them.
    pub(super) fn limiting(&self) -> &[usize] {
        &self.limiting
    }

    /// Whether a watched function is as well resolved as the states are: a linear combination of them.
    pub(super) fn is_combination(&self, watched: usize) -> bool {
        self.combinations[self.time_program.output(self.dimension + watched)]
    }

    /// The program for series in time with numbers as coefficients: its slots are those of [`time_program`](Self::time_program).
    pub(super) fn series(&self) -> &SeriesProgram {
        &self.series
    }
}

/// All components but phases and those whose rate is another component `v`, of a rate of its own.
///
/// NOTE: where `x' = v`, `x_{k+1} = v_k/(k + 1)`: if `|v_k| h^k ≤ ε |v_j| h^j`, then `|x_{k+1}| h^{k+1} ≤ ε (j + 1)/(k + 1) |x_{j+1}| h^{j+1}`, so
/// that the series of `x` is held to less than that of `v` is.
fn limiting(program: &Program, states: &[InputKind]) -> Vec<usize> {
    let is_state = |component: usize| program.output(component) < states.len();
    let is_integral =
        |component: usize| is_state(component) && !is_state(program.output(component));
    let limits = |&component: &usize| {
        states[component] != InputKind::LinearInTime && !is_integral(component)
    };
    (0..states.len()).filter(limits).collect()
}

/// Whether each slot is a linear combination of inputs and constants, its factors constant in time.
fn combinations(program: &Program) -> Vec<bool> {
    let mut are = Vec::with_capacity(program.slots());
    for slot in 0..program.slots() {
        are.push(match *program.operation(slot) {
            Operation::Input | Operation::Constant(_) => true,
            Operation::Add(a, b) | Operation::Sub(a, b) => are[a] && are[b],
            Operation::Neg(a) | Operation::Scale(a, _) | Operation::AddConstant(a, _) => are[a],
            Operation::MulByHead { factor, .. } => are[factor],
            _ => false,
        });
    }
    are
}

/// Kinds of all parameters: the `active` ones variable, the rest bound to their values.
pub fn bound_but(active: &[usize], values: &[Dd]) -> Vec<InputKind> {
    let kind = |(parameter, &value): (usize, &Dd)| {
        if active.contains(&parameter) {
            InputKind::Variable
        } else {
            InputKind::Bound(value)
        }
    };
    values.iter().enumerate().map(kind).collect()
}

/// A state whose rate depends on no state is linear in time: the phase of a forcing.
fn state_in_time(graph: &ExpressionGraph, rate: NodeId, dimension: usize) -> InputKind {
    let constant_rate = graph
        .dependencies(rate)
        .iter()
        .all(|&input| input >= dimension);
    if constant_rate {
        InputKind::LinearInTime
    } else {
        InputKind::Variable
    }
}

fn unbound_as(kind: InputKind, unbound: InputKind) -> InputKind {
    match kind {
        InputKind::Bound(_) => kind,
        _ => unbound,
    }
}
