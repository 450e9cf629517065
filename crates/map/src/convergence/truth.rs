//! Exact images by direct simulation in double-double, errors of maps against them, and the times
//! of a map step, of a multiply-add, and of a direct return.

use std::hint::black_box;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::ConvergenceError;
use super::family::{MapFamily, PROBE};
use super::sample::{SamplePoint, WindowSample};
use crate::analysis::{AnalysisError, DirectEnd, DirectImage, SectionImage, products_of_step};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::iteration::{DiscreteMap, HornerMap};
use crate::model::Scene;
use crate::numeric::{Dd, Real, Scalar, converted};
use crate::orbit::GrazingOrbit;

/// Points of a window with their images by direct simulation in double-double, for comparison with
/// any number of maps.
#[derive(Clone, Debug, Default)]
pub struct ExactImages {
    /// Points that can be compared.
    pub(super) points: Vec<SamplePoint>,
    /// Image of each point.
    pub(super) images: Vec<Vec<Dd>>,
    /// Number of points left out.
    pub(super) excluded: usize,
}

impl ExactImages {
    /// Points and their images.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&SamplePoint, &Vec<Dd>)> {
        self.points.iter().zip(&self.images)
    }

    /// Appends points and images.
    pub(super) fn append(&mut self, other: Self) {
        self.points.extend(other.points);
        self.images.extend(other.images);
        self.excluded += other.excluded;
    }
}

/// Work limit of the images of a window, in products of series in double-double: 1 to 4 s on one
/// core, longest if few of the operations are sums or products.
pub(super) const MOST_PRODUCTS: usize = 600_000;
/// Step limit of an image: a multiple of the steps of the grazing orbit's own image, and a number
/// added to it.
const MOST_STEPS: (usize, usize) = (50, 500);
/// Largest number of points simulated before their work is counted.
const MOST_AT_ONCE: usize = 64;

/// Cost of a step in double-double relative to one in `f64`.
const IN_DOUBLE_DOUBLE: usize = 20;

/// Direct simulation in double-double, with a step limit for each image and a count of the work.
#[derive(Clone, Debug)]
pub(super) struct ExactReturns<'a> {
    direct: DirectImage<'a, Dd>,
    rounded: DirectImage<'a, f64>,
    /// Products of series in one step.
    products: usize,
    /// Steps of the grazing orbit's own image.
    own: usize,
    /// Step limit of an image.
    limit: usize,
}

impl<'a> ExactReturns<'a> {
    /// Direct returns of a scene about its grazing orbit.
    ///
    /// # Errors
    ///
    /// As [`DirectImage::new`].
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, AnalysisError> {
        let mut direct = DirectImage::<Dd>::new(system, scene, orbit)?;
        let origin = [direct.dimension(), direct.parameters()].map(|count| vec![Dd::ZERO; count]);
        direct.image(&origin[0], &origin[1])?;
        let own = direct.steps().max(1);
        let limit = MOST_STEPS.0 * own + MOST_STEPS.1;
        direct.set_step_limit(limit);
        let mut rounded = DirectImage::<f64>::new(system, scene, orbit)?;
        rounded.set_step_limit(limit);
        Ok(Self { direct, rounded, products: products_of_step(scene), own, limit })
    }

    /// Stride through a number of points such that images as long as the grazing orbit's own form
    /// at most `most` products.
    pub(super) fn one_of(&self, points: usize, most: usize) -> usize {
        let all = points.saturating_mul(self.own).saturating_mul(self.products);
        all.div_ceil(most).max(1)
    }

    /// Number of points whose images together form at most `most` products, even at the step limit.
    fn at_once(&self, most: usize) -> usize {
        (most / (self.limit * self.products)).clamp(1, MOST_AT_ONCE)
    }

    /// Image of a point, and the products of series that it took.
    pub(super) fn image(
        &mut self,
        point: &SamplePoint,
    ) -> Result<(ExactImage, usize), AnalysisError> {
        let image = image_or_none(&mut self.direct, point)?;
        Ok((image, self.direct.steps() * self.products))
    }

    /// Image of a point by simulation in double precision, `None` if it cannot be compared, and the
    /// work: the number of products of series in double-double that would take as long.
    pub(super) fn rounded_image(
        &mut self,
        point: &SamplePoint,
    ) -> Result<(Option<Vec<Dd>>, usize), AnalysisError> {
        let image = image(&mut self.rounded, point)?;
        let products = self.rounded.steps() * self.products / IN_DOUBLE_DOUBLE;
        Ok((image.map(|image| converted(&image)), products))
    }
}

