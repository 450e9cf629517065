//! A map in the shape in which it is run, with or without the monomials that a tolerance does not need.

use super::ConvergenceError;
use crate::emission::{prune, prune_composed};
use crate::expansion::{ComposedMap, Expander, LocalMap, Stage};
use crate::iteration::HornerMap;
use crate::jet::Jet;
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

    /// With its coefficients rounded to single precision.
    pub(super) fn single(mut self) -> Self {
        self.jets_mut().into_iter().for_each(|jet| {
            for value in jet.coefficients_mut() {
                *value = f64::from(*value as f32);
            }
        });
        self
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

    fn jets_mut(&mut self) -> Vec<&mut Jet<f64>> {
        if let Some(composed) = &mut self.composed {
            let polynomials = composed.depths.iter_mut().chain(&mut composed.image);
            let terms = polynomials.flat_map(|polynomial| &mut polynomial.terms);
            return terms.map(|term| &mut term.coefficient).collect();
        }
        self.map.stages.iter_mut().flat_map(stage_jets).collect()
    }
}

/// The polynomials of a stage that is a series; none of one that is flown.
fn stage_jets(stage: &mut Stage) -> Vec<&mut Jet<f64>> {
    match stage {
        Stage::Leg(leg) => leg.image.iter_mut().collect(),
        Stage::Contact(contact) => {
            let corrections = contact.linear.iter_mut().chain(&mut contact.quadratic);
            corrections.chain([&mut contact.depth]).collect()
        }
        Stage::Flown(_) => Vec::new(),
    }
}
