//! The study: one expansion, one sample, one truth, and every pair of orders measured on it.

use rayon::prelude::*;

use super::accuracy::{DepthAccuracy, depth_accuracy};
use super::choice::{ChoiceOptions, choose, chosen_map};
use super::data::{
    Choice, ConvergenceStudy, DirectSummary, ErrorSummary, OrderResult, Rate, SampleSummary,
};
use super::errors::summarize;
use super::pareto::pareto;
use super::rates::{ExactFactors, MapRates, discontinuity_rates, smooth_rates};
use super::sample::WindowSample;
use super::sections::choose_sections;
use super::truth::{Truth, truth};
use super::validity::validity;
use super::{ConvergenceError, MapFamily, timing};
use crate::analysis::{DirectImage, MapEvaluation, Progress};
use crate::expansion::{LocalMap, MapOrders, WindowEdge};
use crate::hybrid::{FlowMethod, HybridSystem};
use crate::iteration::{DiscreteMap, HornerMap};
use crate::model::{Orders, Scene, Shape};
use crate::numeric::{Dd, Scalar};
use crate::orbit::GrazingOrbit;

/// Tolerance where the scene names none.
const TOLERANCE: f64 = 1e-8;

/// Highest degree and weight of the factors whose rates are measured.
const RATES: MapOrders = MapOrders::new(6, 8);

/// What a study measures.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvergenceOptions {
    /// Highest degree of `P_smooth` and weight of `D`: all lower ones are swept; `None` for a
    /// degree and two weights beyond the chosen ones.
    pub highest: Option<MapOrders>,
    /// Shapes swept.
    pub shapes: Vec<Shape>,
    /// Points of the window.
    pub points: usize,
    /// Tolerance for which a map is chosen, in the units of the offsets.
    pub tolerance: f64,
    /// Fresh points on which the chosen map has to hold.
    pub fresh: usize,
    /// Whether maps of other sections are chosen too.
    pub sections: bool,
    /// The map chosen for the tolerance on so many fresh points, where it is known already.
    pub chosen: Option<Choice>,
    /// Highest weight of `D` whose rate is measured (its coefficients in double-double).
    pub discontinuity_rates: u32,
    /// Highest degree of `P_smooth` whose rate is measured (its coefficients in double-double, by
    /// Taylor's method: seconds at degree 6 for a nonlinear field).
    pub smooth_rates: u32,
}

impl ConvergenceOptions {
    /// A scene's orders and a little beyond, its tolerance or `1e-8`; both shapes of series, or the
    /// flown one where the scene asks for it.
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

/// A degree and two weights more: where the next orders of both factors lead.
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
    let choice = ChoiceOptions {
        tolerance: options.tolerance,
        fresh: options.fresh,
    };
    let chosen = match &options.chosen {
        Some(chosen) => chosen.clone(),
        None => choose(scene, orbit, &choice)?,
    };
    let highest = options.highest.unwrap_or_else(|| beyond(chosen.orders));
    let sweep = Sweep::new(scene, orbit, options, highest, progress)?;
    let mut orders = sweep.errors(progress)?;
    let rate_orders = MapOrders::new(options.smooth_rates, options.discontinuity_rates);
    let rate_orders = rate_orders.min(highest);
    let factors = ExactFactors::new(sweep.family.expander(), rate_orders)?;
    sweep.add_rates(&factors, &mut orders)?;
    let multiply_add_ns = timing::multiply_add_ns();
    sweep.add_times(&mut orders, multiply_add_ns)?;
    let (local, map) = chosen_map(&chosen, scene, orbit)?;
    let map = map.in_format(chosen.precision);
    let direct = sweep.direct(&sweep.system)?;
    let direct_by_taylor = sweep.direct_by_taylor()?;
    let sections = match options.sections {
        true => choose_sections(scene, orbit, &choice, &chosen)?,
        false => Vec::new(),
    };
    Ok(ConvergenceStudy {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        sample: SampleSummary {
            points: sweep.truth.points.len(),
            excluded: sweep.truth.excluded,
        },
        discontinuity_rates: discontinuity_rates(
            &sweep.sample,
            &factors,
            &sweep.system,
            scene,
            orbit,
        )?,
        smooth_rates: smooth_rates(&sweep.sample, &factors, &sweep.system, scene, orbit)?,
        window_edges: window_edges(&sweep.family, &chosen)?,
        validity: validity(scene, orbit, &local, &*map, options.tolerance)?,
        accuracy: sweep.accuracy(&*map)?,
        pareto: pareto(&orders, direct_by_taylor.iter().chain([&direct])),
        chosen,
        sections,
        direct,
        direct_by_taylor,
        multiply_add_ns,
        orders,
    })
}

/// What the contacts of a chosen map leave out at the edge of the window.
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

