//! Scenes that allow any section: they get the section whose map meets the tolerance at the lowest
//! cost, and the map meets the tolerance there.

use std::sync::LazyLock;

use grazemap::analysis::{DirectEnd, DirectImage, SectionChange};
use grazemap::convergence::{
    Choice, Chooser, SamplePoint, SettledScene, choose_orders, chosen_map, settle_section,
};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::{
    MapOrders, Orders, Scene, Section, SectionRule, StroboscopicPhase, catalogue,
};
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;
use grazemap::prelude::FindGraze;

use crate::support::scenes::{orbit, parsed, scene_with};
use crate::support::tiers;
use crate::{UNUSED, exact};

fn of_any_section(name: &str, tolerance: &str) -> Scene {
    scene_with(name, &[("expansion.tolerance", tolerance), ("section.kind", "any")])
}

fn settled(scene: &Scene) -> SettledScene {
    settle_section(scene, &orbit(scene)).expect("points in the window")
}

/// A moving stop on the section that it takes within 1e-6, settled once for all tests.
static MOVING_STOP: LazyLock<SettledScene> =
    LazyLock::new(|| settled(&of_any_section("moving_stop", "1e-6")));

fn choice(settled: &SettledScene) -> &Choice {
    settled.choice().expect("the section was decided by a map")
}

/// Points of a window that no choice was based on.
fn unused(scene: &Scene, orbit: &GrazingOrbit, count: usize) -> Vec<SamplePoint> {
    let chooser = Chooser::new(scene, orbit, 1).expect("points in the window");
    chooser.points(UNUSED, count)
}

/// Largest difference of a coordinate between a map's image and that of direct simulation in
/// double-double; `None` if the latter does not return or makes other contacts.
fn error(direct: &mut DirectImage<'_, Dd>, map: &HornerMap, point: &SamplePoint) -> Option<f64> {
    let truth = direct.image(&exact(&point.state), &exact(&point.parameters)).expect("good input");
    if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
        return None;
    }
    let mut image = vec![0.0; map.dimension()];
    map.step(&point.state, &point.parameters, &mut image);
    let differences = image.iter().zip(&truth.offsets);
    Some(
        differences.fold(0.0, |worst, (&image, &truth)| {
            worst.max((Dd::from(image) - truth).to_f64().abs())
        }),
    )
}

#[test]
fn a_moving_stop_takes_the_stroboscopic_section_at_its_graze() {
    let scene = of_any_section("moving_stop", "1e-6");
    let tangency = choose_orders(&scene, &orbit(&scene), 1e-6).expect("a choice");
    let settled = &*MOVING_STOP;
    let verdict = settled.verdict.as_ref().expect("any section would do");
    assert_eq!(settled.scene.section, Section::Stroboscopic(StroboscopicPhase::Grazing));
    assert_eq!(settled.scene.section_rule, SectionRule::Named);
    assert!(choice(settled).met && choice(settled).operations < tangency.operations);
    // The tangency section, and an eighth, a quarter and half a period before the graze.
    let others: Vec<_> = verdict.others.iter().map(|other| other.ahead).collect();
    assert_eq!(others, [None, Some(0.125), Some(0.25), Some(0.5)]);
    assert_eq!(verdict.others[0].operations(), Some(tangency.operations));
    let least = verdict.others.iter().filter_map(|other| other.operations());
    assert!(least.min() > verdict.taken.operations());
}

#[test]
fn the_map_of_the_section_taken_agrees_with_direct_simulation_on_it_step_by_step() {
    let (scene, orbit) = (&MOVING_STOP.scene, &MOVING_STOP.orbit);
    let (_, map) = chosen_map(choice(&MOVING_STOP), scene, orbit).expect("it is expanded");
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::<Dd>::new(&system, scene, orbit).expect("good input");
    let points = unused(scene, orbit, 300);
    let mut compared = 0;
    for point in &points {
        let error = error(&mut direct, &map, point).expect("a return");
        // A choice is judged on a thousand points; on others it exceeds its tolerance by some per
        // cent at most.
        assert!(error < 1.1e-6, "{point:?}: {error:e}");
        compared += 1;
        // The image, iterated, is a point of the window again or not.
        let mut next = point.clone();
        map.step(&point.state, &point.parameters, &mut next.state);
        let widths = orbit.section.coordinates.iter();
        let widths = widths.map(|&component| scene.window.state[component]);
        let inside = |(offset, width): (&f64, f64)| offset.abs() <= width;
        if next.state.iter().zip(widths).all(inside) {
            let error = self::error(&mut direct, &map, &next).expect("a return");
            assert!(error < 1.1e-6, "{next:?}: {error:e}");
        }
    }
    assert!(compared > 200, "{compared}");
}

#[test]
fn the_section_taken_is_what_a_scene_that_names_it_gets() {
    let settled = &*MOVING_STOP;
    let mut named = scene_with(
        "moving_stop",
        &[("expansion.tolerance", "1e-6"), ("section.kind", "stroboscopic")],
    );
    // Half-widths have three digits, so that a person can write them into a scene.
    for (component, name) in [(0, "x"), (1, "v")] {
        let width = settled.scene.window.state[component];
        assert_eq!(format!("{width:.2e}").parse(), Ok(width), "{name}");
        named.window.state[component] = width;
    }
    let by_name = choose_orders(&named, &orbit(&named), 1e-6).expect("a choice");
    let taken = Choice { seconds: by_name.seconds, ..choice(settled).clone() };
    assert_eq!(taken, by_name);
}

