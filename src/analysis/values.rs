//! Plain values of a model's expressions at one state.

use crate::flow::{InputKind, Program};
use crate::jet::TimeSeries;
use crate::model::{ExpressionGraph, Model, NodeId};
use crate::numeric::Scalar;

/// Expressions of a graph lowered to a program and run at degree 0.
#[derive(Clone, Debug)]
pub(super) struct Values<S: Scalar> {
    program: Program,
    tape: Vec<S>,
}

impl<S: Scalar> Values<S> {
    /// Expressions in the inputs of a model: the full state, then all parameters.
    pub(super) fn new(model: &Model, graph: &ExpressionGraph, outputs: &[NodeId]) -> Self {
        let inputs = vec![InputKind::Variable; model.dimension() + model.parameters.len()];
        let program = Program::new(graph, outputs, &inputs);
        let tape = vec![S::zero(); program.slots()];
        Self { program, tape }
    }

    /// Evaluates all expressions; read them with [`get`](Self::get).
    pub(super) fn evaluate(&mut self, state: &[S], parameters: &[S]) -> &mut Self {
        self.tape[..state.len()].copy_from_slice(state);
        self.tape[state.len()..state.len() + parameters.len()].copy_from_slice(parameters);
        self.program.advance(
            &TimeSeries { order: 0 },
            0,
            &mut self.tape,
            &mut [S::zero()],
        );
        self
    }

    /// Value of one expression at the state evaluated last.
    pub(super) fn get(&self, output: usize) -> S {
        self.tape[self.program.output(output)]
    }
}
