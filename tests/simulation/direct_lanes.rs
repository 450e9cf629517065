//! Direct simulation in lanes, compared with direct simulation of each orbit alone: equal to the
//! last bit, on the scenes of the catalogue with one rigid stop, by exact leaps and by Taylor's
//! method. Machines without wide registers have no lanes.

use grazemap::analysis::{DirectMap, SectionFrame};
use grazemap::hybrid::{
    DirectReturn, HybridSystem, LaneReturns, NominalPassage, ReturnOutcome, ReturnSection,
};
use grazemap::iteration::{DiscreteMap, StepInfo};
use grazemap::model::{Model, Scene};
use grazemap::numeric::Lanes;
use grazemap::orbit::GrazingOrbit;

use crate::scattered;
use crate::support::needs_wide_registers;
use crate::support::scenes::{grazing_by, scene_with, text};

const LANES: usize = 8;

/// Affine scenes.
const EXACT: [&str; 6] =
    ["linear", "linear_codim2", "foale", "foale_omega_2_2", "moving_stop", "impact_pair"];

/// Scenes that are simulated by Taylor's method.
const BY_TAYLOR: [&str; 4] = ["linear", "moving_stop", "impact_pair", "mems"];

/// An oscillator in a slot, which it grazes on both sides in each period: one surface, two
/// passages.
const SLOT: &str = r#"
[model]
name = "oscillator in a slot"
states = ["x", "v"]
parameters = { zeta = 0.05, delta = 1.0, r = 0.8, alpha = 2.2, omega = 1.8 }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "v"
v = "alpha*cos(theta) - 2*zeta*v - x"
[[model.surface]]
name = "slot"
event = "delta - x^2"
impact = { v = "-r*v" }
[grazing]
passages = ["slot", "slot"]
solve_for = "alpha"
symmetry = "half-period"
guess = { x = 1.0, v = 0.0, theta = 3.061 }
[section]
kind = "tangency"
[expansion]
active = ["alpha", "omega"]
"#;

/// Overrides that select a scene's section.
type Section = &'static [(&'static str, &'static str)];

/// The section that the scene names.
const OWN: Section = &[];

/// The forcing phase of the graze.
const AT_GRAZE: Section = &[("section.kind", "stroboscopic")];

/// Another forcing phase.
const ELSEWHERE: Section = &[("section.kind", "stroboscopic"), ("section.phase", "1")];

/// A scene on a section, and its grazing orbit.
fn grazing(name: &str, section: Section) -> (Scene, GrazingOrbit) {
    let text = match name {
        "slot" => SLOT,
        _ => text(name),
    };
    grazing_by(text, name, section)
}

/// Compares steps of states near the graze, and returns the number of contacts.
fn agree(
    name: &str,
    section: Section,
    lowered: fn(&Model) -> HybridSystem,
    size: f64,
    rounds: usize,
) -> u32 {
    let (scene, orbit) = grazing(name, section);
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
            states = images.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
        }
    }
    contacts
}

#[test]
fn lanes_are_single_orbits_to_the_last_bit() {
    if !needs_wide_registers() {
        return;
    }
    for name in EXACT {
        for size in [1e-6, 1e-3, 0.1] {
            let contacts = agree(name, OWN, HybridSystem::new, size, 12);
            assert!(contacts > 50, "{name} {size}: {contacts}");
        }
    }
}

#[test]
fn lanes_of_taylor_steps_are_single_orbits_to_the_last_bit() {
    if !needs_wide_registers() {
        return;
    }
    for name in BY_TAYLOR {
        for size in [1e-6, 1e-3, 0.1] {
            let contacts = agree(name, OWN, HybridSystem::without_exact_flow, size, 12);
            assert!(contacts > 50, "{name} {size}: {contacts}");
        }
    }
}

#[test]
fn stroboscopic_lanes_are_single_orbits_to_the_last_bit() {
    for name in EXACT {
        stroboscopic_lanes_agree(name, HybridSystem::new);
    }
}

#[test]
fn stroboscopic_lanes_of_taylor_steps_are_single_orbits_to_the_last_bit() {
    for name in BY_TAYLOR {
        stroboscopic_lanes_agree(name, HybridSystem::without_exact_flow);
    }
}