/// Image of a point by direct simulation.
pub(super) enum ExactImage<S = Dd> {
    /// An image that can be compared.
    Known(Vec<S>),
    /// There is no return, or one with contacts other than those of grazing passages.
    None,
    /// The point is outside the model: a reset leaves the state moving into a surface, as for a
    /// restitution below zero.
    /// It does not count for or against a map.
    Outside,
}

impl<S> ExactImage<S> {
    /// The image, if it can be compared.
    pub(super) fn known(self) -> Option<Vec<S>> {
        match self {
            Self::Known(image) => Some(image),
            Self::None | Self::Outside => None,
        }
    }
}

/// Simulates all points in double-double, in parallel.
pub(super) fn truth(
    system: &HybridSystem,
    scene: &Scene,
    orbit: &GrazingOrbit,
    points: Vec<SamplePoint>,
) -> Result<ExactImages, ConvergenceError> {
    let returns = ExactReturns::new(system, scene, orbit)?;
    let mut truth = ExactImages::default();
    truth.take(simulated(&returns, points))?;
    Ok(truth)
}

impl ExactImages {
    /// Simulates points in parallel. Points without return, or with contacts other than those of
    /// the grazing passages, are left out. If a return takes long, only as many points are used as
    /// can be simulated in a few seconds.
    ///
    /// # Errors
    ///
    /// [`ConvergenceError`] if no point is left, or direct simulation fails.
    pub fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        points: Vec<SamplePoint>,
    ) -> Result<Self, ConvergenceError> {
        let system = HybridSystem::new(&scene.model);
        let returns = ExactReturns::new(&system, scene, orbit)?;
        let one_of = returns.one_of(points.len(), MOST_PRODUCTS);
        let mut points = points.into_iter().step_by(one_of);
        let at_once = returns.at_once(MOST_PRODUCTS);
        // If `at_once` is 1, every core simulates a point; points beyond the limit are not used.
        let side_by_side = at_once.max(parallel::threads());
        let (mut truth, mut spent) = (Self::default(), 0);
        while spent < MOST_PRODUCTS {
            let next: Vec<_> = points.by_ref().take(side_by_side).collect();
            if next.is_empty() {
                break;
            }
            let mut next = simulated(&returns, next).into_iter().peekable();
            while spent < MOST_PRODUCTS && next.peek().is_some() {
                spent += truth.take(next.by_ref().take(at_once))?;
            }
        }
        if truth.points.is_empty() {
            return Err(ConvergenceError::NoTruth { tried: truth.excluded });
        }
        Ok(truth)
    }

    /// Adds simulated points; returns the products of series that they took.
    fn take(
        &mut self,
        simulated: impl IntoIterator<Item = Simulated>,
    ) -> Result<usize, ConvergenceError> {
        let mut products = 0;
        for (point, image) in simulated {
            let (image, took) = image?;
            products += took;
            match image {
                ExactImage::Known(image) => {
                    self.points.push(point);
                    self.images.push(image);
                }
                ExactImage::None => self.excluded += 1,
                ExactImage::Outside => {}
            }
        }
        Ok(products)
    }
}

/// A point with its image, and the products of series that the image took.
type Simulated = (SamplePoint, Result<(ExactImage, usize), AnalysisError>);

/// Simulates points in parallel; the results are in their order.
fn simulated(returns: &ExactReturns<'_>, points: Vec<SamplePoint>) -> Vec<Simulated> {
    let simulate = |returns: &mut ExactReturns<'_>, point| {
        let image = returns.image(&point);
        (point, image)
    };
    parallel::map_with(points, || returns.clone(), simulate)
}

/// Image of a point, if the orbit returns without contacts other than those of grazing passages.
///
/// A point without any contact counts too: a map with a contact there has an error as large as its
/// kick.
pub(super) fn image<S: Real>(
    direct: &mut DirectImage<'_, S>,
    point: &SamplePoint,
) -> Result<Option<Vec<S>>, AnalysisError> {
    Ok(image_or_none(direct, point)?.known())
}

/// Whether an image is outside the model: a reset leaves the state moving into a rigid surface by
/// more than rounding, however little.
///
/// NOTE: the simulator ends such a return only where the share is large; below, the state slides
/// through the surface, where a restitution of zero keeps it.
fn is_outside<S: Real>(image: &SectionImage<S>) -> bool {
    image.end == DirectEnd::GoesThrough || image.passed > S::from_f64(S::ROUNDOFF.sqrt())
}

