//! Identities of functions, as properties of random jets over every scalar.

use std::sync::Arc;

use grazemap::jet::{Jet, JetSpace};
use grazemap::numeric::{Dd, Lanes, Scalar};
use proptest::prelude::*;

/// Coefficients a jet is drawn from; enough for every space below.
const DRAWN: usize = 64;

/// Spaces the identities are checked in: uniform, weighted, one variable, only constants.
pub(crate) fn spaces() -> Vec<Arc<JetSpace>> {
    [(vec![1, 1, 1], 4), (vec![1, 2, 2], 7), (vec![3, 1], 8), (vec![1], 9), (vec![5], 4)]
        .map(|(weights, order)| JetSpace::new(&weights, order).expect("a small space"))
        .to_vec()
}

/// A jet with a given head and the drawn coefficients, equal in all lanes.
pub(crate) fn jet<S: Scalar>(space: &Arc<JetSpace>, head: f64, drawn: &[f64]) -> Jet<S> {
    let mut coefficients: Vec<S> =
        drawn.iter().cycle().take(space.len()).map(|&value| S::from_f64(value)).collect();
    coefficients[0] = S::from_f64(head);
    Jet::from_coefficients(space, coefficients)
}

pub(crate) fn drawn() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-0.5..0.5f64, DRAWN)
}

/// Whether two jets agree to rounding of the largest coefficient met on the way.
///
/// Coefficients are sums of at most some hundred products of coefficients no larger than `scale`.
pub(crate) fn agree<S: Scalar>(left: &Jet<S>, right: &Jet<S>, scale: f64) -> bool {
    (left - right).max_abs() <= 256.0 * S::ROUNDOFF * scale.max(1.0)
}

/// `left == right`, computed through the jets of `through`.
fn same<S: Scalar>(name: &str, left: &Jet<S>, right: &Jet<S>, through: &[&Jet<S>]) {
    let product: f64 = through.iter().map(|jet| jet.max_abs().max(1.0)).product();
    let scale = product * left.max_abs().max(right.max_abs()).max(1.0);
    assert!(agree(left, right, scale), "{name}: {:e}, scale {scale:e}", (left - right).max_abs());
}

fn circular<S: Scalar>(a: &Jet<S>, b: &Jet<S>) {
    let one = Jet::constant(a.space(), S::one());
    let (sine, cosine) = a.sin_cos();
    same("sin² + cos² = 1", &(&(&sine * &sine) + &(&cosine * &cosine)), &one, &[&sine, &cosine]);
    same("asin sin a = a", &sine.asin(), a, &[&sine, &(&one / &cosine)]);
    same("acos cos a = a", &cosine.acos(), a, &[&cosine, &(&one / &sine)]);
    same("atan tan a = a", &a.tan().atan(), a, &[&a.tan(), &(&one / &cosine)]);
    same("atan2(a, b) = atan(a / b)", &a.atan2(b), &(a / b).atan(), &[&(a / b), &(&one / b)]);
    same(
        "atan2(cb, sb) = π/2 − a",
        &(&cosine * b).atan2(&(&sine * b)),
        &(-a).add_constant(half_turn()),
        &[b, &(&one / b)],
    );
}

fn half_turn<S: Scalar>() -> S {
    S::from_dd(Dd::FRAC_PI_2)
}

fn hyperbolic<S: Scalar>(a: &Jet<S>) {
    let one = Jet::constant(a.space(), S::one());
    let (sinh, cosh) = a.sinh_cosh();
    same("cosh² − sinh² = 1", &(&(&cosh * &cosh) - &(&sinh * &sinh)), &one, &[&cosh, &cosh]);
    same("cosh + sinh = exp", &(&cosh + &sinh), &a.exp(), &[&cosh]);
    same("tanh cosh = sinh", &(&a.tanh() * &cosh), &sinh, &[&cosh, &a.tanh()]);
}

