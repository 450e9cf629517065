//! Steps of Taylor's method and of collocation over narrow features of a field: pulses, smoothed
//! square waves, high powers and bumps of a state, against integrals in closed form.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use grazemap::flow::{Field, Integrator, jet_transport, jet_transport_taylor};
use grazemap::hybrid::{EventKind, HybridSystem, Outcome, Simulator};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::{ExpressionGraph, NodeId, Unary};
use grazemap::numeric::{Dd, Lanes, Real, Scalar};

use crate::quadrature::integral as integrated;
use crate::support::scenes::{NONE, parsed};

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
    let logistic_wave = |sharpness: f64| {
        integral(move |graph, theta| {
            let (one, sine) = (graph.number(1.0), graph.unary(Unary::Sin, theta));
            let sharpness = graph.number(sharpness);
            let argument = graph.mul(sharpness, sine);
            let exponential = graph.unary(Unary::Exp, argument);
            let sum = graph.add(one, exponential);
            graph.div(one, sum)
        })
    };
    let half_power = |exponent: f64| {
        integral(move |graph, theta| {
            let (one, lowered) = (graph.number(1.0), dip(graph, theta, 0.5));
            let base = graph.add(one, lowered);
            graph.power_real(base, Dd::from(exponent))
        })
    };
    // The mean of |cos(θ/2)|^(2 n + 1) over a period is 2/π Π 2 k/(2 k + 1).
    let odd = (1..=400).fold(Dd::from(4.0), |value, k| {
        let twice = Dd::from(2.0 * f64::from(k));
        value * twice / (twice + Dd::ONE)
    });
    let two_pi = Dd::TWO_PI;
    vec![
        ("logistic wave", logistic_wave(50.0), 50.0, Dd::PI),
        ("logistic wave", logistic_wave(1e5), 1e5, Dd::PI),
        ("power of 400.5", half_power(400.5), 400.5, odd),
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

/// Error in units of the rounding of `s (cos − 1)`: the rounding of 1 times the sharpness.
fn error_in_roundings<S: Real>(found: S, exact: Dd, sharpness: f64) -> f64 {
    (found.to_dd() / exact - Dd::ONE).magnitude() / (sharpness * S::ROUNDOFF)
}

/// Largest error of an integral, in roundings of the sharpest value.
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

/// A scene with a stop, whose free flight and contact are given; the phase has the rate 1.
fn scene(flow: &str, surface: &str) -> String {
    format!(
        "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ p = 1.0 }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"1\"\nperiod = \"2*pi\"\n\
         [model.flow]\n{flow}\n[[model.surface]]\nname = \"stop\"\n{surface}\n\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
    )
}

/// State after a flight without events.
fn flown(text: &str, start: [f64; 3], time: f64) -> Vec<f64> {
    let model = parsed(text, "force", &NONE).model;
    let system = HybridSystem::new(&model);
    let mut simulator = Simulator::new(&system, &[1.0]).expect("finite parameters");
    simulator.set_state(&start).expect("a finite state");
    let trajectory = simulator.run(time).expect("a finite time");
    assert_eq!(trajectory.outcome, Outcome::Completed, "{text}");
    trajectory.state
}

/// Surface that is never met.
const FAR: &str = "event = \"1e9 - x\"\nimpact = { v = \"-v\" }";

/// Integral of a force of the phase, from a phase on, as a speed in free flight.
pub(crate) fn flown_freely(force: &str, from: f64, time: f64) -> f64 {
    let flow = format!("x = \"v\"\nv = \"p*({force})\"");
    flown(&scene(&flow, FAR), [0.0, 0.0, from], time)[1]
}

/// Integral of a force of the phase, as a speed in a contact that does not end.
pub(crate) fn flown_in_contact(force: &str, from: f64, time: f64) -> f64 {
    let surface = format!("event = \"1 - x\"\ncontact = {{ v = \"free + p*({force})\" }}");
    flown(&scene("x = \"v\"\nv = \"0\"", &surface), [1e3, 0.0, from], time)[1]
}

/// Force as a function of the phase: text, phases at which it changes rapidly, and values.
struct Force {
    text: String,
    places: Vec<f64>,
    value: Box<dyn Fn(f64) -> f64>,
}

/// Forces with features of a width proportional to `1/k` or `1/√k`.
fn forces(k: f64) -> Vec<Force> {
    let whole = |turn: f64| vec![turn, turn + PI];
    let mut forces = Vec::new();
    let mut force = |text: &str, places: &[f64], value: Box<dyn Fn(f64) -> f64>| {
        let text = text.replace('K', &format!("{k}"));
        forces.push(Force { text, places: places.to_vec(), value });
    };
    let (zeros, tops) = (whole(0.0), whole(FRAC_PI_2));
    let logistic = |s: f64| 1.0 / (1.0 + (-s).exp());
    force(
        "1/(1 + (K*sin(theta))^2)",
        &zeros,
        Box::new(move |t| 1.0 / (1.0 + (k * t.sin()).powi(2))),
    );
    force(
        "sqrt(sin(theta)^2 + 1/K^2)",
        &zeros,
        Box::new(move |t| (t.sin().powi(2) + k.powi(-2)).sqrt()),
    );
    force(
        "sin(theta)/sqrt(sin(theta)^2 + 1/K^2)",
        &zeros,
        Box::new(move |t| t.sin() / (t.sin().powi(2) + k.powi(-2)).sqrt()),
    );
    force("1/(1 + exp(-K*sin(theta)))", &zeros, Box::new(move |t| logistic(k * t.sin())));
    force("1/(exp(K*sin(theta)) + 1)^2", &zeros, Box::new(move |t| logistic(-k * t.sin()).powi(2)));
    force(
        "1/(2 + exp(-K*sin(theta)))",
        &zeros,
        Box::new(move |t| 1.0 / (2.0 + (-k * t.sin()).exp())),
    );
    force(
        "exp(K*sin(theta))/(1 + exp(K*sin(theta)))^2",
        &zeros,
        Box::new(move |t| logistic(k * t.sin()) * logistic(-k * t.sin())),
    );
    force(
        "log(1 + exp(K*sin(theta)))/K",
        &zeros,
        Box::new(move |t| t.sin().max(0.0) + (-k * t.sin().abs()).exp().ln_1p() / k),
    );
    force(
        "log(cosh(K*sin(theta)))/K",
        &zeros,
        Box::new(move |t| {
            let size = t.sin().abs();
            size + ((-2.0 * k * size).exp().ln_1p() - 2.0_f64.ln()) / k
        }),
    );
    force("1/cosh(K*sin(theta))", &zeros, Box::new(move |t| (k * t.sin()).cosh().recip()));
    force("cosh(K*sin(theta))^-2", &zeros, Box::new(move |t| (k * t.sin()).cosh().powi(-2)));
    force("atan(K*sin(theta - 1))", &whole(1.0), Box::new(move |t| (k * (t - 1.0).sin()).atan()));
    force(
        "exp(-K*(1 - cos(theta - 1)))",
        &[1.0],
        Box::new(move |t| (-2.0 * k * (0.5 * (t - 1.0)).sin().powi(2)).exp()),
    );
    force(
        "tanh(K*(cos(theta) - 0.3))",
        &[0.3_f64.acos(), -0.3_f64.acos()],
        Box::new(move |t| (k * (t.cos() - 0.3)).tanh()),
    );
    force("tanh(K*cos(theta))^3", &tops, Box::new(move |t| (k * t.cos()).tanh().powi(3)));
    force(
        "tanh(K*sin(theta))*exp(-K*(1 - cos(theta - 0.1)))",
        &[0.0, 0.1],
        Box::new(move |t| {
            (k * t.sin()).tanh() * (-2.0 * k * (0.5 * (t - 0.1)).sin().powi(2)).exp()
        }),
    );
    force(
        "tanh(K*exp(-50*(1 - cos(theta))))",
        &[0.0, (1.0 - k.ln() / 50.0).acos(), -(1.0 - k.ln() / 50.0).acos()],
        Box::new(move |t| (k * (-50.0 * (1.0 - t.cos())).exp()).tanh()),
    );
    force(
        "exp(-K*tanh(3*sin(theta))^2)",
        &zeros,
        Box::new(move |t| (-k * (3.0 * t.sin()).tanh().powi(2)).exp()),
    );
    force(
        "atan2(sin(theta), cos(theta) + 1 + 1/K)",
        &[PI],
        Box::new(move |t| t.sin().atan2(2.0 * (0.5 * t).cos().powi(2) + 1.0 / k)),
    );
    force(
        "asin((1 - 1/K)*sin(theta))",
        &tops,
        Box::new(move |t| ((1.0 - 1.0 / k) * t.sin()).asin()),
    );
    if k < 1e4 {
        let power = 2 * k as i32;
        force(&format!("cos(theta)^{power}"), &zeros, Box::new(move |t| t.cos().powi(power)));
        let power = k + 0.5;
        force(
            &format!("(0.5 + 0.5*cos(theta))^{power}"),
            &[0.0],
            Box::new(move |t| (0.5 * t).cos().abs().powf(2.0 * power)),
        );
        force(
            &format!("(3 - 2*cos(theta))^-{power}"),
            &[0.0],
            Box::new(move |t| (1.0 + 4.0 * (0.5 * t).sin().powi(2)).powf(-power)),
        );
        let tenth = (k / 10.0) as i32;
        force(
            &format!("(0.5*(1.07*cos(theta)^10))^{tenth}*{:e}", 2.0_f64.powi(tenth)),
            &zeros,
            Box::new(move |t| (1.07 * t.cos().powi(10)).powi(tenth)),
        );
    }
    forces
}

#[test]
fn integrals_over_features_of_every_kind_are_those_of_gauss_rule_in_free_flight_and_in_contact() {
    for k in [10.0, 1e3, 1e6] {
        for Force { text, places, value } in forces(k) {
            for from in [0.3, 2.9, 5.5] {
                let time = 1.5 * TAU;
                let exact = integrated(&value, [from, from + time], &places);
                let size = integrated(|t| value(t).abs(), [from, from + time], &places);
                for (name, found) in [
                    ("free", flown_freely(&text, from, time)),
                    ("contact", flown_in_contact(&text, from, time)),
                ] {
                    let error = (found - exact).abs();
                    // Rounding of the argument where the feature is, of the phase, of the sum.
                    let most = (20.0 * k * f64::EPSILON * size).min(1e-9) + 1e-13 * (1.0 + size);
                    assert!(error < most, "{text} from {from}, {name}: {error:e} of {exact}");
                }
            }
        }
    }
}

/// Forces that are flat over much of the period, as products and powers written in other ways: a
/// large factor before a power, powers of products and of sums, two powers of one base, and factors
/// whose zeros meet.
fn flat_forces() -> Vec<Force> {
    let mut forces = Vec::new();
    let eighths: Vec<f64> = (0..16).map(|k| PI * f64::from(k) / 8.0).collect();
    let mut force = |text: &str, value: fn(f64) -> f64| {
        let sixths = (0..12).map(|k| PI * f64::from(k) / 6.0);
        let places = eighths.iter().copied().chain(sixths).chain([1.0 + PI]).collect();
        forces.push(Force { text: text.into(), places, value: Box::new(value) });
    };
    force("(sin(theta)*cos(theta))^400*2^400", |t| (2.0 * t).sin().powi(400));
    force("(2*sin(theta))^300*cos(theta)^300", |t| (2.0 * t).sin().powi(300));
    force("(0.4 - 0.4*cos(theta - 1))^200.5*1.25^200.5", |t| {
        (0.5 - 0.5 * (t - 1.0).cos()).powf(200.5)
    });
    force("(1.02*cos(theta)*cos(theta + 0.2))^100", |t| {
        (1.02 * t.cos() * (t + 0.2).cos()).powi(100)
    });
    force("cos(theta)^100 + cos(theta)^1000", |t| t.cos().powi(100) + t.cos().powi(1000));
    force("cos(theta)^15*cos(3*theta)^15", |t| (t.cos() * (3.0 * t).cos()).powi(15));
    force("cos(theta)^15*cos(3*theta)^15*sin(2*theta)^14", |t| {
        (t.cos() * (3.0 * t).cos()).powi(15) * (2.0 * t).sin().powi(14)
    });
    force("(0.5 - 0.5*cos(theta))^15", |t| (0.5 - 0.5 * t.cos()).powi(15));
    force("(0.9*cos(theta)^15 + 0.1*cos(3*theta)^15)^15", |t| {
        (0.9 * t.cos().powi(15) + 0.1 * (3.0 * t).cos().powi(15)).powi(15)
    });
    force("((1 - cos(theta))^2/4*(1 - cos(theta + 0.01))/2)^15", |t| {
        (0.125 * (1.0 - t.cos()).powi(2) * (1.0 - (t + 0.01).cos())).powi(15)
    });
    forces
}

/// A wave beside such a force hides it from the last coefficients.
#[test]
fn integrals_over_flat_forces_beside_a_wave_are_those_of_gauss_rule() {
    for Force { text, places, value } in flat_forces() {
        let beside = format!("x = \"v\"\nv = \"p*({text} + cos(theta))\"");
        let model = parsed(&scene(&beside, FAR), "force", &NONE).model;
        let field = Field::free(&model, &[]);
        for from in [0.0, 0.3, FRAC_PI_2, 2.9, PI, 5.5] {
            let to = from + 1.5 * TAU;
            let exact = integrated(&value, [from, to], &places) + to.sin() - from.sin();
            let mut integrator = Integrator::<f64>::new(&field);
            let mut steps = 2000;
            let end = integrator.flow_within(&[0.0, 0.0, from], &[1.0], to - from, &mut steps);
            let alone = end.expect("a finite force")[1];
            for (name, found) in [
                ("alone", alone),
                ("free", flown_freely(&format!("{text} + cos(theta)"), from, to - from)),
                ("contact", flown_in_contact(&format!("{text} + cos(theta)"), from, to - from)),
            ] {
                let error = (found - exact).abs();
                // The rounding of a base, in a power of up to a thousand.
                assert!(error < 2e-12, "{text} from {from}, {name}: {error:e} of {exact}");
            }
        }
    }
}

/// Such a force alone, from its zeros on: everything is at rest, to more digits than a number has.
#[test]
fn a_flat_force_moves_what_it_finds_at_rest() {
    for Force { text, places, value } in flat_forces() {
        for from in [0.0, FRAC_PI_2, PI] {
            let to = from + 1.5 * TAU;
            let exact = integrated(&value, [from, to], &places);
            let found = flown_freely(&text, from, to - from);
            let error = (found - exact).abs();
            assert!(error < 2e-12, "{text} from {from}: {error:e} of {exact}");
        }
    }
}

#[test]
fn a_force_that_changes_on_a_short_way_of_the_state_keeps_the_energy() {
    // Potentials of height 0.1 with x' = 1 far away: v²/2 + V.
    for k in [10.0, 1e3, 1e6] {
        let step = |x: f64| 0.1 * (k * (x - 0.3)).tanh();
        let hill = |x: f64| 0.1 / (1.0 + (k * (x - 0.3)).powi(2));
        let kink = |x: f64| {
            let size = k * (x - 0.3).abs();
            0.1 * (size + (-2.0 * size).exp().ln_1p() - 2.0_f64.ln()) / k
        };
        type Potential<'p> = (&'static str, &'p dyn Fn(f64) -> f64);
        let cases: [Potential<'_>; 3] = [
            ("-0.1*K/cosh(K*(x - 0.3))^2", &step),
            ("0.2*K*K*(x - 0.3)/(1 + (K*(x - 0.3))^2)^2", &hill),
            ("-0.1*tanh(K*(x - 0.3))", &kink),
        ];
        for (force, potential) in cases {
            let force = force.replace('K', &format!("{k}"));
            let text = scene(&format!("x = \"v\"\nv = \"p*({force})\""), FAR);
            let end = flown(&text, [-0.7, 1.0, 0.0], 2.5);
            let error = 0.5 * end[1] * end[1] + potential(end[0]) - 0.5 - potential(-0.7);
            // Rounding of the place on the slope of the potential.
            assert!(error.abs() < 1e-13 + 1e-16 * k, "{force}: {error:e}");
        }
    }
}

#[test]
fn a_pulse_at_a_place_that_another_oscillator_passes_is_felt() {
    // y'' = −y from 1; the pulse at y = 0.3, at the times ±acos 0.3.
    for k in [10.0, 1e3, 1e6] {
        let text = format!(
            "[model]\nstates = [\"y\", \"v\", \"w\"]\nparameters = {{ p = 1.0 }}\n\
             [model.flow]\ny = \"w\"\nw = \"-y\"\nv = \"p*{k}/(1 + ({k}*(y - 0.3))^2)\"\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"1e3 - y\"\n\
             impact = {{ w = \"-w\" }}\n[grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
        );
        let found = flown(&text, [1.0, 0.0, 0.0], 2.0 * TAU)[1];
        let place = 0.3_f64.acos();
        let value = |t: f64| k / (1.0 + (k * (t.cos() - 0.3)).powi(2));
        let exact = integrated(value, [0.0, 2.0 * TAU], &[place, -place]);
        let error = (found / exact - 1.0).abs();
        assert!(error < 1e-13 + 20.0 * k * f64::EPSILON, "{k}: {error:e}");
    }
}

#[test]
fn a_stop_that_comes_forward_in_a_pulse_meets_a_mass_at_rest() {
    // The gap 0.2 − 0.5 e^{−K (1 − cos(θ − 1))} is zero where the pulse is 0.4.
    for k in [10.0, 1e3, 1e6, 1e9] {
        let surface = format!(
            "event = \"1 - x - 0.5*exp(-{k}*(1 - cos(theta - 1)))\"\n\
             contact = {{ v = \"free - 1e-3*p*(x - 1)\" }}"
        );
        let text = scene("x = \"v\"\nv = \"0\"", &surface);
        let model = parsed(&text, "stop", &NONE).model;
        let system = HybridSystem::new(&model);
        let mut simulator = Simulator::new(&system, &[1.0]).expect("finite parameters");
        simulator.set_state(&[0.8, 0.0, 2.0]).expect("a finite state");
        let trajectory = simulator.run(TAU).expect("a finite time");
        let begin = trajectory.events.iter().find_map(|event| match event.kind {
            EventKind::ContactBegin { .. } => Some(event.time),
            _ => None,
        });
        let early = 2.0 * (2.5_f64.ln() / (2.0 * k)).sqrt().asin();
        let expected = TAU - 1.0 - early;
        // The cosine is known to the rounding of 1, where its slope is the distance from the pulse.
        let most = 1e-13 + 1e-15 / early;
        let begin = begin.unwrap_or_else(|| panic!("{k}: {:?}", trajectory.events));
        assert!((begin - expected).abs() < most, "{k}: {begin}, not {expected}");
    }
}
