//! Steps of Taylor's method and of collocation over narrow features of a field: pulses, smoothed
//! square waves, high powers and bumps of a state, against integrals in closed form.

use grazemap::flow::{Field, Integrator, jet_transport, jet_transport_taylor};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::{ExpressionGraph, NodeId, Unary};
use grazemap::numeric::{Dd, Lanes, Real, Scalar};

/// `x' = f(θ), θ' = 1`.
fn integral(force: impl Fn(&mut ExpressionGraph, NodeId) -> NodeId) -> Field {
    let mut graph = ExpressionGraph::new();
    let (_, theta) = (graph.input(0), graph.input(1));
    let rate = force(&mut graph, theta);
    let one = graph.number(1.0);
    Field::new(&graph, &[rate, one], &[], &[])
}

/// `s (cos(θ − 1) − 1)`: 0 at the phase 1, and negative.
fn dip(graph: &mut ExpressionGraph, theta: NodeId, sharpness: f64) -> NodeId {
    let one = graph.number(1.0);
    let shifted = graph.sub(theta, one);
    let cosine = graph.unary(Unary::Cos, shifted);
    let lowered = graph.sub(cosine, one);
    let sharpness = graph.number(sharpness);
    graph.mul(sharpness, lowered)
}

/// Pulses of a period 2π at the phase 1, with their sharpness and their integrals over a period.
fn pulses() -> Vec<(&'static str, Field, f64, Dd)> {
    let gaussian = |sharpness: f64| {
        integral(move |graph, theta| {
            let argument = dip(graph, theta, sharpness);
            graph.unary(Unary::Exp, argument)
        })
    };
    let lorentzian = |sharpness: f64| {
        integral(move |graph, theta| {
            let (one, argument) = (graph.number(1.0), dip(graph, theta, sharpness));
            let divisor = graph.sub(one, argument);
            graph.div(one, divisor)
        })
    };
    let power = |exponent: i32| {
        integral(move |graph, theta| {
            let (one, lowered) = (graph.number(1.0), dip(graph, theta, 0.5));
            let base = graph.add(one, lowered);
            graph.power_integer(base, exponent)
        })
    };
    let square_wave = |sharpness: f64| {
        integral(move |graph, theta| {
            let (one, sine) = (graph.number(1.0), graph.unary(Unary::Sin, theta));
            let sharpness = graph.number(sharpness);
            let argument = graph.mul(sharpness, sine);
            let step = graph.unary(Unary::Tanh, argument);
            graph.add(one, step)
        })
    };
    let two_pi = Dd::TWO_PI;
    vec![
        ("Gaussian", gaussian(100.0), 1e2, two_pi * scaled_bessel(100.0)),
        ("Gaussian", gaussian(1e4), 1e4, two_pi * scaled_bessel(1e4)),
        ("Gaussian", gaussian(1e7), 1e7, two_pi * scaled_bessel(1e7)),
        ("Lorentzian", lorentzian(1e3), 1e3, two_pi / Dd::from(2001.0).sqrt()),
        ("Lorentzian", lorentzian(1e7), 1e7, two_pi / Dd::from(2e7 + 1.0).sqrt()),
        ("power", power(64), 64.0, two_pi * central_binomial(64)),
        ("power", power(1001), 1e3, two_pi * central_binomial(1001)),
        ("square wave", square_wave(50.0), 50.0, two_pi),
        ("square wave", square_wave(1e5), 1e5, two_pi),
    ]
}

/// `e^{−s} I_0(s)` by its asymptotic series, whose terms fall below `1e−33` for `s ≥ 100`.
fn scaled_bessel(s: f64) -> Dd {
    let (mut sum, mut term) = (Dd::ONE, Dd::ONE);
    for k in 1..60 {
        let odd = f64::from(2 * k - 1);
        term *= Dd::from(odd * odd) / (Dd::from(8.0 * f64::from(k)) * Dd::from(s));
        sum += term;
    }
    sum / (Dd::TWO_PI * Dd::from(s)).sqrt()
}

/// The mean of `((1 + cos θ)/2)^m` over a period: `C(2m, m)/4^m`.
fn central_binomial(exponent: u32) -> Dd {
    (1..=exponent).fold(Dd::ONE, |value, k| {
        let twice = Dd::from(2.0 * f64::from(k));
        value * (twice - Dd::ONE) / twice
    })
}

/// Error over the rounding of `s (cos − 1)`, which is the rounding of 1 times the sharpness.
fn error_in_roundings<S: Real>(found: S, exact: Dd, sharpness: f64) -> f64 {
    (found.to_dd() / exact - Dd::ONE).magnitude() / (sharpness * S::ROUNDOFF)
}

/// Most roundings of the sharpest value that an integral may be off.
const ROUNDINGS: f64 = 30.0;

