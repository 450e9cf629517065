//! Oscillator between two stops whose grazing orbit touches both: contacts with each stop by direct
//! simulation.
//!
//! `x'' = α cos θ − 2ζ v − x` between `x = ±δ`: the free orbit is `x = A cos(θ − φ)`, so that at
//! `α*` it grazes the right stop at `θ = φ` and the left one half a period later.

use std::f64::consts::PI;

use grazemap::analysis::diagram::{
    DiagramPlan, DirectSweep, Observer, SmoothFixedPoint, SweepRequest, run_plan,
};
use grazemap::analysis::{DirectImage, DirectMap, NoProgress, SectionImage, itinerary};
use grazemap::expansion::{Expander, MapOrders, MapWindow};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, OrbitRequest, Period};
use grazemap::model::{Observable, Scene, SweepDirection};
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

use crate::support::scenes::orbit;

const OMEGA: f64 = 0.7;

fn scene(section: &str, periods: usize) -> Scene {
    let text = format!(
        r#"
[model]
name = "an oscillator between two stops"
states = ["x", "v"]
parameters = {{ zeta = 0.05, delta = 1.0, r = 0.8, alpha = 0.55, omega = {OMEGA} }}
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "v"
v = "alpha*cos(theta) - 2*zeta*v - x"
[[model.surface]]
name = "left"
event = "delta + x"
impact = {{ v = "-r*v" }}
[[model.surface]]
name = "right"
event = "delta - x"
impact = {{ v = "-r*v" }}
[grazing]
passages = ["right", "left"]
symmetry = "half-period"
solve_for = "alpha"
[section]
{section}
[expansion]
active = ["alpha"]
"#
    );
    let mut scene = Scene::parse(&text, "two stops").unwrap_or_else(|error| panic!("{error}"));
    scene.grazing.periods = periods;
    scene
}

const TANGENCY: &str = "kind = \"tangency\"";

/// The section at a phase after that of the right graze.
fn at_phase(after: f64) -> String {
    let phase = graze_phase() + after;
    format!("kind = \"stroboscopic\"\nphase = \"{phase:.17}\"")
}

/// `φ`, the phase by which the response lags.
fn graze_phase() -> f64 {
    (0.1 * OMEGA).atan2(1.0 - OMEGA * OMEGA)
}

/// Grazing orbit at the right stop, without the left stop; over several forcing periods it repeats
/// itself.
fn one_sided(scene: &Scene) -> GrazingOrbit {
    let mut once = scene.clone();
    once.grazing.periods = 1;
    let mut orbit = orbit(&once);
    orbit.period *= Dd::from(scene.grazing.periods as f64);
    orbit.passages.truncate(1);
    let phase = orbit.grazing_point().state[2].to_f64();
    assert!((phase - graze_phase()).abs() < 1e-14);
    orbit
}

/// Orbit with every touch of one of its periods: right, left, right, ..., half a forcing period
/// apart.
fn two_sided(scene: &Scene) -> GrazingOrbit {
    let mut orbit = one_sided(scene);
    let right = orbit.passages[0].clone();
    let touches = 2 * scene.grazing.periods;
    orbit.passages = (0..touches)
        .map(|number| {
            let mut touch = right.clone();
            touch.time = orbit.period * Dd::from(number as f64 / touches as f64);
            if number % 2 == 1 {
                touch.surface = 0;
                touch.state[0] = -touch.state[0];
                touch.state[1] = -touch.state[1];
                touch.state[2] += Dd::PI;
            }
            touch
        })
        .collect();
    orbit
}

/// Last of many images at an offset of `alpha`: the attractor.
fn settled(scene: &Scene, orbit: &GrazingOrbit, alpha: f64) -> SectionImage<f64> {
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::new(&system, scene, orbit).expect("good input");
    let mut image = direct.image(&[0.0; 2], &[alpha]).expect("finite offsets");
    for _ in 0..300 {
        image = direct.image(&image.offsets, &[alpha]).expect("an image");
    }
    image
}

/// Offset beyond grazing at which the attractor hits each stop once a period.
const BEYOND: f64 = 0.145;

#[test]
fn passages_are_numbered_in_the_order_in_which_they_follow_the_section() {
    let passages = |section: &str, periods| {
        let scene = scene(section, periods);
        itinerary(&scene, &two_sided(&scene)).passages
    };
    let (left, right) = (0, 1);
    assert_eq!(passages(TANGENCY, 1), [right, left]);
    assert_eq!(passages("kind = \"stroboscopic\"", 1), [right, left]);
    assert_eq!(passages(&at_phase(-0.5), 1), [right, left]);
    assert_eq!(passages(&at_phase(0.5), 1), [left, right]);
    assert_eq!(passages(&at_phase(PI + 0.5), 1), [right, left]);
    assert_eq!(passages(&at_phase(0.5), 2), [left, right, left, right]);
}

#[test]
fn an_orbit_without_the_other_stop_names_its_own_surface_alone() {
    let scene = scene(TANGENCY, 1);
    let itinerary = itinerary(&scene, &one_sided(&scene));
    assert_eq!(itinerary.surfaces, ["right"]);
}

