//! Maps with flown contacts, compared with direct simulation in double-double and with each other
//! in different forms; and refused input.
//!
//! `cargo test --test maps -- flown_maps:: --nocapture` prints the errors.

use grazemap::analysis::{DirectImage, MapEvaluation};
use grazemap::emission::{EmitOptions, emitted_module};
use grazemap::expansion::{Expander, ExpansionError, FlightError, LocalMap, MapOrders};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap, InterpretedMap};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};

use crate::support::driver::run;
use crate::support::scenes::{self, orbit};
use crate::support::soft::{STIFF, guide_scene, scene};

/// Largest error of whole maps against direct simulation in double-double.
fn worst_error(scene: &Scene, orders: MapOrders, points: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let orbit = orbit(scene);
    let map = Expander::new(scene, &orbit)
        .expect("an analytic law")
        .flown(orders)
        .unwrap_or_else(|error| panic!("{error}"));
    let evaluation = MapEvaluation::<Dd>::new(&map);
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::<Dd>::new(&system, scene, &orbit).expect("a good scene");
    let mut worst = 0.0_f64;
    for (state, parameters) in points {
        let exact = |values: &[f64]| values.iter().copied().map(Dd::from).collect::<Vec<_>>();
        let (state, parameters) = (exact(state), exact(parameters));
        let truth = direct.image(&state, &parameters).expect("a finite point");
        let found = evaluation.image(&state, &parameters);
        assert_eq!(found.contacts(), truth.contacts, "{state:?}");
        let pairs = found.offsets.iter().zip(&truth.offsets);
        let errors = pairs.map(|(found, truth)| (*found - *truth).magnitude());
        worst = errors.fold(worst, f64::max);
    }
    worst
}

#[test]
fn errors_fall_with_the_weight_whatever_the_stiffness() {
    let point = |size: f64| {
        let square = size * size;
        (vec![square, 0.7 * square], vec![-0.3 * square])
    };
    for (name, system, law) in STIFF {
        let mut overrides = law.to_vec();
        overrides.extend([
            ("section.kind", "stroboscopic"),
            ("expansion.active", "[\"A\"]"),
            ("window.depth", "1e-2"),
            ("window.state", "{ u = 1e-2, v = 1e-2 }"),
            ("window.parameter", "{ A = 1e-2 }"),
        ]);
        let scene = scene(system, &overrides);
        for weight in [2, 3, 4, 6] {
            let orders = MapOrders { smooth_order: 2, contact_weight: weight };
            let [large, small] =
                [0.06, 0.03].map(|size| worst_error(&scene, orders, &[point(size)]));
            let rate = (large / small).log2();
            println!("{name}, W = {weight}: rate {rate:.2}");
            // The next weight bends the line by the size, 0.06, over a radius of order one.
            assert!(rate > f64::from(weight) + 0.7, "{name}, W = {weight}: {large:e}, {small:e}");
        }
    }
}

/// Depths from 1e-3 to 1e-30. The upper decades, in which one law replaces another, are dense; no
/// depth is a round number.
fn depths() -> impl Iterator<Item = f64> {
    let upper = (0..40).map(|number| 1e-3 * 0.1_f64.powf(0.103 * f64::from(number)));
    upper.chain((4..=27).map(|number| 1e-3 * 0.1_f64.powi(number)))
}

