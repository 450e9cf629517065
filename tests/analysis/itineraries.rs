//! Periodic orbits by itinerary, their folds and flips, compared with closed forms that are
//! independent of map and simulator; and the map compared with direct simulation.

use grazemap::analysis::NoProgress;
use grazemap::analysis::orbits::{
    BifurcationKind, BifurcationRequest, FoundOrbit, Orbits, OrbitsRequest, SteppedParameter,
    orbits,
};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::GrazingOrbit;
use nalgebra::Complex;
use serde_json::Value;

use crate::support::foale::Foale;
use crate::support::reference::{exact, number, read};
use crate::support::scenes::{orbit, scene_with};
use crate::support::tiers;

/// A scene with its grazing orbit and its map.
struct Subject {
    scene: Scene,
    orbit: GrazingOrbit,
    map: LocalMap,
}

impl Subject {
    fn new(name: &str, orders: (u32, u32)) -> Self {
        Self::with(name, orders, &[])
    }

    fn with(
        name: &str,
        (smooth_order, contact_weight): (u32, u32),
        set: &[(String, String)],
    ) -> Self {
        let scene = scene_with(name, set);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        let orders = MapOrders { smooth_order, contact_weight };
        let map = expander.expand(orders).expect("small spaces");
        Self { scene, orbit, map }
    }

    fn itinerary(&self, digits: &str) -> ContactItinerary {
        ContactItinerary::parse(digits, self.map.passages()).expect("digits")
    }

    fn found(&self, request: &OrbitsRequest) -> Orbits {
        orbits(&self.scene, &self.orbit, &self.map, request, &NoProgress).expect("good parameters")
    }

    /// The orbits of an itinerary at one offset of the first parameter.
    fn orbits(&self, digits: &str, offset: f64, direct: bool) -> Vec<FoundOrbit> {
        let mut at = vec![0.0; self.map.parameters.len()];
        at[0] = offset;
        let request = OrbitsRequest {
            itineraries: vec![self.itinerary(digits)],
            at: vec![at],
            direct,
            far: false,
            loci: None,
        };
        self.found(&request).orbits
    }

    /// Folds or flips of an itinerary in the first parameter at offsets of the second.
    fn locus(
        &self,
        digits: &str,
        kind: BifurcationKind,
        offsets: &[f64],
        direct: bool,
    ) -> Vec<FoundOrbit> {
        let request = OrbitsRequest {
            itineraries: vec![self.itinerary(digits)],
            at: Vec::new(),
            direct,
            far: false,
            loci: Some(BifurcationRequest {
                kinds: vec![kind],
                free: 0,
                stepped: Some(SteppedParameter { parameter: 1, values: offsets.to_vec() }),
                at: vec![0.0; 2],
            }),
        };
        let mut loci = self.found(&request).loci.expect("asked for");
        assert!(loci.len() <= 1);
        loci.pop().map_or_else(Vec::new, |locus| locus.points)
    }

    /// Folds and flips found by direct simulation alone, at an offset of the second parameter.
    fn alone(&self, digits: &str, offset: f64) -> Vec<(BifurcationKind, FoundOrbit)> {
        let request = OrbitsRequest {
            itineraries: vec![self.itinerary(digits)],
            at: Vec::new(),
            direct: true,
            far: true,
            loci: Some(BifurcationRequest {
                kinds: vec![BifurcationKind::Fold, BifurcationKind::Flip],
                free: 0,
                stepped: Some(SteppedParameter { parameter: 1, values: vec![offset] }),
                at: vec![0.0; 2],
            }),
        };
        let loci = self.found(&request).loci.expect("asked for").into_iter();
        loci.flat_map(|locus| locus.points.into_iter().map(move |point| (locus.kind, point)))
            .collect()
    }

    fn parameter(&self, name: &str) -> Dd {
        let parameters = &self.scene.model.parameters;
        let place = parameters.iter().position(|known| known.name == name);
        self.orbit.parameters()[place.expect("a parameter")]
    }
}

/// Folds asked for beside the orbits take none of them away: the stable orbit with contact lies far
/// from the graze, where direct simulation alone finds it.
#[test]
fn folds_leave_the_orbits_that_are_far_from_the_graze() {
    let subject = Subject::new("linear", (3, 4));
    let found = |loci: Option<BifurcationRequest>| {
        subject.found(&OrbitsRequest {
            itineraries: vec![subject.itinerary("1")],
            at: vec![vec![-0.5, 0.0]],
            direct: true,
            far: true,
            loci,
        })
    };
    let folds = BifurcationRequest {
        kinds: vec![BifurcationKind::Fold],
        free: 0,
        stepped: None,
        at: vec![0.0; 2],
    };
    let (plain, with_folds) = (found(None), found(Some(folds)));
    assert_eq!(plain.orbits.len(), 2);
    assert_eq!(with_folds.orbits, plain.orbits);
    let folds = with_folds.loci.expect("asked for");
    assert!(folds.iter().any(|locus| !locus.points.is_empty()));
}