/// One study under way.
pub(super) struct Sweep<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    options: ConvergenceOptions,
    highest: MapOrders,
    system: HybridSystem,
    family: MapFamily<'a>,
    sample: WindowSample,
    truth: Truth,
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
            return Err(ConvergenceError::NoTruth {
                tried: options.points,
            });
        }
        Ok(Self {
            scene,
            orbit,
            options: options.clone(),
            highest,
            system,
            family,
            sample,
            truth,
        })
    }

    /// Errors of every map; rates and times are still to come.
    pub(super) fn errors(
        &self,
        progress: &dyn Progress,
    ) -> Result<Vec<OrderResult>, ConvergenceError> {
        let highest = self.highest;
        let tasks: Vec<_> = highest
            .pairs()
            .flat_map(|orders| {
                self.options
                    .shapes
                    .iter()
                    .map(move |&shape| (orders, shape))
            })
            .collect();
        let measure = |(orders, shape)| {
            let result = self.measure(orders, shape);
            progress.advance(1);
            result
        };
        tasks.into_par_iter().map(measure).collect()
    }

    fn measure(&self, orders: MapOrders, shape: Shape) -> Result<OrderResult, ConvergenceError> {
        let lowered = self.lowered(orders, shape)?;
        Ok(OrderResult {
            orders,
            shape,
            error: summarize(&lowered, &self.truth),
            rate: Rate {
                measured: None,
                uncertainty: None,
                expected: f64::from(orders.smooth_order.min(orders.contact_weight) + 1),
                range: None,
            },
            step_ns: 0.0,
            floor_ns: 0.0,
            operations: lowered.frozen_count().total(),
            coefficients: self.coefficients(orders, shape)?,
        })
    }

    /// The map as it is run.
    pub(super) fn lowered(
        &self,
        orders: MapOrders,
        shape: Shape,
    ) -> Result<HornerMap, ConvergenceError> {
        let map = self.map(orders, shape)?;
        Ok(match shape {
            Shape::Composed => HornerMap::composed(&map, &self.family.compose(&map)?),
            Shape::Factored | Shape::Flown | Shape::Auto => HornerMap::new(&map),
        })
    }

    /// The map stage by stage.
    fn map(&self, orders: MapOrders, shape: Shape) -> Result<LocalMap, ConvergenceError> {
        Ok(match shape {
            Shape::Flown => self.family.flown_map(orders)?,
            Shape::Factored | Shape::Composed | Shape::Auto => self.family.map(orders)?,
        })
    }

    fn coefficients(&self, orders: MapOrders, shape: Shape) -> Result<usize, ConvergenceError> {
        let map = self.map(orders, shape)?;
        Ok(match shape {
            Shape::Composed => self.family.compose(&map)?.coefficients(),
            Shape::Factored | Shape::Flown | Shape::Auto => map.coefficients(),
        })
    }

    fn add_rates(
        &self,
        factors: &ExactFactors<'_, '_>,
        orders: &mut [OrderResult],
    ) -> Result<(), ConvergenceError> {
        let expander = self.family.expander();
        let rates = MapRates::new(expander, &self.sample, &self.system, self.scene, self.orbit)?;
        orders.par_iter_mut().try_for_each(|result| {
            let (map, rounding) = self.evaluation(factors, result)?;
            result.rate = rates.rate(&map, rounding, result.orders);
            Ok(())
        })
    }

    /// A map with its coefficients as exactly as they are known, and their rounding.
    fn evaluation(
        &self,
        factors: &ExactFactors<'_, '_>,
        result: &OrderResult,
    ) -> Result<(MapEvaluation<Dd>, f64), ConvergenceError> {
        let orders = result.orders;
        match result.shape {
            Shape::Composed => {
                let composed = self.family.compose(&self.family.map(orders)?)?;
                return Ok((MapEvaluation::composed(&composed), f64::ROUNDOFF));
            }
            Shape::Flown => {
                let map = self.family.flown_map(orders)?;
                return Ok((MapEvaluation::new(&map), f64::ROUNDOFF));
            }
            Shape::Factored | Shape::Auto => {}
        }
        Ok(match factors.map(orders)? {
            Some(map) => (map, Dd::ROUNDOFF),
            None => (MapEvaluation::new(&self.family.map(orders)?), f64::ROUNDOFF),
        })
    }

    /// Times are taken one after another: side by side they would disturb each other.
    fn add_times(
        &self,
        orders: &mut [OrderResult],
        multiply_add_ns: f64,
    ) -> Result<(), ConvergenceError> {
        for result in orders {
            let map = self.lowered(result.orders, result.shape)?;
            result.step_ns = timing::step_ns(&map, &self.truth.points[0]);
            result.floor_ns = multiply_add_ns * result.operations as f64;
        }
        Ok(())
    }

    fn accuracy(&self, map: &dyn DiscreteMap) -> Result<DepthAccuracy, ConvergenceError> {
        depth_accuracy(&self.system, self.scene, self.orbit, &self.sample, map)
    }

    fn direct(&self, system: &HybridSystem) -> Result<DirectSummary, ConvergenceError> {
        let mut direct = DirectImage::<f64>::new(system, self.scene, self.orbit)?;
        let (period_ns, error_estimate) = timing::direct(&mut direct, &self.truth)?;
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

    /// Direct simulation without the exact flow, where there is one.
    fn direct_by_taylor(&self) -> Result<Option<DirectSummary>, ConvergenceError> {
        if self.system.method() == FlowMethod::Taylor {
            return Ok(None);
        }
        let system = HybridSystem::without_exact_flow(&self.scene.model);
        self.direct(&system).map(Some)
    }
}

impl ErrorSummary {
    /// Whether every image was finite and no error above this.
    pub fn is_within(&self, tolerance: f64) -> bool {
        self.max.is_some_and(|error| error <= tolerance)
    }
}
