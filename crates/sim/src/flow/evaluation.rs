//! Programs evaluated on jets.

use std::sync::Arc;

use super::program::Program;
use crate::jet::{Jet, JetSpace};
use crate::numeric::Scalar;

/// Values of a program's outputs at jets: one input jet per input of the program, all of `space`.
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