/// Image of a point, or the reason why there is none.
fn image_or_none<S: Real>(
    direct: &mut DirectImage<'_, S>,
    point: &SamplePoint,
) -> Result<ExactImage<S>, AnalysisError> {
    // NOTE: a return after another number of periods is no image of the map.
    let image = direct.lifted_image(&converted(&point.state), &converted(&point.parameters))?;
    Ok(match image.end {
        _ if is_outside(&image) => ExactImage::Outside,
        DirectEnd::Returned if image.extra_contacts == 0 => ExactImage::Known(image.offsets),
        _ => ExactImage::None,
    })
}

/// Whether the order of a map can be measured at an image: it has contacts, all of them at
/// passages.
pub(super) fn tells_order<S>(image: &SectionImage<S>) -> bool {
    image.end == DirectEnd::Returned && image.contacts > 0 && image.extra_contacts == 0
}

/// Nanoseconds of a direct return in double precision, and its largest error, over at most the
/// first `most` points of a sample.
///
/// NOTE: the preparation of a simulator for new parameters is not part of the time, as for a map
/// with frozen parameters.
pub(super) fn timed_returns(
    direct: &mut DirectImage<'_, f64>,
    truth: &ExactImages,
    most: usize,
) -> Result<(f64, f64), AnalysisError> {
    let mut worst: f64 = 0.0;
    let mut seconds = 0.0;
    for (point, exact) in truth.pairs().take(most) {
        // An orbit that goes elsewhere in double precision is an error as large as the kick.
        image(direct, point)?;
        let start = Instant::now();
        let found = image(direct, point)?;
        seconds += start.elapsed().as_secs_f64();
        let found = found.unwrap_or_else(|| vec![0.0; exact.len()]);
        worst = worst.max(distance(&converted(&found), exact));
    }
    let period = 1e9 * seconds / truth.points.len().min(most).max(1) as f64;
    Ok((period, worst))
}

/// Largest difference of a coordinate; NaN if a coordinate is NaN.
pub(super) fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    let difference = |(&a, &b): (&Dd, &Dd)| (a - b).to_f64().abs();
    a.iter().zip(b).map(difference).fold(0.0, nan_or_larger)
}

/// The larger of two numbers; NaN if one of them is NaN.
pub(super) fn nan_or_larger(largest: f64, value: f64) -> f64 {
    if largest.is_nan() || value <= largest { largest } else { value }
}

/// Numbers of points at which errors were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleSummary {
    /// Number of points compared.
    pub points: usize,
    /// Number of points left out: no image, or contacts other than those of the grazing passages.
    pub excluded: usize,
}

/// Errors over a sample; `null` if a map has no finite image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// Largest error.
    pub max: Option<f64>,
    /// Median error.
    pub median: Option<f64>,
}

impl ErrorSummary {
    /// Whether every image was finite and no error is above a tolerance.
    pub fn is_within(&self, tolerance: f64) -> bool {
        self.max.is_some_and(|error| error <= tolerance)
    }
}

/// Largest and median error of a map; `None` if an image is not finite.
pub(super) fn summarize(map: &dyn DiscreteMap, truth: &ExactImages) -> ErrorSummary {
    let mut errors = truth.errors(map);
    errors.sort_by(f64::total_cmp);
    let finite = |value: Option<&f64>| value.copied().filter(|value| value.is_finite());
    ErrorSummary { max: finite(errors.last()), median: finite(errors.get(errors.len() / 2)) }
}

/// Largest error of a coordinate at one point; not finite if the map has no image.
pub(super) fn error(map: &dyn DiscreteMap, point: &SamplePoint, truth: &[Dd]) -> f64 {
    errors(map, point, truth).into_iter().fold(0.0, nan_or_larger)
}

/// Error of each coordinate at one point; not finite if the map has no image.
pub(super) fn errors(map: &dyn DiscreteMap, point: &SamplePoint, truth: &[Dd]) -> Vec<f64> {
    let pairs = image_of(map, point).into_iter().zip(truth);
    pairs.map(|(value, &exact)| (Dd::from(value) - exact).to_f64().abs()).collect()
}

fn image_of(map: &dyn DiscreteMap, point: &SamplePoint) -> Vec<f64> {
    let mut image = vec![0.0; map.dimension()];
    map.step(&point.state, &point.parameters, &mut image);
    image
}

/// Changes of a map's image, by coordinate, as each offset of a point moves by [`LAST_PLACES`] of
/// its own: errors that no map in double precision is without.
///
/// NOTE: next to a contact in the wake of another one, the depth is a difference of far larger
/// numbers, and its root moves by far more than its rounding.
pub(super) fn rounding_of(map: &dyn DiscreteMap, point: &SamplePoint) -> Vec<f64> {
    let here = image_of(map, point);
    let mut changes = vec![0.0; here.len()];
    let mut moved = point.clone();
    let count = point.state.len() + point.parameters.len();
    for place in 0..count {
        for side in [-LAST_PLACES, LAST_PLACES] {
            moved.clone_from(point);
            let mut offsets = moved.state.iter_mut().chain(&mut moved.parameters);
            if let Some(offset) = offsets.nth(place) {
                *offset *= 1.0 + side * f64::EPSILON;
            }
            let there = image_of(map, &moved);
            for ((change, there), here) in changes.iter_mut().zip(there).zip(&here) {
                *change += (there - here).abs();
            }
        }
    }
    changes
}

