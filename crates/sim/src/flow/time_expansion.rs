//! Taylor coefficients of a solution in time, one power after another.
//!
//! One idea: from `x' = f(x, p)` follows `x_{k+1} = f_k / (k + 1)`, and a program gives `f_k` from
//! `x_0 … x_k` in any algebra graded by powers of time: numbers or jets as coefficients.

use super::Field;
use crate::jet::Graded;
use crate::numeric::Scalar;

/// Fills the tape of a field with the Taylor coefficients of all its slots up to the algebra's
/// order.
///
/// The heads of the inputs must be in place, and the inputs of the parameters zero beyond their
/// heads.
pub(crate) fn expand<S: Scalar, A: Graded<S>>(
    field: &Field,
    algebra: &A,
    tape: &mut [S],
    scratch: &mut [S],
) {
    let (program, len, order) = (field.time_program(), algebra.element_len(), algebra.order());
    for degree in 0..=order {
        program.advance(algebra, degree, tape, scratch);
        if degree == order {
            return;
        }
        let (from, to) = (algebra.part(degree), algebra.part(degree + 1));
        let factor = S::one() / S::from_f64((degree + 1) as f64);
        for component in 0..field.dimension() {
            let source = program.output(component) * len + from.start;
            let target = component * len + to.start;
            for offset in 0..from.len() {
                tape[target + offset] = tape[source + offset] * factor;
            }
        }
    }
}
