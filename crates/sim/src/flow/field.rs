//! A smooth vector field with watched functions, and the errors of an integration along its flow.

use super::program::{InputKind, Program};
use super::series::SeriesProgram;
use crate::jet::JetError;
use crate::model::{ExpressionGraph, Model, NodeId};
use crate::numeric::Dd;

/// A vector field `x' = f(x, p)` with scalar functions watched along its flow, lowered to a
/// [`Program`].
///
/// The state has [`dimension`](Field::dimension) components (the model's full state, the phase
/// included); parameters follow as inputs. The same expressions are lowered twice: for series in
/// time, where parameters are constant and a phase of constant rate is linear, and for jets, where
/// any input that is not bound may have any part.
#[derive(Clone, Debug)]
pub struct Field {
    jet_program: Program,
    time_program: Program,
    series: Box<SeriesProgram>,
    dimension: usize,
    parameters: usize,
    watched: usize,
}

impl Field {
    /// A field from expressions of a graph: one derivative per state component, then the watched
    /// ones.
    ///
    /// `parameters` gives the kind of each parameter of the graph (input `dimension + i`): bound
    /// parameters are folded in as numbers, all others are arguments of every call.
    pub fn new(
        graph: &ExpressionGraph,
        derivatives: &[NodeId],
        watched: &[NodeId],
        parameters: &[InputKind],
    ) -> Self {
        let outputs: Vec<_> = derivatives.iter().chain(watched).copied().collect();
        let states = derivatives.iter().map(|&rate| state_in_time(graph, rate, derivatives.len()));
        let in_time: Vec<_> = states
            .chain(parameters.iter().map(|&kind| unbound_as(kind, InputKind::HeadOnly)))
            .collect();
        let states = derivatives.iter().map(|_| InputKind::Variable);
        let in_jets: Vec<_> = states
            .chain(parameters.iter().map(|&kind| unbound_as(kind, InputKind::Variable)))
            .collect();
        let time_program = Program::new(graph, &outputs, &in_time);
        Self {
            jet_program: Program::new(graph, &outputs, &in_jets),
            series: Box::new(SeriesProgram::new(&time_program, &in_time, derivatives.len())),
            time_program,
            dimension: derivatives.len(),
            parameters: parameters.len(),
            watched: watched.len(),
        }
    }

    /// The free field of a model; all parameters are arguments of every call.
    pub fn free(model: &Model, watched: &[NodeId]) -> Self {
        let parameters = vec![InputKind::Variable; model.parameters.len()];
        Self::new(&model.graph, &model.flow, watched, &parameters)
    }

    /// The free field of a model with every parameter but the `active` ones folded in at its value.
    ///
    /// `values` holds one number per parameter of the model; those of active parameters are not
    /// used. Calls still take one value per parameter of the model and ignore the values of bound
    /// ones.
    pub fn free_bound(model: &Model, watched: &[NodeId], active: &[usize], values: &[Dd]) -> Self {
        Self::new(&model.graph, &model.flow, watched, &bound_but(active, values))
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

    /// Whether a solution may meet a corner of the field or of a watched function.
    pub(crate) fn has_corners(&self) -> bool {
        !self.series.corners().is_empty()
    }

    /// The program for jets: outputs are the derivatives, then the watched functions.
    pub fn program(&self) -> &Program {
        &self.jet_program
    }

    /// The program for series in time, with the same inputs and outputs.
    pub fn time_program(&self) -> &Program {
        &self.time_program
    }

    /// The program for series in time with numbers as coefficients: its slots are those of
    /// [`time_program`](Self::time_program).
    pub(super) fn series(&self) -> &SeriesProgram {
        &self.series
    }
}

/// Kinds of all parameters: the `active` ones variable, the others bound to their values.
pub fn bound_but(active: &[usize], values: &[Dd]) -> Vec<InputKind> {
    let kind = |(parameter, &value): (usize, &Dd)| {
        if active.contains(&parameter) { InputKind::Variable } else { InputKind::Bound(value) }
    };
    values.iter().enumerate().map(kind).collect()
}

/// Kind of a state: linear in time if its rate depends on no state, as for the phase of a forcing.
fn state_in_time(graph: &ExpressionGraph, rate: NodeId, dimension: usize) -> InputKind {
    let constant_rate = graph.dependencies(rate).iter().all(|&input| input >= dimension);
    if constant_rate { InputKind::LinearInTime } else { InputKind::Variable }
}

fn unbound_as(kind: InputKind, unbound: InputKind) -> InputKind {
    match kind {
        InputKind::Bound(_) => kind,
        _ => unbound,
    }
}

/// Error of an integration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// The solution or the field left the finite numbers.
    #[error("the vector field is not finite here (Taylor coefficient {degree})")]
    NotFinite {
        /// Degree of the first Taylor coefficient found not finite.
        degree: usize,
    },
    /// The step limit was reached.
    #[error("no end after {limit} steps; {remaining:e} of the time remains")]
    TooManySteps {
        /// The limit.
        limit: usize,
        /// Remaining time.
        remaining: f64,
    },
    /// The space of jets could not be created.
    #[error(transparent)]
    Jet(#[from] JetError),
}
