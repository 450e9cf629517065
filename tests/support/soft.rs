//! Soft impacts of the catalogue with other values, and stiff ones that need flown contacts.

use grazemap::model::Scene;

use super::scenes::{parsed, scene_with, text};

/// System with the values that make its stop stiff or lightly damped.
pub(crate) type Law = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

pub(crate) const STIFF: [Law; 4] = [
    ("A, k2 = 1e6", "A", &[("k2", "1e6")]),
    ("B, R2 = 0.05, k2 = 100", "B", &[("R2", "0.05"), ("k2", "100")]),
    ("C, d = 1e-3, k2 = 1e5", "C", &[("d", "1e-3"), ("k2", "1e5")]),
    ("D, d = 1e-3, R2 = 0.5, k2 = 1e5", "D", &[("d", "1e-3"), ("R2", "0.5"), ("k2", "1e5")]),
];

/// A system of the catalogue, A to D, with overrides.
pub(crate) fn scene(system: &str, overrides: &[(&str, &str)]) -> Scene {
    let name = format!("soft_{}", system.to_lowercase());
    scene_with(&name, overrides)
}

/// The oscillator of the guide with its compliant stop, released where the mass leaves the surface.
pub(crate) fn guide_scene(overrides: &[(&str, &str)]) -> Scene {
    let law = r#"contact = { v = "free - k2*(x - delta) - R2*v" }
release = "delta - x""#;
    let source = text("linear")
        .replace(r#"impact = { v = "-r*v" }"#, law)
        .replace("r = 0.8", "k2 = 50, R2 = 1");
    parsed(&source, "guide", overrides)
}
