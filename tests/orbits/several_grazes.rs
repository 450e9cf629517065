//! Orbits that graze several times a period: symmetric ones, independent grazes, grazes that touch
//! of themselves.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first thing that is not there")]

use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{
    CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, GrazingOrbit, NotLocated, OrbitError,
    PoincareSectionKind, curve, locate,
};

use crate::support::reference::{exact, read};
use crate::support::scenes::{self, orbit, parameter, parsed, scene};

/// A damped oscillator forced in two harmonics between two stops.
const OSCILLATOR: &str = r#"
[model]
name = "oscillator forced in two harmonics"
states = ["x", "v"]
parameters = { zeta = 0.05, omega = 0.8, b = 0.0, chi = 0.3, right = 2.5, left = 2.0, r = 0.8 }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "v"
v = "cos(theta) + b*cos(2*theta + chi) - 2*zeta*v - x"
[[model.surface]]
name = "left"
event = "left + x"
impact = { v = "-r*v" }
[[model.surface]]
name = "right"
event = "right - x"
impact = { v = "-r*v" }
[grazing]
passages = ["right", "left"]
solve_for = ["right", "left"]
[section]
kind = "tangency"
"#;

fn edited(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(OSCILLATOR.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "nothing to edit: {from}");
        text.replace(from, to)
    })
}

fn parse(text: &str, overrides: &[(&str, &str)]) -> Scene {
    parsed(text, "scene", overrides)
}

fn reason(scene: &Scene) -> NotLocated {
    locate(scene).unwrap().into_result().unwrap_err()
}

fn number(text: &str) -> Dd {
    text.parse().unwrap()
}

/// Amplitude and phase lag of the response to `cos(n θ)` at zeta = 0.05, omega = 0.8.
fn response(harmonic: i32) -> (Dd, Dd) {
    let rate = number("0.8") * Dd::from(f64::from(harmonic));
    let (re, im) = (Dd::ONE - rate * rate, number("0.1") * rate);
    (Dd::ONE / (re * re + im * im).sqrt(), im.atan2(re))
}

/// `x = A cos(θ - ψ₁) + b B cos(2θ + χ - ψ₂)` with its first two derivatives in θ, at b and χ =
/// 0.3.
fn motion(b: Dd, theta: Dd) -> [Dd; 3] {
    let ((a, lag), (second, second_lag)) = (response(1), response(2));
    let (two, four) = (Dd::from(2.0), Dd::from(4.0));
    let (s1, c1) = (theta - lag).sin_cos();
    let (s2, c2) = (two * theta + number("0.3") - second_lag).sin_cos();
    let (p, q) = (a, b * second);
    [p * c1 + q * c2, -p * s1 - two * q * s2, -p * c1 - four * q * c2]
}

/// The extremum of the motion near a phase: Newton's method on its derivative.
fn extremum(b: Dd, mut theta: Dd) -> Dd {
    for _ in 0..12 {
        let [_, first, second] = motion(b, theta);
        theta -= first / second;
    }
    motion(b, theta)[0]
}

#[test]
fn independent_stops_of_a_harmonic_motion_stand_at_its_amplitude() {
    let scene = parse(OSCILLATOR, &[]);
    let orbit = orbit(&scene);
    let (amplitude, lag) = response(1);
    for name in ["right", "left"] {
        let error = parameter(&scene, &orbit, name) - amplitude;
        assert!(error.magnitude() < 1e-28, "{name}: {error}");
    }
    let [right, left] = orbit.passages.as_slice() else {
        panic!("{} passages", orbit.passages.len())
    };
    assert_eq!([right.surface, left.surface], [1, 0]);
    assert!((right.state[2] - lag).magnitude() < 1e-28);
    assert!((left.time * Dd::from(2.0) - orbit.period).magnitude() < 1e-28);
    assert!((left.state[0] + amplitude).magnitude() < 1e-28);
    assert!((left.normal_acceleration - right.normal_acceleration).magnitude() < 1e-28);
    assert!(orbit.residual < 1e-28 && orbit.is_physical());
}

