//! Grazing orbits of the catalogue against independent reference values.

use std::path::Path;

use grazemap::model::Scene;
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
    let overrides: Vec<_> = overrides
        .iter()
        .map(|(key, value)| ((*key).to_owned(), value.clone()))
        .collect();
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Scene::load_with(Path::new(&path), &overrides).unwrap()
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

/// Largest errors of one orbit, all but the multipliers relative.
#[derive(Debug, Default)]
struct Errors {
    parameter: f64,
    phase: f64,
    acceleration: f64,
    multipliers: f64,
    monodromy: f64,
    xi: f64,
}

impl Errors {
    fn largest(self, other: Errors) -> Errors {
        Errors {
            parameter: self.parameter.max(other.parameter),
            phase: self.phase.max(other.phase),
            acceleration: self.acceleration.max(other.acceleration),
            multipliers: self.multipliers.max(other.multipliers),
            monodromy: self.monodromy.max(other.monodromy),
            xi: self.xi.max(other.xi),
        }
    }
}

fn phase_period(scene: &Scene) -> Dd {
    scene.model.phase.as_ref().unwrap().period
}

fn parameter(scene: &Scene, orbit: &GrazingOrbit, name: &str) -> Dd {
    let index = scene
        .model
        .parameters
        .iter()
        .position(|parameter| parameter.name == name)
        .unwrap();
    orbit.parameters()[index]
}

