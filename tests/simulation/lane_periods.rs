//! Forcing periods in lanes against those of each orbit alone: the same states and events to the
//! last bit, where orbits impact, chatter, stick and come free again, by exact leaps and by
//! Taylor's method. Machines without wide registers have no lanes.

use grazemap::hybrid::{Event, EventKind, HybridSystem, LanePeriods, Outcome, Simulator};
use grazemap::model::Model;

use crate::support::needs_wide_registers;
use crate::support::scenes::scene_with;

const LANES: usize = 8;

fn model(name: &str, overrides: &[(&str, f64)]) -> Model {
    let overrides = overrides.iter();
    let overrides: Vec<_> = overrides
        .map(|&(key, value)| (key, value.to_string()))
        .collect();
    scene_with(name, &overrides).model
}

/// Simulators of one system, each with one parameter scaled a little more than the one before, from
/// states of their own before the stop.
fn orbits<'s>(
    system: &'s HybridSystem,
    model: &Model,
    scaled: &str,
    by: f64,
    count: usize,
) -> Vec<Simulator<'s, f64>> {
    let names: Vec<_> = model.parameters.iter().map(|one| &one.name[..]).collect();
    let place = names.iter().position(|&name| name == scaled);
    let place = place.expect("a parameter of the scene");
    let mut orbits = Vec::new();
    for number in 0..count {
        let mut parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.hi).collect();
        parameters[place] *= 1.0 + by * number as f64;
        let mut orbit = Simulator::new(system, &parameters).expect("finite parameters");
        orbit.set_near_miss_limit(0.0);
        let share = |component: usize| ((number * 7 + component * 3) as f64 * 0.618).fract();
        let state: Vec<f64> = (0..system.dimension())
            .map(|component| 0.4 * share(component) - 1.5)
            .collect();
        orbit.set_state(&state).expect("a finite state");
        orbits.push(orbit);
    }
    orbits
}

/// Periods flown both ways.
#[derive(Default)]
struct Flown {
    all: usize,
    /// In lanes to their ends.
    together: usize,
    /// Times an orbit stuck.
    stuck: usize,
    /// Ended early.
    failed: usize,
    /// In lanes to their ends after one of the same orbit that ended early.
    recovered: usize,
}

/// Flies orbits both ways.
fn agree(mut alone: Vec<Simulator<'_, f64>>, periods: usize) -> Flown {
    let mut lanes = LanePeriods::<LANES>::new(alone.clone()).expect("one rigid stop at rest");
    let mut flown = Flown::default();
    let mut last = vec![Outcome::Completed; alone.len()];
    let mut events: Vec<Vec<Event<f64>>> = vec![Vec::new(); alone.len()];
    for number in 0..periods {
        events.iter_mut().for_each(Vec::clear);
        let outcomes = lanes
            .advance(&mut |orbit, event| events[orbit].push(event))
            .to_vec();
        for (orbit, simulator) in alone.iter_mut().enumerate() {
            let period = simulator.forcing_period().expect("a phase");
            let mut expected = Vec::new();
            let outcome = simulator
                .advance_period(period, &mut |event| expected.push(event))
                .expect("a phase");
            let place = format!("orbit {orbit}, period {number}");
            assert_eq!(outcomes[orbit], outcome, "{place}");
            assert_eq!(events[orbit], expected, "{place}");
            assert_eq!(lanes.state(orbit), simulator.state(), "{place}");
            let together = lanes.is_together(orbit);
            flown.all += 1;
            flown.together += usize::from(together);
            flown.recovered += usize::from(together && last[orbit] != Outcome::Completed);
            flown.failed += usize::from(outcome != Outcome::Completed);
            last[orbit] = outcome;
            let stuck = |event: &&Event<f64>| event.kind == EventKind::Stick;
            flown.stuck += expected.iter().filter(stuck).count();
        }
    }
    flown
}

/// Flies eight orbits and three both ways, each with one parameter scaled a little more than the
/// one before; more than a share of all periods is flown in lanes to its end.
fn agree_and_stay(
    system: &HybridSystem,
    model: &Model,
    [name, scaled]: [&str; 2],
    by: f64,
    periods: usize,
    least: f64,
) {
    for count in [LANES, 3] {
        let Flown { all, together, .. } = agree(orbits(system, model, scaled, by, count), periods);
        println!("{name}, {scaled}: {together} of {all} together");
        assert!(
            together as f64 > least * all as f64,
            "{name}, {scaled}: {together} of {all}"
        );
    }
}