/// Number of last places by which sums of the offsets of a point may be rounded.
const LAST_PLACES: f64 = 2.0;

/// Number of rounds; the fastest counts.
const ROUNDS: usize = 5;

/// Window of a map, with depths from an expansion of orders high enough to know them.
pub(super) fn window_sample(
    scene: &Scene,
    orbit: &GrazingOrbit,
    local: &LocalMap,
) -> Result<WindowSample, ConvergenceError> {
    let orders = local.orders;
    if orders.reaches(PROBE) && local.fitted_to.is_none() {
        return Ok(WindowSample::new(local));
    }
    let orders = orders.max(PROBE);
    let map = MapFamily::new(scene, orbit, orders)?.map(orders)?;
    Ok(WindowSample::new(&map))
}

impl ExactImages {
    /// Number of points, and number of points left out.
    pub fn summary(&self) -> SampleSummary {
        SampleSummary { points: self.points.len(), excluded: self.excluded }
    }

    /// Points that have images.
    pub fn points(&self) -> &[SamplePoint] {
        &self.points
    }

    /// Largest error of a coordinate of a map at each point; not finite if the map has no image.
    pub fn errors(&self, map: &dyn DiscreteMap) -> Vec<f64> {
        self.pairs().map(|(point, image)| error(map, point, image)).collect()
    }

    /// Nanoseconds of a return by direct simulation in double precision, run serially over the
    /// first points, the fastest of five rounds; and the largest error there.
    ///
    /// # Errors
    ///
    /// [`ConvergenceError`] if direct simulation fails.
    pub fn direct(
        &self,
        scene: &Scene,
        orbit: &GrazingOrbit,
        points: usize,
    ) -> Result<(f64, f64), ConvergenceError> {
        let system = HybridSystem::new(&scene.model);
        let mut direct = DirectImage::<f64>::new(&system, scene, orbit)?;
        let mut best = timed_returns(&mut direct, self, points)?;
        for _ in 1..ROUNDS {
            let (period_ns, error) = timed_returns(&mut direct, self, points)?;
            best = (best.0.min(period_ns), error);
        }
        Ok(best)
    }
}

/// Number of runs; the median counts.
const RUNS: usize = 5;

/// Number of steps in one run.
const STEPS: usize = 500;

/// Number of multiply-adds in one run.
const MULTIPLY_ADDS: usize = 400_000;

/// Number of independent chains of multiply-adds: enough to fill the units.
const CHAINS: usize = 16;

/// Median time of `work` over a few runs, in nanoseconds per unit.
fn median_ns(units: usize, mut work: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            work();
            1e9 * start.elapsed().as_secs_f64() / units as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

/// Nanoseconds of one step of a map with its parameters frozen, at a point; the median of five
/// runs.
pub fn step_ns(map: &HornerMap, point: &SamplePoint) -> f64 {
    let frozen = map.freeze(&point.parameters);
    let mut image = vec![0.0; frozen.dimension()];
    median_ns(STEPS, || {
        for _ in 0..STEPS {
            frozen.step(black_box(&point.state), &[], &mut image);
            black_box(&mut image);
        }
    })
}

/// Nanoseconds of one multiply-add in double precision, with sixteen chains of them in flight; the
/// median of five runs.
pub fn multiply_add_ns() -> f64 {
    let factor = black_box(0.999_999);
    median_ns(MULTIPLY_ADDS, || {
        let mut sums = [1.0f64; CHAINS];
        for _ in 0..MULTIPLY_ADDS / CHAINS {
            for sum in &mut sums {
                *sum = Scalar::mul_add(*sum, factor, 1e-6);
            }
        }
        black_box(sums);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_that_is_not_a_number_makes_the_distance_none() {
        let at = |values: [f64; 2]| values.map(Dd::from);
        assert_eq!(distance(&at([1.0, 2.0]), &at([1.5, 2.25])), 0.5);
        assert!(distance(&at([f64::NAN, 2.0]), &at([1.5, 2.25])).is_nan());
        assert!(distance(&at([1.0, f64::NAN]), &at([1.5, 2.25])).is_nan());
    }
}
