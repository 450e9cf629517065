//! Attractors that do not come back to the tangency section once in a forcing period, against the
//! stroboscopic section and against exact flight between impacts, which shares nothing with the
//! simulator.

use std::f64::consts::TAU;

use grazemap::analysis::basin::{BasinClass, BasinRequest, basin};
use grazemap::analysis::branches::{Branch, BranchRequest, branches};
use grazemap::analysis::diagram::{DiagramPoint, diagram, measure_graze};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, MapOrbit, OrbitEnd, OrbitRequest, Period};
use grazemap::model::{DiagramRequest, Method, Observable, Starts};

use crate::Case;
use crate::support::exact_flight::{Oscillator, drawn};
use crate::support::scenes;

const PHASE_NOT_REDUCED: &str = include_str!("../data/outside/f01_phase_not_reduced.toml");
const BILINEAR_RIG: &str = include_str!("../data/outside/p01_bilinear_rig.toml");

/// The diagram of direct simulation at one offset, begun at a state in offsets.
fn settled(case: &Case, offset: f64, start: [(&str, f64); 2], observe: Observable) -> DiagramPoint {
    let names = case.scene.model.full_state_names();
    let at = |name: &&str| start.iter().find(|(other, _)| other == name).map(|(_, value)| *value);
    let state = names.iter().map(|name| at(&&**name)).collect();
    let request = DiagramRequest {
        range: [offset, offset + 1e-12],
        points: 1,
        transient: 600,
        keep: 32,
        with: vec![Method::Direct],
        observe,
        starts: Starts::Given(vec![state]),
        ..case.scene.diagrams[0].clone()
    };
    let found = diagram(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
    found.expect("a good scene").sweeps[0].points[0].clone()
}

/// Oscillators of the sequence that are compared.
const OSCILLATORS: usize = 6;

#[test]
fn attractors_have_the_periods_hits_and_speeds_of_exact_flight_on_both_sections() {
    let mut several = 0;
    for number in 0..OSCILLATORS {
        let omega = drawn(number, 0, [0.3, 6.0]);
        let (zeta, r) = (drawn(number, 1, [0.02, 0.2]), drawn(number, 2, [0.4, 0.9]));
        let size = ((1.0 - omega * omega).powi(2) + (2.0 * zeta * omega).powi(2)).sqrt();
        let offset = size * drawn(number, 3, [0.05, 0.6]);
        let alpha = size + offset;
        let oscillator = Oscillator { zeta, alpha, omega, stop: 1.0, r };
        let set = |section: &str| {
            let text = |value: f64| format!("{value:e}");
            let keys = ["omega", "zeta", "r", "section.kind"].map(str::to_owned);
            let values = [text(omega), text(zeta), text(r), format!("\"{section}\"")];
            let set: Vec<_> = keys.into_iter().zip(values).collect();
            Case::of(scenes::scene_with("linear", &set))
        };
        let [tangency, stroboscopic] = ["tangency", "stroboscopic"].map(set);
        // From rest at 0.4 beside the stop, half a radian after the graze; the other section is
        // reached by exact flight.
        let graze = tangency.orbit.grazing_point().state[2].to_f64();
        let start = [0.6, 0.0, graze + 0.5];
        let (strobe, _) = oscillator.simulated(start, (TAU - 0.5) / omega);
        let expected = oscillator.attractor(start, 600);
        let speed = || Observable::ImpactSpeed;
        let found = [
            settled(&tangency, offset, [("x", -0.4), ("theta", 0.5)], speed()),
            settled(&stroboscopic, offset, [("x", strobe[0] - 1.0), ("v", strobe[1])], speed()),
        ];
        for point in &found {
            let at = format!("{number}: {oscillator:?}");
            assert_eq!(point.end, OrbitEnd::Completed, "{at}");
            let Some((hits, periods, impacts)) = &expected else {
                assert!(!matches!(point.period, Period::Periodic(1..=8)), "{at}: {point:?}");
                continue;
            };
            assert_eq!(point.period, Period::Periodic(*periods), "{at}: {point:?}");
            let name = point.orbit.as_ref().expect("a period");
            assert_eq!((&name.hits[..], name.periods), (&[*hits as u32][..], *periods), "{at}");
            for &speed in point.values.iter().filter(|&&speed| speed > 0.0) {
                // The orbit is settled to 1e-7 of its extent.
                let near = |[_, other]: &[f64; 2]| (speed - other).abs() < 1e-5 * speed.max(1.0);
                assert!(impacts.iter().any(near), "{at}: {speed} of {impacts:?}");
            }
        }
        if let Some((_, periods, _)) = expected {
            several += usize::from(periods > 1);
        }
    }
    assert!(several > 0);
}

/// The oscillator of the scene, its stop so far from where it grazes.
fn hard_obstacle(offset: f64) -> Oscillator {
    let grazing = 1.0 / (2.8 * 2.8 - 1.0);
    Oscillator { zeta: 0.0, alpha: 1.0, omega: 2.8, stop: grazing + offset, r: 0.8 }
}

fn phase_not_reduced() -> Case {
    Case::of(scenes::parsed(PHASE_NOT_REDUCED, "f01_phase_not_reduced.toml", &scenes::NONE))
}

/// Speeds and phases are printed to four digits and three.
#[test]
fn the_undamped_oscillator_settles_on_two_impacts_in_two_periods() {
    let case = phase_not_reduced();
    let expected = [
        (-0.0432, [[0.148, 0.1926], [0.923, 0.2721]]),
        (-0.0638, [[0.199, 0.4079], [0.702, 0.3342]]),
    ];
    for (offset, impacts) in expected {
        let request = DiagramRequest {
            range: [offset, offset + 1e-12],
            points: 1,
            // Without damping what is not the attractor's dies out at impacts alone.
            transient: 3000,
            with: vec![Method::Guarded, Method::Direct],
            observe: Observable::ImpactSpeed,
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
        // The printed numbers are those of exact flight.
        let (hits, periods, met) =
            hard_obstacle(offset).attractor([-0.3, 0.1, 0.0], 4000).expect("a period");
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

/// Half of the forcing's phase with half its period says the same.
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
        let point = settled(&case, 0.5, [("x", -0.4), ("theta", 0.2)], Observable::EventFunction);
        let name = point.orbit.expect("a period");
        assert_eq!([name.hits[0] as usize, name.periods], [hits, periods], "{rate}");
        assert_eq!(point.period, Period::Periodic(periods), "{rate}");
    }
}

/// Lanes and single orbits take the same periods off a phase that goes round.
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

/// An orbit without contact returns to itself as `exp(−ζ T)` turned by an angle: its exponent is
/// `−ζ T` however many iterates are kept.
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

/// A stroboscopic plane has states beyond the stop, which are none of the oscillator's.
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

/// The window of a support so stiff is a billionth of the orbit: its states repeat to rounding.
#[test]
fn a_linear_orbit_beside_a_support_that_is_nearly_rigid_has_period_one() {
    let stiff = scenes::parsed(BILINEAR_RIG, "p01_bilinear_rig.toml", &[("beta", "1e12")]);
    let mut case = Case::of(stiff);
    case.map.window.state = vec![2.6e-9, 3.4e-3];
    case.map.window.parameter = vec![1.9e-4, 1.3e-4];
    case.map.window.depth = 1.8e-15;
    let sides = measure_graze(&case.scene, &case.orbit, &case.map, "w").expect("active");
    for side in &sides[..2] {
        assert_eq!((side.period, side.contact), (Period::Periodic(1), false), "{side:?}");
    }
}
