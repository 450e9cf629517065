//! Lowering of the elementary functions.

use super::{Lowering, SharedKey, Support};
use crate::flow::program::operation::{Operation, Slot};
use crate::jet::HeadFunction;
use crate::model::Unary;
use crate::numeric::Dd;

impl Lowering<'_> {
    pub(super) fn power_real(&mut self, a: Slot, exponent: Dd) -> Slot {
        let euler_a = self.euler(a);
        let euler_u = self.operations.len() + 1;
        let u = self.push(Operation::Power { a, exponent, euler_a, euler_u }, self.joint(&[a]));
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    pub(super) fn unary(&mut self, function: Unary, a: Slot) -> Slot {
        match function {
            Unary::Sqrt => self.push(Operation::Sqrt(a), self.joint(&[a])),
            Unary::Exp => {
                let euler_a = self.euler(a);
                self.push(Operation::Exp { a, euler_a }, self.joint(&[a]))
            }
            Unary::Log => self.primitive(HeadFunction::Log, a, a),
            Unary::Sin => self.circular(a),
            Unary::Cos => self.circular(a) + 1,
            Unary::Tan => {
                let sine = self.circular(a);
                self.div(sine, sine + 1)
            }
            Unary::Asin => {
                let w = self.cathetus(a);
                self.primitive(HeadFunction::Asin, a, w)
            }
            Unary::Acos => {
                let w = self.cathetus(a);
                let w = self.neg(w);
                self.primitive(HeadFunction::Acos, a, w)
            }
            Unary::Atan => {
                let square = self.square(a);
                let one = self.constant(Dd::from(1.0));
                let w = self.add(one, square);
                self.primitive(HeadFunction::Atan, a, w)
            }
            Unary::Sinh => self.hyperbolic(a),
            Unary::Cosh => self.hyperbolic(a) + 1,
            Unary::Tanh => {
                let sinh = self.hyperbolic(a);
                self.div(sinh, sinh + 1)
            }
            Unary::Abs => self.push(Operation::SignTimes { a, b: a }, self.joint(&[a])),
            Unary::Sign => self.push(Operation::Sign(a), Support::Head),
        }
    }

    /// `√(1 − a²)`.
    fn cathetus(&mut self, a: Slot) -> Slot {
        let square = self.square(a);
        let one = self.constant(Dd::from(1.0));
        let difference = self.sub(one, square);
        self.push(Operation::Sqrt(difference), self.joint(&[difference]))
    }

    fn primitive(&mut self, function: HeadFunction, a: Slot, w: Slot) -> Slot {
        let euler_u = self.operations.len() + 1;
        let u = self.push(Operation::Primitive { function, a, w, euler_u }, self.joint(&[a]));
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    /// The sine; the cosine is the slot after it.
    fn circular(&mut self, a: Slot) -> Slot {
        if self.support[a] == Support::Linear {
            return self.circular_of_phase(a);
        }
        let euler_a = self.euler(a);
        self.shared(SharedKey::Circular(a), |this| {
            let (sine, support) = (this.operations.len(), this.joint(&[a]));
            this.push(Operation::Sine { a, euler_a, cosine: sine + 1 }, support);
            this.push(Operation::Cosine { a, euler_a, sine }, support);
            sine
        })
    }

    /// The sine of a slot linear in time; the cosine is the slot after it.
    fn circular_of_phase(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::Circular(a), |this| {
            let sine = this.operations.len();
            this.push(
                Operation::OfPhase { function: HeadFunction::Sin, a, partner: sine + 1 },
                Support::Full,
            );
            this.push(
                Operation::OfPhase { function: HeadFunction::Cos, a, partner: sine },
                Support::Full,
            );
            sine
        })
    }

    /// Products of the sine and the cosine of one phase `a`, linear in `sin 2a` and `cos 2a`, which
    /// need no convolution.
    pub(super) fn product_of_phase(&mut self, left: Slot, right: Slot) -> Option<Slot> {
        let of_phase = |slot: Slot| match self.operations[slot] {
            Operation::OfPhase { function, a, .. } => Some((function, a)),
            _ => None,
        };
        let ((first, a), (second, b)) = (of_phase(left)?, of_phase(right)?);
        if a != b {
            return None;
        }
        let two = self.constant(Dd::from(2.0));
        let twice = self.shared(SharedKey::Twice(a), |this| this.mul(two, a));
        let sine = self.circular_of_phase(twice);
        if first != second {
            let half = self.constant(Dd::from(0.5));
            return Some(self.mul(half, sine));
        }
        let sign = if first == HeadFunction::Cos { 1.0 } else { -1.0 };
        let (half, signed) = (self.constant(Dd::from(0.5)), self.constant(Dd::from(0.5 * sign)));
        let wave = self.mul(signed, sine + 1);
        Some(self.add(half, wave))
    }

    /// The hyperbolic sine; the cosine is the slot after it.
    fn hyperbolic(&mut self, a: Slot) -> Slot {
        let euler_a = self.euler(a);
        self.shared(SharedKey::Hyperbolic(a), |this| {
            let (sinh, support) = (this.operations.len(), this.joint(&[a]));
            this.push(Operation::Sinh { a, euler_a, cosh: sinh + 1 }, support);
            this.push(Operation::Cosh { a, euler_a, sinh }, support);
            sinh
        })
    }

    pub(super) fn atan2(&mut self, y: Slot, x: Slot) -> Slot {
        let (euler_y, euler_x) = (self.euler(y), self.euler(x));
        let (y_square, x_square) = (self.square(y), self.square(x));
        let w = self.add(y_square, x_square);
        let euler_u = self.operations.len() + 1;
        let u =
            self.push(Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u }, self.joint(&[y, x]));
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    /// `min` and `max` from `(a + b)/2` and `|a − b|/2`.
    pub(super) fn select(
        &mut self,
        a: Slot,
        b: Slot,
        combine: impl FnOnce(&mut Self, Slot, Slot) -> Slot,
    ) -> Slot {
        let half = self.constant(Dd::from(0.5));
        let (sum, gap) = (self.add(a, b), self.sub(a, b));
        let (mean, half_gap) = (self.mul(sum, half), self.mul(gap, half));
        let size = self.unary(Unary::Abs, half_gap);
        combine(self, mean, size)
    }
}
