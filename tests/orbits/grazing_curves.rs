//! Grazing curves of the electrostatic oscillator against reference points.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first thing that is not there")]

use std::ops::Range;

use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::{
    CurveEnd, CurveOptions, CurveOutcome, CurvePoint, GrazingCurve, OrbitError, SpecialKind, curve,
};
use serde_json::Value;

use crate::support::reference::{exact, read};
use crate::support::scenes::{index, scene, scene_with};

/// `xi_1 = 0`, of the one passage.
const FIRST: SpecialKind = SpecialKind::Codimension2 { n: 1, from: 0, to: 0 };

fn points(file: &str) -> Vec<Value> {
    read(&format!("rigid/{file}")).as_array().unwrap().clone()
}

fn traced(scene: &Scene, from: f64, to: f64, options: &CurveOptions) -> GrazingCurve {
    match curve(scene, index(scene, "omega"), from, to, options).unwrap() {
        CurveOutcome::Traced(curve) => curve,
        other => panic!("{other:?}"),
    }
}

/// Distance of the nearest special point of a kind from a reference point, in both parameters.
fn distance(scene: &Scene, curve: &GrazingCurve, kind: SpecialKind, point: &Value) -> f64 {
    let (omega, v) = (index(scene, "omega"), index(scene, "V"));
    let special = curve.special.iter().filter(|special| special.kind == kind);
    let apart = |a: Dd, key: &str| (a - exact(&point[key])).to_f64().abs();
    special
        .map(|at| apart(at.parameters[omega], "omega").max(apart(at.parameters[v], "V")))
        .fold(1.0, f64::min)
}

/// Number of reference points on a stretch of omega where xi_1 vanishes or multipliers meet, each
/// met to 1e-12.
fn met(scene: &Scene, curve: &GrazingCurve, stretch: Range<f64>) -> usize {
    let mut met = 0;
    for point in points("mems_points.json") {
        let kind = match point["type"].as_str().unwrap() {
            "xi1" => FIRST,
            "disc" => SpecialKind::MultiplierSwitch,
            _ => continue,
        };
        if stretch.contains(&exact(&point["omega"]).to_f64()) {
            // The functions refined to 1e-14 have slopes of order 0.1 and more along the curve.
            let distance = distance(scene, curve, kind, &point);
            assert!(distance < 1e-12, "{kind:?} at {}: {distance:e}", point["omega"]);
            met += 1;
        }
    }
    met
}

/// The force that grazes grows with the square of the frequency: to 160 000 times the stop here.
#[test]
fn steps_grow_with_a_curve_that_comes_far() {
    let scene = scene("linear");
    let curve = traced(&scene, 1.8, 400.0, &CurveOptions::default());
    assert_eq!(curve.end, CurveEnd::Reached);
    assert!(curve.points.len() < 20_000, "{}", curve.points.len());
    let [alpha, omega, zeta] = ["alpha", "omega", "zeta"].map(|name| index(&scene, name));
    for point in &curve.points {
        let at = |parameter: usize| point.parameters[parameter];
        let closed = (1.0 - at(omega).powi(2)).hypot(2.0 * at(zeta) * at(omega));
        // A flow under such a force is known to its rounding.
        let most = 16.0 * f64::EPSILON * at(omega).powi(2);
        assert!((at(alpha) / closed - 1.0).abs() < most, "{}", at(omega));
    }
}

#[test]
fn electrostatic_curve_meets_the_reference_points_where_xi_vanishes_and_multipliers_meet() {
    let scene = scene("mems");
    let curve = traced(&scene, 0.46, 0.62, &CurveOptions::default());
    assert_eq!(curve.end, CurveEnd::Reached);
    assert!(curve.points.iter().all(|point| point.is_physical()));
    assert_eq!(met(&scene, &curve, 0.46..0.62), 4);
    assert_eq!(curve.codim2().count() + curve.multiplier_switches().count(), 4);
}

