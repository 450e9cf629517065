//! The expression graph: every expression of a scene as one directed acyclic graph.
//!
//! Nodes are stored in evaluation order (an operand's index is smaller than its user's) and are
//! hash-consed, so a common subexpression stands once.

use crate::numeric::Dd;

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
    /// An input: the full state first (states, then the phase where there is one), then the parameters.
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
    /// The nodes this one is computed from.
    pub fn operands(self) -> impl Iterator<Item = NodeId> {
        let (first, second) = match self {
            Node::Constant(_) | Node::Input(_) => (None, None),
            Node::Neg(a) | Node::PowerInteger(a, _) | Node::PowerReal(a, _) | Node::Unary(_, a) => (Some(a), None),
            Node::Binary(_, a, b) => (Some(a), Some(b)),
        };
        first.into_iter().chain(second)
    }
}
