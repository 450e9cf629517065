//! Attractors that do not return to the tangency section once per forcing period, compared with the
//! stroboscopic section and with exact flight between impacts, an independent method.

use std::f64::consts::TAU;

use grazemap::FindGraze as _;
use grazemap::analysis::basin::{BasinClass, BasinRequest, basin};
use grazemap::analysis::branches::{Branch, BranchRequest, branches};
use grazemap::analysis::diagram::{DiagramPoint, diagram, measure_graze};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, MapOrbit, OrbitEnd, OrbitRequest, Period};
use grazemap::model::{DiagramRequest, Method, Observable, Starts};

use crate::Case;
use crate::support::exact_flight::{Oscillator, SLOW, drawn};
use crate::support::{scenes, tiers};

const PHASE_NOT_REDUCED: &str = include_str!("../../gallery/outside/scenes/undamped.toml");
const BILINEAR_RIG: &str = include_str!("../../gallery/outside/scenes/bilinear_rig.toml");

/// Point of a diagram of direct simulation at one offset, from a start in offsets.
fn settled(case: &Case, offset: f64, start: &[(&str, f64)], observe: Observable) -> DiagramPoint {
    let names = case.scene.model.full_state_names();
    let at = |name: &&str| start.iter().find(|(other, _)| other == name).map(|(_, value)| *value);
    let state = names.iter().map(|name| at(&&**name)).collect();
    let mut request = DiagramRequest {
        range: [offset, offset + 1e-12],
        points: 1,
        transient: 600,
        keep: 32,
        with: vec![Method::Direct],
        observe,
        starts: Starts::Given(vec![state]),
        ..case.scene.diagrams[0].clone()
    };
    let point = |request: &DiagramRequest| {
        let found = diagram(&case.scene, &case.orbit, &case.map, request, &NoProgress);
        found.expect("a good scene").sweeps[0].points[0].clone()
    };
    let soon = point(&request);
    // No period is named while an orbit still approaches its attractor slowly.
    if soon.period != Period::NotFound {
        return soon;
    }
    request.transient = 6000;
    point(&request)
}

/// Number of oscillators compared: of a part, and of the whole list.
const OSCILLATORS: [usize; 2] = [6, 200];

/// Period of an oscillator's attractor by exact flight, and the differences found by diagrams on
/// both sections.
fn compared(number: usize) -> (Option<usize>, Vec<String>) {
    let omega = drawn(number, 0, [0.3, 6.0]);
    let (zeta, r) = (drawn(number, 1, [0.02, 0.2]), drawn(number, 2, [0.4, 0.9]));
    let set = |section: &str| {
        let text = |value: f64| format!("{value:e}");
        let keys = ["omega", "zeta", "r", "section.kind"].map(str::to_owned);
        let values = [text(omega), text(zeta), text(r), format!("\"{section}\"")];
        let set: Vec<_> = keys.into_iter().zip(values).collect();
        Case::of(scenes::scene_with("linear", &set))
    };
    let [tangency, stroboscopic] = ["tangency", "stroboscopic"].map(set);
    // The amplitude of the force, of either sign.
    let grazing = scenes::parameter(&tangency.scene, &tangency.orbit, "alpha").to_f64();
    let offset = grazing * drawn(number, 3, [0.05, 0.6]);
    let oscillator = Oscillator { zeta, alpha: grazing + offset, omega, stop: 1.0, r };
    // From rest at 0.4 beside the stop, half a radian after the graze; the other section is
    // reached by exact flight.
    let graze = tangency.orbit.grazing_point().state[2].to_f64();
    let start = [0.6, 0.0, graze + 0.5];
    let (strobe, _) = oscillator.simulated(start, (TAU - 0.5) / omega);
    let speed = || Observable::ImpactSpeed;
    let found = [
        settled(&tangency, offset, &[("x", -0.4), ("theta", 0.5)], speed()),
        settled(&stroboscopic, offset, &[("x", strobe[0] - 1.0), ("v", strobe[1])], speed()),
    ];
    let compared = |transient: usize| {
        let expected = oscillator.attractor(start, transient);
        let wrong = found.iter().filter_map(|point| differs(point, expected.as_ref()).err());
        let words = |wrong: String| format!("{number}: {oscillator:?}: {wrong}");
        (expected.as_ref().map(|(_, periods, _)| *periods), wrong.map(words).collect::<Vec<_>>())
    };
    // Exact flight takes longer for attractors that diagrams name while orbits still approach them.
    let soon = compared(600);
    if soon.1.is_empty() { soon } else { compared(6000) }
}