fn trace(orbit: &FoundOrbit) -> f64 {
    orbit.multipliers.iter().map(|[re, _]| re).sum()
}

fn determinant(orbit: &FoundOrbit) -> f64 {
    let multipliers = orbit.multipliers.iter();
    let multipliers = multipliers.map(|&[re, im]| Complex::new(re, im));
    multipliers.product::<Complex<f64>>().re
}

/// Asserts a number to this share of itself.
fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (found / expected - 1.0).abs();
    assert!(error < tolerance, "{what}: {found}, {expected}: {error:e}");
}

/// The orbit whose first contact is the slowest.
fn slowest(orbits: &[FoundOrbit]) -> &FoundOrbit {
    let speed = |orbit: &&FoundOrbit| orbit.contacts[0].speed.abs();
    let least = orbits.iter().min_by(|a, b| speed(a).total_cmp(&speed(b)));
    least.expect("an orbit")
}

#[test]
fn one_impact_orbits_of_periods_one_to_four_are_foales_and_physical_where_the_reference_has_them() {
    // Each row of the reference: impact speed, amplitude, trace, determinant, and whether the stop
    // is passed in between.
    let reference = read("rigid/linear_abc.json");
    for (name, place) in [("foale", "omega_1.8"), ("foale_omega_2_2", "omega_2.2")] {
        let subject = Subject::new(name, (6, 10));
        let reference = &reference["foale"][place];
        for (period, digits) in ["1", "10", "100", "1000"].into_iter().enumerate() {
            let branch = reference["orbits"][(period + 1).to_string()]["branch"].as_array();
            for row in &branch.expect("rows")[..2] {
                let what = format!("{name} {digits} at speed {}", row["y"]);
                let offset = exact(&row["alpha"]) - subject.parameter("alpha");
                let (speed, physical) = (number(&row["y"]), row["physical"] == true);
                let found = subject.orbits(digits, offset.to_f64(), false);
                let orbit = slowest(&found);
                // Truncation: y⁷ beside y, and the trace, 1/y, by two powers more.
                assert_near(orbit.contacts[0].speed, speed, 1e-8, &what);
                assert_near(trace(orbit), number(&row["tr"]), 1e-7, &what);
                assert_near(determinant(orbit), number(&row["det"]), 1e-6, &what);
                assert_eq!((orbit.physical, orbit.stable), (physical, false), "{what}");
                if !physical {
                    continue;
                }
                let found = subject.orbits(digits, offset.to_f64(), true);
                let orbit = slowest(&found);
                // The offset is rounded to a double: 1e-16 of amplitudes of 1 beside speeds of
                // 1e-3.
                assert_near(orbit.contacts[0].speed, speed, 1e-12, &what);
                assert_near(trace(orbit), number(&row["tr"]), 1e-12, &what);
                assert_near(determinant(orbit), number(&row["det"]), 1e-12, &what);
                assert_eq!((orbit.physical, orbit.extra_contacts), (true, 0), "{what}");
            }
        }
    }
}

#[test]
fn virtual_orbits_are_the_closed_form_at_negative_speeds() {
    let subject = Subject::new("foale", (6, 10));
    let zeta = Dd::from(0.5) * subject.parameter("d");
    let form = Foale::new(subject.parameter("omega"), zeta, subject.parameter("r"), 1);
    let speed = Dd::from(-0.004);
    let offset = (form.alpha(speed) - subject.parameter("alpha")).to_f64();
    let found = subject.orbits("1", offset, false);
    let orbit = slowest(&found);
    assert_near(orbit.contacts[0].speed, speed.to_f64(), 1e-8, "speed");
    assert_near(trace(orbit), form.trace(speed).to_f64(), 1e-7, "trace");
    assert!(!orbit.physical);
    // Direct simulation has no other branch of a root.
    assert_eq!(subject.orbits("1", offset, true), []);
}

