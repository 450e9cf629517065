//! Contract test that every [`DiscreteMap`] passes.

use grazemap::analysis::DirectMap;
use grazemap::expansion::{LocalMap, SectionKind, Stage};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{
    DiscreteMap, HornerMap, InterpretedMap, MapOrbit, OrbitEnd, OrbitRequest, PassageSet, StepInfo,
    largest_lyapunov_exponent,
};

use crate::support::scenes::grazing;
use crate::support::synthetic::{self, Numbers};

/// Points at which a map is tested: states and parameters of its window.
type Points = Vec<(Vec<f64>, Vec<f64>)>;

/// Step of the central differences that a Jacobian is compared with, and tolerance relative to the
/// largest entry.
#[derive(Clone, Copy)]
struct Differences {
    step: f64,
    tolerance: f64,
}

/// Differences in double precision. The step is small compared with the depths of the windows, 1e-5
/// and more, below which a root of the depth bends within a step; rounding of images of order 1 is
/// then 1e-8 of an entry.
const DOUBLE: Differences = Differences { step: 1e-8, tolerance: 1e-6 };

/// Differences in single precision. Rounding of images of order 1 is 1e-4 of an entry, the bend of
/// a root of the depth 0.01 a few 1e-3.
const SINGLE: Differences = Differences { step: 5e-4, tolerance: 1e-2 };

/// Checks the contract at these points.
fn check(map: &dyn DiscreteMap, points: &Points) {
    check_by(DOUBLE, map, points);
}

/// Checks the contract at these points with these differences.
///
/// The Jacobian is compared with central differences where both sides of the difference made the
/// same contacts, away from `depth = 0`, where the slope of `y` varies on the scale of the depth
/// itself.
fn check_by(differences: Differences, map: &dyn DiscreteMap, points: &Points) {
    let mut contacts = [0usize; 2];
    for (state, parameters) in points {
        assert_eq!((state.len(), parameters.len()), (map.dimension(), map.parameters()));
        let (image, info) = step(map, state, parameters);
        assert!(
            info.valid && image.iter().all(|value| value.is_finite()),
            "image at {state:?}: {image:?}"
        );
        assert_eq!((image.clone(), info), step(map, state, parameters), "a step is deterministic");
        assert_eq!(!info.passages.is_empty(), info.depth > 0.0, "a contact has a positive depth");
        let (same, jacobian, same_info) = step_jacobian(map, state, parameters);
        assert_eq!(info.passages, same_info.passages);
        for (a, b) in same.iter().zip(&image) {
            assert!(
                (a - b).abs() <= 1e-13 * (1.0 + b.abs()),
                "images of the two steps: {a} and {b}"
            );
        }
        contacts[usize::from(!info.passages.is_empty())] += 1;
        if info.depth == 0.0 || info.depth > 1e-2 {
            check_jacobian(differences, map, state, parameters, info, &jacobian);
        }
    }
    assert!(contacts[0] > 0 && contacts[1] > 0, "points with and without contact: {contacts:?}");
    let infinite = vec![f64::INFINITY; map.dimension()];
    assert!(!step(map, &infinite, &points[0].1).1.valid, "no image of infinity");
}

fn check_jacobian(
    differences: Differences,
    map: &dyn DiscreteMap,
    state: &[f64],
    parameters: &[f64],
    info: StepInfo,
    jacobian: &[f64],
) {
    let Differences { step: width, tolerance } = differences;
    let dimension = map.dimension();
    let size = jacobian.iter().fold(1.0f64, |size, value| size.max(value.abs()));
    for column in 0..dimension {
        let moved = |offset: f64| {
            let mut state = state.to_vec();
            state[column] += offset;
            step(map, &state, parameters)
        };
        let ((above, up), (below, down)) = (moved(width), moved(-width));
        if up.passages != info.passages || down.passages != info.passages {
            continue;
        }
        for row in 0..dimension {
            let difference = (above[row] - below[row]) / (2.0 * width);
            let entry = jacobian[row * dimension + column];
            assert!(
                (difference - entry).abs() < tolerance * size,
                "entry ({row}, {column}): {entry}, difference {difference}"
            );
        }
    }
}

fn step(map: &dyn DiscreteMap, state: &[f64], parameters: &[f64]) -> (Vec<f64>, StepInfo) {
    let mut image = vec![f64::NAN; map.dimension()];
    let info = map.step(state, parameters, &mut image);
    (image, info)
}

fn step_jacobian(
    map: &dyn DiscreteMap,
    state: &[f64],
    parameters: &[f64],
) -> (Vec<f64>, Vec<f64>, StepInfo) {
    let (mut image, mut jacobian) =
        (vec![f64::NAN; map.dimension()], vec![f64::NAN; map.dimension().pow(2)]);
    let info = map.step_jacobian(state, parameters, &mut image, &mut jacobian);
    (image, jacobian, info)
}

