//! A smooth vector field and the functions watched along it.

use super::program::{InputKind, Program};
use crate::model::{ExpressionGraph, Model, NodeId};

/// A vector field `x' = f(x, p)` with scalar functions watched along its flow, lowered to a [`Program`].
///
/// The state has [`dimension`](Field::dimension) components (the model's full state, the phase
/// included); parameters follow as inputs.
#[derive(Clone, Debug)]
pub struct Field {
    program: Program,
    dimension: usize,
    parameters: usize,
    watched: usize,
}

impl Field {
    /// A field from expressions of a graph: one derivative per state component, then the watched ones.
    ///
    /// `parameters` says how each parameter of the graph (input `dimension + i`) enters.
    pub fn new(graph: &ExpressionGraph, derivatives: &[NodeId], watched: &[NodeId], parameters: &[InputKind]) -> Self {
        let inputs: Vec<_> =
            derivatives.iter().map(|_| InputKind::Variable).chain(parameters.iter().copied()).collect();
        let outputs: Vec<_> = derivatives.iter().chain(watched).copied().collect();
        Self {
            program: Program::new(graph, &outputs, &inputs),
            dimension: derivatives.len(),
            parameters: parameters.len(),
            watched: watched.len(),
        }
    }

    /// The free field of a model, its parameters constant in time and given at every call.
    pub fn free(model: &Model, watched: &[NodeId]) -> Self {
        Self::new(&model.graph, &model.flow, watched, &vec![InputKind::HeadOnly; model.parameters.len()])
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

    /// The lowered program: outputs are the derivatives, then the watched functions.
    pub fn program(&self) -> &Program {
        &self.program
    }
}
