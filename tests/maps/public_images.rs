//! The local map against exact images of random points under one, two and three iterations
//! (tests/data/rigid/public_*.json: 38 digits, obtained by multiple-precision simulation; README
//! there).
//!
//! `cargo test --release --test maps -- public_images:: --nocapture` prints the table of errors
//! against orders.

use grazemap::expansion::{Expander, LocalMap, MapOrders};
use serde_json::Value;

use crate::support::reference::{number, read};
use crate::support::scenes::grazing;
use crate::support::stages;

/// Reference file, scene of the catalogue.
const CASES: [(&str, &str); 7] = [
    ("linear_w1.8", "linear"),
    ("linear_codim2", "linear_codim2"),
    ("mems_w0.46", "mems"),
    ("mems_w0.4878_codim2", "mems_codim2"),
    ("mems_scenario3_codim2", "mems_scenario3"),
    ("cantilever_zeta1.7", "cantilever_1_7"),
    ("cantilever_zeta0.107", "cantilever_0_107"),
];

/// Orders (N, W) of the table.
const ORDERS: [(u32, u32); 9] =
    [(1, 1), (1, 2), (2, 2), (3, 4), (4, 5), (5, 6), (6, 8), (8, 10), (10, 16)];

/// Depths y² up to which a map must be exact to `DEEP_ENOUGH` at some order.
const SHALLOW: f64 = 1e-5;
const DEEP_ENOUGH: f64 = 1e-11;

/// Offsets up to which further iterations count as small.
const SMALL: f64 = 5e-3;

struct Row {
    start: Vec<f64>,
    parameters: Vec<f64>,
    images: Vec<Vec<f64>>,
    /// Speed at which the stop is met in the first iteration; 0 without contact.
    impact_speed: f64,
}

/// Rows in the scene's own coordinates: the files measure x from the wall, for the beam with `x =
/// −q`.
fn rows(file: &str) -> Vec<Row> {
    let data = read(&format!("rigid/public_{file}.json"));
    let beam = file.starts_with("cantilever");
    let row = |row: &Value| {
        let offsets = row["param_offsets"].as_array().expect("offsets");
        let parameters: Vec<f64> = offsets.iter().map(number).collect();
        let state = |point: &Value| {
            let x = number(&point["x_minus_delta"]);
            vec![if beam { parameters[0] - x } else { x }, number(&point["dtheta"])]
        };
        let images = row["images"].as_array().expect("images").iter().map(state).collect();
        Row {
            start: state(row),
            images,
            parameters: parameters.clone(),
            impact_speed: number(&row["images"][0]["v_impact"]),
        }
    };
    data["rows"].as_array().expect("rows").iter().map(row).collect()
}

/// Depth and error of each iteration of a row, as long as offsets stay small.
fn errors(map: &LocalMap, row: &Row) -> Vec<(f64, f64)> {
    let mut state = row.start.clone();
    let mut errors = Vec::new();
    for truth in &row.images {
        let (image, y) = stages::image(map, &state, &row.parameters);
        state = image;
        let error = state.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        errors.push((y * y, error));
        if truth.iter().any(|offset| offset.abs() > SMALL) {
            break;
        }
    }
    errors
}

/// Largest error over shallow single steps, over all single steps, and over later shallow
/// iterations.
fn worst(map: &LocalMap, rows: &[Row]) -> [f64; 3] {
    let (mut shallow, mut single, mut later) = (0.0_f64, 0.0_f64, 0.0_f64);
    for row in rows {
        let errors = errors(map, row);
        single = single.max(errors[0].1);
        let deep = errors.iter().position(|(depth, _)| *depth > SHALLOW).unwrap_or(errors.len());
        shallow = shallow.max(errors[..deep.min(1)].iter().map(|e| e.1).fold(0.0, f64::max));
        later = later.max(errors[deep.min(1)..deep].iter().map(|e| e.1).fold(0.0, f64::max));
    }
    [shallow, single, later]
}

#[test]
fn images_reach_rounding_as_the_orders_grow() {
    for (file, name) in CASES {
        let (scene, orbit) = grazing(name);
        let expander = Expander::new(&scene, &orbit).expect("rigid");
        let rows = rows(file);
        println!("\n{file}: largest error (y² ≤ 1e-5 | any | iterations 2, 3 with y² ≤ 1e-5)");
        let mut best = [f64::INFINITY; 3];
        for (smooth_order, contact_weight) in ORDERS {
            let orders = MapOrders { smooth_order, contact_weight };
            let map = expander.expand(orders).expect("an expansion");
            let worst = worst(&map, &rows);
            println!(
                "  ({smooth_order:2}, {contact_weight:2})  {:.1e} | {:.1e} | {:.1e}",
                worst[0], worst[1], worst[2]
            );
            best = [0, 1, 2].map(|kind: usize| best[kind].min(worst[kind]));
        }
        assert!(best[0] <= DEEP_ENOUGH, "{file}: shallow images only to {:e}", best[0]);
        assert!(best[2] <= DEEP_ENOUGH, "{file}: iterations only to {:e}", best[2]);
        // At N = 10, W = 16 every single image of the files is exact to rounding of offsets below
        // 0.1.
        assert!(best[1] <= 1e-15, "{file}: images only to {:e}", best[1]);
    }
}

#[test]
fn impact_speeds_are_those_of_the_exact_images() {
    for (file, name) in CASES {
        let (scene, orbit) = grazing(name);
        let expander = Expander::new(&scene, &orbit).expect("rigid");
        let depth = expander.contact(0, 12).expect("a contact").depth;
        let speed = expander.impact_speed(0, 12).expect("a speed");
        for row in rows(file) {
            let point = [row.start, row.parameters].concat();
            let y = depth.evaluate(&point).max(0.0).sqrt();
            let ours = y * (speed.linear.evaluate(&point) + y * speed.quadratic.evaluate(&point));
            // Cut at weight 12; depths of the files stay below 1e-2.
            let error = (ours - row.impact_speed).abs();
            assert!(error <= 1e-12, "{file}: {ours} for {}", row.impact_speed);
        }
    }
}