fn points(count: usize) -> Points {
    let mut numbers = Numbers::new(3);
    (0..count)
        .map(|_| synthetic::point(&mut numbers))
        .map(|(state, parameters)| (state.into(), parameters.into()))
        .collect()
}

#[test]
fn interpreted_maps_keep_the_contract() {
    for kind in [SectionKind::Tangency, SectionKind::Stroboscopic] {
        check(&InterpretedMap::new(&synthetic::map(3, 4, kind)), &points(200));
    }
}

#[test]
fn horner_maps_keep_the_contract() {
    let map = synthetic::map(3, 4, SectionKind::Stroboscopic);
    check(&HornerMap::new(&map), &points(200));
    check(&HornerMap::composed(&map, &synthetic::composed(6)), &points(200));
}

#[test]
fn single_maps_keep_the_contract() {
    let map = synthetic::map(3, 4, SectionKind::Stroboscopic);
    let composed = HornerMap::composed(&map, &synthetic::composed(6));
    for map in [HornerMap::new(&map), composed] {
        check_by(SINGLE, &map.in_single(), &points(200));
    }
}

#[test]
fn frozen_maps_keep_the_contract() {
    let map = HornerMap::new(&synthetic::map(3, 4, SectionKind::Tangency));
    let parameters = [0.02, -0.03];
    let states = points(200).into_iter().map(|(state, _)| (state, Vec::new())).collect();
    check(&map.freeze(&parameters), &states);
}

#[test]
fn lowering_changes_images_by_rounding_only() {
    for (smooth, weight) in [(1, 1), (3, 4), (5, 6), (8, 10)] {
        let map = synthetic::map(smooth, weight, SectionKind::Stroboscopic);
        let (reference, lowered) = (InterpretedMap::new(&map), HornerMap::new(&map));
        for (state, parameters) in points(50) {
            let ((a, info), (b, same)) =
                (step(&reference, &state, &parameters), step(&lowered, &state, &parameters));
            assert_eq!(info.passages, same.passages);
            let far = a.iter().zip(&b).fold(0.0f64, |far, (a, b)| far.max((a - b).abs()));
            // sqrt turns a rounding of 1e-17 in a depth of 1e-4 and more into at most 1e-15.
            assert!(
                far < 1e-13,
                "orders ({smooth}, {weight}), depth {}: {a:?} and {b:?}",
                info.depth
            );
        }
    }
}

#[test]
fn freezing_changes_no_bit() {
    let map = HornerMap::new(&synthetic::map(5, 6, SectionKind::Stroboscopic));
    for (state, parameters) in points(50) {
        let frozen = map.freeze(&parameters);
        assert_eq!(step(&map, &state, &parameters), step(&frozen, &state, &[]));
        assert_eq!(
            step_jacobian(&map, &state, &parameters).1,
            step_jacobian(&frozen, &state, &[]).1
        );
    }
}

#[test]
fn a_tangent_vector_is_carried_as_the_jacobian_carries_it() {
    let map = HornerMap::new(&synthetic::map(5, 6, SectionKind::Stroboscopic));
    let tangent = [0.6, -0.8];
    for (state, parameters) in points(50) {
        let (image, jacobian, info) = step_jacobian(&map, &state, &parameters);
        let (mut along, mut carried) = ([0.0; 2], [0.0; 2]);
        let frozen = map.freeze(&parameters);
        let found = frozen.step_tangent([&state, &tangent], &[], [&mut along, &mut carried]);
        assert_eq!((along.to_vec(), found), (image, info));
        for (carried, row) in carried.iter().zip(jacobian.chunks(2)) {
            let size: f64 = row.iter().map(|slope| slope.abs()).sum();
            let expected: f64 = row.iter().zip(tangent).map(|(a, b)| a * b).sum();
            // Both sum the same hundred or so products in different orders.
            assert!((carried - expected).abs() <= 1e-13 * size.max(1.0));
        }
    }
}

