//! The cheapest map for a tolerance.
//!
//! One idea: the cost of a map is known from its coefficients and its error forecast from one expansion of higher order, so
//! that only maps that may be the answer are measured. See docs/mathematics/convergence.md.

use std::collections::BTreeMap;
use std::time::Instant;

use super::ConvergenceError;
use super::candidates::candidates;
use super::data::{Choice, Monomials};
use super::errors::summarize;
use super::family::MapFamily;
use super::form::Form;
use super::sample::WindowSample;
use super::truth::{Truth, truth};
use crate::expansion::{LocalMap, MapOrders};
use crate::hybrid::HybridSystem;
use crate::iteration::HornerMap;
use crate::model::{Scene, Shape};
use crate::orbit::GrazingOrbit;

/// Points by which maps are chosen, beside the corners.
pub(super) const POINTS: usize = 128;

/// Orders of the expansions, until the level after the first at which a map meets the tolerance.
const LEVELS: [MapOrders; 4] = [orders(3, 4), orders(4, 6), orders(6, 8), orders(8, 10)];

/// Maps whose composed form is tried at each level, from the cheapest.
const COMPOSED: usize = 8;

const fn orders(smooth_order: u32, contact_weight: u32) -> MapOrders {
    MapOrders {
        smooth_order,
        contact_weight,
    }
}

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

/// The cheapest map whose error on the window is at most `tolerance`, checked on a thousand fresh points; the
/// most accurate one tried, and [`Choice::met`] `false`, where none is.
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
    let clock = Instant::now();
    let mut bench: Option<Bench<'_>> = None;
    let mut found: Option<Choice> = None;
    let mut nearest: Option<Choice> = None;
    for highest in LEVELS {
        let family = MapFamily::new(scene, orbit, highest)?;
        let bench = match &mut bench {
            Some(bench) => bench,
            None => bench.insert(Bench::new(scene, orbit, options, &family)?),
        };
        let was_found = found.is_some();
        for tried in bench.tried(&family)? {
            let best = if tried.met { &mut found } else { &mut nearest };
            if best.as_ref().is_none_or(|best| tried.beats(best)) {
                *best = Some(tried);
            }
        }
        if was_found {
            break;
        }
    }
    let mut choice = found
        .or(nearest)
        .ok_or(ConvergenceError::NoTruth { tried: 0 })?;
    choice.seconds = clock.elapsed().as_secs_f64();
    Ok(choice)
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
    let family = MapFamily::new(&scene, orbit, choice.orders())?;
    let map = match choice.shape {
        Shape::Flown => family.flown_map(choice.orders())?,
        _ => family.map(choice.orders())?,
    };
    let form = Form::new(&scene, orbit, map, choice.shape)?;
    let run = form.with(choice.monomials, choice.tolerance).lowered();
    Ok((form.map, run))
}

impl Choice {
    /// Cheaper where both meet the tolerance, more accurate where neither does.
    fn beats(&self, other: &Self) -> bool {
        let size = |choice: &Self| {
            let errors = [choice.error, choice.fresh_error];
            errors.into_iter().flatten().fold(f64::NAN, f64::max)
        };
        if self.met {
            (self.operations, self.coefficients) < (other.operations, other.coefficients)
        } else {
            size(self) < size(other) || size(other).is_nan()
        }
    }

    /// The orders as the expansion names them.
    pub fn orders(&self) -> MapOrders {
        orders(self.smooth_order, self.contact_weight)
    }

    /// The scene with the weights chosen: what is expanded at [`orders`](Self::orders).
    pub fn weighted(&self, scene: &Scene) -> Scene {
        weighted(scene, &self.weights)
    }
}

fn weighted(scene: &Scene, weights: &BTreeMap<String, u32>) -> Scene {
    let mut scene = scene.clone();
    let kept = |(name, _): &(String, u32)| !weights.contains_key(name);
    scene.expansion.weights.retain(kept);
    let weights = weights.iter();
    let weights = weights.map(|(name, &weight)| (name.clone(), weight));
    scene.expansion.weights.extend(weights);
    scene
}

/// What every candidate is measured on.
struct Bench<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    options: &'a ChoiceOptions,
    system: HybridSystem,
    sample: WindowSample,
    truth: Truth,
    fresh: Option<Truth>,
}

