//! Comparison of truncation orders with direct simulation: every pair of orders is measured with
//! one expansion, one sample and one set of exact images.

mod rates;
mod reach;

pub use rates::{FactorRate, Rate, SlopeFit, fit_slope};
pub use reach::{DepthAccuracy, Validity, WindowAccuracy, validity};

use serde::{Deserialize, Serialize};

use super::choice::{
    Choice, ChoiceOptions, Chooser, Form, SectionChoice, choose_sections, chosen_map,
};
use super::family::MapFamily;
use super::sample::WindowSample;
use super::truth::{
    ErrorSummary, ExactImages, SampleSummary, multiply_add_ns, step_ns, summarize, timed_returns,
    truth,
};
use super::{ConvergenceError, computed, kept, resumed};
use crate::analysis::{DirectImage, MapEvaluation, Progress, SubProgress};
use crate::expansion::{Expander, MapOrders, WindowEdge};
use crate::hybrid::{FlowMethod, HybridSystem};
use crate::iteration::{HornerMap, parallel};
use crate::model::{Digest, Orders, Scene, Shape};
use crate::numeric::{Dd, Scalar};
use crate::orbit::GrazingOrbit;
use rates::{ExactFactors, LazyFactors, ScaledPoints, discontinuity_rates, smooth_rates};
use reach::depth_accuracy;

/// Errors and times of maps of every pair of orders, compared with direct simulation.
///
/// An error is the largest error of a coordinate of one image, in the units of the offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConvergenceStudy {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Numbers of points in the sample of the window.
    pub sample: SampleSummary,
    /// Results, one per pair of orders and shape.
    pub orders: Vec<OrderResult>,
    /// Rates of `D` only, cut at each weight: its error against `y`.
    pub discontinuity_rates: Vec<FactorRate>,
    /// Rates of `P_smooth` only, cut at each degree: its error against the distance.
    pub smooth_rates: Vec<FactorRate>,
    /// Cheapest map for the tolerance, or the most accurate one tried.
    pub chosen: Choice,
    /// Cheapest maps of other sections for the same tolerance; empty unless requested.
    #[serde(default)]
    pub sections: Vec<SectionChoice>,
    /// Truncation errors of the chosen map's contacts at the largest depth of the window, by
    /// passage; empty if their series end or they are flown.
    pub window_edges: Vec<WindowEdge>,
    /// Largest window on which the chosen map meets the tolerance.
    pub validity: Validity,
    /// Errors of the chosen map and of direct simulation in double precision as the window shrinks.
    pub accuracy: DepthAccuracy,
    /// Maps of the sweep that no other one beats in both time and error, and direct simulation.
    pub pareto: Vec<ParetoPoint>,
    /// Cost and accuracy of direct simulation.
    pub direct: DirectSummary,
    /// Direct simulation by Taylor's method, if `direct` uses the exact flow of affine fields.
    #[serde(default)]
    pub direct_by_taylor: Option<DirectSummary>,
    /// Nanoseconds of one multiply-add, measured in the same run.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub multiply_add_ns: f64,
}

/// Result of one map of the sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderResult {
    /// Truncation orders of the map.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape of the map.
    pub shape: Shape,
    /// Error over the sample.
    pub error: ErrorSummary,
    /// Exponent with which the error falls when deviations are scaled as `y²`.
    pub rate: Rate,
    /// Nanoseconds of one interpreted step with the parameters frozen.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub step_ns: f64,
    /// Nanoseconds that the multiply-adds of the step alone would take.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub floor_ns: f64,
    /// Operations of one step with the parameters frozen.
    pub operations: usize,
    /// Nonzero coefficients, with the parameters not frozen.
    pub coefficients: usize,
}

/// Cost and accuracy of direct simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectSummary {
    /// Name of the method: `exact affine flow` or `Taylor`.
    pub method: String,
    /// Nanoseconds of one return to the section in double precision, at the same parameters as the
    /// return before.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub period_ns: f64,
    /// Largest error of double precision against double-double over the sample.
    pub error_estimate: f64,
}

