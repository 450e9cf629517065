//! Stops that are hit at the same instant: resets that commute both act, others are refused.
//!
//! The oracle is one oscillator alone: uncoupled oscillators do together what each does alone.
//! Further numbers are in the scene's head.

use grazemap::analysis::{DirectEnd, DirectImage};
use grazemap::hybrid::{HybridSystem, Outcome, Simulator, Trajectory};

use crate::support::scenes::{grazing_by, parsed};

/// Two oscillators, each with a rigid stop of its own.
const PAIR: &str = include_str!("../data/outside/f08_two_hits_at_once.toml");

/// Text of several oscillators like those of [`PAIR`], with their own responses.
fn several(responses: &[&str]) -> String {
    let mut text = "[model]\nstates = [".to_owned();
    for number in 1..=responses.len() {
        text += &format!("\"x{number}\", \"v{number}\", ");
    }
    text += "]\nparameters = { zeta = 0.05, A = 1.0, w = 0.8, r = 0.8, k = 50.0 }\n\
             [model.phase]\nname = \"theta\"\nrate = \"w\"\nperiod = \"2*pi\"\n[model.flow]\n";
    for number in 1..=responses.len() {
        text += &format!(
            "x{number} = \"v{number}\"\n\
             v{number} = \"A*cos(theta) - 2*zeta*v{number} - x{number}\"\n"
        );
    }
    for (place, response) in responses.iter().enumerate() {
        let number = place + 1;
        let response = response.replace('#', &number.to_string());
        text += &format!(
            "[[model.surface]]\nname = \"s{number}\"\nevent = \"1 - x{number}\"\n{response}\n"
        );
    }
    text + "[grazing]\nsurface = \"s1\"\nsolve_for = \"A\"\n[expansion]\nactive = [\"A\"]\n"
}

const RIGID: &str = "impact = { v# = \"-r*v#\" }";
const SOFT: &str = "contact = { v# = \"free - k*(x# - 1)\" }";

/// Successive images of a point; the last one states why it has no successor.
fn images(
    text: &str,
    set: &[(&str, &str)],
    start: &[f64],
    count: usize,
) -> Vec<(Vec<f64>, DirectEnd)> {
    let (scene, orbit) = grazing_by(text, "together", set);
    let system = HybridSystem::new(&scene.model);
    let mut map = DirectImage::<f64>::new(&system, &scene, &orbit).expect("finite parameters");
    let (mut state, mut found) = (start.to_vec(), Vec::new());
    for _ in 0..count {
        let image = map.image(&state, &[0.05]).expect("finite offsets");
        state.clone_from(&image.offsets);
        found.push((image.offsets, image.end));
        if image.end != DirectEnd::Returned {
            break;
        }
    }
    found
}

const STROBOSCOPIC: [(&str, &str); 1] = [("section.kind", "stroboscopic")];

#[test]
fn the_second_image_of_two_hits_at_once_is_that_of_one_oscillator() {
    let (scene, orbit) = grazing_by(PAIR, "f08", &[]);
    let system = HybridSystem::new(&scene.model);
    let mut map = DirectImage::<f64>::new(&system, &scene, &orbit).expect("finite parameters");
    let mut state = vec![1e-3, 1e-3, 0.0, 0.0];
    for _ in 0..2 {
        let image = map.image(&state, &[0.0]).expect("finite offsets");
        assert_eq!(image.end, DirectEnd::Returned);
        state = image.offsets;
    }
    // The digits given.
    assert!((state[0] - 1.2673543e-3).abs() < 1e-10, "{state:?}");
    assert!((state[3] - 3.6289142e-2).abs() < 1e-9, "{state:?}");
}

/// The coordinates of the first oscillator among those of `count`.
fn own(offsets: &[f64], stroboscopic: bool) -> Vec<f64> {
    match stroboscopic {
        true => offsets[..2].to_vec(),
        false => vec![offsets[0], offsets[offsets.len() - 1]],
    }
}

/// Checks that several oscillators have the images of the first one alone.
fn as_one(responses: &[&str], set: &[(&str, &str)], offset: f64, apart: f64) {
    let stroboscopic = !set.is_empty();
    let alone_start = if stroboscopic { [offset, 0.01] } else { [offset, 0.02] };
    let mut start = vec![alone_start[0]];
    start.extend(stroboscopic.then_some(alone_start[1]));
    for number in 1..responses.len() {
        let speed = if stroboscopic { alone_start[1] } else { 0.0 };
        start.extend([offset + apart * number as f64, speed]);
    }
    start.extend((!stroboscopic).then_some(alone_start[1]));
    let together = images(&several(responses), set, &start, 30);
    let alone = images(&several(&responses[..1]), set, &alone_start, 30);
    for (number, (found, expected)) in together.iter().zip(&alone).enumerate() {
        let context = format!("{responses:?} {set:?} {offset:e} {apart:e}: image {number}");
        assert_eq!(found.1, DirectEnd::Returned, "{context}");
        let pairs = own(&found.0, stroboscopic).into_iter().zip(&expected.0);
        let error = pairs.map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max);
        // Rounding 1e-16 of a depth of 1e-6 at least, grown over a return.
        assert!(error < 1e-9, "{context}: {error:e}");
    }
    assert_eq!(together.len(), alone.len());
}