#[test]
fn orbits_in_lanes_are_those_of_the_frozen_map_to_the_last_bit() {
    let map = HornerMap::new(&synthetic::map(3, 4, SectionKind::Stroboscopic));
    // Large parameters drive some orbits out of the window, at different iterates; the last block
    // fills five lanes of eight.
    let points: Points = points(29)
        .into_iter()
        .map(|(state, parameters)| (state, parameters.iter().map(|p| 4.0 * p).collect()))
        .collect();
    let (mut ended, mut stayed) = (0, 0);
    for (transient, keep) in [(5, 40), (30, 0)] {
        let request = OrbitRequest::new(transient, keep, &[0.2, 0.3]);
        let request = request.escaping_at(&[1.2 * 0.2, 1.2 * 0.3]);
        for block in points.chunks(8) {
            let states: Vec<&[f64]> = block.iter().map(|point| &point.0[..]).collect();
            let parameters: Vec<&[f64]> = block.iter().map(|point| &point.1[..]).collect();
            let mut lanes = map.freeze_lanes::<8>(&parameters);
            let orbits = lanes.orbits(&states, &request);
            let exponents = lanes.largest_lyapunov_exponents(&states, 3, 20);
            for (lane, (state, parameters)) in block.iter().enumerate() {
                let frozen = map.freeze(parameters);
                let alone = MapOrbit::of(&frozen, state, &[], &request);
                assert_eq!(orbits[lane], alone);
                let depths = map.first_depths(alone.states(), parameters);
                for (depth, made) in depths.iter().zip(alone.steps.iter().skip(1)) {
                    assert_eq!(depth.max(0.0), made.depth);
                }
                let exponent = largest_lyapunov_exponent(&frozen, state, &[], 3, 20);
                assert_eq!(exponents[lane], exponent);
                match alone.end {
                    OrbitEnd::Completed => stayed += 1,
                    OrbitEnd::Escaped { .. } | OrbitEnd::NoImage { .. } => ended += 1,
                }
            }
        }
    }
    assert!(ended > 5 && stayed > 5, "{ended} ended, {stayed} stayed");
}

#[test]
fn the_contact_is_the_identity_above_the_surface() {
    let with = synthetic::map(3, 4, SectionKind::Tangency);
    let mut without = with.clone();
    without.stages.remove(0);
    let (with, without) = (InterpretedMap::new(&with), InterpretedMap::new(&without));
    let mut seen = 0;
    for (state, parameters) in points(50) {
        let (image, jacobian, info) = step_jacobian(&with, &state, &parameters);
        if info.passages.is_empty() {
            let free = step_jacobian(&without, &state, &parameters);
            assert_eq!((image, jacobian), (free.0, free.1));
            seen += 1;
        }
    }
    assert!(seen > 10, "{seen} points above the surface");
}

/// The passages of a map whose depth is positive, each depth evaluated at the image of all stages
/// before it.
fn passages_by_depth(map: &LocalMap, state: &[f64], parameters: &[f64]) -> PassageSet {
    let contacts = map.stages.iter().enumerate();
    let contacts = contacts.filter_map(|(place, stage)| match stage {
        Stage::Contact(contact) => Some((place, contact)),
        Stage::Leg(_) | Stage::Flown(_) => None,
    });
    let made = |place: usize, depth: &grazemap::jet::Jet<f64>| {
        let mut before = map.clone();
        before.stages.truncate(place);
        let (arrival, _) = step(&InterpretedMap::new(&before), state, parameters);
        depth.evaluate(&[&arrival[..], parameters].concat()) > 0.0
    };
    let numbered = contacts.enumerate();
    numbered
        .filter(|(_, (place, contact))| made(*place, &contact.depth))
        .map(|(number, _)| number)
        .collect()
}

#[test]
fn every_form_of_a_map_says_which_of_its_passages_made_contact() {
    let mut map = synthetic::map(3, 4, SectionKind::Stroboscopic);
    map.stages.extend(map.stages.clone());
    let (interpreted, horner) = (InterpretedMap::new(&map), HornerMap::new(&map));
    let mut seen = std::collections::BTreeSet::new();
    for (state, parameters) in points(400) {
        let made = passages_by_depth(&map, &state, &parameters);
        let frozen = horner.freeze(&parameters);
        for info in [
            step(&interpreted, &state, &parameters).1,
            step(&horner, &state, &parameters).1,
            step_jacobian(&horner, &state, &parameters).2,
            step(&frozen, &state, &[]).1,
        ] {
            assert_eq!(info.passages, made);
            assert_eq!(info.contacts() as usize, made.len());
        }
        seen.insert(made.iter().collect::<Vec<_>>());
    }
    assert_eq!(seen.len(), 4, "all combinations of two passages: {seen:?}");
}

#[cfg(feature = "compiled-maps")]
#[test]
fn compiled_maps_keep_the_contract() {
    for map in grazemap::iteration::CompiledMap::all() {
        let mut numbers = Numbers::new(13);
        let (state, parameter) = map.window();
        let mut within = |widths: &[f64]| -> Vec<f64> {
            widths
                .iter()
                .map(|&width| if width.is_finite() { width } else { 1e-3 } * numbers.next())
                .collect()
        };
        let points = (0..200).map(|_| (within(state), within(parameter))).collect();
        check(&map, &points);
    }
}

/// The linear oscillator, with and without contact, clear of `y = 0` by more than the steps of
/// differences.
#[test]
fn direct_simulation_keeps_the_contract() {
    let (scene, orbit) = grazing("linear");
    let system = HybridSystem::new(&scene.model);
    let map = DirectMap::new(&system, &scene, &orbit).expect("a section of the scene");
    let states = [-4e-4, -1e-4, 2e-4, 8e-4].map(|x| [vec![x, -1e-2], vec![x, 5e-3]]);
    let points = states.concat().into_iter().map(|state| (state, vec![1e-4, -1e-4]));
    check(&map, &points.collect());
}
