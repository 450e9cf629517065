//! Laws uniform in the stiffness: depth at which a contact turns stiff, and radius of its series.

use grazemap::expansion::Expander;

use super::family::{Family, PRESTRESS, STOP_DAMPING, Stop};

impl Family {
    /// Letter of the family.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
        }
    }

    /// Value of `h''` in contact at the graze, from the free one.
    fn pressed(self, free: f64) -> f64 {
        match self {
            Self::A | Self::B => free,
            Self::C => free + PRESTRESS,
        }
    }

    /// Depth variable at which the contact time changes from that of a soft contact to that of a
    /// stiff one.
    pub fn turn(self, free: f64, k2: f64) -> f64 {
        self.pressed(free) / (2.0 * free * k2).sqrt()
    }

    /// Radius in `y` of the uniform law: the singularity of its arc tangent (A, C) or square root
    /// (B).
    pub fn radius(self, free: f64, k2: f64) -> f64 {
        match self {
            Self::A | Self::C => self.turn(free, k2),
            Self::B => STOP_DAMPING * (free / 2.0).sqrt() / k2,
        }
    }
}

impl Stop {
    /// Value of `h''` of the free motion at the graze.
    pub fn acceleration(&self) -> f64 {
        self.orbit.grazing_point().normal_acceleration.hi
    }

    /// Expander at the graze; the laws of all families are analytic.
    pub fn expander(&self) -> Expander<'_> {
        Expander::new(&self.scene, &self.orbit).expect("an analytic law")
    }
}
