//! The instructions of a series program.

use crate::flow::program::{Operation, Slot};
use crate::numeric::Dd;

/// A product of a number and heads of constant slots.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Factor {
    pub(super) number: Dd,
    pub(super) heads: Vec<Slot>,
}

/// An operand of which the coefficient of the degree at hand is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Operand {
    pub(super) slot: Slot,
    /// Whether that coefficient is what the instruction before this one gave.
    ///
    /// NOTE: it then comes in a register: through memory each of the instructions of one degree
    /// would wait for the one before.
    pub(super) is_fresh: bool,
}

/// A factor, by index, and what it multiplies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    pub(super) factor: usize,
    pub(super) operand: Operand,
}

/// Terms of a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Terms {
    One(Term),
    Two([Term; 2]),
    /// Only the last of several terms may be fresh.
    Three([Term; 3]),
}

/// `Σ_i factor_i · operand_i`, and a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sum {
    pub(super) terms: Terms,
    /// The constant: a factor by its index.
    pub(super) constant: Option<usize>,
}

impl Sum {
    fn terms(&mut self) -> &mut [Term] {
        match &mut self.terms {
            Terms::One(term) => std::slice::from_mut(term),
            Terms::Two(terms) => terms,
            Terms::Three(terms) => terms,
        }
    }
}

/// One recurrence: how the coefficients of a slot follow from those of others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Instruction {
    /// A linear combination.
    Linear { out: Slot, sum: Sum },
    /// `x_{k+1} = sum_k / (k + 1)`.
    Integral { out: Slot, sum: Sum },
    /// A square.
    Square { out: Slot, a: Operand },
    /// A product.
    Product { out: Slot, a: Operand, b: Operand },
    /// `(numerator_k − Σ_{j ≥ 1} b_j u_{k−j}) / b_0`.
    Quotient {
        out: Slot,
        numerator: Operand,
        denominator: Operand,
        /// Slot of `1/b_0`.
        reciprocal: Slot,
    },
    /// Sine and cosine of a phase `a = a_0 + a_1 t`, where wanted: `a_1^k/k!`, a table, times the
    /// derivatives of the functions at `a_0`.
    Phase { a: Slot, table: Slot, sine: Option<Slot>, cosine: Option<Slot> },
    /// Any other operation of the program.
    Other { out: Slot, operation: Operation },
}

impl Instruction {
    /// The slot whose coefficient it gives last.
    pub(super) fn out(&self) -> Option<Slot> {
        match *self {
            Instruction::Linear { out, .. }
            | Instruction::Integral { out, .. }
            | Instruction::Square { out, .. }
            | Instruction::Product { out, .. }
            | Instruction::Quotient { out, .. }
            | Instruction::Other { out, .. } => Some(out),
            Instruction::Phase { .. } => None,
        }
    }

    /// Whether one of the operands whose newest coefficient is wanted is this slot.
    pub(super) fn takes(&self, slot: Slot) -> bool {
        let mut found = false;
        let mut copy = *self;
        copy.each_operand(&mut |operand| found |= operand.slot == slot);
        found
    }

    /// Marks the operands that the instruction before gives.
    pub(super) fn take_from(&mut self, before: Slot) {
        if let Instruction::Linear { sum, .. } | Instruction::Integral { sum, .. } = self {
            let terms = sum.terms();
            let last = terms.len() - 1;
            if let Some(fresh) = terms.iter().position(|term| term.operand.slot == before) {
                terms.swap(fresh, last);
            }
        }
        self.each_operand(&mut |operand| operand.is_fresh = operand.slot == before);
    }

    fn each_operand(&mut self, visit: &mut dyn FnMut(&mut Operand)) {
        match self {
            Instruction::Linear { sum, .. } | Instruction::Integral { sum, .. } => {
                let terms = sum.terms().iter_mut();
                terms.for_each(|term| visit(&mut term.operand));
            }
            Instruction::Square { a, .. } => visit(a),
            Instruction::Product { a, b, .. } => [a, b].into_iter().for_each(visit),
            Instruction::Quotient { numerator, denominator, .. } => {
                [numerator, denominator].into_iter().for_each(visit)
            }
            Instruction::Phase { .. } | Instruction::Other { .. } => {}
        }
    }
}
