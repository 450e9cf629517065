//! A chosen map: its identity, its cost and error, and its polynomials.

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
    /// Requested tolerance, in the units of the offsets.
    pub tolerance: f64,
    /// Whether the error stays within the tolerance on the sample and on fresh points.
    pub met: bool,
    /// Precision in which the map runs: coefficients, input and every operation. Errors are those
    /// in this precision.
    #[serde(default)]
    pub precision: FloatFormat,
    /// Truncation orders of the map.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape of the map.
    pub shape: Shape,
    /// Weights of parameters, by name, if they are heavier than the scene's.
    pub weights: BTreeMap<String, u32>,
    /// Set of monomials of the map.
    pub monomials: Monomials,
    /// Error by which monomials were dropped: those dropped may use a tenth of it, by their bound
    /// on the window. `None` if all are kept.
    pub drop_within: Option<f64>,
    /// Origin of the coefficients.
    pub polynomials: Polynomials,
    /// Orders of the map that economised coefficients were fitted to.
    pub fitted_to: Option<MapOrders>,
    /// Largest error on the sample.
    pub error: Option<f64>,
    /// Largest error on fresh points; `None` if the map failed on the sample.
    pub fresh_error: Option<f64>,
    /// Number of fresh points compared.
    pub fresh_points: usize,
    /// Largest error, on fresh points, of the same map in single precision, for information; `None`
    /// if the map runs in single precision.
    pub single_precision_error: Option<f64>,
    /// Operations of one step with the parameters frozen.
    pub operations: usize,
    /// Nonzero coefficients, with the parameters not frozen.
    pub coefficients: usize,
    /// Orders that the rule predicts for the tolerance; see docs/mathematics/orders.md.
    pub predicted: MapOrders,
    /// Lowest orders allowed, if `xi_1` is near 0 on the window.
    #[serde(default)]
    pub least_orders: Option<LeastOrders>,
    /// Reason why no map meets the tolerance, if none does.
    pub limit: Option<Limit>,
    /// Seconds that the choice took.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub seconds: f64,
}

/// Origin of the coefficients of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Polynomials {
    /// Coefficients of the Taylor series.
    Taylor,
    /// Coefficients fitted to a map of higher orders on the window.
    Economised,
}

/// Reason why no map meets a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Limit {
    /// The truncation error exceeds the tolerance even at the highest orders expanded for this
    /// number of variables.
    Orders,
    /// Terms fall hardly or not at all on the window: it reaches the radius of convergence.
    Radius,
    /// Rounding: the truncation error is within the tolerance, and higher orders do not reduce the
    /// error.
    Rounding,
}

/// Set of monomials of a truncation that a map has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Monomials {
    /// All monomials.
    All,
    /// Monomials that the tolerance needs.
    Needed,
}

/// The chosen map, as it is expanded and as it runs.
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
    /// The scene with the chosen weights, which is expanded at the [`orders`](Self::orders).
    pub fn weighted(&self, scene: &Scene) -> Scene {
        weighted(scene, &self.weights)
    }

    /// The map before monomials are dropped. An economised factored map has them dropped already,
    /// because its coefficients are fitted to the remaining monomials.
    ///
    /// `scene` has the chosen [weights](Self::weighted).
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

    /// Error of which monomials dropped from [`local_map`](Self::local_map) may use a tenth; `None`
    /// if none remain to be dropped.
    pub fn drop_after(&self) -> Option<f64> {
        let dropped = self.polynomials == Polynomials::Economised && self.shape == Shape::Factored;
        self.drop_within.filter(|_| !dropped)
    }
}

/// The scene without its own weights for these parameters.
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

/// A map in the shape in which it runs.
#[derive(Clone)]
pub(in crate::convergence) struct Form {
    /// The map as expanded.
    pub(in crate::convergence) map: LocalMap,
    /// Composed form, if the shape is composed.
    pub(in crate::convergence) composed: Option<ComposedMap>,
}

impl Form {
    /// A map in a shape; the composed form is cut by the weights of the scene.
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

    /// Drops the monomials that an error does not need; `None` keeps all.
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

    /// The operations to run.
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
