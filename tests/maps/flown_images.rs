//! Contacts flown exactly, compared with exact images (tests/data/soft; README there) at depths
//! beyond the series in y.
//!
//! `cargo test --test maps -- flown_images:: --nocapture` prints the errors.

use grazemap::expansion::{
    Expander, FlightWindow, FlownContact, Graze, Numbers, Passage, SectionChart, Variables,
    flown_contact,
};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{PoincareSection, PoincareSectionKind};
use serde_json::Value;

use crate::support::reference::{exact, exact_list, read, text};
use crate::support::scenes::orbit;
use crate::support::soft::{Law, STIFF, guide_scene, scene};
use crate::support::systems::two_masses;
use crate::support::tiers;

/// Default weight of the passages: at y = 0.03 the truncation is below 1e-13.
const WEIGHT: u32 = 8;

fn flown(scene: &Scene, weight: u32) -> FlownContact {
    let orbit = orbit(scene);
    let expander = Expander::new(scene, &orbit).expect("an analytic law");
    let flown = expander.flown_contact(0, weight);
    flown.unwrap_or_else(|error| panic!("{error}")).expect("a compliant stop")
}

/// Change of each coordinate by a flown passage, in double-double so that subtracting the start
/// loses no digits.
fn kick(contact: &FlownContact, start: &[f64]) -> Vec<f64> {
    let shift = |value: f64| Dd::from(value);
    let start: Vec<Dd> = start.iter().copied().map(shift).collect();
    let exact = contact.map_scalars(Dd::from);
    let (image, _) = exact.act(&mut Numbers::new(), &start);
    let pairs = image.iter().zip(&start);
    pairs.map(|(image, start)| (*image - *start).hi).collect()
}

/// A law of the grid of zero-time images: on a section at the phase of the graze, without
/// parameters.
fn grid_scene(row: &Value, kind: &str) -> Scene {
    let omega = format!("2*sqrt(1 - 0.015^2)/{}", text(&row["m"]));
    let mut overrides = vec![
        ("section.kind", kind),
        ("window.depth", "1.1e-3"),
        ("expansion.active", "[]"),
        ("omega", &omega),
        ("A", text(&row["A_g"])),
        ("grazing.guess.theta", row["phase_g"].as_str().unwrap_or("0")),
    ];
    for key in ["k2", "R2", "d"] {
        if !row[key].is_null() {
            overrides.push((key, text(&row[key])));
        }
    }
    scene(row["system"].as_str().unwrap_or("A"), &overrides)
}

#[test]
fn zero_time_images_of_the_grid_of_laws_are_exact_on_every_depth_of_the_window() {
    let file = read("soft/zdm_images.json");
    let cases = file["cases"].as_array().expect("cases");
    let (mut absolute, mut relative) = (0.0_f64, 0.0_f64);
    for row in tiers::part(cases, 10) {
        let contact = flown(&grid_scene(row, "stroboscopic"), WEIGHT);
        for image in row["images"].as_array().expect("images") {
            let [y, du, dv] = [0, 1, 2].map(|column| exact(&image[column]));
            if y.hi > 0.0332 {
                continue;
            }
            let found = kick(&contact, &[(y * y).hi, 0.0]);
            let errors = [found[0] - du.hi, found[1] - dv.hi];
            absolute = errors.iter().fold(absolute, |worst, e| worst.max(e.abs()));
            relative = relative.max((errors[1] / dv.hi).abs());
        }
    }
    println!("grid of laws: {absolute:.1e}, {relative:.1e} of the jump of v");
    // Weight 9 of the free flow at y = 0.03: (0.03)^9 = 2e-14.
    assert!(absolute < 2e-14, "{absolute:e}");
    assert!(relative < 1e-12, "{relative:e}");
}

#[test]
fn images_stay_exact_from_soft_to_rigid() {
    let file = read("soft/soft_to_rigid.json");
    let mut worst = [0.0_f64; 2];
    for case in file["system_A"].as_array().expect("cases") {
        let y = exact(&case["y"]);
        if y.hi > 0.0332 {
            continue;
        }
        for image in tiers::part(case["rows"].as_array().expect("images"), 3) {
            let mut row = case.clone();
            row["k2"] = image["k2"].clone();
            let start = [(y * y).hi, 0.0];
            let zero_time = kick(&flown(&grid_scene(&row, "stroboscopic"), WEIGHT), &start);
            let section = kick(&flown(&grid_scene(&row, "tangency"), WEIGHT), &start);
            let columns = ["zdm_du", "zdm_dv", "pdm_H_over_minus_y2", "pdm_dphase"];
            let [du, dv, gap, phase] = columns.map(|column| exact(&image[column]));
            let du_section = y * y * (gap - Dd::ONE);
            let errors = [zero_time[0] - du.hi, zero_time[1] - dv.hi];
            worst[0] = errors.iter().fold(worst[0], |worst, e| worst.max(e.abs()));
            let errors = [section[0] - du_section.hi, section[1] - phase.hi];
            worst[1] = errors.iter().fold(worst[1], |worst, e| worst.max(e.abs()));
        }
    }
    println!(
        "k2 = 1e2 to 1e20: zero-time mapping {:.1e}, section mapping {:.1e}",
        worst[0], worst[1]
    );
    // At k2 = 1e20 the image is that of a rigid stop, and so is the truncation: weight 9 at y =
    // 0.01.
    assert!(worst[0] < 1e-15, "{worst:?}");
    assert!(worst[1] < 1e-14, "{worst:?}");
}

