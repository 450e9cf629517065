//! Scenes other than one mass against a wall at rest.

use grazemap::model::Scene;
use serde_json::Value;

use super::reference;
use super::scenes::{parsed, text};

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

/// Two masses between two compliant stops of the first one, which grazes both.
const TWO_MASSES: &str = r#"
[model]
name = "two masses, an elastic stop on either side of the first"
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
[[model.surface]]
name = "left"
event = "d + x1"
contact = { v1 = "free - k0*(x1 + d - e)" }
[grazing]
passages = ["right", "left"]
symmetry = "half-period"
solve_for = "d"
guess = { x1 = 1.66, v1 = 0.0, x2 = 0.65, v2 = 0.0, theta = 3.1 }
[section]
kind = "tangency"
[expansion]
active = ["d"]
"#;

/// `h' = 0` at the graze.
pub(crate) const TANGENCY: &str = "tangency";
/// The forcing phase of the graze.
pub(crate) const STROBOSCOPIC: &str = "stroboscopic";

/// A scene of the catalogue by its name, or one of this file.
pub(crate) fn scene(name: &str, section: &str) -> Scene {
    let rigid;
    let text = match name {
        "oblique" => OBLIQUE,
        "planar" => PLANAR,
        "three_masses_rigid" => {
            rigid = three_rigid_masses();
            &rigid
        }
        _ => text(name),
    };
    parsed(text, name, &[("section.kind", section)])
}

/// The chain of the catalogue with a rigid stop.
fn three_rigid_masses() -> String {
    let text = text("three_masses");
    let contact =
        text.lines().find(|line| line.starts_with("contact = ")).expect("a compliant stop");
    text.replace(contact, "impact = { v3 = \"-0.8*v3\" }")
}

/// The two masses of a file of reference images: masses 1 and m2, springs 1 between them and mu_k
/// to the ground.
pub(crate) fn two_masses(file: &Value) -> Scene {
    let of = |key: &str| reference::text(&file["params"][key]);
    let force = |number: usize| reference::text(&file["params"]["f"][number]);
    let outer = format!("1 + {}", of("mu_k"));
    let graze = reference::exact_list(&file["grazing_state_R"]);
    let graze: Vec<_> = graze.iter().map(|value| format!("{:e}", value.hi)).collect();
    let overrides = [
        ("k22", &outer[..]),
        ("m2", of("mu_m")),
        ("zeta", of("zeta")),
        ("k0", of("mu_k0")),
        ("e", of("e")),
        ("w", of("w")),
        ("f1", force(0)),
        ("f2", force(1)),
        ("d", reference::text(&file["d_grazing"])),
        ("grazing.guess.x1", &graze[0]),
        ("grazing.guess.v1", &graze[1]),
        ("grazing.guess.x2", &graze[2]),
        ("grazing.guess.v2", &graze[3]),
        ("grazing.guess.theta", reference::text(&file["phase_R"])),
    ];
    parsed(TWO_MASSES, "two masses", &overrides)
}