#[test]
fn integrals_over_pulses_are_those_of_their_closed_forms_forward_and_backward() {
    for (name, field, sharpness, exact) in pulses() {
        for from in [0.0, -2.5, 2.0] {
            for sign in [1.0, -1.0] {
                let mut integrator = Integrator::<f64>::new(&field);
                let period = sign * std::f64::consts::TAU;
                let end = integrator.flow(&[0.0, from], &[], period).unwrap();
                let error = error_in_roundings(sign * end[0], exact, sharpness);
                assert!(error < ROUNDINGS, "{name} {sharpness} from {from}: {error:e}");
            }
        }
    }
}

#[test]
fn integrals_over_pulses_have_the_digits_of_double_double() {
    for (name, field, sharpness, exact) in pulses() {
        let mut integrator = Integrator::<Dd>::new(&field);
        let end = integrator.flow(&[Dd::ZERO, Dd::from(-2.5)], &[], Dd::TWO_PI).unwrap();
        let error = error_in_roundings(end[0], exact, sharpness);
        assert!(error < ROUNDINGS, "{name} {sharpness}: {error:e}");
    }
}

#[test]
fn every_lane_steps_over_a_pulse_as_one_orbit_alone() {
    for (name, field, ..) in pulses() {
        let starts = [-2.5, 0.0, 0.99, 2.0];
        let mut state = [Lanes([0.0; 4]), Lanes(starts)];
        let durations = Lanes([6.0, -5.0, 0.1, 3.0]);
        Integrator::<Lanes<4>>::new(&field).carry(&mut state, &[], durations);
        for lane in 0..4 {
            let mut alone = Integrator::<f64>::new(&field);
            let end = alone.flow(&[0.0, starts[lane]], &[], durations[lane]).unwrap();
            assert_eq!(state[0][lane].to_bits(), end[0].to_bits(), "{name} {lane}");
        }
    }
}

#[test]
fn jets_by_both_methods_carry_the_slopes_of_a_pulse() {
    let space = JetSpace::uniform(2, 2).unwrap();
    // From 1, against which the rounding of 1 + tanh is small where the square wave is 0.
    let start = [Jet::variable(&space, 0, 1.0), Jet::variable(&space, 1, -2.5)];
    for (name, field, sharpness, _) in pulses() {
        let collocation = jet_transport(&field, &start, &[], 5.0, 1e-15).unwrap().image;
        let taylor = jet_transport_taylor(&field, &start, &[], 5.0).unwrap();
        let mut numbers = Integrator::<f64>::new(&field);
        let rate = |theta: f64, numbers: &mut Integrator<'_, f64>| {
            numbers.step(&[0.0, theta], &[]).unwrap().state_coefficients(0)[1]
        };
        // By the start's phase: the rate at the end less that at the start.
        let slope = rate(2.5, &mut numbers) - rate(-2.5, &mut numbers);
        let whole = numbers.flow(&[1.0, -2.5], &[], 5.0).unwrap()[0];
        for image in [&collocation, &taylor] {
            let coefficients = image[0].coefficients();
            let error = error_in_roundings(coefficients[0], whole.to_dd(), sharpness);
            assert!(error < ROUNDINGS, "{name} {sharpness}: {error:e}");
            // The rates before and after a pulse come from a sum of its slopes, its height
            // over its width.
            let error = (coefficients[2] - slope).abs();
            assert!(error < 1e-13 * sharpness, "{name} {sharpness}: {error:e}");
        }
    }
}

#[test]
fn a_ball_on_a_narrow_bump_of_the_state_keeps_its_energy() {
    // x'' = −V'(x) with V = exp(−(x/w)²)/4: energy v²/2 + V, the bump of width 1e-3 at 0.
    let width = 1e-3;
    let mut graph = ExpressionGraph::new();
    let (x, v) = (graph.input(0), graph.input(1));
    let width_node = graph.number(width);
    let scaled = graph.div(x, width_node);
    let square = graph.power_integer(scaled, 2);
    let argument = graph.neg(square);
    let bump = graph.unary(Unary::Exp, argument);
    let factor = graph.number(0.5 / width);
    let push = graph.mul(scaled, bump);
    let push = graph.mul(factor, push);
    let field = Field::new(&graph, &[v, push], &[], &[]);
    // From afar at speed 1: 1/2 = v²/2 + exp(0)/4 at the top, v = √(1/2); beyond it 1 again.
    let mut integrator = Integrator::<f64>::new(&field);
    let end = integrator.flow(&[-1.0, 1.0], &[], 3.0).unwrap();
    assert!((end[1] - 1.0).abs() < 1e-12, "{end:?}");
    // Slower over the bump: v = √(1 − exp(−u²)/2); it arrives late by w ∫ (1/v − 1) du.
    let late = width * bump_delay();
    assert!((end[0] - (2.0 - late)).abs() < 1e-12, "{:e}", end[0] - (2.0 - late));
}

/// `∫ (1/√(1 − e^{−u²}/2) − 1) du` by the trapezoidal rule, which is exact to rounding here.
fn bump_delay() -> f64 {
    let step = 0.05;
    let value = |k: i32| {
        let u = step * f64::from(k);
        1.0 / (1.0 - 0.5 * (-u * u).exp()).sqrt() - 1.0
    };
    step * (-200..=200).map(value).sum::<f64>()
}
