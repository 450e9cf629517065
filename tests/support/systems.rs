//! Scenes that are not one mass against a wall at rest.

use grazemap::model::{Scene, catalogue};
use grazemap::orbit::{GrazingOrbit, locate};

/// A mass in the plane and a stop across both axes: an oblique surface, restitution along its
/// normal.
const OBLIQUE: &str = r#"
[model]
name = "a mass in the plane and an oblique stop"
states = ["x", "vx", "z", "vz"]
parameters = { zeta = 0.1, s = 1.6, a = 0.6, b = 0.8, c = 1.0, r = 0.7, F = 1.0, omega = 1.3 }
let = { vn = "a*vx + b*vz" }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "vx"
vx = "F*cos(theta) - 2*zeta*vx - x"
z = "vz"
vz = "F*sin(theta) - 2*zeta*vz - s^2*z"
[[model.surface]]
name = "stop"
event = "c - a*x - b*z"
impact = { vx = "vx - (1 + r)*a*vn", vz = "vz - (1 + r)*b*vn" }
[grazing]
surface = "stop"
solve_for = "F"
[section]
kind = "tangency"
[expansion]
active = ["F", "c"]
[window]
depth = 1e-3
state = { x = 1e-3, vx = 1e-3, z = 1e-3, vz = 1e-3, theta = 1e-3 }
parameter = { F = 1e-3, c = 1e-3 }
"#;

/// Van der Pol's oscillator with a stop: its tangency section has one coordinate.
const PLANAR: &str = r#"
[model]
name = "van der Pol oscillator with a stop"
states = ["x", "v"]
parameters = { mu = 0.5, delta = 2.0, r = 0.8 }
[model.flow]
x = "v"
v = "mu*(1 - x^2)*v - x"
[[model.surface]]
name = "stop"
event = "delta - x"
impact = { v = "-r*v" }
[grazing]
surface = "stop"
solve_for = "delta"
guess = { x = 2.0, v = 0.0 }
[expansion]
active = ["mu", "delta"]
[window]
depth = 1e-3
state = { x = 1e-3 }
parameter = { mu = 1e-3, delta = 1e-3 }
"#;

/// `h' = 0` at the graze.
pub(crate) const TANGENCY: &str = "tangency";
/// The forcing phase of the graze.
pub(crate) const STROBOSCOPIC: &str = "stroboscopic";

fn parse(text: &str, name: &str, section: &str) -> Scene {
    let overrides = [("section.kind".to_owned(), section.to_owned())];
    Scene::parse_with(text, name, &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene of the catalogue by its name, or one of this file.
pub(crate) fn scene(name: &str, section: &str) -> Scene {
    match name {
        "oblique" => parse(OBLIQUE, name, section),
        "planar" => parse(PLANAR, name, section),
        "three_masses_rigid" => parse(&three_rigid_masses(), name, section),
        _ => parse(
            catalogue::text(name).expect("in the catalogue"),
            name,
            section,
        ),
    }
}

/// The chain of the catalogue with a rigid stop.
fn three_rigid_masses() -> String {
    let text = catalogue::text("three_masses").expect("in the catalogue");
    let contact = text
        .lines()
        .find(|line| line.starts_with("contact = "))
        .expect("a compliant stop");
    text.replace(contact, "impact = { v3 = \"-0.8*v3\" }")
}

/// The grazing orbit of a scene.
pub(crate) fn located(scene: &Scene) -> GrazingOrbit {
    locate(scene)
        .expect("no wrong input")
        .into_result()
        .unwrap_or_else(|reason| panic!("{}: {reason}", scene.identifier))
}
