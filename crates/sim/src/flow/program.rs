//! Expressions lowered to a straight-line sequence of recurrences, run degree by degree in any
//! graded algebra.
//!
//! One idea: a vector field is evaluated in time series, in jets, or in jets of time series by the
//! *same* program; only the [`Graded`] algebra differs. Slots of the tape hold one element each.
//! The part of degree `k` of every slot follows from lower parts of all slots and from parts of
//! degree `k` of the inputs and of earlier slots, so calling [`Program::advance`] for `k = 0, 1, …`
//! evaluates it.

mod lowering;
mod operation;

use std::borrow::Borrow;
use std::sync::Arc;

use crate::jet::{Graded, HeadFunction, Jet, JetSpace, TimeSeries};
use crate::model::{ExpressionGraph, NodeId};
use crate::numeric::{Dd, Scalar, Vectorised};

use lowering::ProgramLowering;

pub(super) use operation::{Operation, Slot, run};

/// Sums, multiples and other linear operations that together take as long as a product of series
/// of numbers with some forty terms.
const LINEAR_IN_A_PRODUCT: usize = 10;

/// Kind of an input of a program: the parts that can be nonzero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputKind {
    /// Any part may be nonzero: a state, or in a jet any active variable.
    Variable,
    /// Only the head is nonzero: a parameter in a time series.
    HeadOnly,
    /// Only the parts of degree 0 and 1 in time are nonzero: the phase of a forcing.
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
    /// Lowers the expressions `outputs` of a graph; `inputs` gives the kind of each input.
    ///
    /// Input `i` of the graph is slot `i` of the tape.
    pub fn new(graph: &ExpressionGraph, outputs: &[NodeId], inputs: &[InputKind]) -> Self {
        let mut lowering = ProgramLowering::new(graph, inputs);
        lowering.lower_nodes(outputs);
        let outputs = outputs.iter().map(|&node| lowering.slot_of(node)).collect();
        let reaching = [0, 1, 2].map(|degree| {
            let reaches = |&slot: &Slot| lowering.support[slot].reaches(degree);
            (inputs.len()..lowering.operations.len()).filter(reaches).collect()
        });
        Self { operations: lowering.operations, reaching, inputs: inputs.len(), outputs }
    }

    /// Number of slots; a tape holds `slots · element_len` scalars.
    pub fn slots(&self) -> usize {
        self.operations.len()
    }

    /// Number of inputs, whose slots are `0..inputs`.
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

    /// Whether a slot is an Euler derivative: its part of degree `k` has the factor `k`.
    pub(crate) fn is_euler(&self, slot: usize) -> bool {
        matches!(self.operations[slot], Operation::Euler(_))
    }

    /// Number of products of two full elements per evaluation: the measure of cost in jets.
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
                    | Operation::Balance(..)
            )
        };
        self.operations.iter().filter(is_product).count()
    }

    /// Cost of an evaluation in series of numbers, in products of two series: ten other operations
    /// count as one.
    pub fn cost_in_products(&self) -> usize {
        let products = self.products();
        products + (self.operations.len() - products) / LINEAR_IN_A_PRODUCT
    }

    /// Recurrence of a slot.
    pub(super) fn operation(&self, slot: usize) -> &Operation {
        &self.operations[slot]
    }

    /// Slots from which a slot is computed.
    pub(crate) fn operands(&self, slot: usize) -> impl Iterator<Item = usize> + use<> {
        self.operations[slot].operands()
    }

    /// Whether each slot changes along a solution; `inputs` as in the lowering.
    pub(super) fn moving(&self, inputs: &[InputKind]) -> Vec<bool> {
        let is_moving =
            |kind: &InputKind| matches!(kind, InputKind::Variable | InputKind::LinearInTime);
        let mut moves: Vec<bool> = inputs.iter().map(is_moving).collect();
        for slot in inputs.len()..self.slots() {
            let moving = self.operands(slot).any(|operand| moves[operand]);
            moves.push(moving);
        }
        moves
    }

    /// Computes the part of one degree of every slot except the inputs.
    ///
    /// `tape` holds the slots one after another, each [`Graded::element_len`] scalars; `scratch`
    /// holds at least the length of the largest part. Parts of lower degree must have been computed
    /// before, and the inputs' parts of this degree must be filled in. Parts that vanish for all
    /// inputs (such as those of a constant beyond its head) are not written: the tape must be zero
    /// there.
    pub fn advance<S: Scalar, A: Graded<S>>(
        &self,
        algebra: &A,
        degree: usize,
        tape: &mut [S],
        scratch: &mut [S],
    ) {
        self.advance_with::<S, A, &A>(|_| algebra, degree, tape, scratch);
    }

    /// Runs [`advance`](Self::advance) in an algebra chosen for each slot.
    fn advance_with<S: Scalar, A: Graded<S>, R: Borrow<A>>(
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

/// Values of a program's outputs at jets: one input jet per input of the program, all in `space`.
///
/// Inputs that were lowered as bound are not read.
pub fn evaluate<S: Scalar>(
    program: &Program,
    space: &Arc<JetSpace>,
    inputs: &[Jet<S>],
) -> Vec<Jet<S>> {
    let len = space.len();
    let mut tape = vec![S::zero(); program.slots() * len];
    for (slot, input) in inputs.iter().enumerate() {
        tape[slot * len..(slot + 1) * len].copy_from_slice(input.coefficients());
    }
    let mut scratch = vec![S::zero(); len];
    for degree in 0..=space.order() {
        program.advance(&**space, degree, &mut tape, &mut scratch);
    }
    (0..program.outputs())
        .map(|output| {
            let slot = program.output(output);
            Jet::from_coefficients(space, tape[slot * len..(slot + 1) * len].to_vec())
        })
        .collect()
}

impl Program {
    /// Computes the value of every slot from the inputs' values, slots `0..inputs` of `tape`.
    ///
    /// `tape` holds one scalar per slot; the value of output `k` is in slot
    /// [`output(k)`](Self::output). Nothing is allocated.
    ///
    /// # Panics
    ///
    /// If `tape` is shorter than [`slots`](Self::slots).
    pub fn evaluate_values<S: Scalar>(&self, tape: &mut [S]) {
        self.evaluate_values_to(self.slots(), tape);
    }

    /// Computes the values of the first `slots` slots only.
    pub(crate) fn evaluate_values_to<S: Scalar>(&self, slots: usize, tape: &mut [S]) {
        S::dispatch(Values { program: self, slots, tape });
    }
}

/// Vectorised computation of values.
struct Values<'s, S> {
    program: &'s Program,
    slots: usize,
    tape: &'s mut [S],
}

