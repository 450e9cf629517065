//! The operations of an expression that have a corner.

use super::{Binary, ExpressionGraph, Node, NodeId, Unary};

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
        let needed = self.needed(node);
        let operations: Vec<Node> = (self.nodes.iter().zip(needed))
            .filter_map(|(&operation, needed)| needed.then_some(operation))
            .collect();
        let corners = operations.into_iter();
        corners
            .filter_map(|operation| self.corner_operation(operation))
            .collect()
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
