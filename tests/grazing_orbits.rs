//! Grazing orbits of the catalogue against independent reference values.

use grazemap::model::{Scene, catalogue};
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{GrazingOrbit, Location, NotLocated, locate};
use serde_json::Value;

fn reference(file: &str) -> Value {
    let path = format!("{}/tests/data/rigid/{file}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn dd(value: &Value) -> Dd {
    value.as_str().unwrap().parse().unwrap()
}

fn scene(name: &str, overrides: &[(&str, String)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Scene::parse_with(catalogue::text(name).unwrap(), &format!("{name}.toml"), &overrides).unwrap()
}

fn located(scene: &Scene) -> GrazingOrbit {
    match locate(scene).unwrap() {
        Location::Located(orbit) => *orbit,
        Location::NotLocated(reason) => panic!("{}: {reason}", scene.identifier),
    }
}

fn relative(found: Dd, expected: Dd) -> f64 {
    ((found - expected) / expected).magnitude()
}

/// Distance of two phases modulo a period.
fn phase_distance(a: Dd, b: Dd, period: Dd) -> f64 {
    let difference = a - b;
    (difference - (difference / period + Dd::from(0.5)).floor() * period).magnitude()
}

#[test]
fn linear_oscillator_grazes_at_its_closed_form() {
    for case in reference("linear_abc.json")["a_b_grazing_and_xi"].as_array().unwrap() {
        let value = |key: &str| case[key].as_str().unwrap().to_owned();
        let start = format!("{}", dd(&case["alpha_g"]).to_f64() * 0.9);
        let keys = ["omega", "zeta", "r", "delta"];
        let overrides: Vec<_> = keys.iter().map(|&key| (key, value(key))).chain([("alpha", start)]).collect();
        let scene = scene("linear", &overrides);
        let orbit = located(&scene);
        let state = &orbit.grazing_point().state;
        println!("{} {:?} {:e}", value("omega"), orbit.multipliers, orbit.residual);
        println!("alpha {:e}", relative(orbit.parameters()[3], dd(&case["alpha_g"])));
        println!("theta {:e}", phase_distance(state[2], dd(&case["theta_g"]), Dd::TWO_PI));
        println!("a {:e}", relative(-orbit.grazing_point().normal_acceleration, dd(&case["a_star"])));
        for (xi, expected) in orbit.xi.iter().zip(case["xi"].as_array().unwrap()) {
            println!("xi {:e}", relative(*xi, dd(expected)));
        }
    }
}