#[test]
fn orbits_of_soft_stops_have_the_exact_speeds_traces_and_determinants() {
    let reference = read("soft/jacobian_trace_det.json");
    let cases = reference["cases"].as_array().expect("cases");
    for system in ["A", "B", "C", "D"] {
        let case = cases.iter().find(|case| case["system"] == system && case["m"] != "1");
        let case = case.expect("a case");
        let text = |name: &str| case[name].as_str().map(str::to_owned);
        let mut set = vec![
            ("omega".to_owned(), format!("2*sqrt(1 - 0.015^2)/{}", text("m").expect("m"))),
            ("A".to_owned(), text("A_g").expect("A_g")),
            ("expansion.active".to_owned(), "[\"A\"]".to_owned()),
        ];
        let given = |name: &str| Some((name.to_owned(), text(name)?));
        set.extend(["k2", "R2", "d"].into_iter().filter_map(given));
        let row = case["rows"].as_array().expect("rows").iter();
        let mut row = row.map(|row| [0, 1, 3, 4, 5].map(|column| number(&row[column])));
        // Deep enough that the offset, a double, keeps twelve digits of the speed.
        let row = row.find(|row| row[1] > 1e-4).expect("an orbit");
        let [offset, y, speed, expected, determinant_expected] = row;
        set.push((
            "grazing.guess.theta".to_owned(),
            case["rows"][0][2].as_str().expect("a phase").to_owned(),
        ));
        let subject = Subject::with(&format!("soft_{}", system.to_lowercase()), (6, 12), &set);
        for (direct, tolerance) in [(false, 1e-6), (true, 1e-10)] {
            let what = format!("{system}, y = {y:e}, direct: {direct}");
            let found = subject.orbits("1", offset, direct);
            let orbit = found.iter().filter(|orbit| orbit.physical);
            let near = |orbit: &&FoundOrbit| (orbit.contacts[0].speed - speed).abs();
            let orbit = orbit.min_by(|a, b| near(a).total_cmp(&near(b))).expect("an orbit");
            assert_near(orbit.contacts[0].speed, speed, tolerance, &what);
            assert_near(trace(orbit), expected, tolerance, &what);
            assert_near(determinant(orbit), determinant_expected, tolerance, &what);
        }
    }
}

#[test]
fn loci_of_folds_and_flips_leave_the_codimension_two_point_as_foales_do() {
    let subject = Subject::new("linear_codim2", (5, 8));
    let cases = [
        ("1", BifurcationKind::Fold, [-1e-3, -3e-4, -1e-4]),
        ("1", BifurcationKind::Flip, [1e-4, 3e-4, 1e-3]),
        ("10", BifurcationKind::Fold, [1e-4, 3e-4, 1e-3]),
    ];
    for &(digits, kind, offsets) in tiers::part(&cases, 1) {
        let truth = |unfolding: f64| {
            let form = Foale::unfolded(|name| subject.parameter(name), unfolding, digits.len());
            let alpha = match kind {
                BifurcationKind::Fold => form.fold(),
                BifurcationKind::Flip => form.flip(),
            };
            let distance = (alpha - form.gain()).magnitude();
            ((alpha - subject.parameter("alpha")).to_f64(), distance)
        };
        // Relative to the distance from the grazing curve, as docs/studies/dynamics.md has them.
        for (direct, tolerance) in [(false, 1e-3), (true, 1e-9)] {
            let points = subject.locus(digits, kind, &offsets, direct);
            assert_eq!(points.len(), offsets.len(), "{digits} {kind:?} {direct}");
            for (point, unfolding) in points.iter().zip(offsets) {
                let (expected, distance) = truth(unfolding);
                let error = (point.parameters[0] - expected).abs() / distance;
                assert!(error < tolerance, "{digits} {kind:?} {unfolding} {direct}: {error:e}");
                assert_eq!(point.parameters[1], unfolding);
                let nearest =
                    point.multipliers.iter().map(|[re, im]| (re - kind.multiplier()).hypot(*im));
                assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-6);
            }
        }
        // On the other side of the point there is none.
        let other = offsets.map(|offset| -offset);
        assert_eq!(subject.locus(digits, kind, &other, false), [], "{digits} {kind:?}");
    }
}

/// The physical points of Foale's loci (tests/data/rigid/linear_abc.json) lie at speeds of up to 20
/// times those of the map's window.
#[test]
fn folds_and_flips_far_beyond_the_map_are_found_by_direct_simulation_where_foale_has_them() {
    let table = read("rigid/linear_abc.json");
    let table = table["foale"]["loci_table"].as_array().expect("a list");
    // Above omega = 2.1 orbits of period two lose the section point of their return without
    // contact on the way to their saddle-node and flip.
    let cases = [
        ("0.75", "tangency", &["1", "10"][..]),
        ("1.8", "tangency", &["1"]),
        ("2.2", "tangency", &["10"]),
        ("2.2", "stroboscopic", &["1", "10"]),
    ];
    for (omega, section, itineraries) in cases {
        let set = [("section.kind", section), ("window.state", "{}")];
        let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let subject = Subject::with("foale", (3, 4), &set);
        let offset = exact(&Value::from(omega)) - subject.parameter("omega");
        for digits in itineraries {
            let points: Vec<_> = table
                .iter()
                .filter(|point| point["omega"] == omega && point["n"] == digits.len())
                .filter(|point| point["physical"] == true)
                .collect();
            let found = subject.alone(digits, offset.to_f64());
            for point in &points {
                let kind = match point["kind"].as_str() {
                    Some("SN") => BifurcationKind::Fold,
                    _ => BifurcationKind::Flip,
                };
                let expected = exact(&point["alpha"]) - subject.parameter("alpha");
                let error = |(other, orbit): &(BifurcationKind, FoundOrbit)| {
                    let error = (orbit.parameters[0] - expected.to_f64()).abs();
                    if *other == kind { error } else { f64::INFINITY }
                };
                let nearest = found.iter().map(error).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-12, "{omega} {digits} {point}: {nearest:e}");
            }
            // And no other: of one impact the closed form has at most one of each kind.
            assert_eq!(found.len(), points.len(), "{omega} {digits}: {found:?}");
        }
    }
}