#[test]
fn the_window_taken_holds_the_orbits_of_the_window_on_the_tangency_section() {
    let scene = of_any_section("moving_stop", "1e-6");
    let own = orbit(&scene);
    let settled = &*MOVING_STOP;
    let system = HybridSystem::new(&scene.model);
    let to = (&settled.scene, &settled.orbit);
    let mut change = SectionChange::<f64>::new(&system, (&scene, &own), to).expect("good input");
    let mut largest = [0.0_f64; 2];
    for point in unused(&scene, &own, 300) {
        let carried = change.carry(&point.state, &point.parameters).expect("good input");
        let carried = carried.expect("a section point");
        for (place, &component) in settled.orbit.section.coordinates.iter().enumerate() {
            let share = carried[place].abs() / settled.scene.window.state[component];
            largest[place] = largest[place].max(share);
        }
    }
    // Half-widths are the largest of some thousand points, rounded up to three digits: others
    // exceed them by little, and no box is much larger than what it holds.
    for share in largest {
        assert!(share > 0.9 && share < 1.02, "{largest:?}");
    }
}

#[test]
fn the_linear_oscillator_keeps_its_tangency_section_and_its_window() {
    let scene = of_any_section("linear", "1e-6");
    let settled = settled(&scene);
    let verdict = settled.verdict.as_ref().expect("any section would do");
    assert_eq!(settled.scene.section, Section::Tangency);
    assert_eq!(settled.scene.window, scene.window);
    assert_eq!(verdict.taken.ahead, None);
    let own = choose_orders(&scene, &settled.orbit, 1e-6).expect("a choice");
    assert_eq!(choice(&settled).operations, own.operations);
    let others = verdict.others.iter().filter_map(|other| other.operations());
    assert!(others.min() >= Some(own.operations));
}

#[test]
fn the_section_that_a_scene_names_stays_without_a_trial() {
    for kind in ["tangency", "stroboscopic"] {
        let scene = scene_with("linear", &[("section.kind", kind)]);
        let settled = settled(&scene);
        assert!(settled.verdict.is_none() && settled.choice().is_none());
        assert_eq!(settled.scene.section, scene.section);
        assert_eq!(settled.scene.window, scene.window);
    }
}

#[test]
fn an_autonomous_system_has_its_tangency_section_alone() {
    let settled = settled(&of_any_section("self_excited", "1e-4"));
    let verdict = settled.verdict.as_ref().expect("any section would do");
    assert_eq!(settled.scene.section, Section::Tangency);
    assert!(verdict.others.is_empty());
    assert!(choice(&settled).met);
}

#[test]
fn where_no_section_has_a_map_the_scene_stays_on_its_tangency_section() {
    let settled = settled(&of_any_section("self_excited", "1e-30"));
    assert_eq!(settled.scene.section, Section::Tangency);
    assert!(!choice(&settled).met);
}

#[test]
fn a_tolerance_set_takes_the_place_of_orders_and_orders_that_of_a_tolerance() {
    let tolerant = scene_with("linear", &[("expansion.tolerance", "1e-7")]);
    assert_eq!(tolerant.expansion.orders, Orders::Tolerance(1e-7));
    let text = catalogue::text("linear").expect("in the catalogue");
    let keys = [("expansion.tolerance".to_owned(), "1e-7".to_owned())];
    let text = Scene::text_with(text, "linear", &keys).expect("good overrides");
    let back = [("expansion.smooth_order".to_owned(), "4".to_owned())];
    let back = Scene::parse_with(&text, "linear", &back).expect("good overrides");
    // The weight that is not named is the default.
    let orders = Orders::Fixed(MapOrders::new(4, 6));
    assert_eq!(back.expansion.orders, orders);
}

/// Orbits of several forcing periods, in which the graze is not in the period after any phase.
#[test]
fn an_orbit_of_several_forcing_periods_has_a_map_at_every_phase() {
    let text = |flow: &str, periods: usize, guess: &str, phase: f64| {
        format!(
            r#"
[model]
name = "subharmonic"
states = ["x", "v"]
parameters = {{ r = 0.8, w = 1.0, f = 1.0 }}
phase = {{ name = "theta", rate = "{}", period = "2*pi" }}
[model.flow]
x = "v"
v = "{flow}"
[[model.surface]]
name = "stop"
event = "w - x"
impact = {{ v = "-r*v" }}
[grazing]
solve_for = "w"
periods = {periods}
guess = {{ {guess} }}
[section]
kind = "stroboscopic"
phase = "{phase}"
[expansion]
active = ["w"]
smooth_order = 3
contact_weight = 4
"#,
            if periods == 2 { "2.2" } else { "4.2" }
        )
    };
    let twice = ("-0.1*v - (1 + 0.5*f*cos(theta))*x - 0.3*x^3", "x = 1.0, v = 0.0, theta = 3.0");
    let thrice = ("f*cos(theta) - 0.02*v - x - x^3", "x = 1.2, v = 0.0, theta = 0.0");
    for (periods, (flow, guess)) in [(2, twice), (3, thrice)] {
        for &phase in tiers::part(&[0.0, 1.0, 3.0, 5.0], 2) {
            let scene =
                parsed::<&str, &str>(&text(flow, periods, guess, phase), "subharmonic", &[]);
            let map = scene.graze().and_then(|graze| graze.map());
            let map = map.unwrap_or_else(|error| panic!("{periods} {phase}: {error}"));
            let errors = &map.window().errors;
            let small = |error: Option<f64>| error.is_some_and(|error| error < 1e-7);
            assert!(errors.iter().all(|own| small(own.error)), "{periods} {phase}: {errors:?}");
            // The orbit itself, by direct simulation, with the stop out of its way.
            let image = map.simulate(&[0.0, 0.0], &[1e-6]).expect("good input");
            assert_eq!(image.end, DirectEnd::Returned);
            assert!(image.offsets.iter().all(|offset| offset.abs() < 1e-11), "{image:?}");
        }
    }
}
