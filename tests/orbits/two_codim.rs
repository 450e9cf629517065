//! Two masses between two stops: the grazing curve and every condition and codimension-two point
//! along it.
//!
//! Truth: tests/data/soft/two_codim_*.json (32 digits; README there).

use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, GrazingOrbit, curve};
use serde_json::Value;

use crate::support::reference::{exact, read, text};
use crate::support::scenes::{index, orbit, scene, scene_with};
use crate::support::tiers;

const SETS: [(&str, &str); 2] = [("two_stops_t1", "T1"), ("two_stops_t2", "T2")];

/// Passages in the scenes' order: right, left.
const LETTERS: [char; 2] = ['R', 'L'];

/// Error of the gap, relative, and of the conditions, relative to the largest of their `n`.
fn errors(scene: &Scene, orbit: &GrazingOrbit, row: &Value) -> [f64; 2] {
    let d = exact(&row["d"]);
    let gap = (orbit.parameters()[index(scene, "d")] / d - Dd::ONE).magnitude();
    let mut worst = 0.0_f64;
    for conditions in &orbit.conditions {
        // NOTE: left to left and left to right are not in the table; they equal their mirror
        // images.
        let to = LETTERS[usize::from(conditions.from != conditions.to)];
        for n in 1..=4 {
            let expected = exact(&row[format!("R{to}{n}")]);
            let scale = orbit.passages[conditions.from].normal_acceleration;
            let error = conditions.values[n - 1] / scale - expected;
            worst = worst.max(error.magnitude());
        }
    }
    [gap, worst]
}

/// The gap has 28 digits and more in the table, the conditions 24.
#[test]
fn gap_and_conditions_of_every_kind_are_those_of_the_reference_along_the_curve() {
    for (name, set) in SETS {
        let table = read(&format!("soft/two_codim_{set}.json"));
        let rows = table["grazing_curve"].as_array().expect("rows");
        let mut worst = [0.0_f64; 2];
        for row in rows.iter().step_by(4) {
            let scene = scene_with(name, &[("omega", text(&row["w"]))]);
            let orbit = orbit(&scene);
            assert_eq!(orbit.conditions.len(), 4);
            assert!(orbit.conditions.iter().all(|kind| kind.values.len() == 6));
            let found = errors(&scene, &orbit, row);
            worst = [worst[0].max(found[0]), worst[1].max(found[1])];
        }
        println!("{set}: gap {:.1e}, conditions {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-26 && worst[1] < 1e-22, "{set}: {worst:?}");
    }
}

fn traced(scene: &Scene) -> GrazingCurve {
    let options = CurveOptions { xi_count: 4, ..CurveOptions::default() };
    match curve(scene, index(scene, "omega"), 0.2, 4.0, &options).expect("no wrong input") {
        CurveOutcome::Traced(curve) => curve,
        other => panic!("{other:?}"),
    }
}

/// Distance of a point found from one of the reference, in omega and relative in d.
fn distance(scene: &Scene, parameters: &[Dd], point: &Value) -> f64 {
    let omega = parameters[index(scene, "omega")] - exact(&point["w"]);
    let d = parameters[index(scene, "d")] / exact(&point["d"]) - Dd::ONE;
    omega.magnitude().max(d.magnitude())
}

#[test]
fn curve_meets_every_point_of_codimension_two_and_no_other() {
    for &(name, set) in tiers::part(&SETS, 1) {
        let table = read(&format!("soft/two_codim_{set}.json"));
        let points = table["codim2_points_w_in_[0.2,4]"].as_array().expect("points");
        let scene = scene(name);
        let start = std::time::Instant::now();
        let curve = traced(&scene);
        println!("{set}: {} points of the curve, {:?}", curve.points.len(), start.elapsed());
        assert_eq!(curve.end, CurveEnd::Reached);
        let found: Vec<_> = curve.codim2().collect();
        let (mut met, mut worst) = (0, 0.0_f64);
        for point in points {
            let same = |(n, ends): (usize, [usize; 2])| {
                let kind: String = ends.iter().map(|&end| LETTERS[end]).collect();
                n as u64 == point["n"].as_u64().expect("a number") && kind == text(&point["kind"])
            };
            let of_kind = found.iter().filter(|(n, ends, _)| same((*n, *ends)));
            let nearest = of_kind
                .map(|(_, _, special)| distance(&scene, &special.parameters, point))
                .fold(f64::INFINITY, f64::min);
            if nearest < 1e-9 {
                met += 1;
                worst = worst.max(nearest);
            } else {
                println!("{set}: {point} missed by {nearest:.1e}");
            }
        }
        println!("{set}: {met} of {} met to {worst:.1e}; {} found", points.len(), found.len());
        assert_eq!((met, found.len()), (points.len(), points.len()), "{set}");
        assert!(worst < 1e-24, "{set}: {worst:e}");
    }
}