#[test]
fn independent_stops_of_a_motion_of_two_harmonics_stand_at_its_extrema() {
    let scene = parse(OSCILLATOR, &[("b", "0.4")]);
    let orbit = orbit(&scene);
    let b = number("0.4");
    for (passage, name, sign) in [(0, "right", 1.0), (1, "left", -1.0)] {
        let phase = orbit.passages[passage].state[2];
        // NOTE: the phase found only says which extremum is meant.
        let expected = extremum(b, Dd::from(phase.hi)) * Dd::from(sign);
        let found = parameter(&scene, &orbit, name);
        assert!((found - expected).magnitude() < 1e-28, "{name}: {found} for {expected}");
    }
    let gaps = ["right", "left"].map(|name| parameter(&scene, &orbit, name).hi);
    assert!((gaps[0] - gaps[1]).abs() > 0.1, "{gaps:?}");
    assert!(orbit.is_physical());
}

/// `A cos τ − B cos 2τ` has two equal maxima `B + A²/(8 B)` where `B > A/4`.
const TWICE: [(&str, &str); 3] = [
    ("b = 0.0, chi = 0.3", "b = 3.0, chi = 2.6"),
    (
        r#"["right", "left"]
solve_for = ["right", "left"]"#,
        r#"["right", "right"]
solve_for = ["right", "chi"]"#,
    ),
    ("right = 2.5, left = 2.0", "right = 2.2, left = 9.0"),
];

/// The equal maxima of the motion and the χ that makes them equal, at b = 3.
fn equal_maxima() -> (Dd, Dd) {
    let ((a, lag), (second, second_lag)) = (response(1), response(2));
    let b = Dd::from(3.0) * second;
    (b + a * a / (Dd::from(8.0) * b), Dd::PI + second_lag - Dd::from(2.0) * lag)
}

#[test]
fn one_surface_is_grazed_twice_where_two_maxima_are_equal() {
    let scene = parse(&edited(&TWICE), &[]);
    let orbit = orbit(&scene);
    let (height, chi) = equal_maxima();
    assert!((parameter(&scene, &orbit, "right") - height).magnitude() < 1e-27);
    let turn = Dd::PI * Dd::from(2.0);
    let off = (parameter(&scene, &orbit, "chi") - chi) / turn;
    let off = off - (off + Dd::from(0.5)).floor();
    assert!(off.magnitude() < 1e-27, "{off}");
    assert!(orbit.passages[1].time.hi > 0.1 * orbit.period.hi && orbit.is_physical());
}

/// Two equal maxima of a motion that is even in time, run twice: the period is the fault, not a
/// passage without a name.
#[test]
fn an_orbit_of_two_equal_maxima_run_twice_is_a_shorter_one() {
    let even = [
        (
            "zeta = 0.05, omega = 0.8, b = 0.0, chi = 0.3",
            "zeta = 0.0, omega = 0.3, b = -0.5, chi = 0.0",
        ),
        ("right = 2.5, left = 2.0", "right = 1.0, left = 9.0"),
        ("passages = [\"right\", \"left\"]", "surface = \"right\""),
        ("solve_for = [\"right\", \"left\"]", "solve_for = \"right\""),
    ];
    let text = edited(&even);
    let once = reason(&parse(&text, &[]));
    assert!(matches!(once, NotLocated::TouchesElsewhere { .. }), "{once}");
    let twice = reason(&parse(&text, &[("grazing.periods", "2")]));
    assert!(matches!(twice, NotLocated::Repeats { times: 2, periods: Some(2), .. }), "{twice}");
    let named = text.replace("surface = \"right\"", "passages = [\"right\", \"right\"]");
    let scene = parse(&named, &[]);
    // x = a cos θ + c cos 2θ, with equal maxima c + a²/(8 |c|) … at cos θ = a/(4 |c|).
    let one = Dd::from(1.0);
    let square = number("0.3") * number("0.3");
    let a = one / (one - square);
    let c = number("0.5") / (one - Dd::from(4.0) * square);
    let height = c + a * a / (Dd::from(8.0) * c);
    let found = parameter(&scene, &orbit(&scene), "right");
    assert!((found - height).magnitude() < 1e-27, "{found} {height}");
}

