//! Fields with corners: `abs`, `sign`, `min`, `max` and the cut of `atan2`, in free flight and in
//! contact, against integrals and closed forms.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use grazemap::hybrid::{HybridSystem, Outcome, Simulator};
use grazemap::model::Model;
use grazemap::numeric::{Dd, Real, Scalar as _};

use crate::narrow_features::{flown_freely, flown_in_contact};
use crate::quadrature::integral;
use crate::support::scenes::{NONE, parsed};

/// Force as a function of the phase: text, phases of its corners, and values.
type Force = (&'static str, Vec<f64>, fn(f64) -> f64);

fn forces() -> Vec<Force> {
    vec![
        ("abs(sin(theta))", vec![0.0, PI], |t| t.sin().abs()),
        ("sign(sin(theta - 1))", vec![1.0, 1.0 + PI], |t| (t - 1.0).sin().signum()),
        ("sign(cos(theta) - 0.99)", vec![0.99_f64.acos(), -0.99_f64.acos()], |t| {
            (t.cos() - 0.99).signum()
        }),
        ("max(0, cos(theta))", vec![FRAC_PI_2, -FRAC_PI_2], |t| t.cos().max(0.0)),
        ("min(sin(theta), 0.5)", vec![PI / 6.0, 5.0 * PI / 6.0], |t| t.sin().min(0.5)),
        ("max(sin(theta), cos(theta))", vec![FRAC_PI_4, FRAC_PI_4 + PI], |t| t.sin().max(t.cos())),
        (
            "abs(abs(sin(theta)) - 0.5)",
            [0.0, 1.0, 5.0, 6.0, 7.0, 11.0].map(|sixths| sixths * PI / 6.0).to_vec(),
            |t| (t.sin().abs() - 0.5).abs(),
        ),
        ("sqrt(sin(theta)^2)", vec![0.0, PI], |t| t.sin().abs()),
        ("atan2(sin(theta), cos(theta))", vec![PI], |t| t.sin().atan2(t.cos())),
    ]
}

#[test]
fn integrals_over_corners_are_those_of_their_pieces_in_free_flight_and_in_contact() {
    for (text, places, value) in forces() {
        for from in [0.0, 0.5, 2.9] {
            let exact = integral(value, [from, from + 3.0 * TAU], &places);
            for (name, found) in [
                ("free", flown_freely(text, from, 3.0 * TAU)),
                ("contact", flown_in_contact(text, from, 3.0 * TAU)),
            ] {
                // A step ends behind its corner by 16 roundings of the argument over its slope, here
                // 1/7 at least; six corners are passed, at which the force jumps by 2.
                let error = (found - exact).abs();
                assert!(error < 3e-12, "{text} from {from}, {name}: {found}, not {exact}");
            }
        }
    }
}

/// `x' = v` under a force of the state; no stop is near.
fn model(force: &str) -> Model {
    let text = format!(
        "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ p = 1.0 }}\n\
         [model.flow]\nx = \"v\"\nv = \"p*({force})\"\n\
         [[model.surface]]\nname = \"stop\"\nevent = \"1e3 - x\"\nimpact = {{ v = \"-v\" }}\n\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
    );
    parsed(&text, "corner", &NONE).model
}

/// The state after a time, and the way the simulation ended.
fn flown<S: Real>(force: &str, start: [f64; 2], time: S) -> ([S; 2], Outcome<S>) {
    let model = model(force);
    let system = HybridSystem::new(&model);
    let mut simulator = Simulator::new(&system, &[S::one()]).expect("finite parameters");
    simulator.set_state(&start.map(S::from_f64)).expect("a finite state");
    let trajectory = simulator.run(time).expect("a finite time");
    ([trajectory.state[0], trajectory.state[1]], trajectory.outcome)
}

#[test]
fn a_ball_that_is_drawn_to_the_middle_by_a_constant_force_has_the_period_of_its_parabolas() {
    // From rest at 1 with x'' = −sign x: √2 to the middle, 4 √2 to and fro.
    let period = 4.0 * 2.0_f64.sqrt();
    let (state, outcome) = flown("-sign(x)", [1.0, 0.0], 10.25 * period);
    assert_eq!(outcome, Outcome::Completed);
    // A quarter of a period on: in the middle, at the speed −√2. Steps end just behind 20
    // corners, where the force is the wrong one for a moment: that costs below 1e-12 each.
    assert!(state[0].abs() < 2e-11 && (state[1] + 2.0_f64.sqrt()).abs() < 2e-11, "{state:?}");
}

#[test]
fn springs_that_change_at_a_corner_take_half_of_either_period() {
    // x'' = −x above 0 and −4 x below: π + π/2, in double-double too.
    let force = "-max(x, 0) - 4*min(x, 0)";
    let (state, _) = flown(force, [0.3, 0.0], 1.5 * PI);
    assert!((state[0] - 0.3).abs() < 1e-14 && state[1].abs() < 1e-14, "{state:?}");
    let time = Dd::TWO_PI * Dd::from(0.75);
    let (state, _) = flown(force, [0.3, 0.0], time);
    let error = (state[0] - Dd::from(0.3)).magnitude().max(state[1].magnitude());
    // Behind the corner the other spring acts for some roundings of f64: their square.
    assert!(error < 1e-27, "{error:e}");
}

#[test]
fn dry_friction_takes_its_share_of_every_swing_and_stops_where_it_holds() {
    // x'' = −x − μ sign v: the swing from 1 goes to −(1 − 2 μ), and so on; at rest where |x| < μ.
    let force = "-x - 0.15*sign(v)";
    let (state, outcome) = flown(force, [1.0, 0.0], 2.0 * PI);
    assert_eq!(outcome, Outcome::Completed);
    assert!((state[0] - 0.4).abs() < 1e-13, "{state:?}");
    let (state, outcome) = flown(force, [1.0, 0.0], 20.0);
    let Outcome::Slides { time } = outcome else { panic!("{outcome:?}") };
    assert!((time - 3.0 * PI).abs() < 1e-6 && (state[0] + 0.1).abs() < 1e-12, "{time} {state:?}");
}

#[test]
fn a_cubic_of_the_size_keeps_the_energy() {
    // x'' = −|x| x: v²/2 + |x|³/3.
    let energy = |[x, v]: [f64; 2]| 0.5 * v * v + x.abs().powi(3) / 3.0;
    let (state, _) = flown("-abs(x)*x", [0.9, 0.4], 50.0);
    assert!((energy(state) - energy([0.9, 0.4])).abs() < 1e-13, "{state:?}");
}

#[test]
fn a_damper_that_cannot_pull_lets_go_where_its_force_is_zero() {
    // x'' = −max(0, x + v) from 0 at speed 1: x'' + x' + x = 0 until x + v = 0, then free.
    let w = 0.75_f64.sqrt();
    // x = e^{−t/2} sin(w t)/w; x + v = e^{−t/2} (cos w t + sin(w t)/(2 w)), zero at tan w t = −2 w.
    let end = (PI - (2.0 * w).atan()) / w;
    let decay = (-0.5 * end).exp();
    let (x, v) =
        (decay * (w * end).sin() / w, decay * ((w * end).cos() - 0.5 * (w * end).sin() / w));
    let (state, _) = flown("-max(0, x + v)", [0.0, 1.0], end + 0.25);
    let expected = [x + 0.25 * v, v];
    for (found, expected) in state.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-14, "{found}, not {expected}");
    }
}