fn stroboscopic_lanes_agree(name: &str, lowered: fn(&Model) -> HybridSystem) {
    if !needs_wide_registers() {
        return;
    }
    for section in [AT_GRAZE, ELSEWHERE] {
        for size in [1e-6, 1e-3, 0.1] {
            let contacts = agree(name, section, lowered, size, 6);
            assert!(contacts > 20, "{name} {section:?} {size}: {contacts}");
        }
    }
}

#[test]
fn passages_of_one_surface_are_numbered_alike_in_lanes() {
    if !needs_wide_registers() {
        return;
    }
    for section in [OWN, AT_GRAZE, ELSEWHERE] {
        assert_eq!(grazing("slot", section).1.passages.len(), 2);
        let contacts = agree("slot", section, HybridSystem::new, 1e-3, 12);
        assert!(contacts > 600, "{section:?} {contacts}");
    }
}

/// Counts of returns.
#[derive(Clone, Debug, Default)]
struct Flown {
    together: usize,
    apart: usize,
    unreturned: usize,
    /// Numbers of hits and misses of each passage, in returns that were flown in lanes together.
    hits: [usize; 2],
    misses: [usize; 2],
}

impl Flown {
    /// Compares returns in lanes with those of each orbit alone: equal to the last bit.
    fn compare(
        &mut self,
        lanes: &mut LaneReturns<'_, LANES>,
        alone: &mut [DirectReturn<'_, f64>],
        starts: &[Vec<f64>],
    ) {
        let dimension = starts[0].len();
        let component = |place| Lanes::from_fn(|lane| starts[lane][place]);
        let together: Vec<Lanes<LANES>> = (0..dimension).map(component).collect();
        let found = lanes.images(&together, [true; LANES]);
        for lane in 0..LANES {
            let start = &starts[lane];
            let image = alone[lane].image(start).expect("a finite state");
            let returned = image.outcome == ReturnOutcome::Returned;
            assert_eq!(found.returned[lane], returned, "{start:?} {image:?}");
            if !returned {
                self.unreturned += 1;
                continue;
            }
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            let state: Vec<f64> = found.state.iter().map(|values| values[lane]).collect();
            let context = format!("{start:?} {state:?} {image:?}");
            assert_eq!(bits(&state), bits(&image.state), "{context}");
            let speeds: Vec<_> = found.speeds.iter().map(|speeds| speeds[lane]).collect();
            assert_eq!(speeds, image.passages, "{context}");
            if found.together[lane] {
                self.together += 1;
                for (passage, speed) in image.passages.iter().enumerate() {
                    self.hits[passage] += usize::from(speed.is_some());
                    self.misses[passage] += usize::from(speed.is_none());
                }
            } else {
                self.apart += 1;
            }
        }
    }
}

/// Returns over some periods from states near the section point of a scene, with a passage in each.
fn flown(
    name: &str,
    section: Section,
    lowered: fn(&Model) -> HybridSystem,
    periods: usize,
    size: f64,
) -> Flown {
    let (scene, orbit) = grazing(name, section);
    let system = lowered(&scene.model);
    let mut frame = SectionFrame::<f64>::new(&scene, &orbit);
    assert_eq!(frame.periods(), 1);
    let mut flown = Flown::default();
    for round in 0..20 {
        let (mut alone, mut starts) = (Vec::new(), Vec::new());
        for lane in round * LANES..(round + 1) * LANES {
            let offset = |place| size * scattered(lane, place);
            let offsets: Vec<f64> = (0..frame.dimension()).map(offset).collect();
            let offset = |place| 1e-2 * size * scattered(lane, place + 3);
            let parameters: Vec<f64> = (0..frame.active()).map(offset).collect();
            frame.place(&offsets, &parameters).expect("its lengths");
            let period = frame.duration();
            let mut passages = Vec::new();
            for number in 0..periods {
                for mut passage in frame.nominal_passages(period) {
                    passage.time += number as f64 * period;
                    passages.push(passage);
                }
            }
            let duration = periods as f64 * period;
            let (section, own) = (frame.return_section(), frame.parameters());
            let map = DirectReturn::new(&system, own, section, duration, periods);
            let map = map.and_then(|map| map.with_passages(&passages));
            alone.push(map.expect("finite parameters"));
            starts.push(frame.state().to_vec());
        }
        let mut lanes = LaneReturns::new(alone.clone()).expect("one rigid stop");
        flown.compare(&mut lanes, &mut alone, &starts);
    }
    flown
}

/// Constructor of a system from a model, and scenes for it.
type Way = (fn(&Model) -> HybridSystem, &'static [&'static str]);

