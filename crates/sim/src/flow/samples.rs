//! Fields of known oscillators, for the tests of this floor.

use super::Field;
use super::program::InputKind;
use crate::model::{ExpressionGraph, Unary};
use crate::numeric::Dd;

/// Kinds of the parameters of a sample field.
pub(crate) type Parameters<'a> = &'a [InputKind];

/// `x' = v, v' = a cos θ − 2 ζ v − x, θ' = ω`; parameters `(ζ, a, ω)`, watching `x`.
pub(crate) fn linear(parameters: Parameters) -> Field {
    let mut g = ExpressionGraph::new();
    let inputs: Vec<_> = (0..6).map(|input| g.input(input)).collect();
    let [x, v, theta, zeta, amplitude, omega] = inputs[..] else { unreachable!() };
    let cosine = g.unary(Unary::Cos, theta);
    let force = g.mul(amplitude, cosine);
    let two = g.number(2.0);
    let damping = g.mul(two, zeta);
    let damping = g.mul(damping, v);
    let force = g.sub(force, damping);
    let acceleration = g.sub(force, x);
    Field::new(&g, &[v, acceleration, omega], &[x], parameters)
}

/// `x' = v, v' = V² sin² θ/(1 − x)² − 2 ζ v − x, θ' = ω`; parameters `(ζ, V, ω)`: an electrostatic
/// actuator of forcing period `π/ω`; watches the gap `1 − x`.
pub(crate) fn electrostatic(parameters: Parameters) -> Field {
    let mut g = ExpressionGraph::new();
    let inputs: Vec<_> = (0..6).map(|input| g.input(input)).collect();
    let [x, v, theta, zeta, voltage, omega] = inputs[..] else { unreachable!() };
    let sine = g.unary(Unary::Sin, theta);
    let drive = g.mul(voltage, sine);
    let one = g.number(1.0);
    let gap = g.sub(one, x);
    let ratio = g.div(drive, gap);
    let pull = g.power_integer(ratio, 2);
    let two = g.number(2.0);
    let damping = g.mul(two, zeta);
    let damping = g.mul(damping, v);
    let acceleration = g.sub(pull, damping);
    let acceleration = g.sub(acceleration, x);
    Field::new(&g, &[v, acceleration, omega], &[gap], parameters)
}

/// `x' = x²`.
pub(crate) fn quadratic() -> Field {
    let mut g = ExpressionGraph::new();
    let x = g.input(0);
    let square = g.power_integer(x, 2);
    Field::new(&g, &[square], &[], &[])
}

/// `x' = v, v' = −sin x`, watching the energy `v²/2 − cos x`.
pub(crate) fn pendulum() -> Field {
    let mut g = ExpressionGraph::new();
    let (x, v) = (g.input(0), g.input(1));
    let sine = g.unary(Unary::Sin, x);
    let acceleration = g.neg(sine);
    let square = g.power_integer(v, 2);
    let half = g.number(0.5);
    let kinetic = g.mul(half, square);
    let cosine = g.unary(Unary::Cos, x);
    let energy = g.sub(kinetic, cosine);
    Field::new(&g, &[v, acceleration], &[energy], &[])
}

/// Kepler's problem in the plane, `(x, y, u, v)`, with unit attraction.
pub(crate) fn kepler() -> Field {
    let mut g = ExpressionGraph::new();
    let inputs: Vec<_> = (0..4).map(|input| g.input(input)).collect();
    let [x, y, u, v] = inputs[..] else { unreachable!() };
    let (xx, yy) = (g.power_integer(x, 2), g.power_integer(y, 2));
    let square = g.add(xx, yy);
    let inverse_cube = g.power_real(square, Dd::from(-1.5));
    let (ax, ay) = (g.mul(x, inverse_cube), g.mul(y, inverse_cube));
    let (ax, ay) = (g.neg(ax), g.neg(ay));
    Field::new(&g, &[u, v, ax, ay], &[], &[])
}
