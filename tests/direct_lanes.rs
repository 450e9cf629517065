//! Direct simulation in lanes against direct simulation of each orbit alone: the same to the last bit, on the scenes of the
//! catalogue with one rigid stop, by exact leaps and by Taylor's method. Machines without wide registers have no lanes.

use grazemap::analysis::DirectMap;
use grazemap::hybrid::{DirectReturn, HybridSystem, LaneReturns, ReturnOutcome, ReturnSection};
use grazemap::iteration::{DiscreteMap, StepInfo};
use grazemap::model::{Model, Scene, catalogue};
use grazemap::numeric::{Lanes, is_wide};
use grazemap::orbit::locate;

const LANES: usize = 8;

/// Affine scenes.
const EXACT: [&str; 6] = [
    "linear",
    "linear_codim2",
    "foale",
    "foale_omega_2_2",
    "moving_stop",
    "impact_pair",
];

/// Scenes that are flown by Taylor's method.
const BY_TAYLOR: [&str; 4] = ["linear", "moving_stop", "impact_pair", "mems"];

/// A number from −1 to 1 for every pair of numbers.
fn scattered(number: usize, component: usize) -> f64 {
    let step = [0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122][component % 5];
    2.0 * (0.31 + (number + 1) as f64 * step).fract() - 1.0
}

/// Steps of states about the graze, and the number of contacts.
fn agree(name: &str, lowered: fn(&Model) -> HybridSystem, size: f64, rounds: usize) -> u32 {
    let text = catalogue::text(name).expect("in the catalogue");
    let scene = Scene::parse(text, name).expect("a good scene");
    let orbit = locate(&scene).expect("no wrong input").into_result();
    let orbit = orbit.expect("it grazes");
    let system = lowered(&scene.model);
    let map = DirectMap::new(&system, &scene, &orbit).expect("finite parameters");
    let (dimension, active) = (map.dimension(), DiscreteMap::parameters(&map));
    let mut contacts = 0;
    for round in 0..rounds {
        let parameters: Vec<Vec<f64>> = (0..LANES)
            .map(|lane| {
                let offset = |place| 1e-2 * size * scattered(round * LANES + lane, place + 3);
                (0..active).map(offset).collect()
            })
            .collect();
        let own: Vec<&[f64]> = parameters.iter().map(Vec::as_slice).collect();
        let mut lanes = map.in_lanes::<LANES>(&own).expect("one rigid stop");
        let state =
            |place: usize| size * scattered(round * LANES + place / dimension, place % dimension);
        let mut states: Vec<f64> = (0..LANES * dimension).map(state).collect();
        for _ in 0..6 {
            let mut images = vec![0.0; states.len()];
            let mut infos = [StepInfo::default(); LANES];
            lanes.step(&[true; LANES], &states, &mut images, &mut infos);
            for lane in 0..LANES {
                let place = lane * dimension..(lane + 1) * dimension;
                let mut image = vec![0.0; dimension];
                let info = map.step(&states[place.clone()], &parameters[lane], &mut image);
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                let (start, found) = (&states[place.clone()], &images[place.clone()]);
                let context = format!("{name} {round} {lane} {start:?} {:?}", parameters[lane]);
                assert_eq!(infos[lane].valid, info.valid, "{context}");
                if info.valid {
                    assert_eq!(bits(found), bits(&image), "{context} {found:?} {image:?}");
                    assert_eq!(infos[lane], info, "{context}");
                }
                contacts += info.contacts();
            }
            states = images
                .iter()
                .map(|v| if v.is_finite() { *v } else { 0.0 })
                .collect();
        }
    }
    contacts
}

#[test]
fn lanes_are_single_orbits_to_the_last_bit() {
    if !is_wide() {
        return;
    }
    for name in EXACT {
        for size in [1e-6, 1e-3, 0.1] {
            let contacts = agree(name, HybridSystem::new, size, 12);
            assert!(contacts > 50, "{name} {size}: {contacts}");
        }
    }
}

#[test]
fn lanes_of_taylor_steps_are_single_orbits_to_the_last_bit() {
    if !is_wide() {
        return;
    }
    for name in BY_TAYLOR {
        for size in [1e-6, 1e-3, 0.1] {
            let contacts = agree(name, HybridSystem::without_exact_flow, size, 12);
            assert!(contacts > 50, "{name} {size}: {contacts}");
        }
    }
}

/// The linear oscillator with a stop that takes most of the speed, under a slow force: it chatters and sticks.
fn slow_and_soft(lowered: fn(&Model) -> HybridSystem, force: &str) -> (HybridSystem, Vec<f64>) {
    let text = catalogue::text("linear").expect("in the catalogue");
    let overrides = [("r", "0.2"), ("omega", "0.6"), ("alpha", force)];
    let overrides = overrides.map(|(name, value)| (name.to_owned(), value.to_owned()));
    let scene = Scene::parse_with(text, "linear", &overrides).expect("a good scene");
    let parameters = scene.model.parameter_values();
    let parameters = parameters.into_iter().map(|value| value.hi).collect();
    (lowered(&scene.model), parameters)
}

#[test]
fn returns_that_leave_the_lanes_are_those_of_an_orbit_alone() {
    agree_where_orbits_leave(HybridSystem::new, "0.9");
}

#[test]
fn taylor_returns_that_leave_the_lanes_are_those_of_an_orbit_alone() {
    agree_where_orbits_leave(HybridSystem::without_exact_flow, "1.5");
}

fn agree_where_orbits_leave(lowered: fn(&Model) -> HybridSystem, force: &str) {
    if !is_wide() {
        return;
    }
    let (system, parameters) = slow_and_soft(lowered, force);
    let section = ReturnSection::Tangency { surface: 0 };
    let mut alone = DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase");
    let maps = vec![alone.clone(); LANES];
    let mut lanes = LaneReturns::<LANES>::new(maps).expect("one rigid stop");
    let (mut together, mut apart, mut unreturned) = (0, 0, 0);
    for round in 0..200 {
        let component = |lane: usize, place: usize| {
            let share = scattered(round * LANES + lane, place);
            [1.0 + 0.3 * share, 0.0, 3.0 * share][place]
        };
        let starts: [Lanes<LANES>; 3] =
            std::array::from_fn(|place| Lanes::from_fn(|lane| component(lane, place)));
        let found = lanes.images(&starts, [true; LANES]);
        for lane in 0..LANES {
            let start = starts.map(|values| values[lane]);
            let image = alone.image(&start).expect("a finite state");
            let returned = image.outcome == ReturnOutcome::Returned;
            assert_eq!(found.returned[lane], returned, "{start:?} {image:?}");
            if found.together[lane] {
                together += 1;
            } else {
                apart += 1;
            }
            if !returned {
                unreturned += 1;
                continue;
            }
            let state: Vec<f64> = found.state.iter().map(|values| values[lane]).collect();
            assert_eq!(state, image.state, "{start:?}");
            assert_eq!(found.speeds[lane], image.passages[0], "{start:?}");
        }
    }
    println!("{together} together, {apart} apart, {unreturned} without a return");
    assert!(together > 400 && apart > 100, "{together} {apart}");
}