impl<S: Scalar> Vectorised for Values<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { program, slots, tape } = self;
        for slot in program.inputs()..slots {
            tape[slot] = match *program.operation(slot) {
                Operation::Constant(value) => S::from_dd(value),
                Operation::Add(a, b) => tape[a] + tape[b],
                Operation::Sub(a, b) => tape[a] - tape[b],
                Operation::Neg(a) => -tape[a],
                Operation::Scale(a, factor) => tape[a] * S::from_dd(factor),
                Operation::AddConstant(a, value) => tape[a] + S::from_dd(value),
                Operation::MulByHead { head: a, factor: b } | Operation::Mul(a, b) => {
                    tape[a] * tape[b]
                }
                Operation::Div(a, b) => tape[a] / tape[b],
                Operation::Function { function: HeadFunction::Sin, a, partner, .. } => {
                    let (sine, cosine) = tape[a].sin_cos();
                    tape[partner] = cosine;
                    sine
                }
                // NOTE: the sine before it writes it.
                Operation::Function { function: HeadFunction::Cos, .. } => tape[slot],
                ref operation => any_value(operation, slot, tape),
            };
        }
    }
}

#[inline(never)]
fn any_value<S: Scalar>(operation: &Operation, slot: usize, tape: &[S]) -> S {
    let mut out = [S::zero()];
    run(operation, slot, &TimeSeries { order: 0 }, 0, 1, tape, &mut out);
    out[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_linear_operations_count_as_products() {
        let mut graph = ExpressionGraph::new();
        let state = graph.input(0);
        let square = graph.mul(state, state);
        let program = |graph: &ExpressionGraph, sum| {
            Program::new(graph, &[sum], &[InputKind::Variable]).cost_in_products()
        };
        assert_eq!(program(&graph, square), 1);
        let mut sum = square;
        for _ in 0..500 {
            let tiny = graph.constant(Dd::new(1e-9, 0.0));
            let term = graph.mul(tiny, state);
            sum = graph.add(sum, term);
        }
        let products = program(&graph, sum);
        assert!((1 + 500 / LINEAR_IN_A_PRODUCT..=101).contains(&products), "{products}");
    }
}