#[test]
fn points_of_the_curve_are_grazing_orbits_of_the_reference() {
    let scene = scene("mems");
    let (omega, v) = (index(&scene, "omega"), index(&scene, "V"));
    let points = points("mems_curve.json");
    let within = |point: &&Value| {
        point["branch"] == 0 && (0.47..0.56).contains(&exact(&point["omega"]).to_f64())
    };
    for point in points.iter().filter(within).step_by(4) {
        let value = exact(&point["omega"]).to_f64();
        let curve = traced(&scene, 0.46, value, &CurveOptions::default());
        let last = curve.points.last().unwrap();
        assert_eq!(last.parameters[omega], value);
        assert!(
            (last.parameters[v] - exact(&point["V"]).to_f64()).abs() < 1e-12,
            "omega = {value}"
        );
    }
}

#[test]
fn curve_is_followed_round_two_folds_to_the_next_sheet() {
    let scene = scene("mems_scenario3");
    let omega = index(&scene, "omega");
    let start = scene.model.parameters[omega].value.to_f64();
    let curve = traced(&scene, start, 0.15, &CurveOptions::default());
    assert_eq!(curve.end, CurveEnd::Reached);
    let folds: Vec<f64> = curve
        .folds()
        .filter(|(p, _)| *p == omega)
        .map(|(_, fold)| fold.parameters[omega].to_f64())
        .collect();
    let [high, low] = folds.as_slice() else { panic!("{folds:?}") };
    // The start has xi_1 = 0 itself; multipliers meet once before the first fold and once between
    // the folds.
    assert!(0.1397 < *high && *high < 0.14 && 0.1297 < *low && *low < 0.13);
    assert_eq!(met(&scene, &curve, 0.13925..*high), 1);
    assert_eq!(met(&scene, &curve, 0.138..0.139), 1);
    let points = points("mems_points.json");
    let next = points
        .iter()
        .find(|point| point["omega"].as_str().unwrap().starts_with("0.1301129273"))
        .unwrap();
    assert!(distance(&scene, &curve, FIRST, next) < 1e-11);
}

/// A point of the curve of the electrostatic oscillator between the two points where its multipliers
/// become real, omega = 0.69463 and 0.90796.
const HIGH: [(&str, &str); 5] = [
    ("omega", "0.8005223562029"),
    ("V", "0.5979479930374"),
    ("grazing.guess.x", "0.5"),
    ("grazing.guess.v", "0"),
    ("grazing.guess.theta", "-0.0112566146124"),
];

/// Multipliers `rho exp(±i phi)` of a 2x2 monodromy give `xi_n` the factor `sin(n phi)/sin(phi)`:
/// its zeros are those of `xi_1` and the points where `phi = m π/n`, `0 < m < n`.
#[test]
fn every_zero_of_xi_is_met_from_both_ends_and_by_steps_of_any_length() {
    let scene = scene_with("mems", &HIGH);
    let omega = index(&scene, "omega");
    // At the lower end phi = π.
    let (low, high, most) = (0.69464, 0.705, 24);
    let usual = CurveOptions { xi_count: most, ..CurveOptions::default() };
    let long = CurveOptions { ds: 10.0 * usual.ds, ds_max: 10.0 * usual.ds_max, ..usual };
    let share = |point: &CurvePoint| {
        let [re, im] = point.multipliers[0];
        im.abs().atan2(re) / std::f64::consts::PI
    };
    for (from, to, options) in [(low, high, usual), (high, low, long)] {
        let curve = traced(&scene, from, to, &options);
        assert_eq!((&curve.end, curve.unresolved.len()), (&CurveEnd::Reached, 0));
        let ends = [&curve.points[0], curve.points.last().unwrap()];
        let lowest = ends.map(share).into_iter().fold(1.0, f64::min);
        for n in 1..=most {
            let found = curve.codim2().filter(|(number, ..)| *number == n);
            let (mut places, mut omegas) = (Vec::new(), Vec::new());
            for (.., special) in found {
                let place = n as f64 * share(&special.point);
                // Multipliers in f64 have the error 1e-16 over their distance from each other.
                assert!((place - place.round()).abs() < 1e-10, "xi_{n}: {place}");
                places.push(place.round() as usize);
                omegas.push(special.parameters[omega].to_f64());
            }
            places.sort_unstable();
            let expected: Vec<usize> = (1..n).filter(|&m| m as f64 > n as f64 * lowest).collect();
            assert_eq!(places, expected, "xi_{n} from {from}");
            for ends in curve.points.windows(2) {
                let [a, b] = [0, 1].map(|end| ends[end].parameters[omega]);
                let between = omegas.iter().filter(|&&at| a.min(b) < at && at < a.max(b));
                assert!(between.count() <= 1, "xi_{n} between {a} and {b}");
            }
        }
    }
}