#[test]
fn stroboscopic_maps_of_stiff_stops_are_exact_on_depths_from_1e_minus_30_to_1e_minus_3() {
    for (name, system, law) in STIFF {
        let mut overrides = law.to_vec();
        overrides.extend([
            ("section.kind", "stroboscopic"),
            ("expansion.active", "[\"A\"]"),
            ("window.depth", "1e-3"),
            ("window.state", "{ u = 1e-2, v = 1e-2 }"),
            ("window.parameter", "{ A = 1e-2 }"),
        ]);
        let points: Vec<_> = depths()
            .flat_map(|depth| {
                [(vec![depth, 0.0], vec![0.0]), (vec![depth, 3.0 * depth], vec![0.3 * depth])]
            })
            .collect();
        // The legs are linear in state and amplitude. The truncation is of weight 9 in y = 0.03 and
        // v = 3 y².
        let orders = MapOrders { smooth_order: 2, contact_weight: 8 };
        let error = worst_error(&scene(system, &overrides), orders, &points);
        println!("{name}, stroboscopic: {error:.1e}");
        assert!(error < 1e-10, "{name}: {error:e}");
    }
}

#[test]
fn stroboscopic_maps_of_dampers_left_at_the_surface_are_exact_on_the_same_depths() {
    for (k2, r2) in [("50", "1"), ("50", "30"), ("1e4", "1"), ("1e6", "20")] {
        let scene = guide_scene(&[
            ("section.kind", "stroboscopic"),
            ("expansion.active", "[\"alpha\"]"),
            ("window.depth", "1e-3"),
            ("window.state", "{ x = 1e-2, v = 1e-2 }"),
            ("window.parameter", "{ alpha = 1e-2 }"),
            ("k2", k2),
            ("R2", r2),
        ]);
        let points: Vec<_> =
            depths().map(|depth| (vec![depth, 3.0 * depth], vec![0.3 * depth])).collect();
        let orders = MapOrders { smooth_order: 2, contact_weight: 8 };
        let error = worst_error(&scene, orders, &points);
        println!("guide, k2 = {k2}, R2 = {r2}: {error:.1e}");
        // As above: weight 9 in y = 0.03.
        assert!(error < 1e-10, "k2 = {k2}, R2 = {r2}: {error:e}");
    }
}

#[test]
fn section_maps_of_stiff_stops_are_exact_to_1e_minus_9_on_the_same_depths() {
    for (name, system, law) in STIFF {
        let mut overrides = law.to_vec();
        overrides.extend([
            ("window.depth", "1e-3"),
            ("window.state", "{ u = 1e-3, theta = 0.02 }"),
            ("window.parameter", "{ A = 1e-4, omega = 1e-4 }"),
        ]);
        let points: Vec<_> = depths()
            .flat_map(|depth| {
                let shift = 0.02 * depth.sqrt() / 0.0317;
                let moved = 0.1 * depth;
                [
                    (vec![depth, 0.0], vec![0.0, 0.0]),
                    (vec![depth, shift], vec![moved, -moved]),
                    (vec![depth, -shift], vec![-moved, moved]),
                ]
            })
            .collect();
        // A kick turns the phase by up to 0.1, and the legs are series in that turn: C, which is
        // thrown back hardest, has 2e-8 at degree 8.
        let orders = MapOrders { smooth_order: 11, contact_weight: 10 };
        let error = worst_error(&scene(system, &overrides), orders, &points);
        println!("{name}, tangency: {error:.1e}");
        assert!(error < 1e-9, "{name}: {error:e}");
    }
}

#[test]
fn a_prestress_may_be_an_active_parameter() {
    let law = [
        ("d", "1e-2"),
        ("k2", "1e4"),
        ("section.kind", "stroboscopic"),
        ("expansion.active", "[\"A\", \"d\"]"),
        ("window.depth", "1e-3"),
        ("window.state", "{ u = 1e-2, v = 1e-2 }"),
        ("window.parameter", "{ A = 1e-3, d = 1e-3 }"),
    ];
    let points: Vec<_> =
        depths().map(|depth| (vec![depth, depth], vec![0.3 * depth, depth])).collect();
    // The force is a series of its own then: 1, h and h' have no coefficient that moves with d.
    let orders = MapOrders { smooth_order: 2, contact_weight: 8 };
    let error = worst_error(&scene("C", &law), orders, &points);
    println!("C, d active: {error:.1e}");
    assert!(error < 1e-10, "{error:e}");
}

