//! Linear combinations, gathered from the operations they consist of.

use super::Lowering;
use crate::flow::program::{Operation, Slot};
use crate::flow::series::instruction::{Factor, Sum, Term, Terms};
use crate::numeric::Dd;

/// A linear combination: constants, and factors with the slots they multiply.
#[derive(Clone, Default)]
struct Form {
    constants: Vec<Factor>,
    terms: Vec<(Factor, Slot)>,
}

impl Form {
    fn of_slot(slot: Slot) -> Self {
        Self { constants: Vec::new(), terms: vec![(Factor::one(), slot)] }
    }

    fn plus(mut self, other: Self) -> Self {
        self.constants.extend(other.constants);
        self.terms.extend(other.terms);
        self
    }

    fn times(mut self, number: Dd, head: Option<Slot>) -> Self {
        let factors = self.constants.iter_mut();
        for factor in factors.chain(self.terms.iter_mut().map(|term| &mut term.0)) {
            factor.number *= number;
            factor.heads.extend(head);
        }
        self
    }
}

impl Factor {
    fn one() -> Self {
        Self { number: Dd::from(1.0), heads: Vec::new() }
    }
}

impl Lowering<'_> {
    /// Whether an operation is a linear combination with constant factors.
    pub(super) fn is_linear(&self, slot: Slot) -> bool {
        match *self.program.operation(slot) {
            Operation::Add(..)
            | Operation::Sub(..)
            | Operation::Neg(_)
            | Operation::Scale(..)
            | Operation::AddConstant(..) => true,
            Operation::MulByHead { head, .. } => self.is_constant(head),
            _ => false,
        }
    }

    /// Terms of a slot's linear combination with linear operands used only there dissolved; those
    /// of its operands are known.
    pub(super) fn gathered_terms(&self, slot: Slot) -> usize {
        let of = |operand: Slot| match () {
            () if self.is_constant(operand) => 0,
            () if self.uses[operand] == 1 && self.is_linear(operand) => self.terms[operand],
            () => 1,
        };
        match *self.program.operation(slot) {
            Operation::Add(a, b) | Operation::Sub(a, b) => of(a) + of(b),
            Operation::Neg(a) | Operation::Scale(a, _) | Operation::AddConstant(a, _) => of(a),
            Operation::MulByHead { head, factor } if self.is_constant(head) => of(factor),
            _ => 1,
        }
    }

    /// A slot as a linear combination of others; more than three terms are left to the operations
    /// they come from.
    pub(super) fn sum(&mut self, slot: Slot) -> Sum {
        let form = if self.is_linear(slot) {
            self.form(slot, self.terms[slot] <= 3)
        } else {
            self.form_of_operand(slot, false)
        };
        let terms: Vec<_> = form.terms.into_iter().map(|term| self.term(term)).collect();
        let terms = match terms[..] {
            [a, b, c] => Terms::Three([a, b, c]),
            [a, b] => Terms::Two([a, b]),
            [a, ..] => Terms::One(a),
            [] => Terms::One(self.term((Factor::one(), slot))),
        };
        let constant = (!form.constants.is_empty()).then(|| self.factor(form.constants));
        Sum { terms, constant }
    }

    fn term(&mut self, (factor, slot): (Factor, Slot)) -> Term {
        Term { factor: self.factor(vec![factor]), operand: self.operand(slot) }
    }

    fn factor(&mut self, summands: Vec<Factor>) -> usize {
        self.factors.push(summands);
        self.factors.len() - 1
    }

    /// A linear operation; `gathers` says whether linear operands used only here are dissolved.
    fn form(&self, slot: Slot, gathers: bool) -> Form {
        let of = |operand: Slot| self.form_of_operand(operand, gathers);
        let minus = Dd::from(-1.0);
        match *self.program.operation(slot) {
            Operation::Add(a, b) => of(a).plus(of(b)),
            Operation::Sub(a, b) => of(a).plus(of(b).times(minus, None)),
            Operation::Neg(a) => of(a).times(minus, None),
            Operation::Scale(a, factor) => of(a).times(factor, None),
            Operation::AddConstant(a, number) => {
                let mut form = of(a);
                form.constants.push(Factor { number, heads: Vec::new() });
                form
            }
            Operation::MulByHead { head, factor } => of(factor).times(Dd::from(1.0), Some(head)),
            _ => Form::of_slot(slot),
        }
    }

    fn form_of_operand(&self, slot: Slot, gathers: bool) -> Form {
        if let Operation::Constant(number) = *self.program.operation(slot) {
            let mut form = Form::default();
            form.constants.push(Factor { number, heads: Vec::new() });
            form
        } else if self.is_constant(slot) {
            let mut form = Form::default();
            form.constants.push(Factor { number: Dd::from(1.0), heads: vec![slot] });
            form
        } else if gathers && self.uses[slot] == 1 && self.is_linear(slot) {
            self.form(slot, true)
        } else {
            Form::of_slot(slot)
        }
    }
}
