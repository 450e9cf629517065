//! Lowering of the nodes of an expression graph to operations.
//!
//! One idea: for every slot the lowering knows whether it is a number, constant, linear in time or
//! general, so that numbers are folded and the cheapest recurrence is chosen.

use std::collections::HashMap;

use super::InputKind;
use super::operation::{Operation, Slot};
use crate::jet::HeadFunction;
use crate::model::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::Dd;

/// Degrees in which a slot can be nonzero, known at lowering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Support {
    Number(Dd),
    Head,
    Linear,
    Full,
}

impl Support {
    /// Whether a part of a degree can be nonzero (degree 2 represents all higher ones).
    pub(super) fn reaches(self, degree: usize) -> bool {
        match self {
            Support::Number(_) | Support::Head => degree == 0,
            Support::Linear => degree <= 1,
            Support::Full => true,
        }
    }
}

/// The state of a lowering.
pub(super) struct ProgramLowering<'a> {
    graph: &'a ExpressionGraph,
    pub(super) operations: Vec<Operation>,
    pub(super) support: Vec<Support>,
    slots: Vec<Option<Slot>>,
    /// Slots of operations that several nodes share: Euler derivatives, pairs of sine and cosine,
    /// products.
    shared: HashMap<SharedKey, Slot>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum SharedKey {
    Euler(Slot),
    Circular(Slot),
    Hyperbolic(Slot),
    HyperbolicTangent(Slot),
    Logistic(Slot),
    Square(Slot),
    Twice(Slot),
    Constant(u64, u64),
}

impl<'a> ProgramLowering<'a> {
    pub(super) fn new(graph: &'a ExpressionGraph, inputs: &[InputKind]) -> Self {
        let support = |kind: &InputKind| match *kind {
            InputKind::Variable => Support::Full,
            InputKind::HeadOnly => Support::Head,
            InputKind::LinearInTime => Support::Linear,
            InputKind::Bound(value) => Support::Number(value),
        };
        Self {
            graph,
            operations: vec![Operation::Input; inputs.len()],
            support: inputs.iter().map(support).collect(),
            slots: vec![None; graph.nodes().len()],
            shared: HashMap::new(),
        }
    }

    /// Lowers the nodes on which some outputs depend.
    pub(super) fn lower_nodes(&mut self, outputs: &[NodeId]) {
        let graph = self.graph;
        for (index, needed) in graph.needed_by(outputs).into_iter().enumerate() {
            if needed {
                self.slots[index] = Some(self.lower(graph.nodes()[index]));
            }
        }
    }

    pub(super) fn slot_of(&self, node: NodeId) -> Slot {
        self.slots[node.index()].expect("operands are lowered before their users")
    }

    fn lower(&mut self, node: Node) -> Slot {
        match node {
            Node::Constant(value) => self.constant(value),
            Node::Input(input) => match self.support[input] {
                Support::Number(value) => self.constant(value),
                _ => input,
            },
            Node::Neg(a) => {
                let a = self.slot_of(a);
                self.neg(a)
            }
            Node::PowerInteger(a, exponent) => {
                let a = self.slot_of(a);
                self.power_integer(a, exponent)
            }
            Node::PowerReal(a, exponent) => {
                let a = self.slot_of(a);
                self.power_real(a, exponent)
            }
            Node::Unary(function, a) => {
                let a = self.slot_of(a);
                self.unary(function, a)
            }
            Node::Binary(function, a, b) => {
                let (a, b) = (self.slot_of(a), self.slot_of(b));
                self.binary(function, a, b)
            }
        }
    }

    fn push(&mut self, operation: Operation, support: Support) -> Slot {
        self.operations.push(operation);
        self.support.push(support);
        self.operations.len() - 1
    }

    fn shared(&mut self, key: SharedKey, build: impl FnOnce(&mut Self) -> Slot) -> Slot {
        if let Some(&slot) = self.shared.get(&key) {
            return slot;
        }
        let slot = build(self);
        self.shared.insert(key, slot);
        slot
    }

    fn number(&self, slot: Slot) -> Option<Dd> {
        match self.support[slot] {
            Support::Number(value) => Some(value),
            _ => None,
        }
    }

    /// Support of a function of these operands; numbers are folded before.
    fn joint(&self, operands: &[Slot]) -> Support {
        let beyond_head = operands.iter().any(|&slot| self.support[slot].reaches(1));
        if beyond_head { Support::Full } else { Support::Head }
    }

    /// Support of a sum.
    fn joint_of_sum(&self, a: Slot, b: Slot) -> Support {
        let full = [a, b].iter().any(|&slot| self.support[slot] == Support::Full);
        let linear = [a, b].iter().any(|&slot| self.support[slot] == Support::Linear);
        match (full, linear) {
            (true, _) => Support::Full,
            (false, true) => Support::Linear,
            (false, false) => Support::Head,
        }
    }

    fn constant(&mut self, value: Dd) -> Slot {
        let key = SharedKey::Constant(value.hi.to_bits(), value.lo.to_bits());
        self.shared(key, |this| this.push(Operation::Constant(value), Support::Number(value)))
    }