#[test]
fn the_free_field_need_not_be_affine() {
    let law = [
        ("model.flow.v", "A*cos(theta) - R1*v - k1*u - 0.05*u^3"),
        ("model.surface.0.contact.v", "A*cos(theta) - R1*v - k1*u - k2*(u - sigma)"),
        ("k2", "1e5"),
        ("window.depth", "1e-4"),
        ("window.state", "{ u = 1e-4, theta = 0.01 }"),
        ("window.parameter", "{ A = 1e-5, omega = 1e-5 }"),
    ];
    let shallow = depths().filter(|&depth| depth <= 1e-4);
    let points: Vec<_> =
        shallow.map(|depth| (vec![depth, depth], vec![0.1 * depth, 0.0])).collect();
    let orders = MapOrders { smooth_order: 6, contact_weight: 6 };
    let error = worst_error(&scene("A", &law), orders, &points);
    println!("A, a cubic free field: {error:.1e}");
    // Degree 7 and weight 7 at y = 0.01, where the phase turns by 0.03.
    assert!(error < 1e-9, "{error:e}");
}

/// A stiff map on its section, and points of its window with contact.
fn section_map(system: &str, law: &[(&str, &str)]) -> (LocalMap, Vec<[f64; 4]>) {
    let window = [
        ("window.depth", "1e-3"),
        ("window.state", "{ u = 1e-3, theta = 0.02 }"),
        ("window.parameter", "{ A = 1e-4, omega = 1e-4 }"),
    ];
    let scene = scene(system, &[law, &window].concat());
    let orbit = orbit(&scene);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let orders = MapOrders { smooth_order: 4, contact_weight: 6 };
    let map = expander.flown(orders).unwrap_or_else(|error| panic!("{error}"));
    let shares = [0.3, -0.7, 0.9, -0.2];
    let point = |number: usize| {
        let share = |shift: usize| shares[(number + shift) % 4];
        let depth = 1e-3 * 0.3_f64.powi(number as i32);
        [depth, 0.02 * share(0), 1e-2 * depth * share(1), 1e-2 * depth * share(2)]
    };
    (map, (0..12).map(point).collect())
}

/// Agreement relative to the largest entry.
fn agree(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    let size = expected.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    for (found, expected) in found.iter().zip(expected) {
        let error = (found - expected).abs();
        assert!(error <= tolerance * size, "{what}: {found} and {expected}");
    }
}

#[test]
fn interpreted_lowered_frozen_and_compiled_maps_agree() {
    let (map, points) = section_map("A", &[("k2", "1e6")]);
    let (interpreted, horner) = (InterpretedMap::new(&map), HornerMap::new(&map));
    let module = emitted_module(&map, None, &EmitOptions::default()).expect("finite numbers");
    assert!(module.text().contains("Shape: flown"));
    let queries: Vec<_> = points
        .iter()
        .map(|point| {
            let bits = point.map(|value| value.to_bits().to_string());
            format!("{} {}", module.identifier, bits.join(" "))
        })
        .collect();
    let answers = run(&[&module], &queries);
    for (point, answer) in points.iter().zip(&answers) {
        let (state, parameters) = point.split_at(2);
        let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
        let info = interpreted.step_jacobian(state, parameters, &mut image, &mut jacobian);
        assert!(info.valid && info.contacts() == 1, "{point:?}");
        // A stiff contact multiplies rounding by up to √k2 y/√a = 40 in the kick and as much again
        // in its slope.
        agree("compiled image", &answer[..2], &image, 1e-13);
        agree("compiled Jacobian", &answer[3..], &jacobian, 1e-11);
        let frozen = horner.freeze(parameters);
        let (mut again, mut slopes) = ([0.0; 2], [0.0; 4]);
        horner.step_jacobian(state, parameters, &mut again, &mut slopes);
        agree("lowered image", &again, &image, 1e-13);
        agree("lowered Jacobian", &slopes, &jacobian, 1e-11);
        let mut last = [0.0; 2];
        frozen.step(state, &[], &mut last);
        assert_eq!(last, again);
    }
}

