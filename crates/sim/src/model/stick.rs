//! The field of motion at rest against a rigid stop, by symbolic differentiation of its reset.

use super::graph::{ExpressionGraph, NodeId};
use super::oscillator::{Model, Response, Surface};

/// The stick field of a rigid surface, one node per component of the full state; `None` at a
/// compliant one, if no coordinate moves `h'` without moving `h`, or if the reset's impulse does
/// not act on `h'`. The graph is that of the model, with any nodes added.
///
/// A reset `g` is the identity for contact at zero speed, so that on `h = 0`
/// `g(x) − x = h' b + O(h'²)`, where `b` is the direction of the contact's impulse. Differentiation
/// along a coordinate `x_j` that moves `h'` and not `h` gives
///
/// ```text
/// b ∝ ∂_j (g − x),      f_stick = f + λ b,      λ = − h'' / (∇h' · b),
/// ```
///
/// where `λ` keeps `h''` along the stick field at zero. See docs/mathematics/direct-simulation.md.
pub fn stick_field(
    graph: &mut ExpressionGraph,
    model: &Model,
    surface: &Surface,
) -> Option<Vec<NodeId>> {
    let Response::Impact { reset } = &surface.response else { return None };
    let dimension = model.dimension();
    let slopes: Vec<_> =
        (0..dimension).map(|j| graph.derivative(surface.normal_velocity, j)).collect();
    let coordinate = (0..dimension).find(|&j| {
        let moves_gap = graph.derivative(surface.event, j);
        !graph.is_zero(slopes[j]) && graph.is_zero(moves_gap)
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
/// NOTE: if the impulse acts on one component only, its size cancels and is left out: the contact
/// force then balances the free force to the last digit, and a long rest does not drift.
fn pushes(
    graph: &mut ExpressionGraph,
    surface: &Surface,
    kicks: &[NodeId],
    slopes: &[NodeId],
) -> Option<Vec<NodeId>> {
    let kicked: Vec<_> = (0..kicks.len()).filter(|&i| !graph.is_zero(kicks[i])).collect();
    let zero = graph.number(0.0);
    let mut pushes = vec![zero; kicks.len()];
    if let [only] = kicked[..] {
        if graph.is_zero(slopes[only]) {
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
    if graph.is_zero(action) {
        return None;
    }
    let ratio = graph.div(surface.normal_acceleration, action);
    for &i in &kicked {
        pushes[i] = graph.mul(ratio, kicks[i]);
    }
    Some(pushes)
}