/// Flow methods.
const WAYS: [Way; 2] =
    [(HybridSystem::new, &EXACT), (HybridSystem::without_exact_flow, &BY_TAYLOR)];

#[test]
fn most_stroboscopic_returns_are_flown_together() {
    if !needs_wide_registers() {
        return;
    }
    for (lowered, scenes) in WAYS {
        for (&name, section) in scenes.iter().flat_map(|name| [(name, AT_GRAZE), (name, ELSEWHERE)])
        {
            for size in [1e-6, 1e-3] {
                let flown = flown(name, section, lowered, 1, size);
                let context = format!("{name} {section:?} {size}: {flown:?}");
                assert!(flown.together >= 98 && flown.unreturned == 0, "{context}");
                assert!(flown.hits[0] >= 25 && flown.misses[0] >= 60, "{context}");
            }
        }
    }
}

/// Deep passages are not found in lanes, or stick.
#[test]
fn returns_from_far_away_are_those_of_an_orbit_alone() {
    if !needs_wide_registers() {
        return;
    }
    for (lowered, scenes) in WAYS {
        let (mut together, mut apart) = (0, 0);
        for (&name, section) in scenes.iter().flat_map(|name| [(name, AT_GRAZE), (name, ELSEWHERE)])
        {
            let flown = flown(name, section, lowered, 1, 0.1);
            together += flown.together;
            apart += flown.apart;
        }
        assert!(together > 700 && apart > 50, "{together} {apart}");
    }
}

#[test]
fn every_passage_of_a_return_is_known_in_lanes() {
    if !needs_wide_registers() {
        return;
    }
    for (lowered, _) in WAYS {
        for section in [OWN, AT_GRAZE, ELSEWHERE] {
            for name in ["linear", "foale_omega_2_2"] {
                let flown = flown(name, section, lowered, 2, 1e-3);
                assert_eq!(flown.together, 160, "{name} {section:?}: {flown:?}");
                for times in flown.hits.iter().chain(&flown.misses) {
                    assert!(*times > 0, "{name} {section:?}: {flown:?}");
                }
            }
        }
    }
}

/// Linear oscillator with a stop that absorbs most of the speed, under a slow force: it chatters
/// and sticks.
fn slow_and_soft(lowered: fn(&Model) -> HybridSystem, force: &str) -> (HybridSystem, Vec<f64>) {
    let overrides = [("r", "0.2"), ("omega", "0.6"), ("alpha", force)];
    let scene = scene_with("linear", &overrides);
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
    if !needs_wide_registers() {
        return;
    }
    let (system, parameters) = slow_and_soft(lowered, force);
    let surface = 0;
    let sections = [
        (ReturnSection::Tangency { surface }, 0.0),
        (ReturnSection::GrazingPhase { surface }, 0.1),
        (ReturnSection::OtherPhase, 0.1),
    ];
    for (section, speed) in sections {
        let map = DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase");
        let passages =
            [0.0, 4.0].map(|time| NominalPassage { surface, time, hit: false, rests: false });
        let map = map.with_passages(&passages).expect("within the return");
        let mut alone = vec![map; LANES];
        let mut lanes = LaneReturns::new(alone.clone()).expect("one rigid stop");
        let mut flown = Flown::default();
        for round in 0..200 {
            let start = |lane: usize| {
                let share = |place| scattered(round * LANES + lane, place);
                // One of them on the surface, where a dip of a rounding is no contact.
                let [off, rate] = match lane {
                    0 => [0.0, 1e-8],
                    _ => [0.3 * share(0), share(1)],
                };
                vec![1.0 + off, speed * rate, 3.0 * share(2)]
            };
            let starts: Vec<_> = (0..LANES).map(start).collect();
            flown.compare(&mut lanes, &mut alone, &starts);
        }
        assert!(flown.together > 400, "{section:?} {flown:?}");
        assert!(flown.apart > 40, "{section:?} {flown:?}");
        assert!(flown.hits[0] > 5, "{section:?} {flown:?}");
    }
}