#[test]
fn two_points_where_multipliers_meet_are_met_by_long_steps() {
    let sheet = [("omega", "0.1301"), ("V", "0.40591"), ("grazing.guess.theta", "-0.9218")];
    let scene = scene_with("mems_scenario3", &sheet);
    let options = CurveOptions { ds: 0.5, ds_max: 5.0, ..CurveOptions::default() };
    let curve = traced(&scene, 0.1301, 0.14, &options);
    let points = points("mems_points.json");
    let near = ["0.1301420410", "0.1301129361"];
    for omega in near {
        let mut points = points.iter();
        let point = points.find(|point| point["omega"].as_str().unwrap().starts_with(omega));
        let distance = distance(&scene, &curve, SpecialKind::MultiplierSwitch, point.unwrap());
        assert!(distance < 1e-11, "{omega}: {distance:e}");
    }
}

#[test]
fn a_zero_at_the_first_point_of_a_curve_and_one_at_its_last_are_met() {
    let scene = scene("linear");
    // xi_1 of the linear oscillator vanishes at omega = 2 sqrt(1 - zeta^2).
    let zero = 2.0 * (1.0 - 0.05_f64.powi(2)).sqrt();
    for (from, to) in [(zero, 2.1), (1.9, zero), (zero, 1.9)] {
        let curve = traced(&scene, from, to, &CurveOptions::default());
        assert_eq!(curve.codim2().count(), 1, "from {from} to {to}");
    }
}

/// The linear oscillator with every length multiplied by a factor: `alpha` and `delta` are lengths.
#[test]
fn a_curve_does_not_depend_on_the_unit_of_length() {
    let (mut amplitudes, mut frequencies) = (Vec::new(), Vec::new());
    for unit in ["1", "1e3", "1e12", "1e-12"] {
        let length: f64 = unit.parse().unwrap();
        let alpha = (2.9 * length).to_string();
        let set = [("delta", unit), ("alpha", &alpha), ("grazing.guess.x", unit)];
        let scene = scene_with("linear", &set);
        let curve = traced(&scene, 1.8, 2.2, &CurveOptions { xi_count: 3, ..Default::default() });
        assert_eq!(curve.end, CurveEnd::Reached, "{unit}");
        let omega = index(&scene, "omega");
        let zeros: Vec<f64> =
            curve.codim2().map(|(.., point)| point.parameters[omega].to_f64()).collect();
        frequencies.push(zeros);
        amplitudes.push(curve.points.last().unwrap().parameters[index(&scene, "alpha")] / length);
    }
    // alpha/delta = sqrt((1 - omega²)² + (2 zeta omega)²)
    let expected = (1.0 - 2.2_f64.powi(2)).hypot(2.0 * 0.05 * 2.2);
    for (amplitude, zeros) in amplitudes.iter().zip(&frequencies) {
        assert!((amplitude / expected - 1.0).abs() < 1e-13, "{amplitude}");
        assert_eq!(zeros.len(), frequencies[0].len());
        for (zero, first) in zeros.iter().zip(&frequencies[0]) {
            assert!((zero - first).abs() < 1e-14, "{zero} {first}");
        }
    }
}

#[test]
fn second_parameter_must_not_be_the_adjusted_one() {
    let scene = scene("mems");
    let parameter = index(&scene, "V");
    let error = curve(&scene, parameter, 0.2, 0.3, &CurveOptions::default()).unwrap_err();
    assert_eq!(error, OrbitError::SecondParameter { parameter });
}