/// Tolerance if the scene states none.
const TOLERANCE: f64 = 1e-8;

/// Highest degree and weight of the factors whose rates are measured.
const RATES: MapOrders = MapOrders::new(6, 8);

/// Settings of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvergenceOptions {
    /// Highest degree of `P_smooth` and weight of `D`; all lower ones are swept. `None` for a
    /// degree and two weights beyond the chosen ones.
    pub highest: Option<MapOrders>,
    /// Shapes to sweep.
    pub shapes: Vec<Shape>,
    /// Number of points in the window.
    pub points: usize,
    /// Tolerance for which a map is chosen, in the units of the offsets.
    pub tolerance: f64,
    /// Number of fresh points on which the chosen map has to meet the tolerance.
    pub fresh: usize,
    /// Whether maps of other sections are chosen too.
    pub sections: bool,
    /// Map chosen for the tolerance with this number of fresh points, if it is already known.
    pub chosen: Option<Choice>,
    /// Highest weight of `D` whose rate is measured (with coefficients in double-double).
    pub discontinuity_rates: u32,
    /// Highest degree of `P_smooth` whose rate is measured (with coefficients in double-double, by
    /// Taylor's method: seconds at degree 6 for a nonlinear field).
    pub smooth_rates: u32,
}

impl ConvergenceOptions {
    /// Defaults: orders slightly beyond the scene's, its tolerance or `1e-8`, and both shapes of
    /// series, or the flown shape if the scene requests it.
    pub fn of(scene: &Scene) -> Self {
        let (highest, tolerance) = match scene.expansion.orders {
            Orders::Fixed(orders) => (Some(beyond(orders)), TOLERANCE),
            Orders::Tolerance(tolerance) => (None, tolerance),
        };
        Self {
            highest,
            shapes: match scene.emit.shape {
                Shape::Flown => vec![Shape::Flown],
                _ => vec![Shape::Factored, Shape::Composed],
            },
            points: 128,
            tolerance,
            fresh: ChoiceOptions::new(tolerance).fresh,
            sections: false,
            chosen: None,
            discontinuity_rates: RATES.contact_weight,
            smooth_rates: RATES.smooth_order,
        }
    }
}

/// Orders raised by a degree and two weights, to show the effect of the next orders of both
/// factors.
fn beyond(orders: MapOrders) -> MapOrders {
    orders.plus(MapOrders::new(1, 2))
}

