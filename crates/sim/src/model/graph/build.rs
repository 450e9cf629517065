//! Constructors of an [`ExpressionGraph`]: hash-consing and exact simplification.

use num_traits::{One, Zero};

use super::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::{Dd, Scalar};

impl ExpressionGraph {
    /// A number.
    pub fn constant(&mut self, value: Dd) -> NodeId {
        let value = if value == Dd::zero() { Dd::zero() } else { value };
        self.insert(Node::Constant(value))
    }

    /// A number given as an `f64`.
    pub fn number(&mut self, value: f64) -> NodeId {
        self.constant(Dd::from_f64(value))
    }

    /// Input number `input`: the full state first, then the parameters.
    pub fn input(&mut self, input: usize) -> NodeId {
        self.insert(Node::Input(input))
    }

    /// `-a`.
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            Node::Constant(value) => self.constant(-value),
            Node::Neg(inner) => inner,
            Node::Binary(Binary::Sub, left, right) => self.sub(right, left),
            _ => self.insert(Node::Neg(a)),
        }
    }

    /// `a + b`.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.node(a), self.node(b)) {
            (Node::Constant(value), _) if value == Dd::zero() => b,
            (_, Node::Constant(value)) if value == Dd::zero() => a,
            (_, Node::Neg(inner)) => self.sub(a, inner),
            (Node::Neg(inner), _) => self.sub(b, inner),
            _ => self.fold_or_insert(Node::Binary(Binary::Add, a.min(b), a.max(b))),
        }
    }

    /// `a - b`.
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.number(0.0);
        }
        match (self.node(a), self.node(b)) {
            (_, Node::Constant(value)) if value == Dd::zero() => a,
            (Node::Constant(value), _) if value == Dd::zero() => self.neg(b),
            (_, Node::Neg(inner)) => self.add(a, inner),
            _ => self.fold_or_insert(Node::Binary(Binary::Sub, a, b)),
        }
    }

    /// `a b`.
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.power_integer(a, 2);
        }
        match (self.node(a), self.node(b)) {
            (Node::Constant(_), Node::Constant(_)) => {
                self.fold_or_insert(Node::Binary(Binary::Mul, a.min(b), a.max(b)))
            }
            (Node::Constant(value), _) if value == Dd::zero() => a,
            (_, Node::Constant(value)) if value == Dd::zero() => b,
            (Node::Constant(value), _) if value == Dd::one() => b,
            (_, Node::Constant(value)) if value == Dd::one() => a,
            (Node::Constant(value), _) if value == -Dd::one() => self.neg(b),
            (_, Node::Constant(value)) if value == -Dd::one() => self.neg(a),
            (Node::Neg(inner), _) => {
                let product = self.mul(inner, b);
                self.neg(product)
            }
            (_, Node::Neg(inner)) => {
                let product = self.mul(a, inner);
                self.neg(product)
            }
            _ => self.insert(Node::Binary(Binary::Mul, a.min(b), a.max(b))),
        }
    }

    /// `a / b`.
    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.node(a), self.node(b)) {
            (_, Node::Constant(value)) if value == Dd::one() => a,
            (_, Node::Constant(value)) if value == -Dd::one() => self.neg(a),
            (Node::Constant(value), divisor) if value == Dd::zero() && !is_zero(divisor) => a,
            _ => self.fold_or_insert(Node::Binary(Binary::Div, a, b)),
        }
    }

    /// `aⁿ` for an integer `n` of any sign.
    pub fn power_integer(&mut self, a: NodeId, exponent: i32) -> NodeId {
        match (exponent, self.node(a)) {
            (0, _) => self.number(1.0),
            (1, _) => a,
            (_, Node::Neg(inner)) => {
                let power = self.power_integer(inner, exponent);
                if exponent % 2 == 0 { power } else { self.neg(power) }
            }
            (_, Node::PowerInteger(inner, first)) if first.checked_mul(exponent).is_some() => {
                self.power_integer(inner, first * exponent)
            }
            _ => self.fold_or_insert(Node::PowerInteger(a, exponent)),
        }
    }

    /// `a^c` for a real constant `c`; where `c` is an integer this is
    /// [`power_integer`](Self::power_integer), where it is one half, a square root.
    pub fn power_real(&mut self, a: NodeId, exponent: Dd) -> NodeId {
        if let Some(integer) = as_integer(exponent) {
            self.power_integer(a, integer)
        } else if exponent == Dd::from_f64(0.5) {
            self.unary(Unary::Sqrt, a)
        } else {
            self.fold_or_insert(Node::PowerReal(a, exponent))
        }
    }

    /// `a^b`: an integer power, a real constant power, or `exp(b log a)`.
    pub fn power(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if let Some(exponent) = self.constant_value(b) {
            return self.power_real(a, exponent);
        }
        let logarithm = self.unary(Unary::Log, a);
        let product = self.mul(b, logarithm);
        self.unary(Unary::Exp, product)
    }

    /// A function of one argument.
    pub fn unary(&mut self, function: Unary, a: NodeId) -> NodeId {
        self.fold_or_insert(Node::Unary(function, a))
    }

    /// A function of two arguments.
    pub fn binary(&mut self, function: Binary, a: NodeId, b: NodeId) -> NodeId {
        match function {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            Binary::Div => self.div(a, b),
            Binary::Min | Binary::Max if a == b => a,
            Binary::Atan2 | Binary::Min | Binary::Max => {
                self.fold_or_insert(Node::Binary(function, a, b))
            }
        }
    }

    /// The node of an operation: a constant where its operands are and the value is finite.
    fn fold_or_insert(&mut self, node: Node) -> NodeId {
        match self.folded(&node) {
            Some(value) => self.constant(value),
            None => self.insert(node),
        }
    }

    /// The finite value of an operation on constants.
    fn folded(&self, node: &Node) -> Option<Dd> {
        let mut operands = [Dd::zero(); 2];
        for (slot, operand) in operands.iter_mut().zip(node.operands()) {
            *slot = self.constant_value(operand)?;
        }
        let value = match *node {
            Node::Neg(_) => -operands[0],
            Node::PowerInteger(_, exponent) => super::power(operands[0], exponent),
            Node::PowerReal(_, exponent) => operands[0].powf(exponent),
            Node::Unary(function, _) => super::unary(function, operands[0]),
            Node::Binary(function, _, _) => super::binary(function, operands[0], operands[1]),
            Node::Constant(_) | Node::Input(_) => return None,
        };
        value.is_finite().then_some(value)
    }

    /// The node of an operation, entered once.
    fn insert(&mut self, node: Node) -> NodeId {
        let nodes = &mut self.nodes;
        *self.known.entry(key(&node)).or_insert_with(|| {
            let id = NodeId(
                u32::try_from(nodes.len()).expect("fewer than 2^32 operations fit in memory"),
            );
            nodes.push(node);
            id
        })
    }
}

