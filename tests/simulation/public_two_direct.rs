//! Two masses between two stops: images of `P = P2 ∘ D_L ∘ P1 ∘ D_R` by direct simulation.
//!
//! Truth: tests/data/soft/public_two_*.json (32 digits; README there), the composition of exact
//! maps.

use grazemap::hybrid::{
    DirectReturn, HybridSystem, NominalPassage, Return, ReturnOutcome, ReturnSection,
};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real};
use serde_json::Value;

use crate::support::reference::{exact, exact_list, read, text};
use crate::support::scenes::{NONE, parsed};

const SETS: [&str; 4] = ["T1_soft", "T1_rigid", "T2_soft", "T2_rigid"];

/// Surfaces, in the order in which the scene declares them.
const LEFT: usize = 0;
const RIGHT: usize = 1;

/// Masses 1 and m2, springs 1 between them and mu_k to the ground, stops at `|x1| = d`.
fn scene(set: &str, file: &Value) -> Scene {
    let of = |key: &str| text(&file["params"][key]);
    let force = |index: usize| text(&file["params"]["f"][index]);
    let (left, right) = match set.ends_with("soft") {
        true => (
            "contact = { v1 = \"free - k0*(x1 + d - e)\" }",
            "contact = { v1 = \"free - k0*(x1 - d + e)\" }",
        ),
        false => ("impact = { v1 = \"-r*v1\" }", "impact = { v1 = \"-r*v1\" }"),
    };
    let text = format!(
        r#"
[model]
name = "two masses between two stops"
states = ["x1", "v1", "x2", "v2"]
[model.parameters]
k22 = {k22}
m2 = {m2}
zeta = {zeta}
f1 = {f1}
f2 = {f2}
k0 = {k0}
e = {e}
r = 0.8
w = {w}
d = {d}
[model.let]
g1 = "x1 + 2*zeta*v1"
g2 = "x2 + 2*zeta*v2"
[model.phase]
name = "theta"
rate = "w"
period = "2*pi"
[model.flow]
x1 = "v1"
v1 = "f1*cos(theta) - g1 + g2"
x2 = "v2"
v2 = "(f2*cos(theta) + g1 - k22*g2)/m2"
[[model.surface]]
name = "left"
event = "x1 + d"
{left}
[[model.surface]]
name = "right"
event = "d - x1"
{right}
[grazing]
surface = "right"
solve_for = "d"
"#,
        k22 = 1.0 + of("mu_k").parse::<f64>().expect("1 or 1.5"),
        m2 = of("mu_m"),
        zeta = of("zeta"),
        f1 = force(0),
        f2 = force(1),
        k0 = of("mu_k0"),
        e = of("e"),
        w = of("w"),
        d = text(&file["d_grazing"]),
    );
    parsed(&text, set, &NONE)
}

/// One section: where it starts and ends, what is on the way.
struct Section {
    section: ReturnSection,
    passages: [NominalPassage; 2],
}

/// The right stop's tangency section; the left stop is met half a period later.
fn tangency(period: f64) -> Section {
    let at = |surface, time| NominalPassage { surface, time, hit: false, rests: false };
    Section {
        section: ReturnSection::Tangency { surface: RIGHT },
        passages: [at(RIGHT, 0.0), at(LEFT, 0.5 * period)],
    }
}

/// A quarter of a period before the right stop is met.
fn quarter_before(period: f64) -> Section {
    let at = |surface, time| NominalPassage { surface, time, hit: false, rests: false };
    Section {
        section: ReturnSection::OtherPhase,
        passages: [at(RIGHT, 0.25 * period), at(LEFT, 0.75 * period)],
    }
}

/// The image of a full state by direct simulation at a row's gap.
fn image<S: Real>(scene: &Scene, row: &Value, section: &Section, start: &[Dd]) -> Return<S> {
    let system = HybridSystem::new(&scene.model);
    let mut parameters = scene.model.parameter_values();
    let gap = parameters.last_mut().expect("parameters");
    *gap = exact(&row["d"]);
    let parameters: Vec<S> = parameters.into_iter().map(S::from_dd).collect();
    let start: Vec<S> = start.iter().map(|&value| S::from_dd(value)).collect();
    DirectReturn::over_periods(&system, &parameters, section.section, 1)
        .expect("a phase")
        .with_passages(&section.passages)
        .expect("within the period")
        .image(&start)
        .expect("a finite state")
}

