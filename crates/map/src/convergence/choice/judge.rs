//! Candidates for a tolerance, measured on a sample and, if they meet it there, on fresh points.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::candidates::{Candidate, Level};
use super::data::{Choice, Form, Monomials, Polynomials, weighted};
use super::next_depth::{LeastOrders, NextDepth};
use crate::analysis::{NoProgress, Progress, place_of};
use crate::convergence::sample::{SamplePoint, WindowSample};
use crate::convergence::truth::{ExactImages, summarize, truth};
use crate::convergence::{ConvergenceError, resumed};
use crate::expansion::{LocalMap, prune};
use crate::hybrid::HybridSystem;
use crate::model::{Scene, Shape};
use crate::numeric::FloatFormat;
use crate::orbit::GrazingOrbit;

/// Number of points by which maps are chosen, in addition to the corners.
const POINTS: usize = 128;

/// Number of points for forecasts, from the sample and from the joint points each.
const FORECAST_POINTS: usize = 24;

/// Multiples of the tolerance that are tried, largest first: monomials are dropped as long as the
/// sum of their bounds on the window is within a tenth of the multiple. Multiples above 1 are
/// tried because the bounds are rarely reached; the error is measured.
const DROPS: [f64; 6] = [300.0, 100.0, 30.0, 10.0, 3.0, 1.0];

/// Data on which every candidate is measured.
pub(super) struct Bench<'a> {
    pub(super) scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    system: HybridSystem,
    /// Sample of the window.
    pub(super) sample: WindowSample,
    truth: ExactImages,
    /// Points at which truncation is forecast: the first of the sample and of the joint points.
    pub(super) forecast_points: Vec<SamplePoint>,
    /// Required effect on the next depth, if `xi_1` is near 0 on the window.
    next_depth: Option<NextDepth>,
    fresh_points: Vec<SamplePoint>,
    fresh: Option<ExactImages>,
    /// Store for measurements of candidates, including those that an earlier run kept.
    pub(super) progress: &'a dyn Progress,
}

/// Candidates for one tolerance, in one precision: the cheapest that meets it, and the nearest of
/// the others.
#[derive(Debug)]
pub(super) struct Trial {
    pub(super) tolerance: f64,
    /// Precision in which candidates run and are judged.
    pub(super) precision: FloatFormat,
    found: Option<Choice>,
    nearest: Option<Choice>,
    /// A candidate within the tolerance with a wrong effect on the next depth; returned only if
    /// there is no other.
    misleading: Option<Choice>,
}

/// A measured candidate.
#[derive(Debug, Serialize, Deserialize)]
struct MeasuredCandidate {
    choice: Choice,
    /// Whether the candidate is within the tolerance but has a wrong effect on the next depth.
    misleads: bool,
}

impl Trial {
    pub(super) fn new(tolerance: f64, precision: FloatFormat) -> Self {
        Self { tolerance, precision, found: None, nearest: None, misleading: None }
    }

    /// Enters a candidate and its versions with monomials dropped; returns whether the whole
    /// candidate meets the tolerance.
    fn enter(&mut self, measured: Vec<MeasuredCandidate>) -> bool {
        let met = measured.first().is_some_and(|first| first.choice.met);
        for MeasuredCandidate { choice, misleads } in measured {
            match misleads {
                // Such a candidate may not be chosen at any error.
                true => self.misleading = Some(choice),
                false => self.add(choice),
            }
        }
        met
    }

    pub(super) fn add(&mut self, choice: Choice) {
        let best = if choice.met { &mut self.found } else { &mut self.nearest };
        if best.as_ref().is_none_or(|best| choice.beats(best)) {
            *best = Some(choice);
        }
    }

    pub(super) fn found(&self) -> Option<&Choice> {
        self.found.as_ref()
    }

    /// Error of the nearest candidate that fails.
    pub(super) fn nearest_error(&self) -> f64 {
        self.nearest.as_ref().map_or(f64::INFINITY, Choice::size)
    }

    pub(super) fn best(self) -> Option<Choice> {
        self.found.or(self.nearest).or(self.misleading)
    }
}

