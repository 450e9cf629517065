//! Soft stops that have a wanted restitution: springs and dampers by contact law, and the error of
//! a rigid stop in their place.
//!
//! The impact is that of a mass `m` alone, `m δ'' = −F(δ, δ')` with the penetration `δ`. In units
//! of its speed and of the length and time that the spring makes of it, it depends on one number,
//! the damping, and on the exponent. The wanted restitution gives that number, the stiffness or the
//! contact time the units. See docs/mathematics/restitution.md.

mod flight;
mod in_scene;

use serde::Serialize;

use crate::numeric::Bracket;
use flight::{ScaledForce, ScaledImpact};
pub use in_scene::{NoDirection, StopInScene};

/// Contact law of a soft stop, `δ` being the penetration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum StopLaw {
    /// `k δ + c δ'`, released where `δ` is 0 again. The damper pulls at the end.
    LinearToSurface,
    /// `k δ + c δ'`, released where the force is 0. The stop never pulls.
    LinearToForce,
    /// `k δ^p (1 + c δ')`, released where `δ` and the force are 0 again (Hunt and Crossley).
    HuntCrossley,
    /// `k δ^p + c δ'`, released where the force is 0 (Hertz's spring with a linear damper).
    HertzToForce,
    /// `k δ^p + c δ'`, released where `δ` is 0 again. The damper pulls at the end.
    HertzToSurface,
}

/// Soft stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftStop {
    /// Contact law.
    pub law: StopLaw,
    /// Exponent `p` of the spring; 1 of a linear law.
    pub exponent: f64,
    /// Effective mass `m`.
    pub mass: f64,
    /// Stiffness `k`.
    pub stiffness: f64,
    /// Damper `c`.
    pub damper: f64,
}

/// Impact of a mass alone with a soft stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopImpact {
    /// Speed at the release over the speed before.
    pub restitution: f64,
    /// Time from the surface to the release.
    pub time: f64,
    /// Largest penetration.
    pub depth: f64,
}

/// Impact that a soft stop is wanted for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedImpact {
    /// Restitution, above 0 and at most 1.
    pub restitution: f64,
    /// Speed at which the stop has it.
    pub speed: f64,
    /// Effective mass.
    pub mass: f64,
    /// Exponent of the spring of laws that are not linear.
    pub exponent: f64,
    /// Size of the stop.
    pub size: StopSize,
}

/// Size of a soft stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StopSize {
    /// Contact time at the wanted speed.
    Time(f64),
    /// Stiffness.
    Stiffness(f64),
}

/// Largest damping, in the impact's own units, at which a restitution is looked for.
const MOST_DAMPING: f64 = 1e6;

impl From<StopLaw> for &'static str {
    fn from(law: StopLaw) -> Self {
        law.name()
    }
}

impl StopLaw {
    /// All laws.
    pub const ALL: [Self; 5] = [
        Self::LinearToSurface,
        Self::LinearToForce,
        Self::HuntCrossley,
        Self::HertzToForce,
        Self::HertzToSurface,
    ];

    /// Name in tables and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::LinearToSurface => "linear_to_surface",
            Self::LinearToForce => "linear_to_force",
            Self::HuntCrossley => "hunt_crossley",
            Self::HertzToForce => "hertz_to_force",
            Self::HertzToSurface => "hertz_to_surface",
        }
    }

    /// Whether the spring is linear.
    pub fn is_linear(self) -> bool {
        matches!(self, Self::LinearToSurface | Self::LinearToForce)
    }

    /// Whether the stop lets go where its force is zero, before the surface is reached.
    pub fn lets_go(self) -> bool {
        matches!(self, Self::LinearToForce | Self::HertzToForce)
    }

    /// Impact in its own units, with a damping: `c v` of Hunt and Crossley, else `c t/m` with the
    /// unit `t` of time.
    fn scaled(self, exponent: f64, damping: f64) -> Option<ScaledImpact> {
        if self.is_linear() {
            return linear(0.5 * damping, self.lets_go());
        }
        let (with_depth, viscous) = match self {
            Self::HuntCrossley => (damping, 0.0),
            _ => (0.0, damping),
        };
        ScaledForce { exponent, with_depth, viscous, lets_go: self.lets_go() }.impact()
    }

    /// Damping with a restitution, which falls as the damping grows.
    fn damping(self, exponent: f64, restitution: f64) -> Option<f64> {
        let missing = |damping: f64| match self.scaled(exponent, damping) {
            Some(impact) => impact.restitution - restitution,
            // The mass does not come back.
            None => -restitution,
        };
        if restitution >= 1.0 {
            return Some(0.0);
        }
        let mut ends = [(0.0, 1.0 - restitution), (1.0, missing(1.0))];
        while ends[1].1 > 0.0 {
            let next = 2.0 * ends[1].0;
            if next > MOST_DAMPING {
                return None;
            }
            ends = [ends[1], (next, missing(next))];
        }
        let [(lower, above), (upper, below)] = ends;
        Bracket::new(lower, upper, above, below).ok()?.itp((above, below), 0.0, missing).root()
    }
}