#[test]
fn neither_a_pole_nor_a_step_to_another_branch_is_taken_for_a_bifurcation() {
    // At a zero of one of several depth variables det(J - I) changes its sign through infinity.
    let subject = Subject::new("linear_codim2", (5, 6));
    for digits in ["110", "111", "1110"] {
        for kind in [BifurcationKind::Fold, BifurcationKind::Flip] {
            for point in subject.locus(digits, kind, &[-1e-3, 1e-3], false) {
                let apart = point.multipliers.iter();
                let apart = apart.map(|[re, im]| (re - kind.multiplier()).hypot(*im));
                let nearest = apart.fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-4, "{digits} {kind:?}: {:?}", point.multipliers);
            }
        }
    }
}

#[test]
fn an_orbit_that_a_flip_has_doubled_repeats_its_contacts_at_two_depths() {
    let subject = Subject::new("linear_codim2", (5, 8));
    let flip = subject.locus("1", BifurcationKind::Flip, &[1e-3], false).remove(0);
    let at = |beyond: f64, direct| {
        let request = OrbitsRequest {
            itineraries: vec![subject.itinerary("11"), subject.itinerary("1")],
            at: vec![vec![flip.parameters[0] + beyond, 1e-3]],
            direct,
            far: false,
            loci: None,
        };
        let orbits = subject.found(&request).orbits.into_iter();
        orbits.filter(|orbit| orbit.physical).collect::<Vec<_>>()
    };
    let mut sides = [1e-6, -1e-6].map(|beyond| (at(beyond, false), beyond));
    sides.sort_by_key(|(orbits, _)| orbits.len());
    let [(one, _), (both, beyond)] = sides;
    assert_eq!((one.len(), both.len()), (1, 2), "doubled on one side alone");
    let depths: Vec<f64> = both[0].states.iter().map(|state| state[0]).collect();
    assert!(depths.len() == 2 && (depths[0] / depths[1] - 1.0).abs() > 1e-3, "{depths:?}");
    let direct = at(beyond, true);
    assert_eq!(direct.len(), 2);
    for (map, direct) in both.iter().zip(&direct) {
        assert_eq!(map.stable, direct.stable);
        for (map, direct) in map.states.concat().iter().zip(direct.states.concat()) {
            // An orbit next to a flip moves by much more than the map errs.
            assert!((map - direct).abs() < 1e-2 * both[0].states[0][0].abs(), "{map} {direct}");
        }
    }
}

#[test]
fn with_several_stops_every_passage_has_its_digit() {
    let subject = Subject::new("two_stops_t1_rigid", (4, 8));
    let all = ContactItinerary::all(2, 1).expect("short");
    let at = |offset: f64| {
        let request = |direct| OrbitsRequest {
            itineraries: all.clone(),
            at: vec![vec![offset, 0.0]],
            direct,
            far: false,
            loci: None,
        };
        let physical = |orbits: Orbits| -> Vec<FoundOrbit> {
            orbits.orbits.into_iter().filter(|orbit| orbit.physical).collect()
        };
        [false, true].map(|direct| physical(subject.found(&request(direct))))
    };
    let mut seen = 0;
    for [map, direct] in [1e-5, -1e-5].map(at) {
        assert_eq!(map.len(), direct.len());
        for (map, direct) in map.iter().zip(&direct) {
            assert_eq!((&map.itinerary, map.stable), (&direct.itinerary, direct.stable));
            for (map, direct) in map.contacts.iter().zip(&direct.contacts) {
                assert_eq!((map.number, map.passage), (direct.number, direct.passage));
                assert_near(map.speed, direct.speed, 1e-4, "speed");
                seen += 1;
            }
        }
    }
    assert!(seen >= 2, "{seen}");
}