impl Choice {
    /// Whether this choice is cheaper, if both meet the tolerance, or more accurate, if neither
    /// does.
    fn beats(&self, other: &Self) -> bool {
        if self.met {
            (self.operations, self.coefficients) < (other.operations, other.coefficients)
        } else {
            self.size() < other.size()
        }
    }

    /// Largest error measured; infinite if an image was not finite.
    fn size(&self) -> f64 {
        let errors = [self.error, self.fresh_error].into_iter().flatten();
        let largest = errors.fold(f64::NAN, f64::max);
        if largest.is_nan() { f64::INFINITY } else { largest }
    }
}

impl<'a> Bench<'a> {
    /// Simulates the points that maps are chosen by. `map` has the window; `fresh` is the number of
    /// points on which a map also has to meet the tolerance.
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &LocalMap,
        fresh: usize,
    ) -> Result<Self, ConvergenceError> {
        let system = HybridSystem::new(&scene.model);
        let sample = WindowSample::new(map);
        let even = [sample.corners(), sample.points(0, POINTS)].concat();
        let joint = [sample.joint_corners(), sample.joint_points(0, POINTS)].concat();
        let joint = truth(&system, scene, orbit, joint)?;
        let mut truth = truth(&system, scene, orbit, even)?;
        if truth.points.is_empty() {
            return Err(ConvergenceError::NoTruth { tried: POINTS });
        }
        let first =
            |truth: &ExactImages| truth.points.iter().take(FORECAST_POINTS).cloned().collect();
        let forecast_points: [Vec<SamplePoint>; 2] = [first(&truth), first(&joint)];
        truth.append(joint);
        Ok(Self {
            scene,
            orbit,
            system,
            next_depth: NextDepth::new(map, &sample),
            fresh_points: sample.fresh(POINTS, fresh),
            sample,
            truth,
            forecast_points: forecast_points.concat(),
            fresh: None,
            progress: &NoProgress,
        })
    }

    /// Lowest orders that may be chosen, if there is such a limit.
    pub(super) fn least_orders(&self) -> Option<LeastOrders> {
        self.next_depth.as_ref().map(|next| next.least)
    }

    /// Bound on the rounding error of an image.
    pub(super) fn rounding(&self, precision: FloatFormat) -> f64 {
        let offsets = self.truth.images.iter().flatten();
        let largest = offsets.map(|offset| offset.to_f64().abs()).fold(0.0, f64::max);
        2.0 * precision.roundoff() * largest
    }

    /// Measures a candidate with as few monomials as the tolerance needs; returns whether it meets
    /// the tolerance.
    pub(super) fn judge(
        &mut self,
        level: &Level<'_>,
        candidate: &Candidate,
        shape: Shape,
        polynomials: Polynomials,
        trial: &mut Trial,
    ) -> Result<bool, ConvergenceError> {
        let (tolerance, precision) = (trial.tolerance, trial.precision);
        let of = (level.family.highest(), candidate.orders, &candidate.weights);
        let place = place_of(0, &(tolerance, precision, of, shape, polynomials));
        let progress = self.progress;
        let measured = resumed(progress, &place, || {
            self.measured(level, candidate, shape, polynomials, (tolerance, precision))
        });
        Ok(trial.enter(measured?))
    }

    /// Measurements for [`judge`](Self::judge).
    fn measured(
        &mut self,
        level: &Level<'_>,
        candidate: &Candidate,
        shape: Shape,
        polynomials: Polynomials,
        aim: (f64, FloatFormat),
    ) -> Result<Vec<MeasuredCandidate>, ConvergenceError> {
        let map = candidate.map(&level.family)?;
        let scene = weighted(self.scene, &candidate.weights);
        let economiser = match polynomials {
            Polynomials::Taylor => None,
            Polynomials::Economised => match level.economiser() {
                Some(economiser) => Some(economiser),
                None => return Ok(Vec::new()),
            },
        };
        let fitted = |map: LocalMap| match economiser {
            Some(economiser) => economiser.economise(map),
            None => map,
        };
        // Coefficients of a factored map are fitted to the remaining monomials.
        let first = economiser.is_some() && shape != Shape::Composed;
        let whole = Form::new(&scene, self.orbit, fitted(map.clone()), shape)?;
        let pruned = |error: f64| match first {
            true => Form::new(&scene, self.orbit, fitted(prune(&map, error).0), shape),
            false => Ok(whole.without(Some(error))),
        };
        self.fewest(&whole, pruned, (&candidate.weights, shape), aim)
    }

    /// Measures a map with flown contacts, with as few monomials of its legs as the tolerance
    /// needs.
    pub(super) fn judge_flown(
        &mut self,
        map: LocalMap,
        trial: &mut Trial,
    ) -> Result<bool, ConvergenceError> {
        let whole = Form::new(self.scene, self.orbit, map, Shape::Flown)?;
        let pruned = |error: f64| Ok(whole.without(Some(error)));
        let aim = (trial.tolerance, trial.precision);
        let measured = self.fewest(&whole, pruned, (&BTreeMap::new(), Shape::Flown), aim)?;
        Ok(trial.enter(measured))
    }

    /// Measures a map and, if it meets the tolerance, versions with increasing numbers of monomials
    /// until one meets it, which then has the fewest.
    fn fewest(
        &mut self,
        whole: &Form,
        pruned: impl Fn(f64) -> Result<Form, ConvergenceError>,
        what: (&BTreeMap<String, u32>, Shape),
        aim: (f64, FloatFormat),
    ) -> Result<Vec<MeasuredCandidate>, ConvergenceError> {
        let first = self.measure(whole, what, None, aim)?;
        let met = first.choice.met;
        let mut measured = vec![first];
        for times in DROPS.iter().filter(|_| met) {
            let error = times * aim.0;
            let fewer = self.measure(&pruned(error)?, what, Some(error), aim)?;
            let met = fewer.choice.met;
            measured.push(fewer);
            if met {
                break;
            }
        }
        Ok(measured)
    }

    /// Measures one map on the sample and, if it meets the tolerance there, on fresh points.
    fn measure(
        &mut self,
        form: &Form,
        (weights, shape): (&BTreeMap<String, u32>, Shape),
        drop_within: Option<f64>,
        (tolerance, precision): (f64, FloatFormat),
    ) -> Result<MeasuredCandidate, ConvergenceError> {
        let lowered = form.lowered();
        let map = lowered.in_format(precision);
        let error = summarize(&*map, &self.truth).max;
        let within = |error: Option<f64>| error.is_some_and(|error| error <= tolerance);
        let (orders, fitted_to) = (form.map.orders, form.map.fitted_to);
        let mut choice = Choice {
            tolerance,
            met: false,
            precision,
            orders,
            shape,
            weights: weights.clone(),
            monomials: drop_within.map_or(Monomials::All, |_| Monomials::Needed),
            drop_within,
            polynomials: fitted_to.map_or(Polynomials::Taylor, |_| Polynomials::Economised),
            fitted_to,
            error,
            fresh_error: None,
            fresh_points: 0,
            single_precision_error: None,
            operations: lowered.frozen_count().total(),
            coefficients: form.coefficients(),
            predicted: orders,
            least_orders: self.least_orders(),
            limit: None,
            seconds: 0.0,
        };
        if within(error) {
            let fresh = self.fresh()?;
            choice.fresh_error = summarize(&*map, fresh).max;
            choice.fresh_points = fresh.points.len();
            choice.met = within(choice.fresh_error);
            let told = choice.met && shape != Shape::Flown && precision == FloatFormat::F64;
            if told {
                choice.single_precision_error = summarize(&lowered.in_single(), fresh).max;
            }
        }
        let next = self.next_depth.as_ref().filter(|_| choice.met);
        let misleads = next.is_some_and(|next| !next.keeps(&*map));
        choice.met &= !misleads;
        Ok(MeasuredCandidate { choice, misleads })
    }

    fn fresh(&mut self) -> Result<&ExactImages, ConvergenceError> {
        let fresh = match self.fresh.take() {
            Some(fresh) => fresh,
            None => {
                let points = std::mem::take(&mut self.fresh_points);
                truth(&self.system, self.scene, self.orbit, points)?
            }
        };
        Ok(self.fresh.insert(fresh))
    }
}