/// Measures maps of every pair of orders against direct simulation in double-double.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no point to compare at.
pub fn converge(
    scene: &Scene,
    orbit: &GrazingOrbit,
    options: &ConvergenceOptions,
    progress: &dyn Progress,
) -> Result<ConvergenceStudy, ConvergenceError> {
    let choice = ChoiceOptions { tolerance: options.tolerance, fresh: options.fresh };
    let choose = || match &options.chosen {
        Some(chosen) => Ok(chosen.clone()),
        None => resumed(progress, &[Stage::Choice as u64], || {
            let part = SubProgress::new(progress, Stage::Candidates as usize);
            Chooser::new(scene, orbit, choice.fresh)?.resuming(&part).choose(choice.tolerance)
        }),
    };
    let expander = Expander::new(scene, orbit)?;
    let rates = MapOrders::new(options.smooth_rates, options.discontinuity_rates);
    let factors = |highest| LazyFactors::new(&expander, rates.min(highest));
    let part = SubProgress::new(progress, Stage::Orders as usize);
    let known: Option<Vec<OrderResult>> = kept(&part, &[0]);
    let (chosen, highest, factors) = match options.highest {
        // With orders given, the factors need not wait for the choice.
        Some(highest) => {
            let factors = factors(highest);
            let made = || if known.is_none() { factors.get().map(drop) } else { Ok(()) };
            let (chosen, made) = parallel::join(choose, made);
            let chosen = chosen?;
            made?;
            (chosen, highest, factors)
        }
        None => {
            let chosen = choose()?;
            let highest = beyond(chosen.orders);
            (chosen, highest, factors(highest))
        }
    };
    let sweep = Sweep::new(scene, orbit, options, highest, progress)?;
    let multiply_add_ns = multiply_add_ns();
    let Measurements { orders, discontinuity_rates, smooth_rates } =
        sweep.measured(known, &factors, multiply_add_ns, &part)?;
    let (local, map) = chosen_map(&chosen, scene, orbit)?;
    let map = map.in_format(chosen.precision);
    let direct = sweep.direct(&sweep.system)?;
    let direct_by_taylor = sweep.direct_by_taylor()?;
    let sections = match options.sections {
        true => {
            let progress = SubProgress::new(progress, Stage::Sections as usize);
            choose_sections(scene, orbit, &choice, &chosen, &progress)?
        }
        false => Vec::new(),
    };
    Ok(ConvergenceStudy {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        sample: sweep.truth.summary(),
        discontinuity_rates,
        smooth_rates,
        window_edges: window_edges(&sweep.family, &chosen)?,
        validity: resumed(progress, &[Stage::Validity as u64], || {
            validity(scene, orbit, &local, &*map, options.tolerance)
        })?,
        accuracy: resumed(progress, &[Stage::Accuracy as u64], || {
            depth_accuracy(&sweep.system, scene, orbit, &sweep.sample, &*map)
        })?,
        pareto: pareto(&orders, direct_by_taylor.iter().chain([&direct])),
        chosen,
        sections,
        direct,
        direct_by_taylor,
        multiply_add_ns,
        orders,
    })
}

/// Stages of a study that a later run need not repeat.
#[derive(Clone, Copy)]
enum Stage {
    Choice,
    Orders,
    Sections,
    Validity,
    Accuracy,
    Candidates,
}

/// Measured errors, rates and times of maps of every order and of their factors.
struct Measurements {
    orders: Vec<OrderResult>,
    discontinuity_rates: Vec<FactorRate>,
    smooth_rates: Vec<FactorRate>,
}

/// Truncation errors of a chosen map's contacts at the edge of the window.
fn window_edges(
    family: &MapFamily<'_>,
    chosen: &Choice,
) -> Result<Vec<WindowEdge>, ConvergenceError> {
    let expander = family.expander();
    let passages = match chosen.shape {
        Shape::Flown => 0..0,
        _ => 0..expander.passages(),
    };
    let edges = passages.map(|passage| expander.window_edge(passage, chosen.orders.contact_weight));
    let edges = edges.collect::<Result<Vec<_>, _>>()?;
    Ok(edges.into_iter().flatten().collect())
}

/// Data of one study.
pub(super) struct Sweep<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    options: ConvergenceOptions,
    highest: MapOrders,
    system: HybridSystem,
    family: MapFamily<'a>,
    sample: WindowSample,
    truth: ExactImages,
}

