//! Soft impacts of the catalogue with other values, and the stiff ones that flown contacts are for.

use grazemap::model::{Scene, catalogue};
use grazemap::orbit::{GrazingOrbit, locate};

/// A system and the values that make its stop stiff or lightly damped.
pub(crate) type Law = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

pub(crate) const STIFF: [Law; 4] = [
    ("A, k2 = 1e6", "A", &[("k2", "1e6")]),
    (
        "B, R2 = 0.05, k2 = 100",
        "B",
        &[("R2", "0.05"), ("k2", "100")],
    ),
    (
        "C, d = 1e-3, k2 = 1e5",
        "C",
        &[("d", "1e-3"), ("k2", "1e5")],
    ),
    (
        "D, d = 1e-3, R2 = 0.5, k2 = 1e5",
        "D",
        &[("d", "1e-3"), ("R2", "0.5"), ("k2", "1e5")],
    ),
];

/// A system of the catalogue, A to D, with overrides.
pub(crate) fn scene(system: &str, overrides: &[(&str, &str)]) -> Scene {
    let name = format!("soft_{}", system.to_lowercase());
    let source = catalogue::text(&name).expect("in the catalogue");
    let overrides: Vec<_> = overrides
        .iter()
        .map(|&(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    Scene::parse_with(source, &name, &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// The grazing orbit of a scene that has one.
pub(crate) fn orbit(scene: &Scene) -> GrazingOrbit {
    locate(scene)
        .expect("no wrong input")
        .into_result()
        .expect("it grazes")
}

/// The oscillator of the guide with its compliant stop, released where the mass leaves the surface.
pub(crate) fn guide_scene(overrides: &[(&str, &str)]) -> Scene {
    let source = catalogue::text("linear").expect("in the catalogue");
    let law = r#"contact = { v = "free - k2*(x - delta) - R2*v" }
release = "delta - x""#;
    let source = source
        .replace(r#"impact = { v = "-r*v" }"#, law)
        .replace("r = 0.8", "k2 = 50, R2 = 1");
    let overrides: Vec<_> = overrides
        .iter()
        .map(|&(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    Scene::parse_with(&source, "guide", &overrides).unwrap_or_else(|error| panic!("{error}"))
}
