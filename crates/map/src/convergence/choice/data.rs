//! A chosen map: which it is, what it costs and errs, and the polynomials that it stands for.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::economise::Economiser;
use super::next_depth::LeastOrders;
use crate::convergence::ConvergenceError;
use crate::convergence::family::MapFamily;
use crate::expansion::{ComposedMap, Expander, LocalMap, MapOrders, prune, prune_composed};
use crate::iteration::HornerMap;
use crate::model::{Scene, Shape};
use crate::numeric::FloatFormat;
use crate::orbit::GrazingOrbit;

/// The cheapest map for a tolerance, or the most accurate one tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Tolerance asked, in the units of the offsets.
    pub tolerance: f64,
    /// Whether the error stays below the tolerance, on the sample and on fresh points.
    pub met: bool,
    /// What the map is run in: coefficients, input and every operation. Errors are those of these
    /// numbers.
    #[serde(default)]
    pub precision: FloatFormat,
    /// Its truncation orders.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape.
    pub shape: Shape,
    /// Weights of parameters, by name, where they are heavier than the scene's.
    pub weights: BTreeMap<String, u32>,
    /// Which monomials it has.
    pub monomials: Monomials,
    /// The error of which those that it lacks were allowed a tenth, by their bound on the window;
    /// `None` where it has all.
    pub drop_within: Option<f64>,
    /// Whose coefficients it has.
    pub polynomials: Polynomials,
    /// Orders of the map that economised coefficients were fitted to.
    pub fitted_to: Option<MapOrders>,
    /// Largest error on the sample.
    pub error: Option<f64>,
    /// Largest error on fresh points; `None` where it failed on the sample already.
    pub fresh_error: Option<f64>,
    /// Fresh points compared.
    pub fresh_points: usize,
    /// Largest error on fresh points of the same map in single precision, for information; `None`
    /// where it is run in that.
    pub single_precision_error: Option<f64>,
    /// Operations of one step, parameters frozen.
    pub operations: usize,
    /// Coefficients other than zero, parameters not frozen.
    pub coefficients: usize,
    /// Orders that the rule predicts for the tolerance; see docs/mathematics/orders.md.
    pub predicted: MapOrders,
    /// Orders that no choice goes below, where `xi_1` is near 0 on the window.
    #[serde(default)]
    pub least_orders: Option<LeastOrders>,
    /// Why no map meets the tolerance, where none does.
    pub limit: Option<Limit>,
    /// Seconds that the choice took.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub seconds: f64,
}

/// Whose coefficients a map has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Polynomials {
    /// Those of the Taylor series.
    Taylor,
    /// Those fitted to a map of higher orders on the window.
    Economised,
}

/// What keeps maps from meeting a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Limit {
    /// The highest orders that are expanded for so many variables leave out more.
    Orders,
    /// Terms do not fall, or hardly, on the window: it reaches to the radius of convergence.
    Radius,
    /// Rounding: what truncation leaves out is within the tolerance, and higher orders bring the
    /// error down no more.
    Rounding,
}

/// Which monomials of a truncation a map has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Monomials {
    /// All of them.
    All,
    /// Those that the tolerance needs.
    Needed,
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
        let unweighted = unweighted(scene, &self.weights);
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
}

/// The scene without weights of its own for these parameters.
fn unweighted(scene: &Scene, weights: &BTreeMap<String, u32>) -> Scene {
    let mut scene = scene.clone();
    scene.expansion.weights.retain(|(name, _)| !weights.contains_key(name));
    scene
}

/// The scene with these weights of parameters.
pub(super) fn weighted(scene: &Scene, weights: &BTreeMap<String, u32>) -> Scene {
    let mut scene = unweighted(scene, weights);
    let weights = weights.iter();
    let weights = weights.map(|(name, &weight)| (name.clone(), weight));
    scene.expansion.weights.extend(weights);
    scene
}

/// A map in the shape in which it is run.
#[derive(Clone)]
pub(in crate::convergence) struct Form {
    /// As it is expanded.
    pub(in crate::convergence) map: LocalMap,
    /// Its composed form, where that is the shape.
    pub(in crate::convergence) composed: Option<ComposedMap>,
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
        match (error, &self.composed) {
            (None, _) => self.clone(),
            (Some(error), Some(composed)) => Self {
                map: self.map.clone(),
                composed: Some(prune_composed(&self.map, composed, error).0),
            },
            (Some(error), None) => Self { map: prune(&self.map, error).0, composed: None },
        }
    }

    /// The operations that are run.
    pub(in crate::convergence) fn lowered(&self) -> HornerMap {
        match &self.composed {
            Some(composed) => HornerMap::composed(&self.map, composed),
            None => HornerMap::new(&self.map),
        }
    }

    /// Number of coefficients that are not zero.
    pub(in crate::convergence) fn coefficients(&self) -> usize {
        match &self.composed {
            Some(composed) => composed.coefficients(),
            None => self.map.coefficients(),
        }
    }
}
