//! The stroboscopic map of soft impacts half a period before the graze, leg by leg and by direct
//! simulation, against exact images (tests/data/soft/public_strobe_*.json: 36 digits; README
//! there).
//!
//! `cargo test --release --test maps -- soft_images:: --nocapture` prints the tables of errors
//! against orders.

use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::hybrid::{DirectReturn, HybridSystem, NominalPassage, ReturnOutcome, ReturnSection};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use serde_json::Value;

use crate::support::reference::{exact, read, text};
use crate::support::scenes::{orbit, scene_with};
use crate::support::stages;

const SETS: [&str; 8] = ["A1", "A2", "B1", "B2", "C1", "C2", "D1", "D2"];

/// Weights W of the tables; the legs are linear in state and amplitude.
const WEIGHTS: [u32; 7] = [1, 2, 3, 4, 6, 8, 12];

struct Set {
    scene: Scene,
    phase: Dd,
    amplitude: Dd,
    images: Vec<Image>,
}

struct Image {
    /// Offsets of u and v, then of A.
    start: [Dd; 3],
    end: [Dd; 2],
    contacts: u64,
}

fn set(name: &str) -> Set {
    let file = read(&format!("soft/public_strobe_{name}.json"));
    let parameters = file["params"].as_object().expect("parameters");
    let given = parameters.iter().filter(|(name, _)| ["k2", "R2", "d"].contains(&name.as_str()));
    let omega = format!("2*sqrt(1 - 0.015^2)/{}", text(&file["params"]["m"]));
    let guess = format!("{} + pi", text(&file["phase_start"]));
    let mut overrides = vec![
        ("omega", &omega[..]),
        ("A", text(&file["A_g"])),
        ("section.kind", "stroboscopic"),
        ("section.phase", text(&file["phase_start"])),
        ("expansion.active", "[\"A\"]"),
        ("grazing.guess.theta", &guess),
    ];
    overrides.extend(given.map(|(name, value)| (&name[..], text(value))));
    let scene = format!("soft_{}", name[..1].to_lowercase());
    let scene = scene_with(&scene, &overrides);
    let image = |row: &Value| Image {
        start: ["du", "dv", "dA"].map(|key| exact(&row[key])),
        end: [exact(&row["u1"]) + Dd::ONE, exact(&row["v1"])],
        contacts: row["n_contacts"].as_u64().expect("a count"),
    };
    Set {
        phase: exact(&file["phase_start"]),
        amplitude: exact(&file["A_g"]),
        images: file["images"].as_array().expect("images").iter().map(image).collect(),
        scene,
    }
}

#[test]
fn direct_simulation_agrees_with_the_exact_images_to_1e_minus_28() {
    for name in SETS {
        let set = set(name);
        let system = HybridSystem::new(&set.scene.model);
        let position = |name: &str| {
            let mut parameters = set.scene.model.parameters.iter();
            parameters.position(|p| p.name == name).expect("a parameter of the scene")
        };
        let mut parameters = set.scene.model.parameter_values();
        let half_period = Dd::PI / parameters[position("omega")];
        let mut worst = 0.0_f64;
        for image in &set.images {
            parameters[position("A")] = set.amplitude + image.start[2];
            let graze =
                NominalPassage { surface: 0, time: half_period.to_f64(), hit: false, rests: false };
            let mut map =
                DirectReturn::over_periods(&system, &parameters, ReturnSection::OtherPhase, 1)
                    .expect("a phase")
                    .with_passages(&[graze])
                    .expect("within the period");
            let start = [image.start[0] - Dd::ONE, image.start[1], set.phase];
            let found = map.image(&start).expect("a finite state");
            assert_eq!(found.outcome, ReturnOutcome::Returned, "{name}");
            assert_eq!(found.contacts as u64, image.contacts, "{name}");
            let errors = [found.state[0] + Dd::ONE - image.end[0], found.state[1] - image.end[1]];
            worst = errors.map(Scalar::magnitude).into_iter().fold(worst, f64::max);
        }
        println!("{name}: direct simulation to {worst:.1e}");
        assert!(worst < 1e-28, "{name}: {worst:e}");
    }
}

/// Depth variable and error of an image by the map.
fn error_of(map: &LocalMap, image: &Image) -> (f64, f64) {
    let [u, v, amplitude] = image.start.map(|value| value.hi);
    let (state, depth) = stages::image(map, &[u, v], &[amplitude]);
    let errors = [0, 1].map(|i| (state[i] - image.end[i].hi).abs());
    (depth, errors[0].max(errors[1]))
}

#[test]
fn images_inside_the_radius_reach_rounding_as_the_orders_grow() {
    for name in SETS {
        let set = set(name);
        let orbit = orbit(&set.scene);
        let expander = Expander::new(&set.scene, &orbit).expect("an analytic law");
        let radius = expander.depth_radius(0).expect("a series").expect("a finite radius");
        println!(
            "\n{name}: radius {radius:.1e}; largest error (no contact | y < R/8 | R/8 to R/3 | R/3 to R | beyond)"
        );
        let mut best = [f64::INFINITY; 5];
        for contact_weight in WEIGHTS {
            let orders = MapOrders { smooth_order: 2, contact_weight };
            let map = expander.expand(orders).expect("an expansion");
            let mut worst = [0.0_f64; 5];
            let mut count = [0; 5];
            for image in &set.images {
                let (depth, error) = error_of(&map, image);
                // At low weights the depth itself is too rough to tell a near miss.
                if contact_weight >= 8 {
                    assert_eq!(u64::from(depth > 0.0), image.contacts, "{name}");
                }
                let limits = [0.0, radius / 8.0, radius / 3.0, radius];
                let class = limits.iter().filter(|&&limit| depth > limit).count();
                worst[class] = worst[class].max(error);
                count[class] += 1;
            }
            let row: Vec<_> =
                worst.iter().zip(count).map(|(e, n)| format!("{e:.1e} ({n})")).collect();
            println!("  W = {contact_weight:2}  {}", row.join(" | "));
            best = [0, 1, 2, 3, 4].map(|class: usize| best[class].min(worst[class]));
        }
        assert!(best[0] < 1e-15, "{name}: {:e} without contact", best[0]);
        assert!(best[1] < 1e-10, "{name}: {:e} at small depths", best[1]);
    }
}