#[test]
fn kicks_at_a_depth_of_1e_minus_30_keep_their_leading_law() {
    let y = 1e-15_f64;
    // (k2 = 1e6 of A: −4/3 k2 √(2/a) y³; R2 = 0.05, k2 = 100 of B: −R2 y²), M = 1.
    let stiff = [("section.kind", "stroboscopic"), ("k2", "1e6"), ("window.depth", "1e-3")];
    let a = scene("A", &stiff);
    let acceleration = orbit(&a).grazing_point().normal_acceleration.hi;
    let law = -4.0 / 3.0 * 1e6 * (2.0 / acceleration).sqrt() * y.powi(3);
    let damped =
        [("section.kind", "stroboscopic"), ("k2", "100"), ("R2", "0.05"), ("window.depth", "1e-3")];
    let b = scene("B", &damped);
    for (scene, law) in [(a, law), (b, -0.05 * y * y)] {
        let contact = flown(&scene, WEIGHT);
        let found = kick(&contact, &[y * y, 0.0, 0.0, 0.0]);
        // The next term is smaller by y over the radius of the series, 3e-4 and 6e-4, or its
        // square.
        assert!((found[1] / law - 1.0).abs() < 1e-9, "{} against {law}", found[1]);
    }
}

#[test]
fn a_damper_left_at_the_surface_kicks_by_the_cube_of_the_depth_variable() {
    let (k2, zeta) = (50.0, 0.05);
    for r2 in [0.0, 1.0, 30.0] {
        let text = r2.to_string();
        let scene = guide_scene(&[("section.kind", "stroboscopic"), ("R2", &text)]);
        let acceleration = orbit(&scene).grazing_point().normal_acceleration.hi;
        let contact = flown(&scene, WEIGHT);
        for y in [1e-15, 1e-12, 1e-9] {
            // The forces along the free flow, -k2 (x - delta) - R2 v, and what the free field makes
            // of the damper's R2 (x - delta) on the way: x' = v and v' = -2 zeta v. The gap's
            // integral is -4/3 y^3 sqrt(2/a).
            let integral = -4.0 / 3.0 * (2.0 / acceleration).sqrt() * y * y * y;
            let law = [r2 * integral, (k2 - 2.0 * zeta * r2) * integral];
            let found = kick(&contact, &[y * y, 0.0, 0.0, 0.0]);
            for (found, law) in found.iter().zip(law) {
                // The next term is smaller by R2 y or k2 y^2.
                let error = (found - law).abs();
                assert!(
                    error < 1e3 * y * law.abs() + 1e-14 * integral.abs(),
                    "R2 = {r2}, y = {y:e}: {found:e} and {law:e}"
                );
            }
        }
    }
}

#[test]
fn images_do_not_depend_on_how_a_flight_is_planned() {
    let more: [Law; 4] = [
        ("B, R2 = 0.05, k2 = 1e6", "B", &[("R2", "0.05"), ("k2", "1e6")]),
        ("A, k2 = 1e8", "A", &[("k2", "1e8")]),
        ("D, overdamped", "D", &[("d", "1e-6"), ("R2", "200"), ("k2", "1e4")]),
        ("C, hardly pressed", "C", &[("d", "1e-9"), ("k2", "1e7")]),
    ];
    for (name, system, law) in STIFF.into_iter().chain(more) {
        // Another window: other depths are fitted and checked, and other steps flown.
        let [one, other] = ["1e-3", "3e-3"].map(|depth| {
            let mut overrides = law.to_vec();
            overrides.extend([("window.depth", depth), ("expansion.active", "[]")]);
            flown(&scene(system, &overrides), WEIGHT)
        });
        let mut worst = 0.0_f64;
        for number in 0..600 {
            let depth = 1e-3 * 0.1_f64.powf(0.0437 * f64::from(number));
            let [one, other] = [&one, &other].map(|contact| kick(contact, &[depth, 0.0]));
            let size = one.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
            let errors = one.iter().zip(&other).map(|(one, other)| (one - other).abs());
            worst = errors.fold(worst, |worst, error| worst.max(error / size));
        }
        println!("{name}: {:?} and {:?} differ by {worst:.1e}", one.plan(), other.plan());
        // Both plans are held to 1e-14 of the kick.
        assert!(worst < 2e-14, "{name}: {worst:e}");
    }
}