/// Whether a point of a diagram has the periods, hits and speeds of exact flight.
fn differs(
    point: &DiagramPoint,
    expected: Option<&(usize, usize, Vec<[f64; 2]>)>,
) -> Result<(), String> {
    let wrong = |what: &str| Err(format!("{what} {expected:?}: {point:?}"));
    if point.end != OrbitEnd::Completed {
        return wrong("ended");
    }
    let Some((hits, periods, impacts)) = expected else {
        let short = matches!(point.period, Period::Periodic(1..=8));
        return if short { wrong("short period") } else { Ok(()) };
    };
    // The simulator sums the end of a chatter.
    let chatters = impacts.iter().any(|[_, speed]| *speed < 10.0 * SLOW);
    let named = point.orbit.as_ref();
    let named = named
        .is_some_and(|name| (chatters || name.hits == [*hits as u32]) && name.periods == *periods);
    if !named || point.period != Period::Periodic(*periods) {
        return wrong("name");
    }
    let is_met = |&speed: &f64| {
        // The orbit is settled to 1e-7 of its extent.
        let near = |[_, other]: &[f64; 2]| (speed - other).abs() < 1e-5 * speed.max(1.0);
        speed == 0.0 || impacts.iter().any(near)
    };
    if point.values.iter().all(is_met) { Ok(()) } else { wrong("speeds") }
}

#[test]
fn attractors_have_the_periods_hits_and_speeds_of_exact_flight_on_both_sections() {
    let count = tiers::count(OSCILLATORS[0], OSCILLATORS[1]);
    let all: Vec<_> = (0..count).map(compared).collect();
    let wrong: Vec<&String> = all.iter().flat_map(|(_, wrong)| wrong).collect();
    assert!(wrong.is_empty(), "{}: {wrong:#?}", wrong.len());
    assert!(all.iter().any(|(periods, _)| periods.is_some_and(|periods| periods > 1)));
}

/// Oscillator of the scene, with its stop at an offset from the grazing position.
fn hard_obstacle(offset: f64) -> Oscillator {
    let grazing = 1.0 / (2.8 * 2.8 - 1.0);
    Oscillator { zeta: 0.0, alpha: 1.0, omega: 2.8, stop: grazing + offset, r: 0.8 }
}

/// Scene with its map on the measured window: on an open window guarded iteration would use the map
/// at any state.
fn phase_not_reduced() -> Case {
    let scene = scenes::parsed(PHASE_NOT_REDUCED, "f01_phase_not_reduced.toml", &scenes::NONE);
    let map = scene.graze().expect("a grazing orbit").map().expect("a map");
    Case { scene: map.scene().clone(), orbit: map.orbit().clone(), map: map.local().clone() }
}