#[test]
fn oscillators_that_hit_at_once_do_what_each_does_alone() {
    for set in [&[][..], &STROBOSCOPIC] {
        for offset in [1e-3, 1e-6, -1e-3] {
            as_one(&[RIGID, RIGID], set, offset, 0.0);
        }
    }
}

#[test]
fn hits_within_rounding_of_each_other_have_images() {
    for set in [&[][..], &STROBOSCOPIC] {
        for apart in [1e-16, -1e-16, 4e-16, -4e-16, 3e-15, -3e-15] {
            as_one(&[RIGID, RIGID], set, 1e-3, apart);
        }
    }
}

/// On the tangency section a hit of another stop in the middle of an approach hides no image.
#[test]
fn hits_one_after_another_within_an_approach_have_images() {
    for apart in [-1e-12, -1e-9, -1e-6, -1e-4] {
        as_one(&[RIGID, RIGID], &[], 1e-3, apart);
    }
}

#[test]
fn a_graze_and_a_hit_at_once_have_an_image() {
    for offset in [0.0, -1e-16, -1e-15, 1e-16, 1e-15, 1e-9] {
        // The second oscillator meets its stop at the first one's graze.
        let start = [offset, 0.0, 0.3, 0.0];
        let together = images(&several(&[RIGID, RIGID]), &[], &start, 1);
        let alone = images(&several(&[RIGID]), &[], &[offset, 0.0], 1);
        assert_eq!(together[0].1, DirectEnd::Returned, "{offset:e}");
        let error = (together[0].0[0] - alone[0].0[0]).abs();
        // A depth of rounding has a speed of its root.
        assert!(error < 1e-7, "{offset:e}: {error:e}");
    }
}

/// Simulates oscillators that start alike, and so meet their stops at once.
fn fly(responses: &[&str]) -> Trajectory<f64> {
    let model = parsed(&several(responses), "together", &[("w", "0.8")]).model;
    let system = HybridSystem::new(&model);
    let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.to_f64()).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    let mut state = [0.3, 0.9].repeat(responses.len());
    state.push(0.0);
    simulator.set_state(&state).expect("a finite state");
    simulator.run(40.0).expect("a finite time")
}

#[test]
fn stops_of_any_kind_hit_at_once_act_all() {
    for responses in [&[RIGID, RIGID, RIGID][..], &[RIGID, SOFT], &[SOFT, RIGID, RIGID]] {
        let together = fly(responses);
        assert_eq!(together.outcome, Outcome::Completed, "{responses:?}");
        let mut contacts = 0;
        for (place, response) in responses.iter().enumerate() {
            let alone = fly(&[response]);
            contacts += alone.contacts();
            assert!(alone.contacts() > 3, "{response}: {}", alone.contacts());
            for component in 0..2 {
                let error = together.state[2 * place + component] - alone.state[component];
                // Rounding, grown over some impacts.
                assert!(error.abs() < 1e-10, "{responses:?} {place}: {error:e}");
            }
        }
        assert_eq!(together.contacts(), contacts, "{responses:?}");
    }
}

/// A mass that meets a wall at the instant at which another runs into it.
const CRADLE: &str = r#"
[model]
states = ["x", "v", "y", "w"]
parameters = { r = 1.0 }
[model.flow]
x = "v"
v = "0"
y = "w"
w = "0"
[[model.surface]]
name = "wall"
event = "x"
impact = { v = "-r*v" }
[[model.surface]]
name = "pair"
event = "y - x"
impact = { v = "w", w = "v" }
[grazing]
surface = "wall"
solve_for = "r"
"#;

#[test]
fn hits_at_once_whose_resets_do_not_commute_are_refused() {
    let model = parsed(CRADLE, "cradle", &[("section.kind", "tangency")]).model;
    let system = HybridSystem::new(&model);
    let cradle = |state: &[f64]| {
        let mut simulator = Simulator::new(&system, &[1.0]).expect("finite parameters");
        simulator.set_state(state).expect("a finite state");
        simulator.run(2.0).expect("a finite time")
    };
    // Both at 0 after a time of 1.
    let outcome = cradle(&[1.0, -1.0, 2.0, -2.0]).outcome;
    let Outcome::HitTogether { surfaces: [0, 1], time } = outcome else {
        panic!("{outcome:?}");
    };
    assert!((time - 1.0).abs() < 1e-15, "{time}");
    // One after the other, by 1e-6.
    let found = cradle(&[1.0, -1.0, 2.000_002, -2.0]);
    assert_eq!((found.outcome, found.contacts()), (Outcome::Completed, 4));
}
