//! The grazing orbit, as plain data.

use serde::{Deserialize, Serialize};

use crate::model::{Digest, Scene};
use crate::numeric::Dd;

use super::conditions::GrazingConditions;
use super::section::PoincareSection;

/// A point where an orbit of the free flow touches a surface: `h = 0`, `h' = 0`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrazingPoint {
    /// The surface (index into [`Model::surfaces`](crate::model::Model::surfaces)).
    pub surface: usize,
    /// Full state; the phase in `[0, period)`.
    pub state: Vec<Dd>,
    /// All parameters of the model.
    pub parameters: Vec<Dd>,
    /// `h''` along the free flow; positive.
    pub normal_acceleration: Dd,
    /// Time since the first grazing point of the period, in `[0, period of the orbit)`.
    pub time: Dd,
    /// The section moved along the orbit to this point: the chart in which its contact acts.
    pub section: PoincareSection,
}

/// A periodic orbit of the free flow that grazes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrazingOrbit {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Grazing passages of one period, in order; the first starts the orbit.
    pub passages: Vec<GrazingPoint>,
    /// Duration of one period of the orbit: `periods · period/rate`, in units of time.
    pub period: Dd,
    /// Largest residual of closure, `h` and `h'`, in double-double.
    pub residual: f64,
    /// The section and its coordinates.
    pub section: PoincareSection,
    /// Full state where the orbit meets the section.
    pub section_point: Vec<Dd>,
    /// Jacobian of `P_smooth` on the section's coordinates, by rows.
    pub monodromy: Vec<Vec<Dd>>,
    /// Eigenvalues of the monodromy, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1 … xi_6` from the first passage to itself: `xi_n = h_x · Mⁿ · β`
    /// (docs/mathematics/orbit.md).
    pub xi: Vec<Dd>,
    /// The same from every passage to every passage, ordered by `from`, then `to`.
    pub conditions: Vec<GrazingConditions<Dd>>,
    /// Lowest minimum of any event function along the orbit other than the grazing passages;
    /// negative where the orbit penetrates a surface and is therefore not one of the
    /// oscillator with its stops.
    pub clearance: Option<f64>,
    /// Distance from the scene's guess in the full state (the phase taken modulo its period).
    pub guess_distance: Option<f64>,
}

impl GrazingOrbit {
    /// The first grazing point.
    pub fn grazing_point(&self) -> &GrazingPoint {
        &self.passages[0]
    }

    /// All parameters of the model at which the orbit grazes.
    pub fn parameters(&self) -> &[Dd] {
        &self.grazing_point().parameters
    }

    /// Whether the orbit stays on the free side of every surface between its grazing passages.
    pub fn is_physical(&self) -> bool {
        self.clearance.is_none_or(|clearance| clearance >= 0.0)
    }

    /// Names and values of the section's coordinates where the orbit meets it.
    pub fn section_coordinates<'a>(&self, scene: &'a Scene) -> Vec<(&'a str, Dd)> {
        let names = self.section.coordinate_names(&scene.model);
        let values = self
            .section
            .coordinates
            .iter()
            .map(|&component| self.section_point[component]);
        names.into_iter().zip(values).collect()
    }
}
