//! Returns to sections that lie inside a contact, behind one or in a rest, compared with a
//! simulation without a section (`xtask section-phases` does the whole catalogue).

use grazemap::hybrid::{
    DirectReturn, HybridSystem, Outcome, ReturnOutcome, ReturnSection, Simulator,
};
use grazemap::model::Model;
use xtask::section_phases::campaign::{Campaign, Tally};

use crate::scattered;
use crate::support::scenes::{parsed, scene_with};

/// Returns at 16 phases from six orbits of a scene of the catalogue.
fn tally(name: &str, set: &[(&str, &str)], size: f64) -> Tally {
    let model = scene_with(name, set).model;
    let system = HybridSystem::new(&model);
    let parameters = model.parameter_values().iter().map(|value| value.to_f64()).collect();
    let campaign = Campaign { system: &system, parameters, phases: 16 };
    let mut tally = Tally::default();
    for number in 0..6 {
        let start: Vec<f64> =
            (0..model.dimension()).map(|place| size * scattered(number, place)).collect();
        campaign.follow(&start, &mut tally);
    }
    tally
}

/// Checks that no return is wrong, many are compared, and few are reported as ambiguous.
fn agrees(name: &str, set: &[(&str, &str)], size: f64) -> Tally {
    let tally = tally(name, set, size);
    assert!(tally.wrong.is_empty(), "{name} {set:?}: {}: {:#?}", tally.wrong.len(), tally.wrong);
    assert!(tally.agreed > 250, "{name} {set:?}: {tally:?}");
    assert!(tally.ambiguous * 50 <= tally.agreed, "{name} {set:?}: {tally:?}");
    tally
}

#[test]
fn sections_inside_a_contact_with_either_of_two_stops_return_what_the_simulation_does() {
    for d in ["1.3", "1.6", "1.64"] {
        let tally = agrees("two_stops_t1", &[("d", d)], 0.5);
        assert!(tally.held > 5, "{d}: {tally:?}");
    }
    agrees("two_stops_t2", &[("d", "0.3")], 0.2);
    agrees("two_stops_t1_prestressed", &[("d", "1.5")], 0.5);
    agrees("two_stops_t1_rigid", &[("d", "1.3")], 0.5);
}

#[test]
fn sections_behind_a_release_with_a_negative_gap_fly_freely() {
    let gap = ("sigma", "0.2");
    let tally = agrees("soft_b", &[gap, ("R2", "3")], 0.1);
    assert!(tally.held > 5, "{tally:?}");
    agrees("soft_a", &[gap], 0.1);
    agrees("soft_d", &[gap], 0.1);
}

#[test]
fn sections_on_a_rest_at_a_rigid_stop_stay_there() {
    for set in [
        [("r", "0.2"), ("omega", "0.3"), ("alpha", "1.5")],
        [("r", "0.3"), ("omega", "0.2"), ("alpha", "2.9")],
    ] {
        let tally = agrees("linear", &set, 0.1);
        assert!(tally.held > 5, "{set:?}: {tally:?}");
    }
}

#[test]
fn sections_on_a_rest_and_behind_a_chatter_at_a_stop_at_zero_return_what_the_simulation_does() {
    for b in ["5.76", "5.8"] {
        let tally = tally("gear_rattle", &[("b", b)], 2.0);
        assert!(tally.wrong.is_empty(), "{b}: {:#?}", tally.wrong);
        assert!(tally.agreed > 100 && tally.held > 2, "{b}: {tally:?}");
    }
}

