//! Expansions of the linear oscillator against Taylor coefficients obtained by contour integration
//! of the exact flow (tests/data/rigid/linear_series.json; forty digits, see the README there).

use std::collections::BTreeMap;

use grazemap::expansion::{Contact, Expander};
use grazemap::jet::Jet;
use grazemap::model::Scene;
use serde_json::Value;

use crate::support::reference::{number, read, text};
use crate::support::scenes::{orbit, scene_with};

type Powers = Vec<u8>;
type Coefficients = BTreeMap<Powers, f64>;

fn sets() -> Vec<Value> {
    let sets = read("rigid/linear_series.json");
    sets.as_array().expect("a list").clone()
}

fn scene(set: &Value, active: &str) -> Scene {
    let value = |name: &'static str| (name, text(&set[name]));
    let mut overrides: Vec<_> = ["omega", "zeta", "r", "delta", "alpha"].map(value).to_vec();
    overrides.push(("expansion.active", active));
    scene_with("linear", &overrides)
}

/// A coordinate's image `x_i + y B + y² C` as a polynomial in (y; the variables after x), using `x
/// = y²`.
fn in_depth_variable(contact: &Contact, coordinate: usize) -> Coefficients {
    let mut sum = Coefficients::new();
    let mut add = |jet: &Jet<f64>, power: u8| {
        for (monomial, &value) in jet.coefficients().iter().enumerate() {
            let exponents = jet.space().exponents(monomial);
            let mut powers = vec![power + 2 * exponents[0]];
            powers.extend_from_slice(&exponents[1..]);
            *sum.entry(powers).or_default() += value;
        }
    };
    let space = contact.linear[coordinate].space();
    add(&Jet::variable(space, coordinate, 0.0), 0);
    add(&contact.linear[coordinate], 1);
    add(&contact.quadratic[coordinate], 2);
    sum
}

/// Largest error of each coefficient, relative to the largest of its total degree.
fn worst_error(ours: &Coefficients, truth: &Coefficients, degree: u32) -> f64 {
    let total = |powers: &Powers| powers.iter().map(|&power| u32::from(power)).sum::<u32>();
    (0..=degree)
        .map(|k| {
            let of_degree = truth.iter().filter(|(powers, _)| total(powers) == k);
            let scale = of_degree.map(|(_, value)| value.abs()).fold(0.0, f64::max);
            let keys = ours.keys().chain(truth.keys()).filter(|powers| total(powers) == k);
            let get = |map: &Coefficients, key: &Powers| map.get(key).copied().unwrap_or(0.0);
            let error =
                keys.map(|key| (get(ours, key) - get(truth, key)).abs()).fold(0.0, f64::max);
            if scale > 0.0 { error / scale } else { error }
        })
        .fold(0.0, f64::max)
}

fn listed(list: &Value) -> Coefficients {
    let term = |entry: &Value| {
        let powers = entry[0]
            .as_array()
            .expect("exponents")
            .iter()
            .map(|e| e.as_u64().expect("an exponent") as u8);
        (powers.collect(), number(&entry[1]))
    };
    list.as_array().expect("a list").iter().map(term).collect()
}

#[test]
fn discontinuity_mapping_in_depth_and_phase_to_degree_six() {
    for set in sets() {
        let scene = scene(&set, "[]");
        let orbit = orbit(&scene);
        let contact =
            Expander::new(&scene, &orbit).expect("rigid").contact(0, 12).expect("a simple graze");
        for (coordinate, name) in
            ["x_out_minus_delta", "theta_out_minus_theta_star"].iter().enumerate()
        {
            let truth = set["D_coefficients_y_dtheta"][name].as_array().expect("a list");
            let exponent =
                |entry: &Value, key: &str| entry[key].as_u64().expect("an exponent") as u8;
            let truth: Coefficients = truth
                .iter()
                .map(|e| (vec![exponent(e, "y"), exponent(e, "dtheta")], number(&e["coef"])))
                .collect();
            let error = worst_error(&in_depth_variable(&contact, coordinate), &truth, 6);
            assert!(error < 1e-11, "omega {}, {name}: {error:e}", set["omega"]);
        }
    }
}

#[test]
fn discontinuity_mapping_with_parameters_to_degree_four() {
    for set in sets() {
        let scene = scene(&set, "[\"alpha\", \"omega\"]");
        let orbit = orbit(&scene);
        let contact =
            Expander::new(&scene, &orbit).expect("rigid").contact(0, 8).expect("a simple graze");
        for (coordinate, name) in
            ["x_out_minus_delta", "theta_out_minus_theta_star"].iter().enumerate()
        {
            let truth = listed(&set["D_coefficients_y_dtheta_dalpha_domega_deg4"][name]);
            let error = worst_error(&in_depth_variable(&contact, coordinate), &truth, 4);
            assert!(error < 1e-11, "omega {}, {name}: {error:e}", set["omega"]);
        }
    }
}

#[test]
fn smooth_map_with_parameters_to_degree_four() {
    for set in sets() {
        let scene = scene(&set, "[\"alpha\", \"omega\"]");
        let orbit = orbit(&scene);
        let leg = Expander::new(&scene, &orbit).expect("rigid").smooth(4).expect("a smooth flow");
        let names = ["x_out_minus_delta", "theta_out_minus_theta_star_minus_2pi"];
        for (image, name) in leg.image.iter().zip(names) {
            let space = image.space();
            let ours = image
                .coefficients()
                .iter()
                .enumerate()
                .map(|(m, &value)| (space.exponents(m).to_vec(), value));
            let error = worst_error(&ours.collect(), &listed(&set["P_smooth_deg4"][name]), 4);
            assert!(error < 1e-11, "omega {}, {name}: {error:e}", set["omega"]);
        }
    }
}