#[test]
fn the_identity_holds_exactly_without_contact() {
    let contact = flown(&scene("B", &[("k2", "100"), ("R2", "0.05"), ("window.depth", "1e-3")]), 6);
    for start in [[0.0, 0.0, 0.0, 0.0], [-1e-4, 0.02, 1e-5, -1e-5], [-1e-30, 0.0, 0.0, 0.0]] {
        let (image, depth) = contact.act(&mut Numbers::new(), &start);
        assert!(depth <= 0.0, "{depth:e}");
        assert_eq!(image, start[..2]);
    }
}

/// Stop of the two masses: its surface, and the name of its images in the file. The orbit is
/// symmetric.
struct Side {
    surface: usize,
    sign: f64,
    start: &'static str,
    phase: &'static str,
    image: &'static str,
}

const SIDES: [Side; 2] = [
    Side { surface: 0, sign: 1.0, start: "x_i", phase: "phase_i", image: "D_R" },
    Side { surface: 1, sign: -1.0, start: "left_point", phase: "left_phase", image: "D_L" },
];

/// Largest error of the images of one stop at zero net time.
fn worst_zero_time_error(file: &Value, graze: &[Dd], contact: &FlownContact, side: &Side) -> f64 {
    let contact = contact.map_scalars(Dd::from);
    let mut worst = 0.0_f64;
    for row in file["images"].as_array().expect("images") {
        let mut point = exact_list(&row[side.start]);
        point.push(exact(&row[side.phase]));
        let offset = point.iter().zip(graze).map(|(&a, &b)| a - b);
        let offset: Vec<_> = offset.chain([exact(&row["d_offset"])]).collect();
        let (found, _) = contact.act(&mut Numbers::new(), &offset);
        let truth = exact_list(&row[side.image]);
        let errors = truth.iter().zip(graze).zip(found);
        let errors = errors.map(|((t, &graze), found)| (graze + found - *t).magnitude());
        worst = errors.fold(worst, f64::max);
    }
    worst
}

#[test]
fn zero_time_images_of_two_masses_fall_with_every_order_at_every_depth() {
    for (set, side) in ["T1", "T2"].into_iter().flat_map(|set| SIDES.iter().map(move |s| (set, s)))
    {
        let file = read(&format!("soft/public_two_{set}_soft.json"));
        let scene = two_masses(&file);
        let orbit = orbit(&scene);
        let mut state = orbit.grazing_point().state.clone();
        if side.sign < 0.0 {
            state[..4].iter_mut().for_each(|value| *value = -*value);
            state[4] += Dd::PI;
        }
        let position = |name: &str| scene.model.parameters.iter().position(|p| p.name == name);
        let d = position("d").expect("the gap");
        let parameters = &orbit.grazing_point().parameters;
        let passage = Passage::new(&scene.model, side.surface, &state, parameters, &[d])
            .expect("an analytic law");
        let chart = SectionChart {
            section: PoincareSection {
                kind: PoincareSectionKind::Stroboscopic { phase: Dd::ZERO },
                coordinates: (0..5).collect(),
                eliminated: 4,
            },
            point: state.clone(),
        };
        let variables = Variables {
            names: ["x1", "v1", "x2", "v2", "theta", "d"].map(str::to_owned).to_vec(),
            weights: vec![2; 6],
            coordinates: 5,
        };
        let graze = Graze { passage, chart, variables };
        let window = FlightWindow { depth: 0.05, half_widths: vec![0.05; 6] };
        let mut last = f64::INFINITY;
        for weight in [2, 4, 6, 8] {
            let contact = flown_contact(&graze, weight, &window);
            let contact = contact.unwrap_or_else(|e| panic!("{e}")).expect("a compliant stop");
            let worst = worst_zero_time_error(&file, &state, &contact, side);
            println!("{set}, {}, W = {weight}: {worst:.1e}", side.image);
            assert!(worst < 0.05 * last, "{set}, W = {weight}: {worst:e} after {last:e}");
            last = worst;
        }
        // The truncation is of weight 9; the stops are met up to y = 0.18 on the right and 0.38 on
        // the left.
        assert!(last < 1e-6, "{set}: {last:e}");
    }
}
