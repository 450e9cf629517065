//! Families of hardening stops: scenes with a stiffness.
//!
//! The linear oscillator `u'' = −R1 u' − k1 u + A cos θ` of `Kundu2012` with its stop at `u = 1`;
//! the state `w = u − 1` is the distance from the stop, so that a depth of 1e-26 has all its digits
//! in double-double.

use grazemap::model::Scene;
use grazemap::orbit::{GrazingOrbit, locate};

use super::direct::DirectJump;

/// `R1` of every family; `k1 = σ = M = 1`.
pub const DAMPING: f64 = 0.03;
/// Damper of the stop of family B.
pub const STOP_DAMPING: f64 = 0.5;
/// Force with which the stop of family C is pressed against its seat.
pub const PRESTRESS: f64 = 1.0;

/// Contact law with a free stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Spring: `−k2 w`.
    A,
    /// Spring and damper, released at zero force: `−k2 w − R2 w'`, `R2 = 0.5`.
    B,
    /// Spring with a prestress independent of the stiffness: `−k2 w − F`, `F = 1`.
    C,
}

/// Grazing stop of some stiffness.
#[derive(Debug)]
pub struct Stop {
    /// Scene, on a stroboscopic section.
    pub scene: Scene,
    /// Grazing orbit of the scene.
    pub orbit: GrazingOrbit,
}

impl Family {
    /// All families, in the order of the study.
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::C];

    /// Stop of a stiffness; `m` is twice the ratio of natural to forcing frequency.
    pub fn stop(self, k2: &str, m: &str) -> Stop {
        let law = match self {
            Self::A => format!("contact = {{ v = \"free - {k2}*w\" }}"),
            Self::B => format!(
                "contact = {{ v = \"free - {k2}*w - {STOP_DAMPING}*v\" }}\nrelease = \"{k2}*w + {STOP_DAMPING}*v\""
            ),
            Self::C => format!("contact = {{ v = \"free - {k2}*w - {PRESTRESS}\" }}"),
        };
        Stop::of(&law, m)
    }

    /// Damping coefficient of the stop.
    pub fn stop_damping(self) -> f64 {
        match self {
            Self::B => STOP_DAMPING,
            Self::A | Self::C => 0.0,
        }
    }
}

impl Stop {
    /// Rigid stop with restitution 1.
    pub fn rigid(m: &str) -> Self {
        Self::of("impact = { v = \"-v\" }", m)
    }

    fn of(law: &str, m: &str) -> Self {
        let text = format!(
            r#"
[model]
name = "a stop that hardens"
states = ["w", "v"]
parameters = {{ A = 0.31, omega = "2*sqrt(1 - 0.015^2)/{m}" }}

[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"

[model.flow]
w = "v"
v = "A*cos(theta) - {DAMPING}*v - w - 1"

[[model.surface]]
name = "stop"
event = "-w"
{law}

[grazing]
surface = "stop"
solve_for = "A"
periods = 1
guess = {{ w = 0.0, v = 0.0, theta = 0.05 }}

[section]
kind = "stroboscopic"

[expansion]
active = []
smooth_order = 1
contact_weight = 1
"#
        );
        let scene = Scene::parse(&text, "stop.toml").unwrap_or_else(|error| panic!("{error}"));
        let orbit = locate(&scene)
            .expect("a good scene")
            .into_result()
            .expect("the linear oscillator grazes");
        Self { scene, orbit }
    }

    /// Direct simulation of contacts with the stop.
    pub fn direct(&self) -> DirectJump {
        DirectJump::new(&self.scene, &self.orbit)
    }
}