/// Speeds and phases are printed to four digits and three.
///
/// At the second offset the oscillator has another attractor, `(5,4)`: the start lies in a part of
/// the basin of `(2,2)` that holds all states nearer than 0.01 in `x` and 0.02 in `theta`.
#[test]
fn the_undamped_oscillator_settles_on_two_impacts_in_two_periods() {
    let case = phase_not_reduced();
    let expected = [
        (-0.0432, [[0.148, 0.1926], [0.923, 0.2721]]),
        (-0.0638, [[0.199, 0.4078], [0.702, 0.3340]]),
    ];
    for (offset, impacts) in expected {
        let request = DiagramRequest {
            range: [offset, offset + 1e-12],
            points: 1,
            // Without damping, only impacts make deviations from the attractor die out.
            transient: 3000,
            with: vec![Method::Guarded, Method::Direct],
            observe: Observable::ImpactSpeed,
            starts: Starts::Given(vec![vec![Some(-0.45), None, Some(0.0)]]),
            ..case.scene.diagrams[0].clone()
        };
        let found = diagram(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
        for sweep in found.expect("a good scene").sweeps {
            let point = &sweep.points[0];
            assert_eq!(point.period, Period::Periodic(2), "{point:?}");
            assert_eq!(point.orbit.as_ref().map(ToString::to_string).as_deref(), Some("(2,2)"));
            // A return of two impacts has the speed of one of them.
            assert!(!point.values.is_empty());
            for &speed in &point.values {
                let near = |[_, other]: &[f64; 2]| (speed - other).abs() < 1e-4;
                assert!(impacts.iter().any(near), "{point:?}");
            }
        }
        // The printed numbers are those of exact flight from the same state.
        let start = [0, 1, 2].map(|place| case.orbit.grazing_point().state[place].to_f64());
        let start = [start[0] - 0.45, start[1], start[2]];
        let (hits, periods, met) = hard_obstacle(offset).attractor(start, 4000).expect("a period");
        assert_eq!((hits, periods), (2, 2));
        for [theta, speed] in met {
            let phase = (theta / TAU).rem_euclid(1.0);
            let near =
                |[at, other]: &[f64; 2]| (phase - at).abs() < 1e-3 && (speed - other).abs() < 1e-4;
            assert!(impacts.iter().any(near), "{phase} {speed}");
        }
    }
}

/// Linear oscillator far beyond its graze: it impacts once in two periods.
#[test]
fn states_of_the_tangency_section_go_where_exact_flight_takes_them() {
    let case = Case::of(scenes::scene_with("linear", &[("omega", "3.3")]));
    let request = BasinRequest {
        parameters: vec![0.5, 0.0],
        ranges: [[-2.0, -0.4], [-3.0, 3.0]],
        points: [5, 5],
        transient: 200,
        method: Method::Direct,
        ..BasinRequest::over_the_window(&case.map)
    };
    let found = basin(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
    let found = found.expect("a plane");
    assert_eq!(found.escaped.count, 0);
    let point = &case.orbit.grazing_point().state;
    let alpha = case.orbit.parameters()[scenes::index(&case.scene, "alpha")].to_f64() + 0.5;
    let oscillator = Oscillator { zeta: 0.05, alpha, omega: 3.3, stop: 1.0, r: 0.8 };
    for ([x, theta], class) in found.located() {
        let start = [point[0].to_f64() + x, 0.0, point[2].to_f64() + theta];
        let (hits, periods, _) = oscillator.attractor(start, 300).expect("a period");
        let BasinClass::Attractor(number) = class else { panic!("{x} {theta}: {class:?}") };
        let attractor = &found.attractors[number].attractor;
        let name = attractor.orbit.as_ref().expect("a period");
        assert_eq!((name.hits[0] as usize, name.periods), (hits, periods), "{x} {theta}");
        assert_eq!(attractor.period, Period::Periodic(periods));
    }
}

#[test]
fn what_is_measured_beside_a_graze_does_not_escape_by_its_phase() {
    let case = Case::of(scenes::scene_with("linear", &[("omega", "3.3")]));
    let sides = measure_graze(&case.scene, &case.orbit, &case.map, "alpha").expect("active");
    for side in sides {
        assert_eq!(side.end, OrbitEnd::Completed, "{side:?}");
        assert_eq!(side.contact, side.offset > 0.0, "{side:?}");
    }
}

/// Orbits that differ by whole periods of the phase are one, on one branch; the orbit with one
/// impact in two periods has the determinant of its impact and of its damped flight.
#[test]
fn a_branch_of_orbits_that_return_every_second_period_is_listed_once() {
    let case = Case::of(scenes::scene_with("linear", &[("omega", "3.3")]));
    let request = BranchRequest {
        itineraries: vec![ContactItinerary::parse("1", 1).expect("digits")],
        longest: 1,
        along: 0,
        range: [0.4, 0.6],
        at: vec![0.0; 2],
        direct: true,
        starts: Vec::new(),
    };
    let found = branches(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
    let found = found.expect("a good scene").branches;
    let every_second = |branch: &&Branch| branch.points.iter().any(|point| point.orbit.turns == 1);
    let [branch] = found.iter().filter(every_second).collect::<Vec<_>>()[..] else {
        panic!("{} branches", found.len())
    };
    let determinant = (0.8f64).powi(2) * (-2.0 * 0.05 * 2.0 * TAU / 3.3).exp();
    for point in &branch.points {
        let [[a, b], [c, d]] = point.orbit.multipliers[..] else { panic!("{point:?}") };
        // Both real, or a pair: the product has no imaginary part.
        assert!((a * c - b * d - determinant).abs() < 1e-9, "{point:?}");
    }
}

/// Attractors are the same if the phase counts half the forcing's phase, with half its period.
#[test]
fn attractors_do_not_depend_on_how_the_phase_is_counted() {
    let omega = 3.3;
    for (rate, period, phase) in [("omega", "2*pi", "theta"), ("omega/2", "pi", "2*theta")] {
        let set = [
            ("omega", "3.3".to_owned()),
            ("model.phase.rate", format!("\"{rate}\"")),
            ("model.phase.period", format!("\"{period}\"")),
            ("model.flow.v", format!("\"alpha*cos({phase}) - 2*zeta*v - x\"")),
        ];
        let case = Case::of(scenes::scene_with("linear", &set));
        let alpha = case.orbit.parameters()[scenes::index(&case.scene, "alpha")].to_f64() + 0.5;
        let oscillator = Oscillator { zeta: 0.05, alpha, omega, stop: 1.0, r: 0.8 };
        let (hits, periods, _) = oscillator.attractor([0.5, 0.0, 1.0], 300).expect("a period");
        let point = settled(&case, 0.5, &[("x", -0.4), ("theta", 0.2)], Observable::EventFunction);
        let name = point.orbit.expect("a period");
        assert_eq!([name.hits[0] as usize, name.periods], [hits, periods], "{rate}");
        assert_eq!(point.period, Period::Periodic(periods), "{rate}");
    }
}

/// The linear oscillator driven by a limit cycle, `(c, s)` on a circle, in place of a phase.
const DRIVEN_BY_A_CYCLE: &str = r#"
[model]
name = "linear oscillator driven by a limit cycle"
states = ["x", "v", "c", "s"]
parameters = { zeta = 0.05, delta = 1.0, r = 0.8, alpha = 9.9, omega = 3.3 }
[model.flow]
x = "v"
v = "alpha*c - 2*zeta*v - x"
c = "c*(1 - c^2 - s^2) - omega*s"
s = "s*(1 - c^2 - s^2) + omega*c"
[[model.surface]]
name = "stop"
event = "delta - x"
impact = { v = "-r*v" }
[grazing]
surface = "stop"
solve_for = "alpha"
guess = { x = 1.0, v = 0.0, c = -1.0, s = 0.03 }
[expansion]
active = ["alpha"]
smooth_order = 1
contact_weight = 2
[[diagram]]
parameter = "alpha"
range = [0.0, 1.0]
points = 1
"#;

/// Without a phase, forcing periods are not counted: an attractor has the returns and impacts of
/// the same oscillator with a phase.
#[test]
fn an_autonomous_system_has_the_attractors_of_the_same_oscillator_with_a_phase() {
    let case = Case::of(scenes::parsed(DRIVEN_BY_A_CYCLE, "driven_by_a_cycle", &scenes::NONE));
    let graze = case.orbit.grazing_point();
    let theta = graze.state[3].to_f64().atan2(graze.state[2].to_f64());
    let alpha = graze.parameters[scenes::index(&case.scene, "alpha")].to_f64() + 0.5;
    let oscillator = Oscillator { zeta: 0.05, alpha, omega: 3.3, stop: 1.0, r: 0.8 };
    let (hits, periods, impacts) =
        oscillator.attractor([0.6, 0.0, theta + 0.2], 600).expect("a period");
    // One impact in two periods, and no other maximum.
    assert_eq!((hits, periods), (1, 2));
    let moved = [(theta + 0.2).cos() - theta.cos(), (theta + 0.2).sin() - theta.sin()];
    let start = [("x", -0.4), ("c", moved[0]), ("s", moved[1])];
    let point = settled(&case, 0.5, &start, Observable::ImpactSpeed);
    assert_eq!((point.end, point.period), (OrbitEnd::Completed, Period::Periodic(1)), "{point:?}");
    let name = point.orbit.expect("a period");
    assert_eq!((&name.hits[..], name.periods), (&[1][..], 1));
    // The orbit is settled to 1e-7 of its extent.
    let far = |&speed: &f64| (speed - impacts[0][1]).abs() > 1e-6;
    assert!(!point.values.iter().any(far), "{:?} for {impacts:?}", point.values);
}

/// Orbits whose phase advances by whole periods are the same in lanes and alone.
#[test]
fn orbits_whose_phase_goes_round_are_the_same_in_lanes() {
    let case = Case::of(scenes::scene_with("linear", &[("omega", "3.3")]));
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let request = OrbitRequest::new(400, 12, &[1.0, 1.0])
        .escaping_at(&[100.0, f64::INFINITY])
        .on_circle(direct.circle());
    let offsets: Vec<[f64; 2]> =
        (0..8).map(|number| [0.3 + 0.1 * f64::from(number), 0.0]).collect();
    let parameters: Vec<&[f64]> = offsets.iter().map(|own| &own[..]).collect();
    let start = [-0.5, 0.3];
    let alone: Vec<MapOrbit> =
        parameters.iter().map(|own| MapOrbit::of(&direct, &start, own, &request)).collect();
    assert!(alone.iter().any(|orbit| orbit.turns() > 0), "{alone:?}");
    let phases = alone.iter().flat_map(|orbit| orbit.states().map(|state| state[1]));
    assert!(phases.into_iter().all(|phase| phase.abs() <= 0.5 * TAU));
    if let Some(mut lanes) = direct.in_lanes::<8>(&parameters) {
        assert_eq!(lanes.orbits(&[&start[..]; 8], &request), alone);
    }
}

/// The exponent per return of an orbit without contact is `−ζ T`, with the period T, however many
/// iterates are kept.
#[test]
fn the_exponent_of_a_periodic_orbit_does_not_depend_on_the_iterates_kept() {
    let case = Case::new("linear");
    for keep in [13, 16, 32] {
        let request = DiagramRequest {
            range: [-9e-4, -1e-4],
            points: 3,
            transient: 400,
            keep,
            with: vec![Method::Map, Method::Guarded],
            ..case.scene.diagrams[0].clone()
        };
        let found = diagram(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
        let sweeps = found.expect("active").sweeps;
        for point in sweeps.iter().flat_map(|sweep| &sweep.points) {
            // Guarded iteration has no derivative where it simulates a contact.
            if point.kept_contacts > 0 {
                continue;
            }
            let exponent = point.lyapunov.expect("a derivative");
            // Orders 5 and 8 have the multipliers to ten digits in this window.
            assert!((exponent + 0.05 * TAU / 1.8).abs() < 1e-9, "{keep}: {exponent}");
            assert_eq!(point.lyapunov_error, None);
        }
    }
}

/// States beyond the stop in a stroboscopic plane are not states of the oscillator.
#[test]
fn states_beyond_a_rigid_stop_have_no_image_and_do_not_escape() {
    let set = [("section.kind", "\"stroboscopic\""), ("section.phase", "\"0\"")];
    let case = Case::of(scenes::scene_with("linear", &set));
    let request = BasinRequest {
        parameters: vec![-5e-4, 0.0],
        ranges: [[-1.0, 3.0], [-1.0, 1.0]],
        points: [16, 5],
        method: Method::Direct,
        ..BasinRequest::over_the_window(&case.map)
    };
    let found = basin(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
    let found = found.expect("a plane");
    let origin = case.orbit.section_point[0].to_f64();
    assert_eq!(found.escaped.count, 0);
    for ([x, _], class) in found.located() {
        assert_eq!(class == BasinClass::NoImage, origin + x > 1.0, "{x}: {class:?}");
    }
}

/// The window at a very stiff support is a billionth of the orbit's size: states of the period
/// agree only to rounding.
#[test]
fn a_linear_orbit_beside_a_support_that_is_nearly_rigid_has_period_one() {
    let stiff = scenes::parsed(BILINEAR_RIG, "bilinear_rig.toml", &[("beta", "1e12")]);
    let mut case = Case::of(stiff);
    case.map.window.state = vec![2.6e-9, 3.4e-3];
    case.map.window.parameter = vec![1.9e-4, 1.3e-4];
    case.map.window.depth = 1.8e-15;
    let sides = measure_graze(&case.scene, &case.orbit, &case.map, "w").expect("active");
    for side in &sides[..2] {
        assert_eq!((side.period, side.contact), (Period::Periodic(1), false), "{side:?}");
    }
}
