//! Plain values of a program's outputs.

use super::program::{Operation, Program, run};
use crate::jet::TimeSeries;
use crate::numeric::{Kernel, Scalar};

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

    /// The same for the first slots alone.
    pub(crate) fn evaluate_values_to<S: Scalar>(&self, slots: usize, tape: &mut [S]) {
        S::dispatch(Values { program: self, slots, tape });
    }
}

/// Values to be computed.
struct Values<'s, S> {
    program: &'s Program,
    slots: usize,
    tape: &'s mut [S],
}

impl<S: Scalar> Kernel for Values<'_, S> {
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
                Operation::Sine { a, cosine, .. } => {
                    let (sine, cosine_of_a) = tape[a].sin_cos();
                    tape[cosine] = cosine_of_a;
                    sine
                }
                // NOTE: its sine comes before it.
                Operation::Cosine { .. } => tape[slot],
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
