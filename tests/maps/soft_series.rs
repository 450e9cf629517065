//! Expansions of soft impacts against Taylor coefficients obtained by contour integration of the
//! exact piecewise-linear flow (tests/data/soft/taylor_*.json; forty digits, see the README there).

use std::collections::BTreeMap;

use grazemap::expansion::{
    Contact, Expander, Graze, Passage, SectionChart, Variables, discontinuity,
};
use grazemap::jet::{Jet, JetSpace, substitute_all};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{GrazingOrbit, PoincareSection, PoincareSectionKind};
use serde_json::Value;

use crate::support::reference::{number, read, text};
use crate::support::scenes::{orbit, scene_with};

/// Total degree of the coefficients in `taylor_2var.json`.
const DEGREE: u32 = 8;

/// Total degree of the coefficients in `taylor_3var_A1.json`.
const THREE_VARIABLES_DEGREE: u32 = 8;
/// Error of coefficients that are expanded in double-double: two roundings.
const ROUNDING: f64 = 1e-15;

/// The scene of a reference set; `active` as in `[expansion]`.
fn scene(set: &Value, active: &str) -> Scene {
    let parameters = set["params"].as_object().expect("parameters");
    let system = parameters["typ"].as_str().expect("a letter").to_lowercase();
    let mut overrides = vec![
        ("omega", text(&set["w"])),
        ("A", text(&set["A_g"])),
        ("grazing.guess.theta", text(&set["phase_g"])),
        ("expansion.active", active),
    ];
    let given = parameters.iter().filter(|(name, _)| ["k2", "R2", "d"].contains(&name.as_str()));
    overrides.extend(given.map(|(name, value)| (&name[..], text(value))));
    let name = format!("soft_{system}");
    scene_with(&name, &overrides)
}

/// Variables of the reference, `(y, phase, …)`, all of weight 1.
fn reference_space(variables: usize, degree: u32) -> std::sync::Arc<JetSpace> {
    JetSpace::uniform(variables, degree as usize).expect("a small space")
}

/// `y B + y² C` of a coordinate, at the coordinates and parameters given as jets in (y, …).
fn correction<S: Scalar>(contact: &Contact<S>, coordinate: usize, at: &[Jet<S>]) -> Jet<S> {
    let y = Jet::variable(at[0].space(), 0, S::zero());
    let linear = substitute_all(&contact.linear[coordinate..=coordinate], at);
    let quadratic = substitute_all(&contact.quadratic[coordinate..=coordinate], at);
    &y * &(&linear[0] + &(&y * &quadratic[0]))
}

fn listed(list: &Value) -> BTreeMap<Vec<u8>, f64> {
    let powers = |key: &str| key.split(',').map(|power| power.parse().expect("a power")).collect();
    let terms = list.as_object().expect("a table");
    terms.iter().map(|(key, value)| (powers(key), number(value))).collect()
}

/// Largest error of each coefficient, relative to the largest of its total degree.
fn worst_error(ours: &Jet<f64>, truth: &BTreeMap<Vec<u8>, f64>) -> f64 {
    let degree_of = |powers: &[u8]| powers.iter().map(|&power| usize::from(power)).sum::<usize>();
    let space = ours.space();
    (0..=space.order())
        .map(|degree| {
            let of_degree = truth.iter().filter(|(powers, _)| degree_of(powers) == degree);
            let scale = of_degree.map(|(_, value)| value.abs()).fold(0.0, f64::max);
            let errors = space.degree_range(degree).map(|monomial| {
                let expected =
                    truth.get(space.exponents(monomial)).expect("every coefficient is listed");
                (ours.coefficients()[monomial] - expected).abs()
            });
            let error = errors.fold(0.0, f64::max);
            if scale > 0.0 { error / scale } else { error }
        })
        .fold(0.0, f64::max)
}

