//! The field of a state that stays on a rigid surface, built as expressions.
//!
//! A reset `g` is the identity where the surface is met with no speed, so on `h = 0`
//! `g(x) − x = h' b + O(h'²)`: `b` is the direction of the contact's impulse. It follows by
//! differentiating along a coordinate `x_j` that moves `h'` and not `h`,
//!
//! ```text
//! b = ∂_j (g − x) / ∂_j h',      f_stick = f + λ b,      λ = − h'' / (∇h' · b),
//! ```
//!
//! where `λ` keeps `h''` along the stick field at zero. See docs/mathematics/direct-simulation.md.

use crate::model::{ExpressionGraph, Model, NodeId, Surface};
use crate::numeric::Dd;

/// The stick field of a rigid surface; `None` where no coordinate moves `h'` without moving `h`, or
/// the reset's impulse does not act on `h'`.
pub(crate) fn stick_field(
    graph: &mut ExpressionGraph,
    model: &Model,
    surface: &Surface,
    reset: &[NodeId],
) -> Option<Vec<NodeId>> {
    let dimension = model.dimension();
    let slopes: Vec<_> = (0..dimension)
        .map(|j| graph.derivative(surface.normal_velocity, j))
        .collect();
    let coordinate = (0..dimension).find(|&j| {
        let moves_gap = graph.derivative(surface.event, j);
        !is_zero(graph, slopes[j]) && is_zero(graph, moves_gap)
    })?;
    let direction: Vec<_> = (0..dimension)
        .map(|i| {
            let state = graph.input(i);
            let kick = graph.sub(reset[i], state);
            let kick = graph.derivative(kick, coordinate);
            graph.div(kick, slopes[coordinate])
        })
        .collect();
    let mut action = graph.number(0.0);
    for (&slope, &b) in slopes.iter().zip(&direction) {
        let term = graph.mul(slope, b);
        action = graph.add(action, term);
    }
    if is_zero(graph, action) {
        return None;
    }
    let ratio = graph.div(surface.normal_acceleration, action);
    let field = model.flow.iter().zip(&direction).map(|(&free, &b)| {
        let push = graph.mul(ratio, b);
        graph.sub(free, push)
    });
    Some(field.collect())
}

fn is_zero(graph: &ExpressionGraph, node: NodeId) -> bool {
    graph.constant_value(node) == Some(Dd::ZERO)
}
