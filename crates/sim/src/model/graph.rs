//! The expression graph: every expression of a scene as one directed acyclic graph.
//!
//! Nodes are stored in evaluation order (an operand's index is smaller than its user's) and are
//! hash-consed, so a common subexpression stands once.

mod build;
mod derivative;

use std::collections::HashMap;

use crate::numeric::{Dd, Scalar};

/// Index of a node in an [`ExpressionGraph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(crate) u32);

impl NodeId {
    /// Position of the node in [`ExpressionGraph::nodes`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// Square root.
    Sqrt,
    /// Natural exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Arc sine.
    Asin,
    /// Arc cosine.
    Acos,
    /// Arc tangent.
    Atan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Absolute value; not analytic at 0.
    Abs,
    /// Sign; not analytic at 0.
    Sign,
}

/// Function of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Product.
    Mul,
    /// Quotient.
    Div,
    /// `atan2(y, x)`: angle of the point `(x, y)`.
    Atan2,
    /// Smaller of two; not analytic where they are equal.
    Min,
    /// Larger of two; not analytic where they are equal.
    Max,
}

/// One operation of the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Node {
    /// A number, exact to 32 digits (decimal literals are read in double-double).
    Constant(Dd),
    /// An input: the full state first (states, then the phase where there is one), then the
    /// parameters.
    Input(usize),
    /// Negation.
    Neg(NodeId),
    /// Integer power, any sign.
    PowerInteger(NodeId, i32),
    /// Real constant power of a positive base.
    PowerReal(NodeId, Dd),
    /// Function of one argument.
    Unary(Unary, NodeId),
    /// Function of two arguments.
    Binary(Binary, NodeId, NodeId),
}

impl Node {
    /// Operands of the operation, in order.
    pub fn operands(&self) -> impl Iterator<Item = NodeId> + use<> {
        let pair = match *self {
            Node::Constant(_) | Node::Input(_) => [None, None],
            Node::Neg(a) | Node::PowerInteger(a, _) | Node::PowerReal(a, _) | Node::Unary(_, a) => {
                [Some(a), None]
            }
            Node::Binary(_, a, b) => [Some(a), Some(b)],
        };
        pair.into_iter().flatten()
    }
}

/// Every expression of a model, as operations in evaluation order.
///
/// An operand's index is smaller than its user's, and equal operations stand once. Constructors
/// ([`add`](ExpressionGraph::add), [`unary`](ExpressionGraph::unary), ...) simplify where that is
/// exact: `0 + x`, `1 x`, `0 x`, `x - x`, `--x`, `x^1`, and operations on constants, which are done
/// in [`Dd`].
///
/// ```
/// use grazemap_sim::model::ExpressionGraph;
///
/// let mut graph = ExpressionGraph::new();
/// let x = graph.input(0);
/// let square = graph.mul(x, x);
/// let slope = graph.derivative(square, 0);
/// let mut values = Vec::new();
/// graph.evaluate(&[3.0_f64], &mut values);
/// assert_eq!(values[slope.index()], 6.0);
/// ```
#[derive(Clone, Debug, Default)]
pub struct ExpressionGraph {
    nodes: Vec<Node>,
    known: HashMap<[u64; 3], NodeId>,
    derivatives: HashMap<(NodeId, usize), NodeId>,
}

impl ExpressionGraph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// Every operation, operands before their users.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The operation of a node of this graph.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// The value of a node that is a constant.
    pub fn constant_value(&self, id: NodeId) -> Option<Dd> {
        match self.node(id) {
            Node::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// Numbers of the inputs a node depends on, increasing.
    pub fn dependencies(&self, node: NodeId) -> Vec<usize> {
        let needed = self.needed_by(&[node]);
        let mut inputs: Vec<usize> = (self.nodes.iter().zip(&needed))
            .filter_map(|(operation, needed)| match operation {
                Node::Input(input) if *needed => Some(*input),
                _ => None,
            })
            .collect();
        inputs.sort_unstable();
        inputs
    }

    /// Which nodes, up to the last of some outputs, these are computed from (themselves included).
    pub fn needed_by(&self, outputs: &[NodeId]) -> Vec<bool> {
        let last = outputs.iter().map(|output| output.index() + 1).max();
        let mut needed = vec![false; last.unwrap_or(0)];
        for output in outputs {
            needed[output.index()] = true;
        }
        for index in (0..needed.len()).rev() {
            if needed[index] {
                for operand in self.nodes[index].operands() {
                    needed[operand.index()] = true;
                }
            }
        }
        needed
    }
}

/// An operation that is not analytic where its argument is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerOperation {
    /// `abs`, `sign`, `min` or `max`.
    pub function: &'static str,
    /// Its argument; of `min` and `max` the difference of both.
    pub argument: NodeId,
}

