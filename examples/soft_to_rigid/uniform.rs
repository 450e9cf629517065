//! What the laws uniform in the stiffness say: where a contact turns stiff, where its series end.

use grazemap::expansion::Expander;

use crate::family::{Family, PRESTRESS, STOP_DAMPING, Stop};

impl Family {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
        }
    }

    /// `h''` in contact at the graze, for the free one.
    fn pressed(self, free: f64) -> f64 {
        match self {
            Self::A | Self::B => free,
            Self::C => free + PRESTRESS,
        }
    }

    /// The depth variable at which the contact time turns from that of a soft contact to that of a
    /// stiff one.
    pub(crate) fn turn(self, free: f64, k2: f64) -> f64 {
        self.pressed(free) / (2.0 * free * k2).sqrt()
    }

    /// Radius in `y` of the uniform law: where its arc tangent (A, C) or its square root (B) ends.
    pub(crate) fn radius(self, free: f64, k2: f64) -> f64 {
        match self {
            Self::A | Self::C => self.turn(free, k2),
            Self::B => STOP_DAMPING * (free / 2.0).sqrt() / k2,
        }
    }
}

impl Stop {
    /// `h''` of the free motion at the graze.
    pub(crate) fn acceleration(&self) -> f64 {
        self.orbit.grazing_point().normal_acceleration.hi
    }

    pub(crate) fn expander(&self) -> Expander<'_> {
        Expander::new(&self.scene, &self.orbit).expect("an analytic law")
    }
}
