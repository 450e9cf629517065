//! A map in the shape in which it is run, with or without the monomials that a tolerance does not
//! need.

use super::ConvergenceError;
use crate::emission::{prune, prune_composed};
use crate::expansion::{ComposedMap, Expander, LocalMap};
use crate::iteration::HornerMap;
use crate::model::{Scene, Shape};
use crate::orbit::GrazingOrbit;

/// A map in the shape in which it is run.
#[derive(Clone)]
pub(super) struct Form {
    /// As it is expanded.
    pub(super) map: LocalMap,
    composed: Option<ComposedMap>,
}

impl Form {
    /// The composed form is cut by the weights of the scene.
    pub(super) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: LocalMap,
        shape: Shape,
    ) -> Result<Self, ConvergenceError> {
        let composed = match shape {
            Shape::Composed => Some(Expander::new(scene, orbit)?.compose(&map)?),
            Shape::Factored | Shape::Flown | Shape::Auto => None,
        };
        Ok(Self { map, composed })
    }

    /// Without the monomials that an error does not need; `None` keeps them all.
    pub(super) fn without(&self, error: Option<f64>) -> Self {
        error.map_or_else(|| self.clone(), |error| self.pruned(error))
    }

    fn pruned(&self, tolerance: f64) -> Self {
        match &self.composed {
            Some(composed) => Self {
                map: self.map.clone(),
                composed: Some(prune_composed(&self.map, composed, tolerance).0),
            },
            None => Self {
                map: prune(&self.map, tolerance).0,
                composed: None,
            },
        }
    }

    pub(super) fn lowered(&self) -> HornerMap {
        match &self.composed {
            Some(composed) => HornerMap::composed(&self.map, composed),
            None => HornerMap::new(&self.map),
        }
    }

    pub(super) fn coefficients(&self) -> usize {
        match &self.composed {
            Some(composed) => composed.coefficients(),
            None => self.map.coefficients(),
        }
    }
}