#[test]
fn a_curve_ends_where_a_function_along_its_orbits_comes_to_its_corner() {
    // x'' + 2 zeta x' + x = alpha cos(omega t) grazes x = 1 with a largest speed of omega.
    let limited = "alpha*cos(theta) - 2*zeta*min(v, 2) - x";
    let limited = scene_with("linear", &[("model.flow.v", limited)]);
    let options = CurveOptions::default();
    let curve = traced(&limited, 1.8, 2.2, &options);
    let CurveEnd::Corner { function, key, at } = &curve.end else { panic!("{}", curve.end) };
    assert_eq!((*function, key.as_str()), ("min", "model.flow.v"));
    assert_eq!(at.0[1], ("v".to_owned(), 2.0));
    let last = curve.points.last().unwrap();
    let omega = last.parameters[index(&limited, "omega")];
    // The grid on which signs are looked at misses a crossing of the largest speed by less.
    assert!((1.99..2.01).contains(&omega), "{omega}");
    let plain = traced(&scene("linear"), 1.8, omega, &options);
    let alpha = index(&limited, "alpha");
    let apart = last.parameters[alpha] - plain.points.last().unwrap().parameters[alpha];
    assert!(apart.abs() < 1e-12, "{apart:e}");
}

#[test]
fn a_curve_ends_where_a_function_comes_to_its_corner_in_the_parameter_followed() {
    let places = [
        ("model.surface.0.event", "delta - x + 0.001*abs(zeta - 0.06)*v"),
        ("model.surface.0.impact.v", "-r*v - 0.001*abs(zeta - 0.06)*v"),
        ("model.flow.v", "alpha*cos(theta) - (2*zeta + 0.001*abs(zeta - 0.06))*v - x"),
    ];
    let options = CurveOptions { ds: 0.002, ds_max: 0.004, ..CurveOptions::default() };
    for (place, expression) in places {
        let scene = scene_with("linear", &[(place, expression)]);
        let zeta = index(&scene, "zeta");
        // The corner is at the end of the range, or between two points.
        for to in [0.06, 0.07] {
            let CurveOutcome::Traced(curve) = curve(&scene, zeta, 0.05, to, &options).unwrap()
            else {
                panic!("a grazing orbit at zeta = 0.05")
            };
            let ended = matches!(&curve.end, CurveEnd::Corner { function, key, .. } if *function == "abs" && key == place);
            assert!(ended, "{place} {to}: {}", curve.end);
            let last = curve.points.last().unwrap().parameters[zeta];
            assert!((0.055..0.06).contains(&last), "{place} {to}: {last}");
            let all = curve.points.iter();
            assert!(all.map(|point| point.parameters[zeta]).all(|zeta| zeta < 0.06));
        }
    }
}

#[test]
fn multipliers_at_the_end_of_a_curve_contract_areas_as_the_flow_does() {
    // Two harmonics: the minimum that grazes meets a maximum, h'' = 0, near omega = 0.718.
    let force = "alpha*cos(theta) + 0.15*sin(2*theta + 0.4)";
    let flow = format!("{force} - 2*zeta*v - x - 0.2*x^2 - 0.35*x^3");
    let changes = [
        ("model.flow.v", flow.as_str()),
        ("model.parameters.zeta", "0.06"),
        ("model.parameters.delta", "1.1"),
        ("model.parameters.alpha", "0.6"),
        ("model.parameters.omega", "0.8"),
    ];
    let scene = scene_with("linear", &changes);
    let curve = traced(&scene, 0.8, 0.5, &CurveOptions::default());
    assert!(matches!(curve.end, CurveEnd::DegenerateGraze { .. }), "{}", curve.end);
    for point in &curve.points {
        let areas = (-2.0 * 0.06 * point.period).exp();
        let &[[re, im], [other, _]] = point.multipliers.as_slice() else { panic!("two") };
        let product = if im == 0.0 { re * other } else { re * re + im * im };
        assert!((product / areas - 1.0).abs() < 1e-8, "{product} {areas}: {point:?}");
    }
}