impl<'a> Sweep<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        options: &ConvergenceOptions,
        highest: MapOrders,
        progress: &dyn Progress,
    ) -> Result<Self, ConvergenceError> {
        let pairs = u64::from(highest.smooth_order * highest.contact_weight);
        progress.expect(pairs * options.shapes.len() as u64);
        let system = HybridSystem::new(&scene.model);
        let family = MapFamily::new(scene, orbit, highest)?;
        let sample = WindowSample::new(&family.map(highest)?);
        let truth = truth(&system, scene, orbit, sample.points(0, options.points))?;
        if truth.points.is_empty() {
            return Err(ConvergenceError::NoTruth { tried: options.points });
        }
        Ok(Self { scene, orbit, options: options.clone(), highest, system, family, sample, truth })
    }

    /// Errors, rates and times of all maps, and rates of their factors.
    fn measured(
        &self,
        known: Option<Vec<OrderResult>>,
        factors: &LazyFactors<'_, '_>,
        multiply_add_ns: f64,
        progress: &SubProgress<'_>,
    ) -> Result<Measurements, ConvergenceError> {
        let (sample, scene, orbit, system) = (&self.sample, self.scene, self.orbit, &self.system);
        let measure = || {
            let (maps, factors) = parallel::join(|| self.maps(progress), || factors.get());
            let (maps, factors) = (maps?, factors?);
            let mut orders: Vec<OrderResult> = maps.iter().map(|map| self.measure(map)).collect();
            self.add_rates(factors, &maps, &mut orders)?;
            self.add_times(&maps, &mut orders, multiply_add_ns);
            Ok::<_, ConvergenceError>(orders)
        };
        let orders = match known {
            Some(orders) => orders,
            None => computed(progress, &[0], measure)?,
        };
        let discontinuity_rates = resumed(progress, &[1], || {
            discontinuity_rates(sample, factors.get()?, system, scene, orbit)
        })?;
        let smooth_rates =
            resumed(progress, &[2], || smooth_rates(sample, factors.get()?, system, scene, orbit))?;
        Ok(Measurements { orders, discontinuity_rates, smooth_rates })
    }

    /// Maps of every pair of orders in every shape.
    fn maps(&self, progress: &dyn Progress) -> Result<Vec<SweptOrders>, ConvergenceError> {
        let tasks: Vec<_> = self
            .highest
            .pairs()
            .flat_map(|orders| self.options.shapes.iter().map(move |&shape| (orders, shape)))
            .collect();
        let map = |(orders, shape)| {
            let map = self.map(orders, shape);
            progress.advance(1);
            map
        };
        parallel::try_map(tasks, map)
    }

    fn map(&self, orders: MapOrders, shape: Shape) -> Result<SweptOrders, ConvergenceError> {
        let local = match shape {
            Shape::Flown => self.family.flown_map(orders)?,
            Shape::Factored | Shape::Composed | Shape::Auto => self.family.map(orders)?,
        };
        let composed = match shape {
            Shape::Composed => Some(self.family.compose(&local)?),
            Shape::Factored | Shape::Flown | Shape::Auto => None,
        };
        let form = Form { map: local, composed };
        Ok(SweptOrders { orders, shape, run: form.lowered(), form })
    }

    /// Error of a map; its rate and times are added later.
    fn measure(&self, map: &SweptOrders) -> OrderResult {
        let orders = map.orders;
        OrderResult {
            orders,
            shape: map.shape,
            error: summarize(&map.run, &self.truth),
            rate: Rate {
                measured: None,
                uncertainty: None,
                expected: f64::from(orders.smooth_order.min(orders.contact_weight) + 1),
                range: None,
            },
            step_ns: 0.0,
            floor_ns: 0.0,
            operations: map.run.frozen_count().total(),
            coefficients: map.form.coefficients(),
        }
    }

    fn add_rates(
        &self,
        factors: &ExactFactors<'_, '_>,
        maps: &[SweptOrders],
        results: &mut [OrderResult],
    ) -> Result<(), ConvergenceError> {
        let expander = self.family.expander();
        let rates =
            ScaledPoints::of_maps(expander, &self.sample, &self.system, self.scene, self.orbit)?;
        let add = |(result, map): (&mut OrderResult, &SweptOrders)| {
            let (evaluation, rounding) = map.evaluation(factors)?;
            result.rate = rates.rate(&evaluation, rounding, map.orders);
            Ok(())
        };
        parallel::try_map(results.iter_mut().zip(maps), add).map(drop)
    }

    /// Times are measured serially: in parallel they would disturb each other.
    fn add_times(&self, maps: &[SweptOrders], results: &mut [OrderResult], multiply_add_ns: f64) {
        for (result, map) in results.iter_mut().zip(maps) {
            result.step_ns = step_ns(&map.run, &self.truth.points[0]);
            result.floor_ns = multiply_add_ns * result.operations as f64;
        }
    }

    fn direct(&self, system: &HybridSystem) -> Result<DirectSummary, ConvergenceError> {
        let mut direct = DirectImage::<f64>::new(system, self.scene, self.orbit)?;
        let (period_ns, error_estimate) = timed_returns(&mut direct, &self.truth, usize::MAX)?;
        Ok(DirectSummary {
            method: match system.method() {
                FlowMethod::ExactAffine => "exact affine flow",
                FlowMethod::Taylor => "Taylor",
            }
            .to_owned(),
            period_ns,
            error_estimate,
        })
    }

    /// Direct simulation by Taylor's method, if the exact flow is available.
    fn direct_by_taylor(&self) -> Result<Option<DirectSummary>, ConvergenceError> {
        if self.system.method() == FlowMethod::Taylor {
            return Ok(None);
        }
        let system = HybridSystem::without_exact_flow(&self.scene.model);
        self.direct(&system).map(Some)
    }
}