impl SoftStop {
    /// Stop of a law with the wanted impact; `None` if no damping gives the restitution, or if the
    /// stiffness or the damper is no number of normal size.
    pub fn with_restitution(law: StopLaw, wanted: &WantedImpact) -> Option<Self> {
        let WantedImpact { restitution, speed, mass, size, .. } = *wanted;
        let exponent = if law.is_linear() { 1.0 } else { wanted.exponent };
        let damping = law.damping(exponent, restitution)?;
        let stiffness = match size {
            StopSize::Stiffness(stiffness) => stiffness,
            StopSize::Time(time) => {
                // The unit of time is (m v^(1 − p)/k)^(1/(p + 1)).
                let unit = time / law.scaled(exponent, damping)?.time;
                mass * speed.powf(1.0 - exponent) / unit.powf(1.0 + exponent)
            }
        };
        let mut stop = Self { law, exponent, mass, stiffness, damper: 0.0 };
        stop.damper = damping / stop.damping_of_unit(speed);
        let is_number = stiffness.is_normal() && stop.damper.is_finite();
        is_number.then_some(stop)
    }

    /// Impact at a speed; `None` if the mass does not come back.
    pub fn impact(&self, speed: f64) -> Option<StopImpact> {
        let damping = self.damper * self.damping_of_unit(speed);
        let scaled = self.law.scaled(self.exponent, damping)?;
        let unit = self.unit_of_time(speed);
        Some(StopImpact {
            restitution: scaled.restitution,
            time: scaled.time * unit,
            depth: scaled.depth * unit * speed,
        })
    }

    /// Damping of an impact with a damper of 1, in the impact's own units.
    fn damping_of_unit(&self, speed: f64) -> f64 {
        match self.law {
            StopLaw::HuntCrossley => speed,
            _ => self.unit_of_time(speed) / self.mass,
        }
    }

    /// Time in which the spring makes a change of the speed as large as the speed.
    fn unit_of_time(&self, speed: f64) -> f64 {
        let scale = self.mass * speed.powf(1.0 - self.exponent) / self.stiffness;
        scale.powf(1.0 / (1.0 + self.exponent))
    }
}

/// Impact with a linear spring and damper, `x'' + 2 ζ x' + x = 0`, in closed form; `None` if the
/// mass does not come back.
///
/// With `A = arccos ζ/√(1 − ζ²)` the force is zero at `t = 2 A` with the speed `e^(−2 ζ A)`, at the
/// depth `2 ζ e^(−2 ζ A)`; the depth is largest at `t = A`, `e^(−ζ A)`. The surface is reached at
/// `t = π/√(1 − ζ²)`, if `ζ < 1`.
fn linear(damping: f64, lets_go: bool) -> Option<ScaledImpact> {
    let square = (1.0 - damping) * (1.0 + damping);
    let root = square.abs().sqrt();
    let quarter = match (root == 0.0, square > 0.0) {
        (true, _) => 1.0,
        (_, true) => root.atan2(damping) / root,
        (_, false) => root.asinh() / root,
    };
    let depth = (-damping * quarter).exp();
    if lets_go {
        return Some(ScaledImpact { restitution: depth * depth, time: 2.0 * quarter, depth });
    }
    let time = std::f64::consts::PI / root;
    let restitution = (-damping * time).exp();
    (square > 0.0).then_some(ScaledImpact { restitution, time, depth })
}
