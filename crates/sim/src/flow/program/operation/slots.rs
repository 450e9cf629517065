//! Which slots an operation reads, and the same operation on others.

use super::{Operation, Slot};
use crate::jet::Span;

impl Operation {
    /// Slots of which a recurrence reads more than the part of the degree at hand; none for linear
    /// operations.
    pub(in crate::flow) fn history(&self, slot: Slot) -> Vec<Slot> {
        match *self {
            Operation::Mul(a, b) => vec![a, b],
            Operation::MulByHead { head, factor } => vec![head, factor],
            Operation::Div(a, b) => vec![a, b, slot],
            Operation::Sqrt(a) => vec![a, slot],
            Operation::Exp { a, euler_a } => vec![a, euler_a, slot],
            Operation::Sine { a, euler_a, cosine: partner }
            | Operation::Cosine { a, euler_a, sine: partner }
            | Operation::Sinh { a, euler_a, cosh: partner }
            | Operation::Cosh { a, euler_a, sinh: partner } => vec![a, euler_a, partner],
            Operation::OfPhase { a, partner, .. } => vec![a, partner],
            Operation::Primitive { a, w, euler_u, .. } => vec![a, w, euler_u],
            Operation::Power { a, euler_a, euler_u, .. } => vec![a, euler_a, euler_u, slot],
            Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u } => {
                vec![y, x, euler_y, euler_x, w, euler_u]
            }
            Operation::SignTimes { a, .. } => vec![a],
            Operation::Sign(_)
            | Operation::Input
            | Operation::Constant(_)
            | Operation::Euler(_)
            | Operation::Add(..)
            | Operation::Sub(..)
            | Operation::Neg(_)
            | Operation::Scale(..)
            | Operation::AddConstant(..) => Vec::new(),
        }
    }

    /// The same operation on slots of other names.
    pub(in crate::flow) fn renamed(self, name: impl Fn(Slot) -> Slot) -> Self {
        let mut renamed = self;
        match &mut renamed {
            Operation::Input | Operation::Constant(_) => {}
            Operation::Euler(a)
            | Operation::Neg(a)
            | Operation::Scale(a, _)
            | Operation::AddConstant(a, _)
            | Operation::Sqrt(a)
            | Operation::Sign(a) => *a = name(*a),
            Operation::Add(a, b)
            | Operation::Sub(a, b)
            | Operation::Mul(a, b)
            | Operation::Div(a, b)
            | Operation::MulByHead { head: a, factor: b }
            | Operation::Exp { a, euler_a: b }
            | Operation::OfPhase { a, partner: b, .. }
            | Operation::SignTimes { a, b } => [a, b].into_iter().for_each(|s| *s = name(*s)),
            Operation::Sine { a, euler_a, cosine: b }
            | Operation::Cosine { a, euler_a, sine: b }
            | Operation::Sinh { a, euler_a, cosh: b }
            | Operation::Cosh { a, euler_a, sinh: b }
            | Operation::Primitive { a, w: euler_a, euler_u: b, .. }
            | Operation::Power { a, euler_a, euler_u: b, .. } => {
                [a, euler_a, b].into_iter().for_each(|s| *s = name(*s))
            }
            Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u } => {
                [y, x, euler_y, euler_x, w, euler_u].into_iter().for_each(|s| *s = name(*s))
            }
        }
        renamed
    }

    /// The slots an operation reads, its own left out.
    pub(in crate::flow) fn operands(&self) -> impl Iterator<Item = Slot> + use<> {
        let slots: [Option<Slot>; 3] = match *self {
            Operation::Input | Operation::Constant(_) => [None, None, None],
            Operation::Euler(a)
            | Operation::Neg(a)
            | Operation::Scale(a, _)
            | Operation::AddConstant(a, _)
            | Operation::Sqrt(a)
            | Operation::Exp { a, .. }
            | Operation::Sine { a, .. }
            | Operation::Cosine { a, .. }
            | Operation::OfPhase { a, .. }
            | Operation::Sinh { a, .. }
            | Operation::Cosh { a, .. }
            | Operation::Power { a, .. }
            | Operation::Sign(a) => [Some(a), None, None],
            Operation::Add(a, b)
            | Operation::Sub(a, b)
            | Operation::Mul(a, b)
            | Operation::Div(a, b)
            | Operation::MulByHead { head: a, factor: b }
            | Operation::Primitive { a, w: b, .. }
            | Operation::SignTimes { a, b } => [Some(a), Some(b), None],
            Operation::Atan2 { y, x, w, .. } => [Some(y), Some(x), Some(w)],
        };
        slots.into_iter().flatten()
    }

    /// The factors and the terms of the product of which a part consists, if it is one product and
    /// a factor.
    pub(in crate::flow) fn product(&self, slot: Slot) -> Option<(Slot, Slot, Span)> {
        match *self {
            Operation::Mul(a, b) => Some((a, b, Span::Full)),
            Operation::Div(_, b) => Some((b, slot, Span::WithoutFirst)),
            Operation::Sine { euler_a, cosine: partner, .. }
            | Operation::Cosine { euler_a, sine: partner, .. } => {
                Some((euler_a, partner, Span::WithoutFirst))
            }
            _ => None,
        }
    }

    /// Highest degree of a part that can differ from zero, up to an order, from those of the slots
    /// it reads.
    pub(in crate::flow) fn highest_degree(
        &self,
        order: usize,
        of: impl Fn(Slot) -> usize,
    ) -> usize {
        match *self {
            Operation::Constant(_) | Operation::Sign(_) => 0,
            Operation::Euler(a)
            | Operation::Neg(a)
            | Operation::Scale(a, _)
            | Operation::AddConstant(a, _)
            | Operation::MulByHead { factor: a, .. }
            | Operation::SignTimes { b: a, .. } => of(a),
            Operation::Add(a, b) | Operation::Sub(a, b) => of(a).max(of(b)),
            Operation::Mul(a, b) => (of(a) + of(b)).min(order),
            _ if self.operands().all(|operand| of(operand) == 0) => 0,
            _ => order,
        }
    }

    /// All slots an operation reads, those that are computed after it included.
    pub(in crate::flow) fn reads(&self) -> impl Iterator<Item = Slot> + use<> {
        let partners = match *self {
            Operation::Exp { euler_a, .. } => [Some(euler_a), None, None],
            Operation::Sine { euler_a, cosine, .. } => [Some(euler_a), Some(cosine), None],
            Operation::Cosine { euler_a, sine, .. } => [Some(euler_a), Some(sine), None],
            Operation::OfPhase { partner, .. } => [Some(partner), None, None],
            Operation::Sinh { euler_a, cosh, .. } => [Some(euler_a), Some(cosh), None],
            Operation::Cosh { euler_a, sinh, .. } => [Some(euler_a), Some(sinh), None],
            Operation::Primitive { euler_u, .. } => [Some(euler_u), None, None],
            Operation::Power { euler_a, euler_u, .. } => [Some(euler_a), Some(euler_u), None],
            Operation::Atan2 { euler_y, euler_x, euler_u, .. } => {
                [Some(euler_y), Some(euler_x), Some(euler_u)]
            }
            _ => [None; 3],
        };
        self.operands().chain(partners.into_iter().flatten())
    }
}
