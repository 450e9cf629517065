//! Two masses between two stops: the local map `P = P2 ∘ D_L ∘ P1 ∘ D_R` against images of exact
//! maps.
//!
//! Truth: tests/data/soft/public_two_*.json (32 digits; README there).
//! `cargo test --test maps -- public_two_maps:: --nocapture` prints the tables of errors against
//! orders.

use grazemap::analysis::MapEvaluation;
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;
use serde_json::Value;

use crate::support::reference::{exact, exact_list, read};
use crate::support::scenes::{orbit, scene_with};

/// Weights `W` of the tables, and the degrees `N` of their legs up to the highest.
const WEIGHTS: [u32; 5] = [4, 6, 8, 10, 12];
const HIGHEST_DEGREE: u32 = 12;

struct Set {
    file: Value,
    scene: Scene,
    orbit: GrazingOrbit,
}

/// The catalogue's scene of a set, `overrides` applied.
fn set(name: &str, overrides: &[(&str, &str)]) -> Set {
    let name_of_scene = format!("two_stops_{}", name.to_lowercase().replace("_soft", ""));
    let scene = scene_with(&name_of_scene, overrides);
    let orbit = orbit(&scene);
    Set { file: read(&format!("soft/public_two_{name}.json")), scene, orbit }
}

/// One image: offsets of the section's coordinates and of the gap, and the image's offsets.
struct Image {
    start: Vec<Dd>,
    gap: Dd,
    end: Vec<Dd>,
    contacts: usize,
    deepest: f64,
}

impl Set {
    fn images(&self, section: Section) -> Vec<Image> {
        let rows = self.file["images"].as_array().expect("images").iter();
        rows.map(|row| self.image(row, section)).collect()
    }

    fn image(&self, row: &Value, section: Section) -> Image {
        let join = |state: &Value, phase: &Value| {
            let mut full = exact_list(state);
            full.push(exact(phase));
            full
        };
        let strobe = &self.file["strobe_phase"];
        let (start, end) = match section {
            Section::Tangency => (
                join(&row["x_i"], &row["phase_i"]),
                join(&row["image"], &row["image_phase_minus_2pi"]),
            ),
            Section::Stroboscopic => {
                (join(&row["strobe_start"], strobe), join(&row["strobe_image"], strobe))
            }
        };
        let offsets = |full: Vec<Dd>| {
            let coordinates = self.orbit.section.coordinates.iter();
            let offset = |&component: &usize| full[component] - self.orbit.section_point[component];
            coordinates.map(offset).collect()
        };
        let made = ["right_contact", "left_contact"].map(|key| &row[key]);
        let made = made.into_iter().filter(|contact| !contact.is_null());
        let depths: Vec<f64> = made.map(|contact| exact(&contact["y2"]).to_f64()).collect();
        Image {
            start: offsets(start),
            gap: exact(&row["d"]) - exact(&self.file["d_grazing"]),
            end: offsets(end),
            contacts: depths.len(),
            deepest: depths.into_iter().fold(0.0, f64::max),
        }
    }

    fn map(&self, smooth_order: u32, contact_weight: u32) -> LocalMap {
        let orders = MapOrders { smooth_order, contact_weight };
        let expander = Expander::new(&self.scene, &self.orbit).expect("an analytic law");
        expander.expand(orders).expect("an expansion")
    }
}

#[derive(Clone, Copy, Debug)]
enum Section {
    Tangency,
    Stroboscopic,
}

fn error(map: &LocalMap, image: &Image) -> f64 {
    let found = MapEvaluation::<Dd>::new(map).image(&image.start, &[image.gap]);
    assert_eq!(found.contacts(), image.contacts);
    let pairs = found.offsets.iter().zip(&image.end);
    pairs.map(|(&found, &truth)| (found - truth).to_f64().abs()).fold(0.0, f64::max)
}

/// A set on one of its sections, the gap active.
fn on_section(name: &str, section: Section) -> Set {
    let active = ("expansion.active", "[\"d\"]");
    match section {
        Section::Tangency => set(name, &[active]),
        Section::Stroboscopic => {
            let kind = ("section.kind", "stroboscopic");
            let tangency = set(name, &[active]);
            let phase = tangency.file["strobe_phase"].as_str().expect("a phase");
            set(name, &[active, kind, ("section.phase", phase)])
        }
    }
}

/// Largest error of the images no deeper than `deepest`, weight by weight.
fn errors(set: &Set, images: &[Image], deepest: f64) -> Vec<f64> {
    let shallow: Vec<_> = images.iter().filter(|image| image.deepest <= deepest).collect();
    assert!(!shallow.is_empty());
    let worst = |&weight: &u32| {
        let map = set.map(weight.min(HIGHEST_DEGREE), weight);
        let errors = shallow.iter().map(|image| error(&map, image));
        errors.fold(0.0, f64::max)
    };
    WEIGHTS.iter().map(worst).collect()
}

/// Error caused by rounding the coefficients to double precision, at any order.
const ROUNDING: f64 = 1e-16;

/// Errors as a row of a table.
fn shown(errors: &[f64]) -> String {
    let errors: Vec<_> = errors.iter().map(|error| format!("{error:.1e}")).collect();
    errors.join(", ")
}

#[test]
fn maps_of_two_passages_approach_the_exact_composition_order_by_order() {
    // Deeper images are beyond a table that ends here: y over the springs' radius, 0.32 and 0.09,
    // is no longer small. The shallowest contacts of T2_rigid have y = 0.1; on its curved tangency
    // sections degree 12 leaves y^13.
    for (name, deepest, bound) in [
        ("T1_soft", 1e-3, 1e-10),
        ("T2_soft", 3e-4, 1e-10),
        ("T1_rigid", 1e-3, 1e-10),
        ("T2_rigid", 1e-2, 1e-9),
    ] {
        for section in [Section::Tangency, Section::Stroboscopic] {
            let set = on_section(name, section);
            let gap = *set.orbit.parameters().last().expect("the gap");
            let missed = (gap - exact(&set.file["d_grazing"])).to_f64().abs();
            assert!(missed < 1e-30, "{name}: the orbit grazes {missed:e} off");
            let errors = errors(&set, &set.images(section), deepest);
            println!("{name} {section:?}, depth <= {deepest:e}: {}", shown(&errors));
            assert!(
                errors.is_sorted_by(|&a, &b| b < a || a < ROUNDING),
                "{name} {section:?}: {}",
                shown(&errors)
            );
            assert!(errors[WEIGHTS.len() - 1] < bound, "{name} {section:?}: {}", shown(&errors));
        }
    }
}
