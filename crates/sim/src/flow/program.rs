//! Expressions lowered to a straight line of recurrences, run degree by degree in any graded
//! algebra.
//!
//! One idea: a vector field is evaluated in time series, in jets, or in jets of time series by the
//! *same* program; only the [`Graded`] algebra differs. Slots of the tape hold one element each.
//! The part of degree `k` of every slot follows from lower parts of all slots and from parts of
//! degree `k` of the inputs and of earlier slots, so calling [`Program::advance`] for `k = 0, 1, …`
//! evaluates it.

mod lowering;
mod operation;

use std::borrow::Borrow;

use crate::jet::Graded;
use crate::model::{ExpressionGraph, NodeId};
use crate::numeric::{Dd, Scalar};
use lowering::Lowering;
pub(super) use operation::{Operation, Slot, run};

/// How an input of the graph enters a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputKind {
    /// Any part may be non-zero: a state, or in a jet any active variable.
    Variable,
    /// Only the head is non-zero: a parameter in a time series.
    HeadOnly,
    /// Only the parts of degree 0 and 1 are non-zero, in a series in time: the phase of a forcing.
    LinearInTime,
    /// A number, folded into the program.
    Bound(Dd),
}

/// A lowered set of expressions.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    operations: Vec<Operation>,
    /// Slots with a part of degree 0, 1, and 2 or more.
    reaching: [Vec<Slot>; 3],
    inputs: usize,
    outputs: Vec<Slot>,
}

impl Program {
    /// Lowers the expressions `outputs` of a graph; `inputs` says how each input enters.
    ///
    /// Input `i` of the graph is slot `i` of the tape.
    pub fn new(graph: &ExpressionGraph, outputs: &[NodeId], inputs: &[InputKind]) -> Self {
        let mut lowering = Lowering::new(graph, inputs);
        lowering.mark_needed(outputs);
        lowering.lower_nodes();
        let outputs = outputs.iter().map(|&node| lowering.slot_of(node)).collect();
        let reaching = [0, 1, 2].map(|degree| {
            let reaches = |&slot: &Slot| lowering.support[slot].reaches(degree);
            (inputs.len()..lowering.operations.len()).filter(reaches).collect()
        });
        Self { operations: lowering.operations, reaching, inputs: inputs.len(), outputs }
    }

    /// Number of slots: a tape holds `slots · element_len` scalars.
    pub fn slots(&self) -> usize {
        self.operations.len()
    }

    /// Number of inputs: slots `0..inputs`.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of output expressions.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Slot of an output expression.
    pub fn output(&self, output: usize) -> usize {
        self.outputs[output]
    }

    /// Whether the linear part of a slot in a variable is that of the Euler derivative of a
    /// function: at degree `k` it carries the factor `k`.
    pub(crate) fn is_euler(&self, slot: usize) -> bool {
        matches!(self.operations[slot], Operation::Euler(_))
    }

    /// Number of products of two full elements per evaluation: the unit of cost.
    pub fn products(&self) -> usize {
        let is_product = |operation: &&Operation| {
            !matches!(
                operation,
                Operation::Input
                    | Operation::Constant(_)
                    | Operation::Euler(_)
                    | Operation::Add(..)
                    | Operation::Sub(..)
                    | Operation::Neg(_)
                    | Operation::Scale(..)
                    | Operation::AddConstant(..)
                    | Operation::OfPhase { .. }
                    | Operation::SignTimes { .. }
                    | Operation::Sign(_)
            )
        };
        self.operations.iter().filter(is_product).count()
    }

    /// The recurrence of a slot.
    pub(super) fn operation(&self, slot: usize) -> &Operation {
        &self.operations[slot]
    }

    /// The slots a slot is computed from.
    pub(crate) fn operands(&self, slot: usize) -> impl Iterator<Item = usize> + use<> {
        self.operations[slot].operands()
    }

    /// Computes the part of one degree of every slot but the inputs'.
    ///
    /// `tape` holds the slots one after another, each [`Graded::element_len`] scalars; `scratch` at
    /// least the length of the largest part. Parts of lower degree must have been computed before
    /// and the inputs' parts of this degree filled in. Parts that vanish whatever the inputs
    /// (beyond the head of a constant, say) are not written: the tape must be zero there.
    pub fn advance<S: Scalar, A: Graded<S>>(
        &self,
        algebra: &A,
        degree: usize,
        tape: &mut [S],
        scratch: &mut [S],
    ) {
        self.advance_with::<S, A, &A>(|_| algebra, degree, tape, scratch);
    }

    /// As [`advance`](Self::advance), in an algebra chosen for each slot.
    pub(crate) fn advance_with<S: Scalar, A: Graded<S>, R: Borrow<A>>(
        &self,
        algebra_of: impl Fn(usize) -> R,
        degree: usize,
        tape: &mut [S],
        scratch: &mut [S],
    ) {
        for &slot in &self.reaching[degree.min(2)] {
            let chosen = algebra_of(slot);
            let algebra = chosen.borrow();
            let (len, part) = (algebra.element_len(), algebra.part(degree));
            let out = &mut scratch[..part.len()];
            run(&self.operations[slot], slot, algebra, degree, len, tape, out);
            tape[slot * len + part.start..slot * len + part.end].copy_from_slice(out);
        }
    }
}