fn strings(pairs: &[(&'static str, &str)]) -> Vec<(&'static str, String)> {
    pairs
        .iter()
        .map(|&(key, value)| (key, value.to_owned()))
        .collect()
}

/// Largest error of the monodromy's entries against rows of strings, relative to its largest entry.
fn monodromy_error(orbit: &GrazingOrbit, expected: &Value) -> f64 {
    let rows = expected.as_array().unwrap();
    let entries = |row: &Value| row.as_array().unwrap().iter().map(dd).collect::<Vec<_>>();
    let expected: Vec<Dd> = rows.iter().flat_map(entries).collect();
    let found: Vec<Dd> = orbit.monodromy.iter().flatten().copied().collect();
    let size = expected
        .iter()
        .map(|value| value.magnitude())
        .fold(0.0, f64::max);
    found
        .iter()
        .zip(&expected)
        .map(|(a, b)| (*a - *b).magnitude())
        .fold(0.0, f64::max)
        / size
}

/// Largest distance of the multipliers from the roots of `z² − trace z + det`.
fn multiplier_error(orbit: &GrazingOrbit, trace: Dd, determinant: Dd) -> f64 {
    let half = trace * Dd::from(0.5);
    let discriminant = half * half - determinant;
    let root = discriminant.abs().sqrt();
    let expected = if discriminant.to_f64() < 0.0 {
        [
            [half.to_f64(), root.to_f64()],
            [half.to_f64(), -root.to_f64()],
        ]
    } else {
        [[(half + root).to_f64(), 0.0], [(half - root).to_f64(), 0.0]]
    };
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let nearest = |value: &[f64; 2]| {
        expected
            .iter()
            .map(|root| distance(value, root))
            .fold(f64::INFINITY, f64::min)
    };
    orbit.multipliers.iter().map(nearest).fold(0.0, f64::max)
}

/// Largest error of `xi_n`, relative to `xi_n`, from monodromy `rows` as `scale [Mⁿ]₁₂`.
fn xi_error(orbit: &GrazingOrbit, expected: &[Dd]) -> f64 {
    orbit
        .xi
        .iter()
        .zip(expected)
        .map(|(&xi, &expected)| relative(xi, expected))
        .fold(0.0, f64::max)
}

#[test]
fn linear_oscillator_grazes_at_its_closed_form() {
    let mut worst = Errors::default();
    for case in reference("linear_abc.json")["a_b_grazing_and_xi"]
        .as_array()
        .unwrap()
    {
        let value = |key: &str| case[key].as_str().unwrap().to_owned();
        let start = format!("{}", dd(&case["alpha_g"]).to_f64() * 0.9);
        let keys = ["omega", "zeta", "r", "delta"];
        let section = strings(&[
            ("section.kind", "stroboscopic"),
            ("section.phase", "grazing"),
        ]);
        let overrides: Vec<_> = keys
            .iter()
            .map(|&key| (key, value(key)))
            .chain([("alpha", start)])
            .collect();
        let scene = scene("linear", &[overrides, section].concat());
        let orbit = located(&scene);
        let graze = orbit.grazing_point();
        let codim2 = case["xi"][0].as_str().unwrap().contains("e-");
        let xi: Vec<Dd> = case["xi"].as_array().unwrap().iter().map(dd).collect();
        worst = worst.largest(Errors {
            parameter: relative(parameter(&scene, &orbit, "alpha"), dd(&case["alpha_g"])),
            phase: phase_distance(graze.state[2], dd(&case["theta_g"]), phase_period(&scene)),
            acceleration: relative(-graze.normal_acceleration, dd(&case["a_star"])),
            multipliers: 0.0,
            monodromy: monodromy_error(&orbit, &case["M"]),
            xi: if codim2 {
                orbit.xi[0].magnitude()
            } else {
                xi_error(&orbit, &xi)
            },
        });
    }
    println!("{worst:?}");
}

#[test]
fn electrostatic_oscillator_grazes_at_the_reference_orbits() {
    for (name, file) in [
        ("mems", "public_mems_w0.46.json"),
        ("mems_codim2", "public_mems_w0.4878_codim2.json"),
        ("mems_scenario3", "public_mems_scenario3_codim2.json"),
    ] {
        let base = &reference(file)["base"];
        let scene = scene(
            name,
            &[("omega", base["omega_star"].as_str().unwrap().to_owned())],
        );
        let orbit = located(&scene);
        let graze = orbit.grazing_point();
        println!(
            "{name} V {:e} theta {:e} x {:e} v {:e} residual {:e} clearance {:?} guess {:?}",
            relative(parameter(&scene, &orbit, "V"), dd(&base["V_star"])),
            phase_distance(
                graze.state[2],
                dd(&base["theta_star"]),
                phase_period(&scene)
            ),
            (graze.state[0] - Dd::from(0.5)).magnitude(),
            graze.state[1].magnitude(),
            orbit.residual,
            orbit.clearance,
            orbit.guess_distance,
        );
    }
}

#[test]
fn electrostatic_grazing_curve_is_met_on_every_sheet() {
    let points = reference("mems_curve.json");
    let mut worst = Errors::default();
    for point in points.as_array().unwrap().iter().step_by(6) {
        let near = |key: &str, by: f64| format!("{:?}", dd(&point[key]).to_f64() + by);
        let scene = scene(
            "mems",
            &[
                ("omega", point["omega"].as_str().unwrap().to_owned()),
                ("V", near("V", 1e-3)),
                ("grazing.guess.x", "0.501".to_owned()),
                ("grazing.guess.v", "-0.001".to_owned()),
                ("grazing.guess.theta", near("theta_star", 1e-3)),
                ("section.kind", "stroboscopic".to_owned()),
                ("section.phase", "grazing".to_owned()),
            ],
        );
        let orbit = match locate(&scene).unwrap() {
            Location::Located(orbit) => *orbit,
            Location::NotLocated(reason) => {
                println!("{} {}: {reason}", point["omega"], point["branch"]);
                continue;
            }
        };
        let graze = orbit.grazing_point();
        let factor = Dd::from_dd("1.8".parse().unwrap());
        let xi: Vec<Dd> = point["xi_over_1plusr"]
            .as_array()
            .unwrap()
            .iter()
            .map(|xi| dd(xi) * factor)
            .collect();
        let errors = Errors {
            parameter: relative(parameter(&scene, &orbit, "V"), dd(&point["V"])),
            phase: phase_distance(
                graze.state[2],
                dd(&point["theta_star"]),
                phase_period(&scene),
            ),
            acceleration: relative(-graze.normal_acceleration, dd(&point["a_star"])),
            multipliers: multiplier_error(&orbit, dd(&point["trace"]), dd(&point["det"])),
            monodromy: monodromy_error(&orbit, &point["M"]),
            xi: xi_error(&orbit, &xi),
        };
        println!(
            "{} {}: {errors:?} {:?}",
            point["omega"], point["branch"], orbit.clearance
        );
        worst = worst.largest(errors);
    }
    println!("{worst:?}");
}

#[test]
fn cantilever_grazes_at_every_row_of_the_tables() {
    let rows = reference("beam_tables.json");
    let mut worst = Errors::default();
    for row in rows.as_array().unwrap() {
        let value = |key: &str| row[key].as_str().unwrap().to_owned();
        let near = |key: &str, by: f64| format!("{:?}", dd(&row[key]).to_f64() + by);
        let scene = scene(
            "cantilever_1_7",
            &[
                ("zeta", value("zeta")),
                ("alpha", value("alpha")),
                ("beta", value("beta")),
                ("Q", near("Q_G_qmin", 1e-3)),
                ("grazing.guess.q", near("Q_G_qmin", -1e-3)),
                ("grazing.guess.theta", near("t_G", 1e-3)),
                ("section.kind", "stroboscopic".to_owned()),
                ("section.phase", "grazing".to_owned()),
            ],
        );
        let orbit = located(&scene);
        let graze = orbit.grazing_point();
        let errors = Errors {
            parameter: relative(parameter(&scene, &orbit, "Q"), dd(&row["Q_G_qmin"])),
            phase: phase_distance(graze.state[2], dd(&row["t_G"]), phase_period(&scene)),
            acceleration: relative(graze.normal_acceleration, dd(&row["a_G"])),
            multipliers: multiplier_error(&orbit, dd(&row["trace"]), dd(&row["det"])),
            monodromy: monodromy_error(&orbit, &row["A"]),
            xi: 0.0,
        };
        println!(
            "{}: {errors:?} {:?} {:?}",
            row["zeta"], orbit.clearance, orbit.multipliers
        );
        worst = worst.largest(errors);
    }
    println!("{worst:?}");
}