/// The map of one pair of orders in one shape.
struct SweptOrders {
    orders: MapOrders,
    shape: Shape,
    form: Form,
    /// The map lowered for running.
    run: HornerMap,
}

impl SweptOrders {
    /// The map with its coefficients as exact as they are known, and their rounding.
    fn evaluation(
        &self,
        factors: &ExactFactors<'_, '_>,
    ) -> Result<(MapEvaluation<Dd>, f64), ConvergenceError> {
        if let Some(composed) = &self.form.composed {
            return Ok((MapEvaluation::composed(composed), f64::ROUNDOFF));
        }
        let exact = match self.shape {
            Shape::Flown => None,
            _ => factors.map(self.orders)?,
        };
        Ok(match exact {
            Some(exact) => (exact, Dd::ROUNDOFF),
            None => (MapEvaluation::new(&self.form.map), f64::ROUNDOFF),
        })
    }
}

/// One method on the Pareto front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// Orders and shape of the map; `None` for direct simulation in double precision.
    pub map: Option<ParetoMap>,
    /// Method of direct simulation; `None` for a map.
    #[serde(default)]
    pub direct: Option<String>,
    /// Nanoseconds of one step, or of one return.
    #[serde(deserialize_with = "crate::analysis::number_or_nan")]
    pub step_ns: f64,
    /// Largest error on the window, against double-double.
    pub error: f64,
}

/// Orders and shape of a map on the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParetoMap {
    /// Truncation orders of the map.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape of the map.
    pub shape: Shape,
}

/// Pareto front, fastest first. Every method of direct simulation comes last, even if beaten.
fn pareto<'d>(
    orders: &[OrderResult],
    direct: impl IntoIterator<Item = &'d DirectSummary>,
) -> Vec<ParetoPoint> {
    let point = |result: &OrderResult| {
        Some(ParetoPoint {
            map: Some(ParetoMap { orders: result.orders, shape: result.shape }),
            direct: None,
            step_ns: result.step_ns,
            error: result.error.max?,
        })
    };
    let mut points: Vec<ParetoPoint> = orders.iter().filter_map(point).collect();
    let speed = |point: &ParetoPoint| (point.step_ns, point.error);
    points.sort_by(|a, b| {
        let ((a_ns, a_error), (b_ns, b_error)) = (speed(a), speed(b));
        a_ns.total_cmp(&b_ns).then(a_error.total_cmp(&b_error))
    });
    let mut best = f64::INFINITY;
    points.retain(|point| {
        let better = point.error < best;
        best = best.min(point.error);
        better
    });
    points.extend(direct.into_iter().map(|direct| ParetoPoint {
        map: None,
        direct: Some(direct.method.clone()),
        step_ns: direct.period_ns,
        error: direct.error_estimate,
    }));
    points
}
