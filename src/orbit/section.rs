//! Poincaré sections through a grazing orbit, and which state components are their coordinates.

use serde::{Deserialize, Serialize};

use crate::model::{Model, Scene, Section, StroboscopicPhase};
use crate::numeric::{Dd, Scalar};

use super::OrbitError;
use super::geometry::Geometry;

/// A section of a scene, in coordinates: the full state without one component.
///
/// On the tangency section `h' = 0` the eliminated component is the one with the largest
/// `|∂h'/∂x_i|` at the grazing point (the normal velocity; the coordinates of one degree of freedom
/// are `x, theta`). On a stroboscopic section it is the phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoincareSection {
    /// Which section.
    pub kind: PoincareSectionKind,
    /// Components of the full state that are coordinates, increasing.
    pub coordinates: Vec<usize>,
    /// The component of the full state that is not.
    pub eliminated: usize,
}

/// Which Poincaré section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoincareSectionKind {
    /// `h' = 0` near the grazing point.
    Tangency,
    /// A fixed phase.
    Stroboscopic {
        /// The phase, in `[0, period)`.
        phase: Dd,
    },
}

impl PoincareSection {
    /// The section a scene asks for, through an orbit that grazes `surface` at a full state.
    ///
    /// # Errors
    ///
    /// [`OrbitError::StroboscopicWithoutPhase`] if the scene asks for a phase of a model that has
    /// none.
    pub fn of(
        scene: &Scene,
        surface: usize,
        state: &[Dd],
        parameters: &[Dd],
    ) -> Result<Self, OrbitError> {
        let model = &scene.model;
        let phase = match scene.section {
            Section::Tangency => return Ok(Self::tangency(model, surface, state, parameters)),
            Section::Stroboscopic(StroboscopicPhase::Grazing) => state[model.dimension() - 1],
            Section::Stroboscopic(StroboscopicPhase::At(phase)) => phase,
        };
        let clock = model
            .phase
            .as_ref()
            .ok_or(OrbitError::StroboscopicWithoutPhase)?;
        let kind = PoincareSectionKind::Stroboscopic {
            phase: reduced(phase, clock.period),
        };
        Ok(Self::without(
            kind,
            model.dimension(),
            model.dimension() - 1,
        ))
    }

    /// The section `h' = 0` at a grazing point.
    pub(super) fn tangency(model: &Model, surface: usize, state: &[Dd], parameters: &[Dd]) -> Self {
        let geometry = Geometry::new(model, surface);
        let slopes = geometry.at(state, parameters).velocity_gradient();
        let steepest = (0..model.dimension())
            .max_by(|&a, &b| {
                slopes[a]
                    .magnitude()
                    .total_cmp(&slopes[b].magnitude())
                    .then(b.cmp(&a))
            })
            .unwrap_or(0);
        Self::without(PoincareSectionKind::Tangency, model.dimension(), steepest)
    }

    fn without(kind: PoincareSectionKind, dimension: usize, eliminated: usize) -> Self {
        Self {
            kind,
            coordinates: (0..dimension)
                .filter(|&component| component != eliminated)
                .collect(),
            eliminated,
        }
    }

    /// Names of the coordinates.
    pub fn coordinate_names<'a>(&self, model: &'a Model) -> Vec<&'a str> {
        let names = model.full_state_names();
        self.coordinates
            .iter()
            .map(|&component| names[component])
            .collect()
    }
}

/// A phase in `[0, period)`.
pub(super) fn reduced(phase: Dd, period: Dd) -> Dd {
    let rest = phase - (phase / period).floor() * period;
    if rest < period { rest } else { rest - period }
}