    fn euler(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::Euler(a), |this| this.push(Operation::Euler(a), this.joint(&[a])))
    }

    fn neg(&mut self, a: Slot) -> Slot {
        match self.number(a) {
            Some(value) => self.constant(-value),
            None => self.push(Operation::Neg(a), self.support[a]),
        }
    }

    fn binary(&mut self, function: Binary, a: Slot, b: Slot) -> Slot {
        match function {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            Binary::Div => self.div(a, b),
            Binary::Atan2 => self.atan2(a, b),
            Binary::Min => self.select(a, b, |this, mean, half_gap| this.sub(mean, half_gap)),
            Binary::Max => self.select(a, b, |this, mean, half_gap| this.add(mean, half_gap)),
        }
    }

    fn add(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a + b),
            (Some(value), None) => self.push(Operation::AddConstant(b, value), self.support[b]),
            (None, Some(value)) => self.push(Operation::AddConstant(a, value), self.support[a]),
            (None, None) => self.push(Operation::Add(a, b), self.joint_of_sum(a, b)),
        }
    }

    fn sub(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a - b),
            (None, Some(value)) => self.push(Operation::AddConstant(a, -value), self.support[a]),
            _ => self.push(Operation::Sub(a, b), self.joint_of_sum(a, b)),
        }
    }

    fn mul(&mut self, a: Slot, b: Slot) -> Slot {
        if a == b {
            return self.square(a);
        }
        if let Some(product) = self.product_of_phase(a, b) {
            return product;
        }
        match (self.support[a], self.support[b]) {
            (Support::Number(a), Support::Number(b)) => self.constant(a * b),
            (Support::Number(factor), _) => self.push(Operation::Scale(b, factor), self.support[b]),
            (_, Support::Number(factor)) => self.push(Operation::Scale(a, factor), self.support[a]),
            (Support::Head, support) => {
                self.push(Operation::MulByHead { head: a, factor: b }, support)
            }
            (support, Support::Head) => {
                self.push(Operation::MulByHead { head: b, factor: a }, support)
            }
            _ => self.push(Operation::Mul(a, b), Support::Full),
        }
    }

    fn square(&mut self, a: Slot) -> Slot {
        if let Some(value) = self.number(a) {
            return self.constant(value * value);
        }
        self.shared(SharedKey::Square(a), |this| {
            this.product_of_phase(a, a)
                .unwrap_or_else(|| this.push(Operation::Mul(a, a), this.joint(&[a])))
        })
    }

    fn div(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a / b),
            (None, Some(b)) => self.mul_by_inverse(a, b),
            _ if self.support[b] == Support::Head && self.support[a].reaches(1) => {
                let one = self.constant(Dd::from(1.0));
                let inverse = self.push(Operation::Div(one, b), Support::Head);
                self.mul(a, inverse)
            }
            _ => self.push(Operation::Div(a, b), self.joint(&[a, b])),
        }
    }

    fn mul_by_inverse(&mut self, a: Slot, divisor: Dd) -> Slot {
        let inverse = self.constant(Dd::from(1.0) / divisor);
        self.mul(a, inverse)
    }

    fn power_integer(&mut self, a: Slot, exponent: i32) -> Slot {
        let mut rest = exponent.unsigned_abs();
        let (mut square, mut result) = (a, None);
        while rest > 0 {
            if rest & 1 == 1 {
                result = Some(result.map_or(square, |result| self.mul(result, square)));
            }
            rest >>= 1;
            if rest > 0 {
                square = self.square(square);
            }
        }
        let one = self.constant(Dd::from(1.0));
        let power = result.unwrap_or(one);
        if exponent < 0 { self.div(one, power) } else { power }
    }

    fn power_real(&mut self, a: Slot, exponent: Dd) -> Slot {
        let euler_a = self.euler(a);
        let euler_u = self.operations.len() + 1;
        let u = self.push(Operation::Power { a, exponent, euler_a, euler_u }, self.joint(&[a]));
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    fn unary(&mut self, function: Unary, a: Slot) -> Slot {
        match function {
            Unary::Sqrt => self.push(Operation::Sqrt(a), self.joint(&[a])),
            Unary::Exp => {
                let euler_a = self.euler(a);
                self.push(Operation::Exp { a, euler_a }, self.joint(&[a]))
            }
            Unary::Log => self.primitive(HeadFunction::Log, [a, a], a),
            Unary::Sin => self.circular(a),
            Unary::Cos => self.circular(a) + 1,
            Unary::Tan => {
                let sine = self.circular(a);
                self.div(sine, sine + 1)
            }
            Unary::Asin => {
                let w = self.cathetus(a);
                self.primitive(HeadFunction::Asin, [a, a], w)
            }
            Unary::Acos => {
                let w = self.cathetus(a);
                let w = self.neg(w);
                self.primitive(HeadFunction::Acos, [a, a], w)
            }
            Unary::Atan => {
                let one = self.constant(Dd::from(1.0));
                let factor = self.balance(a, one);
                let shrunk = self.mul(factor, a);
                let (square, one) = (self.square(shrunk), self.square(factor));
                let (b, w) = (self.mul(factor, shrunk), self.add(one, square));
                self.primitive(HeadFunction::Atan, [a, b], w)
            }
            Unary::Sinh => self.hyperbolic(a),
            Unary::Cosh => self.hyperbolic(a) + 1,
            Unary::Tanh => self.hyperbolic_tangent(a),
            Unary::Sech => self.sech(a),
            Unary::Logistic => self.logistic(a),
            Unary::Softplus => {
                let partner = self.logistic(a);
                self.with_partner(HeadFunction::Softplus, a, partner)
            }
            Unary::LogCosh => {
                let partner = self.hyperbolic_tangent(a);
                self.with_partner(HeadFunction::LogCosh, a, partner)
            }
            Unary::Abs => self.push(Operation::SignTimes { a, b: a }, self.joint(&[a])),
            Unary::Sign => self.push(Operation::Sign(a), Support::Head),
        }
    }

    /// `√(1 − a²)`, as `√((1 − a)(1 + a))`: no cancellation near `|a| = 1`.
    fn cathetus(&mut self, a: Slot) -> Slot {
        let one = self.constant(Dd::from(1.0));
        let (below, above) = (self.sub(one, a), self.add(one, a));
        let product = self.mul(below, above);
        self.push(Operation::Sqrt(product), self.joint(&[product]))
    }

    /// A number that prevents overflow and underflow of the squares of two slots.
    fn balance(&mut self, a: Slot, b: Slot) -> Slot {
        self.push(Operation::Balance(a, b), Support::Head)
    }

    fn primitive(&mut self, function: HeadFunction, [a, b]: [Slot; 2], w: Slot) -> Slot {
        let euler_u = self.operations.len() + 1;
        let u = self.push(Operation::Primitive { function, a, b, w, euler_u }, self.joint(&[a]));
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    /// The sine; the cosine is the slot after it.
    fn circular(&mut self, a: Slot) -> Slot {
        if self.support[a] == Support::Linear {
            return self.circular_of_phase(a);
        }
        self.shared(SharedKey::Circular(a), |this| {
            this.partners([HeadFunction::Sin, HeadFunction::Cos], a)
        })
    }

    /// Two functions of a slot that are each other's partners; the second is the slot after the
    /// first.
    fn partners(&mut self, functions: [HeadFunction; 2], a: Slot) -> Slot {
        let first = self.euler_before(a);
        for (function, partner) in functions.into_iter().zip([first + 1, first]) {
            self.with_partner(function, a, partner);
        }
        first
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

    /// Products of the sine and the cosine of one phase `a`: linear in `sin 2a` and `cos 2a`, which
    /// need no convolution.
    fn product_of_phase(&mut self, left: Slot, right: Slot) -> Option<Slot> {
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
        self.shared(SharedKey::Hyperbolic(a), |this| {
            this.partners([HeadFunction::Sinh, HeadFunction::Cosh], a)
        })
    }

    /// The hyperbolic tangent; its derivative `1/cosh²` is the slot after it.
    ///
    /// NOTE: not a quotient of the hyperbolic sine and cosine, because these overflow.
    fn hyperbolic_tangent(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::HyperbolicTangent(a), |this| {
            let tanh = this.euler_before(a);
            this.with_partner(HeadFunction::Tanh, a, tanh + 1);
            this.push(Operation::SechSquared { a, tanh }, this.joint(&[a]));
            tanh
        })
    }

    /// The reciprocal of the hyperbolic cosine; its product with the tangent is the slot after it.
    fn sech(&mut self, a: Slot) -> Slot {
        let tanh = self.hyperbolic_tangent(a);
        let sech = self.euler_before(a);
        self.with_partner(HeadFunction::Sech, a, sech + 1);
        self.push(Operation::Mul(sech, tanh), self.joint(&[a]));
        sech
    }

    /// The logistic function; the logistic function of the negative and the product of both are the
    /// slots after it.
    fn logistic(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::Logistic(a), |this| {
            let logistic = this.euler_before(a);
            for function in [HeadFunction::Logistic, HeadFunction::LogisticOfNegative] {
                this.with_partner(function, a, logistic + 2);
            }
            this.push(Operation::Mul(logistic, logistic + 1), this.joint(&[a]));
            logistic
        })
    }

    /// The slot after the Euler derivative of a slot.
    fn euler_before(&mut self, a: Slot) -> Slot {
        self.euler(a);
        self.operations.len()
    }

    /// A function of a slot whose derivative is the slot `partner`, or minus that.
    fn with_partner(&mut self, function: HeadFunction, a: Slot, partner: Slot) -> Slot {
        let euler_a = self.euler(a);
        self.push(Operation::Function { function, a, euler_a, partner }, self.joint(&[a]))
    }

    fn atan2(&mut self, y: Slot, x: Slot) -> Slot {
        let factor = self.balance(y, x);
        let (y, x) = (self.mul(factor, y), self.mul(factor, x));
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
    fn select(
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
