//! Electrostatic actuator on whose period other programs were measured.

use std::sync::Arc;

use grazemap::flow::{Field, InputKind};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::{ExpressionGraph, Unary};

/// `x' = v, v' = V² sin² θ/(1 − x)² − 0.04 v − x, θ' = ω`; parameters `(V, ω)`.
pub(crate) fn electrostatic() -> Field {
    let mut g = ExpressionGraph::new();
    let [x, v, theta, voltage, omega] = std::array::from_fn(|input| g.input(input));
    let sine = g.unary(Unary::Sin, theta);
    let drive = g.mul(voltage, sine);
    let one = g.number(1.0);
    let gap = g.sub(one, x);
    let ratio = g.div(drive, gap);
    let pull = g.power_integer(ratio, 2);
    let damping = g.number(0.04);
    let damping = g.mul(damping, v);
    let acceleration = g.sub(pull, damping);
    let acceleration = g.sub(acceleration, x);
    Field::new(&g, &[v, acceleration, omega], &[], &[InputKind::Variable; 2])
}

/// State and parameters at the start.
pub(crate) const POINT: [f64; 5] = [0.3, 0.1, 0.4, 0.2, 0.6];

/// The states, and then the parameters, as variables of a space.
pub(crate) fn jets(space: &Arc<JetSpace>) -> (Vec<Jet<f64>>, Vec<Jet<f64>>) {
    let jet = |variable: usize| Jet::variable(space, variable, POINT[variable]);
    ((0..3).map(jet).collect(), (3..5).map(jet).collect())
}