#[test]
fn second_graze_is_found_where_it_touches_of_itself_and_its_gap_is_told_where_not() {
    let text = edited(&TWICE).replace(r#"["right", "chi"]"#, r#""right""#);
    let (height, chi) = equal_maxima();
    let exact = chi.to_decimal(32);
    let scene = parse(&text, &[("chi", &exact)]);
    let orbit = orbit(&scene);
    assert_eq!(orbit.passages.len(), 2);
    assert!((parameter(&scene, &orbit, "right") - height).magnitude() < 1e-27);
    let near = (chi + number("1e-15")).to_decimal(32);
    let NotLocated::DoesNotTouch { passage, event, .. } = reason(&parse(&text, &[("chi", &near)]))
    else {
        panic!("a gap of the order of 1e-15 is seen")
    };
    assert!(passage == 2 && (1e-17..1e-13).contains(&event.abs()), "{event:e}");
}

#[test]
fn surface_without_a_minimum_where_it_is_named_is_not_grazed() {
    let text =
        edited(&[(r#"passages = ["right", "left"]"#, r#"passages = ["right", "left", "right"]"#)]);
    let reason = reason(&parse(&text, &[]));
    assert_eq!(reason, NotLocated::NoMinimum { passage: 3, surface: "right".to_owned() });
}

#[test]
fn limit_cycle_grazes_both_stops_at_its_amplitude() {
    // Amplitude and period at mu = 1 from high-precision integrations in the literature of the van
    // der Pol equation.
    let text = edited(&[
        ("cos(theta) + b*cos(2*theta + chi) - 2*zeta*v - x", "(1 - x^2)*v - x"),
        ("[model.phase]\nname = \"theta\"\nrate = \"omega\"\nperiod = \"2*pi\"\n", ""),
        (
            "zeta = 0.05, omega = 0.8, b = 0.0, chi = 0.3, right = 2.5, left = 2.0",
            "right = 1.9, left = 1.9",
        ),
        ("[section]", "guess = { x = 1.9, v = 0.0 }\n[section]"),
    ]);
    let scene = parse(&text, &[]);
    let orbit = orbit(&scene);
    for name in ["right", "left"] {
        let amplitude = parameter(&scene, &orbit, name).hi;
        assert!((amplitude - 2.008_619_860_874_843).abs() < 1e-14, "{name}");
    }
    assert!((orbit.period.hi - 6.663_286_859_323_13).abs() < 1e-13);
    assert!((orbit.passages[1].time * Dd::from(2.0) - orbit.period).magnitude() < 1e-28);
}

/// One parameter for both stops, whose mirror image each other is.
const MIRRORED: [(&str, &str); 3] = [
    ("left + x", "right + x"),
    (r#"solve_for = ["right", "left"]"#, "solve_for = \"right\"\nsymmetry = \"half-period\""),
    ("left = 2.0, ", ""),
];

#[test]
fn symmetric_stops_graze_half_a_period_apart() {
    let scene = parse(&edited(&MIRRORED), &[]);
    let orbit = orbit(&scene);
    let (amplitude, _) = response(1);
    assert!((parameter(&scene, &orbit, "right") - amplitude).magnitude() < 1e-28);
    let [right, left] = orbit.passages.as_slice() else {
        panic!("{} passages", orbit.passages.len())
    };
    assert!((left.time * Dd::from(2.0) - orbit.period).magnitude() < 1e-30);
    assert!((right.state[0] + left.state[0]).magnitude() < 1e-30);
    assert!(orbit.multipliers.len() == 2 && orbit.is_physical() && orbit.residual < 1e-28);
    let mut unaware = scene.clone();
    unaware.grazing.symmetry = grazemap::model::Symmetry::None;
    let same = scenes::orbit(&unaware);
    assert!((parameter(&unaware, &same, "right") - amplitude).magnitude() < 1e-28);
    for (a, b) in orbit.passages.iter().zip(&same.passages) {
        assert!((a.time - b.time).magnitude() < 1e-27);
        let apart = a.state.iter().zip(&b.state).map(|(&a, &b)| (a - b).magnitude());
        assert!(apart.fold(0.0, f64::max) < 1e-27);
    }
}

#[test]
fn symmetry_that_the_model_lacks_is_wrong_input() {
    let error = locate(&parse(&edited(&MIRRORED), &[("b", "0.4")])).unwrap_err();
    let OrbitError::NotSymmetric { component, rate, mirrored, .. } = error else {
        panic!("{error}")
    };
    assert!(component == "v" && (rate + mirrored).abs() > 0.1);
    let unequal = [MIRRORED[1]];
    let reason = reason(&parse(&edited(&unequal), &[]));
    let NotLocated::NotMirrored { passage: 2, of: 1, event, velocity, .. } = reason else {
        panic!("{reason}")
    };
    let expected = 2.0 - response(1).0.hi;
    assert!((event - expected).abs() < 1e-14 && velocity.abs() < 1e-14);
}

#[test]
fn grazes_that_contradict_the_symmetry_are_wrong_input() {
    let text = edited(&MIRRORED);
    let passages = |list: &str| text.replace(r#"["right", "left"]"#, list);
    let error = |scene: &Scene| locate(scene).unwrap_err();
    assert_eq!(
        error(&parse(&text, &[("grazing.periods", "2")])),
        OrbitError::EvenPeriods { periods: 2 }
    );
    assert_eq!(
        error(&parse(&passages(r#"["right"]"#), &[])),
        OrbitError::UnpairedPassages { passages: 1 }
    );
    let two = text.replace(r#"solve_for = "right""#, r#"solve_for = ["right", "zeta"]"#);
    assert_eq!(error(&parse(&two, &[])), OrbitError::AdjustedParameters { named: 2, most: 1 });
}

#[test]
fn section_moves_neither_the_passages_nor_the_multipliers() {
    let text = edited(&MIRRORED);
    let tangency = orbit(&parse(&text, &[]));
    let fixed = [("section.kind", "stroboscopic"), ("section.phase", "1")];
    let stroboscopic = orbit(&parse(&text, &fixed));
    assert_eq!(stroboscopic.section_point[2], Dd::ONE);
    let charts = |orbit: &GrazingOrbit| {
        let charts = orbit.passages.iter();
        charts.map(|at| at.section.coordinates.clone()).collect::<Vec<_>>()
    };
    assert_eq!(charts(&tangency), [[0, 2], [0, 2]]);
    assert_eq!(charts(&stroboscopic), [[0, 1], [0, 1]]);
    assert_eq!(tangency.passages[1].section.kind, PoincareSectionKind::Tangency);
    for (a, b) in tangency.multipliers.iter().zip(&stroboscopic.multipliers) {
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-14);
    }
    assert_eq!(tangency.conditions, stroboscopic.conditions);
}

/// The grazing curve in b from 0 on.
fn along_b(scene: &Scene, to: f64) -> GrazingCurve {
    let mut parameters = scene.model.parameters.iter();
    let b = parameters.position(|parameter| parameter.name == "b").unwrap();
    match curve(scene, b, 0.0, to, &CurveOptions::default()).unwrap() {
        CurveOutcome::Traced(curve) => curve,
        other => panic!("{other:?}"),
    }
}

#[test]
fn curve_of_independent_grazes_ends_at_the_orbit_located_there() {
    let scene = parse(OSCILLATOR, &[]);
    let curve = along_b(&scene, 0.4);
    assert_eq!(curve.end, CurveEnd::Reached);
    let names = curve.free.iter().map(|&at| scene.model.parameters[at].name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["right", "left", "b"]);
    let last = curve.points.last().unwrap();
    let there = orbit(&parse(OSCILLATOR, &[("b", "0.4")]));
    for (found, expected) in last.parameters.iter().zip(there.parameters()) {
        assert!((found - expected.hi).abs() < 1e-12, "{found} for {expected}");
    }
    // One condition is followed by default, and six are given by the orbit.
    for (found, expected) in last.conditions.iter().zip(&there.conditions) {
        assert_eq!((found.from, found.to), (expected.from, expected.to));
        assert!((found.values[0] - expected.values[0].hi).abs() < 1e-11);
    }
    assert_eq!(last.conditions.len(), 4);
}

#[test]
fn curve_ends_where_a_passage_that_nothing_adjusts_ceases_to_graze() {
    let mut scene = parse(&edited(&MIRRORED), &[]);
    scene.grazing.symmetry = grazemap::model::Symmetry::None;
    let curve = along_b(&scene, 0.2);
    assert_eq!(curve.end, CurveEnd::PassageLost { passage: 2 });
}

#[test]
fn two_masses_graze_both_stops_at_the_reference_orbits() {
    for (set, file) in [("t1", "T1"), ("t2", "T2")] {
        let truth = read(&format!("soft/public_two_{file}_soft.json"));
        let scene = scene(&format!("two_stops_{set}"));
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let gap = parameter(&scene, &orbit, "d") - exact(&truth["d_grazing"]);
        assert!(gap.magnitude() < 1e-28, "{set}: {gap}");
        assert!((graze.state[4] - exact(&truth["phase_R"])).magnitude() < 1e-28, "{set}");
        for (found, expected) in
            graze.state.iter().zip(truth["grazing_state_R"].as_array().unwrap())
        {
            assert!((*found - exact(expected)).magnitude() < 1e-28, "{set}");
        }
        assert_eq!(orbit.passages.len(), 2);
        assert!(orbit.is_physical() && orbit.residual < 1e-28);
    }
}
