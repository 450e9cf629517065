//! Crises compared with iteration: on one side of the curve an attractor stays in its bands.

use grazemap::Map;
use grazemap::analysis::loci::{LociRequest, Locus, LocusKind, LocusPoint};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::prelude::{FindGraze, Scene};

/// Map of the beam with a period-adding cascade of attractors, whose seven-band attractor ends in a
/// crisis.
fn beam() -> Map {
    let scene = Scene::of_catalogue("cantilever_3_5_soft").expect("a scene");
    scene.graze().and_then(|graze| graze.map()).expect("a map")
}

/// Crisis at the saddle `1100000` in the amplitude and the distance of the stop.
fn crisis(map: &Map, direct: bool) -> Locus {
    let request = LociRequest {
        plane: [1, 0],
        range: [-2e-6, 2e-6],
        at: vec![0.0; 2],
        kinds: vec![LocusKind::Crisis],
        itineraries: vec![ContactItinerary::parse("1100000", 1).expect("digits")],
        direct,
    };
    let found = map.loci(&request, &NoProgress).expect("loci").loci;
    assert_eq!(found.len(), 1, "crises");
    found[0].clone()
}

/// Number of returns until the deep contacts, which mark the phase of the bands, are no longer
/// seven returns apart; `most` if they always are.
fn returns_in_bands(
    map: &dyn DiscreteMap,
    parameters: &[f64],
    start: &[f64],
    most: usize,
) -> usize {
    let (mut state, mut image) = (start.to_vec(), vec![0.0; 2]);
    let mut last = None;
    for number in 0..most {
        let step = map.step(&state, parameters, &mut image);
        assert!(step.valid, "no image of {state:?}");
        if step.depth > 1e-6 {
            if last.is_some_and(|last| number - last != 7) {
                return number;
            }
            last = Some(number);
        }
        state.copy_from_slice(&image);
    }
    most
}

/// Graze on the attractor at the crisis, and its parameters.
fn graze(locus: &Locus) -> (Vec<f64>, [f64; 2]) {
    let size = |point: &&LocusPoint| point.parameters[1].abs();
    let points = locus.points.iter();
    let middle = points.min_by(|a, b| size(a).total_cmp(&size(b))).expect("points");
    let [number, _] = locus.grazing.expect("a graze");
    (middle.states[number].clone(), [middle.parameters[0], middle.parameters[1]])
}

/// Distance above the crisis, as a share of its parameter, at which no other attractor is known.
const FAR: f64 = 5e-3;

/// State on the attractor at a distance above the crisis, continued there from [`FAR`].
fn settled(map: &dyn DiscreteMap, graze: &[f64], [q, beta]: [f64; 2], share: f64) -> Vec<f64> {
    let (mut state, mut image) = (graze.to_vec(), vec![0.0; 2]);
    let mut iterate = |away: f64, returns: usize| {
        for _ in 0..returns {
            assert!(map.step(&state, &[q * (1.0 + away), beta], &mut image).valid);
            state.copy_from_slice(&image);
        }
    };
    iterate(FAR, 10_000);
    let mut away = FAR;
    while away > share.max(1e-9) {
        away = (0.7 * away).max(share.max(1e-9));
        iterate(away, 70);
    }
    iterate(share, 7);
    state
}

/// Number of returns in bands at a distance above the crisis.
fn bands_at(map: &dyn DiscreteMap, locus: &Locus, share: f64, most: usize) -> usize {
    let (start, [q, beta]) = graze(locus);
    let start = settled(map, &start, [q, beta], share);
    returns_in_bands(map, &[q * (1.0 + share), beta], &start, most)
}

#[test]
fn manifolds_that_meet_without_an_attractor_are_no_crisis() {
    // The manifolds of the saddle meet near a half-width of the window, where the oscillator
    // settles on a stable orbit of seven returns on both sides.
    let text = r#"
[model]
states = ["x", "v"]
parameters = { c = 3.0, k = 0.8, g = 0.9, r = 0.65, A = 1.0, w = 3.0 }
phase = { name = "th", rate = "w", period = "2*pi" }

[model.flow]
x = "v"
v = "A*cos(th) - c*v - k*x"

[[model.surface]]
name = "wall"
event = "g - x"
impact = { v = "-r*v" }

[grazing]
solve_for = "A"

[section]
kind = "tangency"

[expansion]
active = ["A", "w"]
smooth_order = 7
contact_weight = 9
"#;
    let scene = Scene::parse(text, "damped.toml").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let width = map.local().window.parameter[1];
    let request = LociRequest {
        plane: [1, 0],
        range: [-width, width],
        at: vec![0.0; 2],
        kinds: vec![LocusKind::Crisis],
        itineraries: vec![ContactItinerary::parse("1100000", 1).expect("digits")],
        direct: false,
    };
    let found = map.loci(&request, &NoProgress).expect("loci").loci;
    assert!(found.is_empty(), "{} crises", found.len());
}

#[test]
fn seven_bands_of_the_map_end_at_its_crisis() {
    let map = beam();
    let locus = crisis(&map, false);
    assert!(locus.points.len() > 2 && locus.points.iter().all(|point| point.physical));
    let horner = HornerMap::new(map.local());
    for share in [1e-9, 1e-6, 1e-3] {
        assert_eq!(bands_at(&horner, &locus, share, 400_000), 400_000, "{share:e} above");
    }
    for share in [-1e-4, -1e-3] {
        assert!(bands_at(&horner, &locus, share, 400_000) < 400_000, "{share:e}");
    }
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn seven_bands_of_direct_simulation_end_at_its_crisis() {
    let map = beam();
    let locus = crisis(&map, true);
    let system = HybridSystem::new(&map.scene().model);
    let direct = DirectMap::new(&system, map.scene(), map.orbit()).expect("a section");
    // The map's crisis lies as far from it as the map errs.
    let apart = graze(&locus).1[0] / graze(&crisis(&map, false)).1[0] - 1.0;
    assert!((1e-4..1e-2).contains(&apart.abs()), "{apart:e}");
    for share in [1e-6, 1e-3] {
        assert_eq!(bands_at(&direct, &locus, share, 30_000), 30_000, "{share:e} above");
    }
    for share in [-1e-3, -3e-3] {
        assert!(bands_at(&direct, &locus, share, 30_000) < 30_000, "{share:e}");
    }
}