impl<'a> Bench<'a> {
    fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        options: &'a ChoiceOptions,
        family: &MapFamily<'_>,
    ) -> Result<Self, ConvergenceError> {
        let system = HybridSystem::new(&scene.model);
        let sample = WindowSample::new(&family.map(family.highest())?);
        let points = [sample.corners(), sample.points(0, POINTS)].concat();
        let truth = truth(&system, scene, orbit, points)?;
        if truth.points.is_empty() {
            return Err(ConvergenceError::NoTruth { tried: POINTS });
        }
        Ok(Self {
            scene,
            orbit,
            options,
            system,
            sample,
            truth,
            fresh: None,
        })
    }

    /// Maps of one expansion: of each shape the cheapest that meets the tolerance, and those that failed on the way.
    fn tried(&mut self, family: &MapFamily<'_>) -> Result<Vec<Choice>, ConvergenceError> {
        if self.scene.emit.shape == Shape::Flown {
            return self.tried_flown(family);
        }
        let candidates = candidates(family, &self.truth.points, self.options.tolerance)?;
        let mut tried = Vec::new();
        if self.scene.emit.shape != Shape::Composed {
            for candidate in &candidates {
                tried.push(self.judge(
                    candidate.map(family)?,
                    &candidate.weights,
                    Shape::Factored,
                )?);
                if tried.last().is_some_and(|choice| choice.met) {
                    break;
                }
            }
        }
        if self.scene.emit.shape != Shape::Factored {
            for candidate in candidates.iter().take(COMPOSED) {
                tried.push(self.judge(
                    candidate.map(family)?,
                    &candidate.weights,
                    Shape::Composed,
                )?);
                if tried.last().is_some_and(|choice| choice.met) {
                    break;
                }
            }
        }
        Ok(tried)
    }

    /// Maps with flown contacts, leg degree and contact weight growing together until the tolerance is met: no series
    /// forecasts what their truncation leaves out.
    fn tried_flown(&mut self, family: &MapFamily<'_>) -> Result<Vec<Choice>, ConvergenceError> {
        let highest = family.highest();
        let mut tried = Vec::new();
        for contact_weight in 2..=highest.contact_weight {
            let smooth_order = contact_weight.min(highest.smooth_order);
            let map = family.flown_map(orders(smooth_order, contact_weight))?;
            tried.push(self.judge(map, &BTreeMap::new(), Shape::Flown)?);
            if tried.last().is_some_and(|choice| choice.met) {
                break;
            }
        }
        Ok(tried)
    }

    /// A candidate measured on the sample and, where it holds there, on fresh points: without the monomials that the tolerance
    /// does not need, or else with them.
    fn judge(
        &mut self,
        map: LocalMap,
        weights: &BTreeMap<String, u32>,
        shape: Shape,
    ) -> Result<Choice, ConvergenceError> {
        let (tolerance, orders) = (self.options.tolerance, map.orders);
        let scene = weighted(self.scene, weights);
        let form = Form::new(&scene, self.orbit, map, shape)?;
        let mut last = None;
        for monomials in [Monomials::Needed, Monomials::All] {
            let form = form.with(monomials, tolerance);
            let map = form.lowered();
            let error = summarize(&map, &self.truth).max;
            let within = |error: Option<f64>| error.is_some_and(|error| error <= tolerance);
            let mut choice = Choice {
                tolerance,
                met: false,
                smooth_order: orders.smooth_order,
                contact_weight: orders.contact_weight,
                shape,
                weights: weights.clone(),
                monomials,
                error,
                fresh_error: None,
                fresh_points: 0,
                single_precision_error: None,
                operations: map.frozen_count().total(),
                coefficients: form.coefficients(),
                seconds: 0.0,
            };
            if within(error) {
                let fresh = self.fresh()?;
                choice.fresh_error = summarize(&map, fresh).max;
                choice.fresh_points = fresh.points.len();
                choice.met = within(choice.fresh_error);
                choice.single_precision_error = match shape {
                    Shape::Flown => None,
                    _ => summarize(&form.clone().single().lowered(), fresh).max,
                };
                if choice.met {
                    return Ok(choice);
                }
            }
            last = Some(choice);
        }
        last.ok_or(ConvergenceError::NoTruth { tried: 0 })
    }

    fn fresh(&mut self) -> Result<&Truth, ConvergenceError> {
        let fresh = match self.fresh.take() {
            Some(fresh) => fresh,
            None => {
                let points = self.sample.points(POINTS, self.options.fresh);
                truth(&self.system, self.scene, self.orbit, points)?
            }
        };
        Ok(self.fresh.insert(fresh))
    }
}
