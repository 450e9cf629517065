//! The field of a state that stays on a rigid surface, built as expressions.
//!
//! A reset `g` is the identity where the surface is met with no speed, so on `h = 0`
//! `g(x) − x = h' b + O(h'²)`: `b` is the direction of the contact's impulse. It follows by
//! differentiating along a coordinate `x_j` that moves `h'` and not `h`,
//!
//! ```text
//! b ∝ ∂_j (g − x),      f_stick = f + λ b,      λ = − h'' / (∇h' · b),
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
    let kicks: Vec<_> = (0..dimension)
        .map(|i| {
            let state = graph.input(i);
            let kick = graph.sub(reset[i], state);
            graph.derivative(kick, coordinate)
        })
        .collect();
    let pushes = pushes(graph, surface, &kicks, &slopes)?;
    let field = model.flow.iter().zip(&pushes);
    Some(field.map(|(&free, &push)| graph.sub(free, push)).collect())
}

/// `−λ b`, per component; `None` if the impulse does not act on `h'`.
///
/// NOTE: where the impulse acts on one component, its size cancels and is left out: the contact
/// force then balances the free one to the last digit, and a long rest does not drift.
fn pushes(
    graph: &mut ExpressionGraph,
    surface: &Surface,
    kicks: &[NodeId],
    slopes: &[NodeId],
) -> Option<Vec<NodeId>> {
    let kicked: Vec<_> = (0..kicks.len())
        .filter(|&i| !is_zero(graph, kicks[i]))
        .collect();
    let zero = graph.number(0.0);
    let mut pushes = vec![zero; kicks.len()];
    if let [only] = kicked[..] {
        if is_zero(graph, slopes[only]) {
            return None;
        }
        pushes[only] = graph.div(surface.normal_acceleration, slopes[only]);
        return Some(pushes);
    }
    let mut action = zero;
    for &i in &kicked {
        let term = graph.mul(slopes[i], kicks[i]);
        action = graph.add(action, term);
    }
    if is_zero(graph, action) {
        return None;
    }
    let ratio = graph.div(surface.normal_acceleration, action);
    for &i in &kicked {
        pushes[i] = graph.mul(ratio, kicks[i]);
    }
    Some(pushes)
}

fn is_zero(graph: &ExpressionGraph, node: NodeId) -> bool {
    graph.constant_value(node) == Some(Dd::ZERO)
}
