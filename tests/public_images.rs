//! The local map against exact images of random points (tests/data/rigid/public_*.json, 38 digits).

use grazemap::expansion::{Contact, Expander, Leg, LocalMap, MapOrders, Stage};
use grazemap::model::{Scene, catalogue};
use grazemap::orbit::locate;
use serde_json::Value;

fn local_map(scene: &str, orders: MapOrders) -> LocalMap {
    let scene = Scene::parse(catalogue::text(scene).expect("in the catalogue"), scene)
        .expect("a good scene");
    let orbit = locate(&scene)
        .expect("no wrong input")
        .into_result()
        .expect("it grazes");
    Expander::new(&scene, &orbit)
        .expect("rigid")
        .expand(orders)
        .expect("an expansion")
}

fn fly(leg: &Leg, state: &mut [f64], parameters: &[f64]) {
    let point: Vec<f64> = state.iter().chain(parameters).copied().collect();
    for (value, jet) in state.iter_mut().zip(&leg.image) {
        *value = jet.evaluate(&point);
    }
}

fn touch(contact: &Contact, state: &mut [f64], parameters: &[f64]) -> f64 {
    let point: Vec<f64> = state.iter().chain(parameters).copied().collect();
    let y = contact.depth.evaluate(&point).max(0.0).sqrt();
    for (value, (b, c)) in state
        .iter_mut()
        .zip(contact.linear.iter().zip(&contact.quadratic))
    {
        *value += y * (b.evaluate(&point) + y * c.evaluate(&point));
    }
    y
}

fn number(value: &Value) -> f64 {
    value
        .as_str()
        .expect("a decimal string")
        .parse()
        .expect("a number")
}

fn study(file: &str, scene: &str, orders: MapOrders) -> Vec<(f64, f64)> {
    let path = format!(
        "{}/tests/data/rigid/public_{file}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let data: Value =
        serde_json::from_str(&std::fs::read_to_string(path).expect("file")).expect("JSON");
    let t0 = std::time::Instant::now();
    let map = local_map(scene, orders);
    println!("  expansion {:?}", t0.elapsed());
    let beam = file.starts_with("cantilever");
    let rows = data["rows"].as_array().expect("rows");
    rows.iter()
        .map(|row| {
            let p: Vec<f64> = row["param_offsets"]
                .as_array()
                .expect("offsets")
                .iter()
                .map(number)
                .collect();
            let x = number(&row["x_minus_delta"]);
            let x = if beam { p[0] - x } else { x };
            let mut state = vec![x, number(&row["dtheta"])];
            let mut depth = 0.0;
            for stage in &map.stages {
                match stage {
                    Stage::Leg(leg) => fly(leg, &mut state, &p),
                    Stage::Contact(contact) => depth = touch(contact, &mut state, &p),
                }
            }
            let image = &row["images"][0];
            let tx = number(&image["x_minus_delta"]);
            let tx = if beam { p[0] - tx } else { tx };
            (
                (depth * depth),
                (state[0] - tx)
                    .abs()
                    .max((state[1] - number(&image["dtheta"])).abs()),
            )
        })
        .collect()
}

#[test]
fn table() {
    for (file, scene) in [
        ("linear_w1.8", "linear"),
        ("linear_codim2", "linear_codim2"),
        ("mems_w0.46", "mems"),
        ("mems_w0.4878_codim2", "mems_codim2"),
        ("mems_scenario3_codim2", "mems_scenario3"),
        ("cantilever_zeta1.7", "cantilever_1_7"),
        ("cantilever_zeta0.107", "cantilever_0_107"),
    ] {
        println!("{file}");
        for (n, w) in [
            (1, 1),
            (2, 2),
            (3, 4),
            (5, 6),
            (6, 8),
            (8, 10),
            (10, 12),
            (10, 16),
        ] {
            let rows = study(
                file,
                scene,
                MapOrders {
                    smooth_order: n,
                    contact_weight: w,
                },
            );
            let shallow = rows
                .iter()
                .filter(|r| r.0 <= 1e-5)
                .map(|r| r.1)
                .fold(0.0, f64::max);
            let all = rows.iter().map(|r| r.1).fold(0.0, f64::max);
            println!("  ({n},{w}) shallow {shallow:.2e} all {all:.2e}");
        }
    }
}