/// All state components as coordinates, at zero net time: the ZDM on the full state.
fn full_state(scene: &Scene, orbit: &GrazingOrbit) -> Graze {
    let graze = orbit.grazing_point();
    let active = &scene.expansion.active;
    let passage = Passage::new(&scene.model, 0, &graze.state, orbit.parameters(), active)
        .expect("an analytic law");
    let chart = SectionChart {
        section: PoincareSection {
            kind: PoincareSectionKind::Stroboscopic { phase: Dd::ZERO },
            coordinates: vec![0, 1, 2],
            eliminated: 2,
        },
        point: graze.state.clone(),
    };
    let variables = Variables {
        names: ["u", "v", "theta"].map(str::to_owned).to_vec(),
        weights: vec![2; 3 + active.len()],
        coordinates: 3,
    };
    Graze { passage, chart, variables }
}

#[test]
fn zero_time_mapping_in_depth_and_phase_to_degree_eight() {
    for (name, set) in read("soft/taylor_2var.json").as_object().expect("sets") {
        let scene = scene(set, "[]");
        let orbit = orbit(&scene);
        let graze = full_state(&scene, &orbit);
        let contact = discontinuity::<Dd>(&graze, 2 * DEGREE)
            .unwrap_or_else(|error| panic!("{name}: {error}"))
            .to_f64();
        let space = reference_space(2, DEGREE);
        let y = Jet::variable(&space, 0, 0.0);
        let phase = Jet::variable(&space, 1, 0.0);
        let at = [&y * &y, Jet::zero(&space), phase];
        for (coordinate, key) in [(0, "zdm_du"), (1, "zdm_dv")] {
            let ours = correction(&contact, coordinate, &at);
            let error = worst_error(&ours, &listed(&set[key]));
            println!("{name} {key}: {error:.1e}");
            assert!(error < ROUNDING, "{name}, {key}: {error:e}");
        }
    }
}

#[test]
fn section_mapping_in_depth_and_phase_to_degree_eight() {
    for (name, set) in read("soft/taylor_2var.json").as_object().expect("sets") {
        let scene = scene(set, "[]");
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        let contact =
            expander.contact(0, 2 * DEGREE).unwrap_or_else(|error| panic!("{name}: {error}"));
        let space = reference_space(2, DEGREE);
        let y = Jet::variable(&space, 0, 0.0);
        let at = [&y * &y, Jet::variable(&space, 1, 0.0)];
        for (coordinate, key) in [(0, "pdm_du"), (1, "pdm_dphase")] {
            let ours = correction(&contact, coordinate, &at);
            let error = worst_error(&ours, &listed(&set[key]));
            println!("{name} {key}: {error:.1e}");
            assert!(error < ROUNDING, "{name}, {key}: {error:e}");
        }
    }
}

#[test]
fn mappings_in_depth_phase_and_amplitude() {
    let set = read("soft/taylor_3var_A1.json");
    let scene = scene(&set, "[\"A\"]");
    let orbit = orbit(&scene);
    let graze = full_state(&scene, &orbit);
    let weight = 2 * THREE_VARIABLES_DEGREE;
    let zero_time = discontinuity::<Dd>(&graze, weight).expect("an analytic law").to_f64();
    let section = Expander::new(&scene, &orbit)
        .expect("an analytic law")
        .contact(0, weight)
        .expect("a simple release");
    let space = reference_space(3, THREE_VARIABLES_DEGREE);
    let variable = |i| Jet::variable(&space, i, 0.0);
    let (y, phase, amplitude) = (variable(0), variable(1), variable(2));
    let square = &y * &y;
    let full = [square.clone(), Jet::zero(&space), phase.clone(), amplitude.clone()];
    let on_section = [square, phase, amplitude];
    let cases = [
        ("zdm_du", correction(&zero_time, 0, &full)),
        ("zdm_dv", correction(&zero_time, 1, &full)),
        ("pdm_du", correction(&section, 0, &on_section)),
        ("pdm_dphase", correction(&section, 1, &on_section)),
    ];
    for (key, ours) in cases {
        let error = worst_error(&ours, &listed(&set[key]));
        assert!(error < ROUNDING, "{key}: {error:e}");
    }
}
