//! One grazing passage of a two-mass oscillator with an elastic or prestressed stop: four states
//! and a phase.
//!
//! Truth: the images D_R at zero net time in tests/data/soft/public_two_*_soft.json (32 digits;
//! README there).

use grazemap::expansion::{
    Contact, DepthSeries, Graze, Passage, SectionChart, Variables, discontinuity,
};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{PoincareSection, PoincareSectionKind, locate};
use serde_json::Value;

const SCENE: &str = r#"
[model]
name = "two masses, an elastic stop on the right of the first"
states = ["x1", "v1", "x2", "v2"]
parameters = { k11 = 1.0, k12 = -1.0, k22 = 3.0, m2 = 1.0, zeta = 0.02, f1 = 1.0, f2 = 0.5, k0 = 20.0, e = 0.0, w = 1.1, d = 1.66 }
[model.let]
g1 = "x1 + 2*zeta*v1"
g2 = "x2 + 2*zeta*v2"
[model.phase]
name = "theta"
rate = "w"
period = "2*pi"
[model.flow]
x1 = "v1"
v1 = "f1*cos(theta) - k11*g1 - k12*g2"
x2 = "v2"
v2 = "(f2*cos(theta) - k12*g1 - k22*g2)/m2"
[[model.surface]]
name = "right"
event = "d - x1"
contact = { v1 = "free - k0*(x1 - d + e)" }
[grazing]
surface = "right"
solve_for = "d"
guess = { x1 = 1.66, v1 = 0.0, x2 = 0.65, v2 = 0.0, theta = 3.1 }
[section]
kind = "tangency"
[expansion]
active = ["d"]
"#;

fn read(set: &str) -> Value {
    let path = format!(
        "{}/tests/data/soft/public_two_{set}_soft.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).expect("the reference file");
    serde_json::from_str(&text).expect("JSON")
}

fn number(value: &Value) -> Dd {
    Dd::from_decimal(value.as_str().expect("a decimal string")).expect("a decimal number")
}

fn list(value: &Value) -> Vec<Dd> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(number)
        .collect()
}

/// The scene of a set: masses 1 and m2, springs 1 between them and mu_k to the ground.
fn scene(file: &Value) -> Scene {
    let text = |value: &Value| value.as_str().expect("a decimal string").to_owned();
    let of = |key: &str| text(&file["params"][key]);
    let mut overrides = vec![("k22".to_owned(), format!("1 + {}", of("mu_k")))];
    for (name, key) in [
        ("m2", "mu_m"),
        ("zeta", "zeta"),
        ("k0", "mu_k0"),
        ("e", "e"),
        ("w", "w"),
    ] {
        overrides.push((name.to_owned(), of(key)));
    }
    overrides.push(("f1".to_owned(), text(&file["params"]["f"][0])));
    overrides.push(("f2".to_owned(), text(&file["params"]["f"][1])));
    overrides.push(("d".to_owned(), text(&file["d_grazing"])));
    let graze = list(&file["grazing_state_R"]);
    for (name, value) in ["x1", "v1", "x2", "v2"].iter().zip(graze) {
        overrides.push((format!("grazing.guess.{name}"), format!("{:e}", value.hi)));
    }
    overrides.push(("grazing.guess.theta".to_owned(), text(&file["phase_R"])));
    Scene::parse_with(SCENE, "two masses", &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// The image of an offset of the full state and the parameter, and its depth variable.
fn image(contact: &Contact<Dd>, offset: &[Dd]) -> (Vec<Dd>, Dd) {
    let y = contact.depth.evaluate(offset).max(Dd::ZERO).sqrt();
    let terms = contact.linear.iter().zip(&contact.quadratic).zip(offset);
    let image = terms.map(|((linear, quadratic), &start)| {
        start + y * (linear.evaluate(offset) + y * quadratic.evaluate(offset))
    });
    (image.collect(), y)
}

/// Share of the radius of convergence in y up to which an image counts as shallow.
const SHALLOW: f64 = 0.125;

/// Largest error of the images at zero net time, of shallow passages and of all.
fn worst_errors(file: &Value, graze: &[Dd], contact: &Contact<Dd>, radius: f64) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for row in file["images"].as_array().expect("images") {
        let mut point = list(&row["x_i"]);
        point.push(number(&row["phase_i"]));
        let offset = point.iter().zip(graze).map(|(&a, &b)| a - b);
        let offset: Vec<_> = offset.chain([number(&row["d_offset"])]).collect();
        let (found, y) = image(contact, &offset);
        let errors = list(&row["D_R"]).into_iter().zip(graze).zip(found);
        let error = errors.map(|((truth, &graze), found)| (graze + found - truth).magnitude());
        let error = error.fold(0.0, f64::max);
        worst[1] = worst[1].max(error);
        if y.hi <= SHALLOW * radius {
            worst[0] = worst[0].max(error);
        }
    }
    worst
}

#[test]
fn zero_time_images_of_two_masses_fall_with_every_order() {
    for set in ["T1", "T2"] {
        let file = read(set);
        let scene = scene(&file);
        let orbit = locate(&scene)
            .expect("no wrong input")
            .into_result()
            .expect("it grazes");
        let graze = orbit.grazing_point();
        let position = |name: &str| scene.model.parameters.iter().position(|p| p.name == name);
        let d = position("d").expect("the gap");
        let gap = graze.parameters[d] - number(&file["d_grazing"]);
        assert!(gap.magnitude() < 1e-28, "{set}");
        let passage = Passage::new(&scene.model, 0, &graze.state, &graze.parameters, &[d])
            .expect("an analytic law");
        let chart = SectionChart {
            section: PoincareSection {
                kind: PoincareSectionKind::Stroboscopic { phase: Dd::ZERO },
                coordinates: (0..5).collect(),
                eliminated: 4,
            },
            point: graze.state.clone(),
        };
        let variables = Variables {
            names: ["x1", "v1", "x2", "v2", "theta", "d"]
                .map(str::to_owned)
                .to_vec(),
            weights: vec![2; 6],
            coordinates: 5,
        };
        let point = &graze.state;
        let graze = Graze {
            passage,
            chart,
            variables,
        };
        let series = DepthSeries::new(&graze, 24).expect("a release");
        let radius = series.radius().expect("an infinite series");
        let mut last = [f64::INFINITY; 2];
        for weight in [2, 4, 6, 8] {
            let contact = discontinuity::<Dd>(&graze, weight).expect("a release");
            let worst = worst_errors(&file, point, &contact, radius);
            println!(
                "{set}, R = {radius:.3}, W = {weight}: {:.1e} shallow, {:.1e} all",
                worst[0], worst[1]
            );
            assert!(
                worst[0] < 0.05 * last[0],
                "{set}, W = {weight}: {worst:?} after {last:?}"
            );
            last = worst;
        }
        assert!(last[0] < 1e-10, "{set}: {last:?}");
    }
}