/// Whether an operation is the constant zero.
fn is_zero(node: Node) -> bool {
    matches!(node, Node::Constant(value) if value == Dd::zero())
}

/// The integer a constant is, if it is one that fits.
fn as_integer(value: Dd) -> Option<i32> {
    let limit = f64::from(i32::MAX);
    let integer = value.lo == 0.0 && value.hi.fract() == 0.0 && value.hi.abs() <= limit;
    integer.then_some(value.hi as i32)
}

/// Three words that are equal exactly for equal operations.
fn key(node: &Node) -> [u64; 3] {
    let pair = |tag: u64, a: NodeId, b: u64| [tag, u64::from(a.0), b];
    match *node {
        Node::Constant(value) => [0, value.hi.to_bits(), value.lo.to_bits()],
        Node::Input(input) => [1, input as u64, 0],
        Node::Neg(a) => pair(2, a, 0),
        Node::PowerInteger(a, exponent) => pair(3, a, i64::from(exponent) as u64),
        Node::PowerReal(a, exponent) => {
            [4 | (u64::from(a.0) << 8), exponent.hi.to_bits(), exponent.lo.to_bits()]
        }
        Node::Unary(function, a) => pair(5, a, function as u64),
        Node::Binary(function, a, b) => pair(6 | ((function as u64) << 8), a, u64::from(b.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_operations_stand_once() {
        let mut graph = ExpressionGraph::new();
        let (x, y) = (graph.input(0), graph.input(1));
        assert_eq!(graph.add(x, y), graph.add(y, x));
        assert_eq!(graph.mul(x, x), graph.power_integer(x, 2));
        assert_ne!(graph.sub(x, y), graph.sub(y, x));
        assert_ne!(graph.unary(Unary::Sin, x), graph.unary(Unary::Cos, x));
        assert_ne!(graph.binary(Binary::Min, x, y), graph.binary(Binary::Max, x, y));
    }

    #[test]
    fn exact_simplifications_leave_no_operation() {
        let mut graph = ExpressionGraph::new();
        let (x, zero, one) = (graph.input(0), graph.number(0.0), graph.number(1.0));
        assert_eq!(
            [graph.add(zero, x), graph.mul(one, x), graph.sub(x, zero), graph.div(x, one)],
            [x; 4]
        );
        assert_eq!([graph.mul(x, zero), graph.sub(x, x), graph.div(zero, x)], [zero; 3]);
        let negative = graph.neg(x);
        assert_eq!([graph.neg(negative), graph.power_integer(x, 1)], [x; 2]);
        assert_eq!(graph.power_integer(x, 0), one);
        assert_eq!(graph.nodes().len(), 4);
    }

    #[test]
    fn constants_are_folded_only_where_the_value_is_finite() {
        let mut graph = ExpressionGraph::new();
        let (three, zero) = (graph.number(3.0), graph.number(0.0));
        let root = graph.unary(Unary::Sqrt, three);
        let square = graph.mul(root, root);
        let value = graph.constant_value(square).expect("a constant");
        assert!((value - Dd::from_f64(3.0)).hi.abs() < 1e-31);
        let quotient = graph.div(three, zero);
        assert_eq!(graph.constant_value(quotient), None);
    }

    #[test]
    fn dependencies_are_the_inputs_that_remain() {
        let mut graph = ExpressionGraph::new();
        let (x, y, z) = (graph.input(4), graph.input(1), graph.input(2));
        let (product, difference) = (graph.mul(x, y), graph.sub(z, z));
        let sum = graph.add(product, difference);
        assert_eq!(graph.dependencies(sum), [1, 4]);
    }
}
