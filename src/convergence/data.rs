//! A study of convergence as plain data.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::accuracy::DepthAccuracy;
use super::next_depth::LeastOrders;
use super::pareto::ParetoPoint;
use super::sections::SectionChoice;
use super::validity::Validity;
use crate::expansion::{MapOrders, WindowEdge};
use crate::model::{Digest, Shape};
use crate::numeric::FloatFormat;

/// How far maps of every order are from direct simulation, and how fast they are.
///
/// Errors are largest errors of a coordinate of one image, in the units of the offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConvergenceStudy {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// The sample of the window.
    pub sample: SampleSummary,
    /// One entry per pair of orders and shape.
    pub orders: Vec<OrderResult>,
    /// `D` alone, cut at each weight: its error against `y`.
    pub discontinuity_rates: Vec<FactorRate>,
    /// `P_smooth` alone, cut at each degree: its error against the distance.
    pub smooth_rates: Vec<FactorRate>,
    /// The cheapest map for the tolerance, or the most accurate one tried.
    pub chosen: Choice,
    /// The cheapest maps of other sections for the same tolerance; none where they were not asked
    /// for.
    #[serde(default)]
    pub sections: Vec<SectionChoice>,
    /// What its contacts leave out at the largest depth of the window, by passage; none where
    /// their series end or are flown.
    pub window_edges: Vec<WindowEdge>,
    /// The largest window on which the chosen map meets the tolerance.
    pub validity: Validity,
    /// The chosen map and direct simulation in double precision as the window shrinks.
    pub accuracy: DepthAccuracy,
    /// Maps of the sweep that no other one beats in both time and error, and direct simulation.
    pub pareto: Vec<ParetoPoint>,
    /// Direct simulation.
    pub direct: DirectSummary,
    /// The same by Taylor's method, where `direct` is by the exact flow of affine fields.
    #[serde(default)]
    pub direct_by_taylor: Option<DirectSummary>,
    /// Nanoseconds of one multiply-add, measured in the same run.
    pub multiply_add_ns: f64,
}

/// The points at which errors were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleSummary {
    /// Points compared.
    pub points: usize,
    /// Points left out: no image, or contacts other than those of the grazing passages.
    pub excluded: usize,
}

/// One map of the sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderResult {
    /// Its truncation orders.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape of the map.
    pub shape: Shape,
    /// Error over the sample.
    pub error: ErrorSummary,
    /// Exponent with which the error falls when deviations are scaled as `y²`.
    pub rate: Rate,
    /// Nanoseconds of one step, parameters frozen, interpreted.
    pub step_ns: f64,
    /// Nanoseconds that the step's multiply-adds alone would take.
    pub floor_ns: f64,
    /// Operations of one step, parameters frozen.
    pub operations: usize,
    /// Coefficients other than zero, parameters not frozen.
    pub coefficients: usize,
}

/// Errors over a sample; `null` where a map has no finite image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// Largest.
    pub max: Option<f64>,
    /// Median.
    pub median: Option<f64>,
}

/// A measured exponent beside the expected one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Slope of the error in logarithms; `None` where rounding leaves too short a range.
    pub measured: Option<f64>,
    /// Standard error of the slope.
    pub uncertainty: Option<f64>,
    /// What truncation alone would give.
    pub expected: f64,
    /// Range of the small variable used, in units of the window's edge.
    pub range: Option<[f64; 2]>,
}

/// The rate of one factor of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactorRate {
    /// Its truncation order: a weight of `D`, a degree of `P_smooth`.
    pub order: u32,
    /// Its rate.
    pub rate: Rate,
    /// What it was measured from: sizes in units of the window's edge, and root-mean-square
    /// errors.
    pub errors: Vec<[f64; 2]>,
}

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

/// What direct simulation costs and how accurate it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectSummary {
    /// The method: `exact affine flow` or `Taylor`.
    pub method: String,
    /// Nanoseconds of one return to the section, in double precision, the parameters being those
    /// of the one before.
    pub period_ns: f64,
    /// Largest error of double precision against double-double, over the sample.
    pub error_estimate: f64,
}
