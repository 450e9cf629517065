//! Which series say how long a step may be.

use crate::flow::program::{InputKind, Operation, Program};

/// All components but phases and those whose rate is another component `v`, of a rate of its own.
///
/// NOTE: where `x' = v`, `x_{k+1} = v_k/(k + 1)`: if `|v_k| h^k ≤ ε |v_j| h^j`, then `|x_{k+1}|
/// h^{k+1} ≤ ε (j + 1)/(k + 1) |x_{j+1}| h^{j+1}`, so that the series of `x` is held to less than
/// that of `v` is.
pub(super) fn limiting(program: &Program, states: &[InputKind]) -> Vec<usize> {
    let is_state = |component: usize| program.output(component) < states.len();
    let is_integral =
        |component: usize| is_state(component) && !is_state(program.output(component));
    let limits = |&component: &usize| {
        states[component] != InputKind::LinearInTime && !is_integral(component)
    };
    (0..states.len()).filter(limits).collect()
}

/// Whether each slot is a linear combination of inputs and constants, its factors constant in time.
pub(super) fn combinations(program: &Program) -> Vec<bool> {
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