impl ExpressionGraph {
    /// The operations with a corner that a node is computed from, operands first.
    ///
    /// ```
    /// use grazemap_sim::model::{ExpressionGraph, Unary};
    ///
    /// let mut graph = ExpressionGraph::new();
    /// let x = graph.input(0);
    /// let size = graph.unary(Unary::Abs, x);
    /// let friction = graph.mul(size, x);
    /// let corners = graph.corner_operations(friction);
    /// assert_eq!(corners.len(), 1);
    /// assert_eq!((corners[0].function, corners[0].argument), ("abs", x));
    /// ```
    pub fn corner_operations(&mut self, node: NodeId) -> Vec<CornerOperation> {
        let needed = self.needed_by(&[node]);
        let operations: Vec<Node> = (self.nodes.iter().zip(needed))
            .filter_map(|(&operation, needed)| needed.then_some(operation))
            .collect();
        let corners = operations.into_iter();
        corners.filter_map(|operation| self.corner_operation(operation)).collect()
    }

    fn corner_operation(&mut self, operation: Node) -> Option<CornerOperation> {
        let (function, argument) = match operation {
            Node::Unary(Unary::Abs, a) => ("abs", a),
            Node::Unary(Unary::Sign, a) => ("sign", a),
            Node::Binary(Binary::Min, a, b) => ("min", self.sub(a, b)),
            Node::Binary(Binary::Max, a, b) => ("max", self.sub(a, b)),
            _ => return None,
        };
        Some(CornerOperation { function, argument })
    }
}

impl ExpressionGraph {
    /// Fills `values` with the value of every node at `inputs` (full state, then parameters).
    ///
    /// Functions outside their domain give NaN, as in [`Scalar`].
    ///
    /// # Panics
    ///
    /// If `inputs` is shorter than the largest input number of the graph.
    pub fn evaluate<S: Scalar>(&self, inputs: &[S], values: &mut Vec<S>) {
        values.clear();
        values.reserve(self.nodes.len());
        for node in &self.nodes {
            let value = match *node {
                Node::Constant(value) => S::from_dd(value),
                Node::Input(input) => inputs[input],
                Node::Neg(a) => -values[a.index()],
                Node::PowerInteger(a, exponent) => power(values[a.index()], exponent),
                Node::PowerReal(a, exponent) => values[a.index()].powf(S::from_dd(exponent)),
                Node::Unary(function, a) => unary(function, values[a.index()]),
                Node::Binary(function, a, b) => {
                    binary(function, values[a.index()], values[b.index()])
                }
            };
            values.push(value);
        }
    }
}

/// `aⁿ` by repeated squaring; a negative exponent is the reciprocal of the positive one.
fn power<S: Scalar>(base: S, exponent: i32) -> S {
    let mut result = S::one();
    let mut square = base;
    let mut remaining = exponent.unsigned_abs();
    while remaining > 0 {
        if remaining & 1 == 1 {
            result *= square;
        }
        remaining >>= 1;
        if remaining > 0 {
            square = square * square;
        }
    }
    if exponent < 0 { S::one() / result } else { result }
}

/// A function of one argument.
fn unary<S: Scalar>(function: Unary, a: S) -> S {
    match function {
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Log => a.ln(),
        Unary::Sin => a.sin_cos().0,
        Unary::Cos => a.sin_cos().1,
        Unary::Tan => {
            let (sine, cosine) = a.sin_cos();
            sine / cosine
        }
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh_cosh().0,
        Unary::Cosh => a.sinh_cosh().1,
        Unary::Tanh => tanh(a),
        Unary::Abs => a.abs(),
        Unary::Sign => a.signum(),
    }
}

/// Hyperbolic tangent; the argument is limited to where it is ±1 to every digit, so that nothing
/// overflows.
fn tanh<S: Scalar>(a: S) -> S {
    let limit = S::from_dd(Dd { hi: 300.0, lo: 0.0 });
    let (sine, cosine) = a.max(-limit).min(limit).sinh_cosh();
    sine / cosine
}

/// A function of two arguments.
fn binary<S: Scalar>(function: Binary, a: S, b: S) -> S {
    match function {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Atan2 => a.atan2(b),
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
    }
}