fn algebraic<S: Scalar>(a: &Jet<S>, b: &Jet<S>) {
    let inverse = b.power_integer(-1);
    let (root, log) = (a.sqrt(), a.ln());
    same("(a / b) b = a", &(&(a / b) * b), a, &[b, &inverse]);
    same("√a √a = a", &(&root * &root), a, &[&root, &root]);
    same("exp ln a = a", &log.exp(), a, &[&log]);
    same("ln exp a = a", &a.exp().ln(), a, &[&a.exp(), &(-a).exp()]);
    let exponent = S::from_f64(1.75);
    same("a^r = exp(r ln a)", &a.power_real(exponent), &log.scale(exponent).exp(), &[&log, a]);
    same(
        "a^-3 both ways",
        &a.power_integer(-3),
        &a.power_real(S::from_f64(-3.0)),
        &[&a.power_integer(-3)],
    );
    same("a^0.5 = √a", &a.power_real(S::from_f64(0.5)), &root, &[&log]);
}

fn differential<S: Scalar>(a: &Jet<S>, b: &Jet<S>) {
    for variable in 0..a.space().variables() {
        let weight = a.space().weights()[variable] as usize;
        let Some(kept) = a.space().order().checked_sub(weight) else {
            continue;
        };
        let leibniz = &(&a.derivative(variable) * b) + &(a * &b.derivative(variable));
        same(
            "(ab)' = a'b + ab'",
            &(a * b).derivative(variable).truncate(kept),
            &leibniz.truncate(kept),
            &[a, b],
        );
        same("(∫a)' = a", &a.integral(variable).derivative(variable), &a.truncate(kept), &[a]);
    }
}

fn all<S: Scalar>(head: f64, a: &[f64], b: &[f64]) {
    for space in spaces() {
        let (a, b) = (jet::<S>(&space, head, a), jet::<S>(&space, 1.0 + head, b));
        circular(&a, &b);
        hyperbolic(&a);
        algebraic(&a, &b);
        differential(&a, &b);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn identities_hold_for_doubles(head in 0.4..1.2f64, a in drawn(), b in drawn()) {
        all::<f64>(head, &a, &b);
    }

    #[test]
    fn identities_hold_for_double_doubles(head in 0.4..1.2f64, a in drawn(), b in drawn()) {
        all::<Dd>(head, &a, &b);
    }

    #[test]
    fn identities_hold_for_lanes(head in 0.4..1.2f64, a in drawn(), b in drawn()) {
        all::<Lanes<4>>(head, &a, &b);
    }

    #[test]
    fn every_lane_of_a_product_is_the_product_of_that_lane(a in drawn(), b in drawn()) {
        let space = JetSpace::new(&[1, 2, 2], 7).unwrap();
        let scalar = |lane: usize, drawn: &[f64]| jet::<f64>(&space, 1.0, &drawn[lane..]);
        let lanes = |drawn: &[f64]| {
            let jets = [0, 1, 2, 3].map(|lane| scalar(lane, drawn));
            let lane = |m: usize| Lanes::<4>::from_fn(|lane| jets[lane].coefficients()[m]);
            Jet::from_coefficients(&space, (0..space.len()).map(lane).collect())
        };
        let product = &lanes(&a) * &lanes(&b);
        for lane in 0..4 {
            let expected = &scalar(lane, &a) * &scalar(lane, &b);
            prop_assert!(agree(&product.map_scalars(|value| value[lane]), &expected, 1.0));
        }
    }

    #[test]
    fn gradients_are_values_of_derivatives(a in drawn(), point in prop::array::uniform3(-0.5..0.5f64)) {
        let space = JetSpace::new(&[1, 2, 2], 7).unwrap();
        let a = jet::<f64>(&space, 0.3, &a);
        let mut gradient = [0.0; 3];
        let value = a.evaluate_with_gradient(&point, &mut gradient);
        prop_assert!((value - a.evaluate(&point)).abs() < 1e-15);
        for (variable, slope) in gradient.iter().enumerate() {
            prop_assert!((slope - a.derivative(variable).evaluate(&point)).abs() < 1e-14);
        }
    }
}
