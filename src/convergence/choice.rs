//! The cheapest map for a tolerance.
//!
//! One idea: the cost of a map is known from its coefficients and its error forecast from one
//! expansion of higher order, so that only maps that may be the answer are measured. See
//! docs/mathematics/convergence.md.

use std::collections::BTreeMap;

use super::ConvergenceError;
use super::chooser::Chooser;
use super::data::{Choice, Polynomials};
use super::economise::Economiser;
use super::family::MapFamily;
use super::form::Form;
use crate::emission::prune;
use crate::expansion::{Expander, LocalMap};
use crate::iteration::HornerMap;
use crate::model::{Scene, Shape};
use crate::orbit::GrazingOrbit;

/// What is asked of a choice.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceOptions {
    /// Largest error of a coordinate of one image on the window, in the units of the offsets.
    pub tolerance: f64,
    /// Fresh points on which a map has to hold too.
    pub fresh: usize,
}

impl ChoiceOptions {
    /// A tolerance, tried on a thousand fresh points.
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            fresh: 1000,
        }
    }
}

/// The cheapest map whose error on the window is at most `tolerance`, checked on a thousand fresh
/// points; the most accurate one tried, and [`Choice::met`] `false`, where none is.
///
/// This is what a scene with `expansion.tolerance` gets.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no point to compare at.
pub fn choose_orders(
    scene: &Scene,
    orbit: &GrazingOrbit,
    tolerance: f64,
) -> Result<Choice, ConvergenceError> {
    choose(scene, orbit, &ChoiceOptions::new(tolerance))
}

/// [`choose_orders`] with the number of fresh points named.
///
/// # Errors
///
/// As [`choose_orders`].
pub fn choose(
    scene: &Scene,
    orbit: &GrazingOrbit,
    options: &ChoiceOptions,
) -> Result<Choice, ConvergenceError> {
    Chooser::new(scene, orbit, options.fresh)?.choose(options.tolerance)
}

/// The map that was chosen: as it is expanded, and as it is run.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded.
pub fn chosen_map(
    choice: &Choice,
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<(LocalMap, HornerMap), ConvergenceError> {
    let scene = choice.weighted(scene);
    let map = choice.local_map(&scene, orbit)?;
    let form = Form::new(&scene, orbit, map, choice.shape)?;
    let run = form.without(choice.drop_after()).lowered();
    Ok((form.map, run))
}

impl Choice {
    /// The scene with the weights chosen: what is expanded at the [`orders`](Self::orders).
    pub fn weighted(&self, scene: &Scene) -> Scene {
        weighted(scene, &self.weights)
    }

    /// The map before anything is dropped of it, with what an economised one lacks dropped already:
    /// coefficients are fitted to the monomials that are left.
    ///
    /// `scene` has the [weights](Self::weighted) chosen.
    ///
    /// # Errors
    ///
    /// [`ConvergenceError`] if the scene cannot be expanded.
    pub fn local_map(
        &self,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<LocalMap, ConvergenceError> {
        let orders = self.orders;
        if self.shape == Shape::Flown {
            return Ok(MapFamily::new(scene, orbit, orders)?.flown_map(orders)?);
        }
        let Some(exact) = self.fitted_to else {
            return Ok(MapFamily::new(scene, orbit, orders)?.map(orders)?);
        };
        let unweighted = self.unweighted(scene);
        let family = MapFamily::new(&unweighted, orbit, exact)?;
        let variables = Expander::new(scene, orbit)?.variables().clone();
        let map = family.weighted_map(orders, &variables.weights[variables.coordinates..])?;
        let map = match self.drop_within {
            Some(error) if self.shape == Shape::Factored => prune(&map, error).0,
            _ => map,
        };
        Ok(Economiser::new(family.map(exact)?)?.economise(map))
    }

    /// The error of which monomials dropped of [`local_map`](Self::local_map) may use a tenth;
    /// `None` where none are to be dropped any more.
    pub fn drop_after(&self) -> Option<f64> {
        let dropped = self.polynomials == Polynomials::Economised && self.shape == Shape::Factored;
        self.drop_within.filter(|_| !dropped)
    }

    /// The scene without the weights chosen.
    fn unweighted(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        let kept = |(name, _): &(String, u32)| !self.weights.contains_key(name);
        scene.expansion.weights.retain(kept);
        scene
    }
}

pub(super) fn weighted(scene: &Scene, weights: &BTreeMap<String, u32>) -> Scene {
    let mut scene = scene.clone();
    let kept = |(name, _): &(String, u32)| !weights.contains_key(name);
    scene.expansion.weights.retain(kept);
    let weights = weights.iter();
    let weights = weights.map(|(name, &weight)| (name.clone(), weight));
    scene.expansion.weights.extend(weights);
    scene
}