#[test]
fn a_start_on_a_stop_at_zero_is_told_from_a_penetration_by_the_size_of_its_motion() {
    let model = scene_with("gear_rattle", &[("r", "0.6")]).model;
    let system = HybridSystem::new(&model);
    let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.to_f64()).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    let mut flown = |state: [f64; 3]| {
        simulator.set_state(&state).expect("three components");
        simulator.run(1.0).expect("a finite time")
    };
    // At rest, leaving and arriving; the force presses onto the stop at this phase.
    for [velocity, speeds] in [[-3e-21, 0.0], [0.5, 0.0], [-0.5, 0.5]] {
        for gap in [-1e-21, -1e-19, -1e-17, 1e-21] {
            let found = flown([gap, velocity, 2.5]);
            assert_eq!(found.outcome, Outcome::Completed, "{gap} {velocity}");
            let first = found.events.iter().find_map(|event| event.kind.contact_speed());
            let exact = flown([0.0, velocity, 2.5]);
            let apart = found.state.iter().zip(&exact.state).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-9, "{gap} {velocity}: {:?}", found.state);
            if speeds > 0.0 {
                assert!(first.is_some_and(|first| (first - speeds).abs() < 1e-9), "{first:?}");
            }
        }
    }
    for gap in [-1e-9, -1e-12] {
        let found = flown([gap, 0.0, 2.5]);
        assert_eq!(found.outcome, Outcome::Penetrating { surface: 0, time: 0.0, gap });
    }
}

/// Two carts, each with a buffer of its own, which meet them at the same time.
const TWO_CARTS: &str = r#"
[model]
states = ["x", "v", "z", "w"]
parameters = { gap = 0.5, k = 20.0, F = 1.0, omega = 0.9 }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "v"
v = "F*cos(theta) - 0.1*v - x"
z = "w"
w = "F*cos(theta) - 0.1*w - 0.9*z"
[[model.surface]]
name = "first"
event = "gap - x"
contact = { v = "free - k*(x - gap)" }
[[model.surface]]
name = "second"
event = "gap - z"
contact = { w = "free - k*(z - gap)" }
[grazing]
surface = "first"
solve_for = "F"
"#;

/// Simulates two carts; the stop of the second one can be rigid.
fn carts(rigid: bool) -> (Model, Outcome<f64>, Vec<f64>) {
    let mut text = TWO_CARTS.to_owned();
    if rigid {
        let contact = "contact = { w = \"free - k*(z - gap)\" }";
        assert!(text.contains(contact));
        text = text.replace(contact, "impact = { w = \"-0.8*w\" }");
    }
    let model = parsed(&text, "carts", &[("omega", "0.9")]).model;
    let system = HybridSystem::new(&model);
    let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.to_f64()).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    simulator.set_state(&[0.4, 1.0, 0.3, 1.0, 0.0]).expect("five components");
    let flown = simulator.run(0.3).expect("a finite time");
    (model, flown.outcome, flown.state)
}

#[test]
fn a_state_that_two_stops_hold_is_refused_not_let_go_by_one() {
    let (model, outcome, _) = carts(false);
    assert!(matches!(outcome, Outcome::HeldTwice { surfaces: [0, 1], .. }), "{outcome:?}");
    let system = HybridSystem::new(&model);
    let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.to_f64()).collect();
    let section = ReturnSection::OtherPhase;
    let mut map = DirectReturn::over_periods(&system, &parameters, section, 1).expect("a map");
    let image = map.image(&[0.6, 0.0, 0.6, 0.0, 0.0]).expect("five components");
    assert!(
        matches!(image.outcome, ReturnOutcome::Ended(Outcome::HeldTwice { .. })),
        "{:?}",
        image.outcome
    );
}

/// The second cart, which hits a rigid stop while the first is in its buffer, does not free it.
#[test]
fn an_impact_elsewhere_leaves_a_contact_as_it_is() {
    let (_, outcome, state) = carts(true);
    assert_eq!(outcome, Outcome::Completed);
    // The first cart alone: a spring of 21 about (20 · 0.5 + F cos)/21, from x = 0.5 on.
    let (mut x, mut v, mut time) = (0.4_f64, 1.0_f64, 0.0_f64);
    let step = 1e-6;
    while time < 0.3 {
        let push = if x > 0.5 { 20.0 * (x - 0.5) } else { 0.0 };
        let half = v + 0.5 * step * ((0.9 * time).cos() - 0.1 * v - x - push);
        (x, time) = (x + step * half, time + step);
        let push = if x > 0.5 { 20.0 * (x - 0.5) } else { 0.0 };
        v = half + 0.5 * step * ((0.9 * time).cos() - 0.1 * half - x - push);
    }
    assert!((state[0] - x).abs() < 1e-5 && (state[1] - v).abs() < 1e-5, "{state:?} {x} {v}");
}