#[test]
fn contacts_belong_to_the_passage_of_their_surface_on_every_section() {
    let stroboscopic = "kind = \"stroboscopic\"".to_owned();
    let sections = [TANGENCY.to_owned(), stroboscopic, at_phase(-1.0), at_phase(1.0)];
    let mut speeds: Vec<Vec<f64>> = Vec::new();
    for section in &sections {
        let scene = scene(section, 1);
        let orbit = two_sided(&scene);
        let found = settled(&scene, &orbit, BEYOND);
        assert_eq!((found.contacts, found.extra_contacts), (2, 0), "{section}");
        assert_eq!(found.hits, [1, 1], "{section}");
        let mut both: Vec<f64> = found.passages.into_iter().flatten().collect();
        both.sort_by(f64::total_cmp);
        speeds.push(both);
        let below = settled(&scene, &orbit, -1e-2);
        assert_eq!(below.passages, [None, None], "{section}");
        assert_eq!((below.contacts, below.hits), (0, vec![0, 0]), "{section}");
    }
    // One orbit, or its mirror image, seen from four sections: a slow contact and a fast one.
    for both in &speeds {
        let mut pairs = both.iter().zip(&speeds[0]);
        assert!(pairs.all(|(a, b)| (a - b).abs() < 1e-10), "{speeds:?}");
    }
}

#[test]
fn a_contact_of_one_stop_alone_is_told_from_that_of_the_other() {
    let scene = scene(&at_phase(0.5 * PI), 1);
    let system = HybridSystem::new(&scene.model);
    let orbit = two_sided(&scene);
    let map = DirectMap::new(&system, &scene, &orbit).expect("good input");
    let mut seen = std::collections::BTreeSet::new();
    for x in [-4e-3, 0.0, 4e-3] {
        for v in [-4e-3, 0.0, 4e-3] {
            let mut step_image = [0.0; 2];
            let info = map.step(&[x, v], &[0.0], &mut step_image);
            let simulated = map.simulate(&[x, v], &[0.0]).expect("finite");
            let speeds = &simulated.passages;
            let made: Vec<usize> = (0..2).filter(|&k| speeds[k].is_some()).collect();
            assert_eq!(info.passages.iter().collect::<Vec<_>>(), made);
            assert_eq!(info.contacts() as usize, simulated.contacts);
            // h'' = ω² δ at either graze.
            let depth = |speed: &f64| speed * speed / (2.0 * OMEGA * OMEGA);
            let deepest = speeds.iter().flatten().map(depth).fold(0.0, f64::max);
            assert!((info.depth - deepest).abs() < 1e-12, "{} {deepest}", info.depth);
            // The left stop comes first after the section, and is the first surface of the model.
            assert_eq!(simulated.hits, [speeds[0], speeds[1]].map(|s| usize::from(s.is_some())));
            seen.insert(made);
        }
    }
    assert!(seen.contains(&vec![0]) && seen.contains(&vec![1]), "{seen:?}");
}

#[test]
fn a_contact_at_a_stop_that_does_not_graze_is_extra() {
    let scene = scene(TANGENCY, 1);
    let found = settled(&scene, &one_sided(&scene), BEYOND);
    assert_eq!(found.passages.len(), 1);
    assert_eq!((found.contacts, found.extra_contacts), (1, 1));
    assert_eq!(found.hits, [1, 1]);
}

#[test]
fn direct_diagrams_name_orbits_by_their_hits_at_either_stop() {
    let scene = scene(TANGENCY, 1);
    let (system, one, two) =
        (HybridSystem::new(&scene.model), one_sided(&scene), two_sided(&scene));
    let orders = MapOrders { smooth_order: 2, contact_weight: 2 };
    let map = Expander::new(&scene, &one).and_then(|expander| expander.expand(orders));
    let map = map.expect("a simple graze");
    let observer = Observer::new(&scene, &one, &map, &Observable::EventFunction);
    let sweep = DirectSweep {
        map: DirectMap::new(&system, &scene, &two).expect("good input"),
        start: SmoothFixedPoint::new(&map),
        observer: observer.expect("no impact speed"),
        itinerary: itinerary(&scene, &two),
    };
    let plan = DiagramPlan {
        maps: vec![Box::new(sweep)],
        direction: SweepDirection::Up,
        request: SweepRequest {
            parameter: 0,
            offsets: vec![-1e-2, BEYOND],
            starts: Vec::new(),
            orbit: OrbitRequest::new(400, 20, &[1.0, 1.0]),
            window: MapWindow { depth: 1.0, state: vec![1.0; 2], parameter: vec![1.0] },
        },
    };
    let sweep = &run_plan(&plan, &NoProgress)[0];
    assert_eq!(sweep.points[0].period, Period::Periodic(1));
    let names = sweep.points.iter().map(|point| point.orbit.as_ref());
    let names: Vec<_> = names.map(|name| name.map(ToString::to_string)).collect();
    let expected = ["(0,0,1)", "(1,1,1)"];
    assert_eq!(names, expected.map(|name| Some(name.to_owned())));
}
