//! Jet transport against closed forms, and its two methods against each other.

use std::sync::Arc;

use super::{jet_transport, jet_transport_taylor};
use crate::flow::{InputKind, samples};
use crate::jet::{Jet, JetSpace};
use crate::numeric::{Dd, Real, Scalar};

/// Largest difference of two sets of jets, over the largest coefficient of the same degree: worst degree.
fn degree_error<S: Real>(value: &[Jet<f64>], exact: &[Jet<S>]) -> f64 {
    let space = Arc::clone(value[0].space());
    let mut worst = 0.0_f64;
    for degree in 0..=space.order() {
        let (mut error, mut largest) = (0.0_f64, 0.0_f64);
        for (a, b) in value.iter().zip(exact) {
            for monomial in space.degree_range(degree) {
                let (a, b) = (a.coefficients()[monomial], b.coefficients()[monomial]);
                error = error.max((S::from_f64(a) - b).magnitude());
                largest = largest.max(b.magnitude());
            }
        }
        if largest > 0.0 {
            worst = worst.max(error / largest);
        }
    }
    worst
}

/// Jets of an electrostatic actuator in `(x, v, θ, ω, V)`.
fn electrostatic_inputs<S: Scalar>(space: &Arc<JetSpace>, zeta: f64) -> (Vec<Jet<S>>, Vec<Jet<S>>) {
    let variable = |index: usize, value: f64| Jet::variable(space, index, S::from_f64(value));
    let states = vec![variable(0, 0.3), variable(1, 0.1), variable(2, 0.4)];
    let zeta = Jet::constant(space, S::from_f64(zeta));
    (states, vec![zeta, variable(4, 0.2), variable(3, 0.6)])
}

fn electrostatic() -> crate::flow::Field {
    let zeta = InputKind::Bound(Dd::from(0.02));
    samples::electrostatic(&[zeta, InputKind::Variable, InputKind::Variable])
}

#[test]
fn collocation_and_taylor_agree_on_the_electrostatic_period_in_every_degree() {
    let space = JetSpace::uniform(5, 4).unwrap();
    let field = electrostatic();
    let duration = std::f64::consts::PI / 0.6;
    let (states, parameters) = electrostatic_inputs::<f64>(&space, 0.02);
    let collocation = jet_transport(&field, &states, &parameters, duration, 1e-15).unwrap();
    let (states, parameters) = electrostatic_inputs::<f64>(&space, 0.02);
    let taylor = jet_transport_taylor(&field, &states, &parameters, duration).unwrap();
    let error = degree_error(&collocation.image, &taylor);
    assert!(
        error < 1e-14,
        "{error:e}, {} elements, {:e}",
        collocation.elements,
        collocation.error_estimate
    );
}
