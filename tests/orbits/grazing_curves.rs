//! Grazing curves of the electrostatic oscillator against reference points.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first thing that is not there")]

use std::ops::Range;

use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::{
    CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, OrbitError, SpecialKind, curve,
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
