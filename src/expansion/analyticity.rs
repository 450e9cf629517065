//! Whether expressions are analytic at a point: away from corners and branch points.
//!
//! One idea: every operation of the expression graph is analytic wherever its value and the
//! derivatives of its own function are finite, so it is enough to look at the arguments of the few
//! that have a corner (`abs`, `sign`, `min`, `max`) or a branch point (`sqrt`, `log`, powers that
//! are not whole, quotients).

use crate::model::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::Dd;

/// An operation that is not analytic at the point asked.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Corner {
    /// The function, with its exponent for a power.
    pub(super) function: String,
    /// Its argument.
    pub(super) argument: f64,
}

/// Arguments nearer to a corner than this, relative to what they are computed from, lie on it.
const ON_THE_CORNER: f64 = 1e-13;

/// The first operation under `outputs` that is not analytic at `inputs` (full state, then
/// parameters).
pub(super) fn corner_under(
    graph: &ExpressionGraph,
    outputs: &[NodeId],
    inputs: &[Dd],
) -> Option<Corner> {
    let mut values = Vec::new();
    graph.evaluate(inputs, &mut values);
    let scale = inputs.iter().fold(1.0_f64, |m, v| m.max(v.to_f64().abs()));
    let needed = needed_by(graph, outputs);
    let operations = graph.nodes().iter().zip(needed);
    operations
        .filter(|(_, needed)| *needed)
        .find_map(|(node, _)| corner_of(node, &values, scale * ON_THE_CORNER))
}

/// Which nodes the outputs are computed from.
fn needed_by(graph: &ExpressionGraph, outputs: &[NodeId]) -> Vec<bool> {
    let mut needed = vec![false; graph.nodes().len()];
    for output in outputs {
        needed[output.index()] = true;
    }
    for index in (0..needed.len()).rev() {
        if needed[index] {
            for operand in graph.nodes()[index].operands() {
                needed[operand.index()] = true;
            }
        }
    }
    needed
}

/// The operation as a corner, if its argument lies on one within `near`, or beyond its domain.
fn corner_of(node: &Node, values: &[Dd], near: f64) -> Option<Corner> {
    let value = |id: NodeId| values[id.index()].to_f64();
    let (function, argument, distance) = match *node {
        Node::Unary(Unary::Abs, a) => ("abs".to_owned(), value(a), value(a).abs()),
        Node::Unary(Unary::Sign, a) => ("sign".to_owned(), value(a), value(a).abs()),
        Node::Unary(Unary::Sqrt, a) => ("sqrt".to_owned(), value(a), value(a)),
        Node::Unary(Unary::Log, a) => ("log".to_owned(), value(a), value(a)),
        Node::Unary(Unary::Asin, a) => ("asin".to_owned(), value(a), 1.0 - value(a).abs()),
        Node::Unary(Unary::Acos, a) => ("acos".to_owned(), value(a), 1.0 - value(a).abs()),
        Node::Binary(Binary::Min, a, b) => {
            let difference = value(a) - value(b);
            ("min".to_owned(), difference, difference.abs())
        }
        Node::Binary(Binary::Max, a, b) => {
            let difference = value(a) - value(b);
            ("max".to_owned(), difference, difference.abs())
        }
        Node::Binary(Binary::Div, _, b) => ("the reciprocal".to_owned(), value(b), value(b).abs()),
        Node::PowerInteger(a, exponent) if exponent < 0 => {
            (format!("power {exponent}"), value(a), value(a).abs())
        }
        Node::PowerReal(a, exponent) => {
            (format!("power {}", exponent.to_f64()), value(a), value(a))
        }
        _ => return None,
    };
    // NOTE: a distance that is not a number is no safe distance.
    let on_it = distance <= near || distance.is_nan();
    on_it.then_some(Corner { function, argument })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(build: impl Fn(&mut ExpressionGraph, NodeId) -> NodeId, at: f64) -> Option<String> {
        let mut graph = ExpressionGraph::new();
        let x = graph.input(0);
        let output = build(&mut graph, x);
        corner_under(&graph, &[output], &[Dd::from(at)]).map(|corner| corner.function)
    }

    #[test]
    fn corners_are_named_only_where_they_are() {
        let abs = |graph: &mut ExpressionGraph, x| graph.unary(Unary::Abs, x);
        assert_eq!(corner(abs, 0.0).as_deref(), Some("abs"));
        assert_eq!(corner(abs, 0.5), None);
        let square = |graph: &mut ExpressionGraph, x| graph.mul(x, x);
        assert_eq!(corner(square, 0.0), None);
    }

    #[test]
    fn branch_points_and_what_lies_beyond_them_are_named() {
        let root = |graph: &mut ExpressionGraph, x| graph.unary(Unary::Sqrt, x);
        assert_eq!(corner(root, 0.0).as_deref(), Some("sqrt"));
        assert_eq!(corner(root, -1.0).as_deref(), Some("sqrt"));
        assert_eq!(corner(root, 1.0), None);
    }
}