/// Largest difference of a component.
fn distance<S: Real>(found: &[S], truth: &[Dd]) -> f64 {
    let pairs = found.iter().zip(truth);
    let differences = pairs.map(|(&found, &truth)| (found.to_dd() - truth).abs().to_f64());
    differences.fold(0.0, f64::max)
}

/// The image on the tangency section and on the stroboscopic one, with their errors.
fn both<S: Real>(scene: &Scene, file: &Value, row: &Value) -> [(Return<S>, f64); 2] {
    let period = exact(&file["T"]).to_f64();
    let join = |state: &Value, phase: &Value| {
        let mut full = exact_list(state);
        full.push(exact(phase));
        full
    };
    let start = join(&row["x_i"], &row["phase_i"]);
    let truth = join(&row["image"], &row["image_phase_minus_2pi"]);
    let grazing = image::<S>(scene, row, &tangency(period), &start);
    let phase = &file["strobe_phase"];
    let start = join(&row["strobe_start"], phase);
    let strobe = image::<S>(scene, row, &quarter_before(period), &start);
    let strobe_truth = join(&row["strobe_image"], phase);
    let errors = [distance(&grazing.state, &truth), distance(&strobe.state, &strobe_truth)];
    [(grazing, errors[0]), (strobe, errors[1])]
}

/// The contacts of the right and the left stop in the reference, where they were made.
fn contacts(row: &Value) -> [Option<&Value>; 2] {
    ["right_contact", "left_contact"]
        .map(|key| Some(&row[key]).filter(|contact| !contact.is_null()))
}

/// Asserts that the passages made contact where those of the reference do, once each, at its
/// speeds.
fn check_contacts(found: &Return<Dd>, row: &Value, place: &str) {
    let [right, left] = contacts(row);
    let hits = [left, right].map(|contact| usize::from(contact.is_some()));
    assert_eq!(found.outcome, ReturnOutcome::Returned, "{place}");
    assert_eq!((found.contacts, found.extra_contacts), (hits[0] + hits[1], 0), "{place}");
    assert_eq!(found.hits, hits, "{place}");
    for (speed, contact) in found.passages.iter().zip([right, left]) {
        let truth = contact.map(|contact| exact(&contact["v_in"]).abs());
        assert_eq!(speed.is_some(), truth.is_some(), "{place}");
        let error = speed.unwrap_or(Dd::ZERO) - truth.unwrap_or(Dd::ZERO);
        assert!(error.abs().to_f64() < 1e-27, "{place}: {error:?}");
    }
}

#[test]
fn images_in_double_double_agree_with_the_composition_of_exact_maps_to_1e_minus_27() {
    for set in SETS {
        let file = read(&format!("soft/public_two_{set}.json"));
        let scene = scene(set, &file);
        let mut worst = [0.0_f64; 2];
        let rows = file["images"].as_array().expect("images");
        assert_eq!(rows.len(), 20, "{set}");
        for (number, row) in rows.iter().enumerate() {
            for (worst, (found, error)) in worst.iter_mut().zip(both::<Dd>(&scene, &file, row)) {
                check_contacts(&found, row, &format!("{set} image {number}"));
                *worst = worst.max(error);
            }
        }
        println!("{set}: tangency {:.1e}, stroboscopic {:.1e}", worst[0], worst[1]);
        // Rounding, 1e-32, times the factor 1/y of a square root, y > 5e-3, times the expansion of
        // a period, below 1e2.
        assert!(worst.iter().all(|&error| error < 1e-27), "{set}: {worst:?}");
    }
}

#[test]
fn images_in_double_obey_the_rounding_law_of_the_square_root() {
    for set in SETS {
        let file = read(&format!("soft/public_two_{set}.json"));
        let scene = scene(set, &file);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for row in file["images"].as_array().expect("images") {
            let made = contacts(row).into_iter().flatten();
            let depths = made.map(|contact| exact(&contact["y2"]).to_f64());
            let unit = f64::EPSILON * (1.0 + 1.0 / depths.fold(1.0, f64::min).sqrt());
            let count = contacts(row).into_iter().flatten().count();
            for (found, error) in both::<f64>(&scene, &file, row) {
                assert_eq!((found.contacts, found.extra_contacts), (count, 0), "{set}");
                (worst, largest) = (worst.max(error / unit), largest.max(error));
            }
        }
        println!("{set}: f64 at most {worst:.1} eps (1 + 1/y), {largest:.1e}");
        // Rounding of x1 - d by eps moves y by eps/(2 y); two legs then expand by at most about 30.
        assert!(worst < 100.0, "{set}: {worst}");
    }
}