#[test]
fn jacobians_are_the_slopes_of_the_image() {
    // A's force is gone at the release, whose time then does not matter; those of C and D are not.
    for (name, system, law) in STIFF {
        let (map, points) = section_map(system, law);
        check_slopes(name, &map, &points);
    }
}

fn check_slopes(name: &str, map: &LocalMap, points: &[[f64; 4]]) {
    let (lowered, exact) = (HornerMap::new(map), MapEvaluation::<Dd>::new(map));
    for point in points {
        let (state, parameters) = point.split_at(2);
        let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
        lowered.step_jacobian(state, parameters, &mut image, &mut jacobian);
        let size = jacobian.iter().fold(0.0_f64, |size, slope| size.max(slope.abs()));
        for column in 0..2 {
            // Central differences in double-double err by the square of the step's share of the
            // depth.
            let step = 1e-7 * point[0];
            let image = |sign: f64| {
                let mut moved: Vec<Dd> = state.iter().copied().map(Dd::from).collect();
                moved[column] += Dd::from(sign * step);
                let parameters: Vec<Dd> = parameters.iter().copied().map(Dd::from).collect();
                exact.image(&moved, &parameters).offsets
            };
            let (right, left) = (image(1.0), image(-1.0));
            for row in 0..2 {
                let slope = ((right[row] - left[row]) / Dd::from(2.0 * step)).hi;
                let error = (slope - jacobian[2 * row + column]).abs();
                assert!(error < 1e-9 * size, "{name}, {point:?}: {slope} and {jacobian:?}");
            }
        }
    }
}

/// The scene of system A with another contact law.
fn with_contact(contact: &str, active: &str) -> Scene {
    let law = format!("{{ v = \"{contact}\" }}");
    scene("A", &[("model.surface.0.contact", &law), ("expansion.active", active)])
}

#[test]
fn laws_that_are_not_affine_are_refused_with_the_component_at_fault() {
    let refused = |scene: &Scene| {
        let orbit = orbit(scene);
        let expander = Expander::new(scene, &orbit).expect("an analytic law");
        expander.flown_contact(0, 4).expect_err("no affine law")
    };
    let at = |state: &str| {
        ExpansionError::Flight(FlightError::Field {
            surface: "stop".to_owned(),
            component: "v".to_owned(),
            state: state.to_owned(),
        })
    };
    let cubic = with_contact("free - k2*(u - sigma) - 5*(u - sigma)^3", "[\"A\"]");
    assert_eq!(refused(&cubic), at("u"));
    let swept = with_contact("free - k2*(u - sigma)", "[\"k2\"]");
    assert_eq!(refused(&swept), at("u"));
    let quadratic = with_contact("free - k2*(u - sigma) - R1*v*v", "[\"A\"]");
    assert_eq!(refused(&quadratic), at("v"));
}

#[test]
fn a_contact_that_outlasts_its_own_times_is_refused() {
    // Behind a damper of rate 1e4 the mass creeps back to the surface.
    let scene = scene("D", &[("R2", "1e4"), ("k2", "10")]);
    let orbit = orbit(&scene);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let error = expander.flown_contact(0, 4).expect_err("many steps");
    assert!(matches!(error, ExpansionError::Flight(FlightError::TooLong { .. })), "{error}");
}

#[test]
fn a_scene_of_rigid_stops_has_nothing_to_fly() {
    let scene = scenes::scene("linear");
    let orbit = orbit(&scene);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let orders = MapOrders { smooth_order: 2, contact_weight: 3 };
    let error = expander.flown(orders).expect_err("a rigid stop");
    assert_eq!(error, ExpansionError::NothingToFly);
}
