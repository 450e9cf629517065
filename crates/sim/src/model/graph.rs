//! The expression graph: every expression of a scene as one directed acyclic graph.
//!
//! Nodes are stored in evaluation order (an operand's index is smaller than its user's) and are
//! hash-consed, so a common subexpression stands once.

mod build;
mod corners;
mod derivative;
mod evaluate;

pub use corners::CornerOperation;

use std::collections::HashMap;

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
        let needed = self.needed(node);
        let mut inputs: Vec<usize> = (self.nodes.iter().zip(&needed))
            .filter_map(|(operation, needed)| match operation {
                Node::Input(input) if *needed => Some(*input),
                _ => None,
            })
            .collect();
        inputs.sort_unstable();
        inputs
    }

    /// Which of the nodes up to `node` it is computed from (itself included).
    fn needed(&self, node: NodeId) -> Vec<bool> {
        let mut needed = vec![false; node.index() + 1];
        needed[node.index()] = true;
        for index in (0..=node.index()).rev() {
            if needed[index] {
                for operand in self.nodes[index].operands() {
                    needed[operand.index()] = true;
                }
            }
        }
        needed
    }
}