/// The system by its exact flow and by Taylor's method.
fn systems(model: &Model) -> [HybridSystem; 2] {
    [
        HybridSystem::new(model),
        HybridSystem::without_exact_flow(model),
    ]
}

#[test]
fn periods_in_lanes_are_those_of_single_orbits_to_the_last_bit() {
    if !needs_wide_registers() {
        return;
    }
    for (name, scaled, by, least) in [
        ("linear", "alpha", 1e-4, 0.9),
        ("linear", "omega", 1e-3, 0.9),
        ("foale", "alpha", 1e-2, 0.9),
        ("linear_codim2", "alpha", 1e-3, 0.9),
    ] {
        let model = model(name, &[]);
        let system = HybridSystem::new(&model);
        agree_and_stay(&system, &model, [name, scaled], by, 400, least);
    }
}

#[test]
fn periods_of_taylor_steps_in_lanes_are_those_of_single_orbits_to_the_last_bit() {
    if !needs_wide_registers() {
        return;
    }
    for (name, overrides, scaled, by, least) in [
        ("linear", &[][..], "alpha", 1e-4, 0.99),
        ("linear", &[("omega", 1.1)], "omega", 1e-3, 0.99),
        ("linear_codim2", &[], "alpha", 1e-3, 0.99),
        ("mems", &[("V", 0.25)], "V", 1e-2, 0.99),
        ("moving_stop", &[], "alpha", 1e-2, 0.98),
    ] {
        let model = model(name, overrides);
        let system = HybridSystem::without_exact_flow(&model);
        agree_and_stay(&system, &model, [name, scaled], by, 200, least);
    }
}

#[test]
fn orbits_that_chatter_and_stick_leave_the_lanes_and_come_back() {
    if !needs_wide_registers() {
        return;
    }
    let model = model("linear", &[("delta", -1.0), ("r", 0.3), ("omega", 1.8)]);
    for system in systems(&model) {
        let orbits = orbits(&system, &model, "alpha", 0.3, LANES);
        let Flown {
            all,
            together,
            stuck,
            ..
        } = agree(orbits, 400);
        println!("{together} of {all} together, {stuck} stuck");
        assert!(stuck > 100 && 10 * together > all && together < all);
    }
}

#[test]
fn a_period_after_one_that_failed_says_how_it_ended_itself() {
    if !needs_wide_registers() {
        return;
    }
    let model = model("linear", &[("delta", -1.0), ("r", 0.3), ("omega", 1.8)]);
    let system = HybridSystem::new(&model);
    let mut orbits = orbits(&system, &model, "alpha", 0.3, LANES);
    for orbit in &mut orbits {
        // Few enough that orbits fail where they slide, and only there.
        orbit.set_step_limit(2);
    }
    let Flown {
        failed, recovered, ..
    } = agree(orbits, 400);
    println!("{failed} failed, {recovered} recovered");
    assert!(failed > 100 && recovered >= 5);
}

#[test]
fn a_state_beyond_the_stop_is_refused_as_it_is_alone() {
    if !needs_wide_registers() {
        return;
    }
    let model = model("linear", &[]);
    for system in systems(&model) {
        let mut alone = orbits(&system, &model, "alpha", 1e-4, LANES);
        for (orbit, rate) in [(3, 0.0), (5, -2.0)] {
            let beyond = alone[orbit].set_state(&[1.5, rate, 0.0]);
            beyond.expect("a finite state");
        }
        agree(alone, 3);
    }
}

#[test]
fn what_lanes_do_not_know_has_none() {
    for name in ["moving_stop", "impact_pair", "soft_a_stiff"] {
        let model = model(name, &[]);
        let system = HybridSystem::new(&model);
        let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.hi).collect();
        let orbit = Simulator::new(&system, &parameters).expect("finite parameters");
        assert!(LanePeriods::<LANES>::new(vec![orbit]).is_none(), "{name}");
    }
}
