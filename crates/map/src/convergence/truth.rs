//! Images by direct simulation in double-double, the errors of maps against them, and times of a
//! map step, of a multiply-add, of a direct return.

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

/// Points of a window with their images by direct simulation in double-double, to compare any
/// number of maps with.
#[derive(Clone, Debug, Default)]
pub struct ExactImages {
    /// Points that can be compared.
    pub(super) points: Vec<SamplePoint>,
    /// Their images.
    pub(super) images: Vec<Vec<Dd>>,
    /// Points left out.
    pub(super) excluded: usize,
}

impl ExactImages {
    /// Points and their images.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&SamplePoint, &Vec<Dd>)> {
        self.points.iter().zip(&self.images)
    }

    /// Takes in further points.
    pub(super) fn append(&mut self, other: Self) {
        self.points.extend(other.points);
        self.images.extend(other.images);
        self.excluded += other.excluded;
    }
}

/// Most products of series in double-double that the images of a window form: 1 to 4 s on one core,
/// the longest where few of the operations are sums or products.
pub(super) const MOST_PRODUCTS: usize = 600_000;
/// Most steps of an image, in those of the grazing orbit's own and beside them.
const MOST_STEPS: (usize, usize) = (50, 500);
/// Most points whose images are made before what they took is looked at.
const MOST_AT_ONCE: usize = 64;

/// What a step in double-double costs beside one in `f64`.
const IN_DOUBLE_DOUBLE: usize = 20;

/// Direct simulation in double-double whose images take a limited number of steps, and what they
/// cost.
#[derive(Clone, Debug)]
pub(super) struct ExactReturns<'a> {
    direct: DirectImage<'a, Dd>,
    rounded: DirectImage<'a, f64>,
    /// Products of series in a step.
    products: usize,
    /// Steps of the grazing orbit's own image.
    own: usize,
    /// Most steps of an image.
    limit: usize,
}

impl<'a> ExactReturns<'a> {
    /// The returns of a scene about its grazing orbit.
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

    /// Of how many points one is taken, so that images as long as the grazing orbit's own form at
    /// most so many products.
    pub(super) fn one_of(&self, points: usize, most: usize) -> usize {
        let all = points.saturating_mul(self.own).saturating_mul(self.products);
        all.div_ceil(most).max(1)
    }

    /// How many points at once form at most so many products, whatever their images take.
    fn at_once(&self, most: usize) -> usize {
        (most / (self.limit * self.products)).clamp(1, MOST_AT_ONCE)
    }

    /// The image of a point, and the products of series that it took.
    pub(super) fn image(
        &mut self,
        point: &SamplePoint,
    ) -> Result<(ExactImage, usize), AnalysisError> {
        let image = image_or_none(&mut self.direct, point)?;
        Ok((image, self.direct.steps() * self.products))
    }

    /// The image of a point in double precision, if it can be compared, and what it took, in
    /// products of series in double-double.
    pub(super) fn rounded_image(
        &mut self,
        point: &SamplePoint,
    ) -> Result<(Option<Vec<Dd>>, usize), AnalysisError> {
        let image = image(&mut self.rounded, point)?;
        let products = self.rounded.steps() * self.products / IN_DOUBLE_DOUBLE;
        Ok((image.map(|image| converted(&image)), products))
    }
}

/// The image of a point by direct simulation.
pub(super) enum ExactImage<S = Dd> {
    /// One that can be compared.
    Known(Vec<S>),
    /// No return, or one with contacts other than those of grazing passages.
    None,
    /// The point is outside of the model: it has no impact there, as where a restitution is below
    /// zero. Nothing is said of a map there.
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

/// Simulates all points in double-double, side by side.
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
    /// Simulates points side by side; those that do not return, or with contacts other than those
    /// of the grazing passages, are left out. Where a return takes long, the points are fewer, as
    /// many as are simulated in a few seconds.
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
        // Where that is one point, every core simulates one; those beyond the limit are not used.
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

    /// Takes in simulated points; the products of series that they took.
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

/// A point with its image, and the products of series that it took.
type Simulated = (SamplePoint, Result<(ExactImage, usize), AnalysisError>);

/// Points in their order, simulated side by side.
fn simulated(returns: &ExactReturns<'_>, points: Vec<SamplePoint>) -> Vec<Simulated> {
    let simulate = |returns: &mut ExactReturns<'_>, point| {
        let image = returns.image(&point);
        (point, image)
    };
    parallel::map_with(points, || returns.clone(), simulate)
}

/// The image of a point after which the orbit returns with no contact but those of grazing
/// passages, if any.
///
/// A point that makes none counts: a map that sees one there errs by its kick.
pub(super) fn image<S: Real>(
    direct: &mut DirectImage<'_, S>,
    point: &SamplePoint,
) -> Result<Option<Vec<S>>, AnalysisError> {
    Ok(image_or_none(direct, point)?.known())
}

/// The same, or why there is none.
fn image_or_none<S: Real>(
    direct: &mut DirectImage<'_, S>,
    point: &SamplePoint,
) -> Result<ExactImage<S>, AnalysisError> {
    // NOTE: a return of another number of periods is no image of the map's.
    let image = direct.lifted_image(&converted(&point.state), &converted(&point.parameters))?;
    Ok(match image.end {
        DirectEnd::Returned if image.extra_contacts == 0 => ExactImage::Known(image.offsets),
        DirectEnd::GoesThrough => ExactImage::Outside,
        _ => ExactImage::None,
    })
}

/// Whether the order of a map can be measured at an image: it has contacts, all of them at
/// passages.
pub(super) fn tells_order<S>(image: &SectionImage<S>) -> bool {
    image.end == DirectEnd::Returned && image.contacts > 0 && image.extra_contacts == 0
}

/// Nanoseconds of a direct return in double precision, and its largest error, over a sample: its
/// first points, so many at most.
///
/// NOTE: what a simulator prepares at new parameters is not part of the time, as for a map with its
/// parameters frozen.
pub(super) fn timed_returns(
    direct: &mut DirectImage<'_, f64>,
    truth: &ExactImages,
    most: usize,
) -> Result<(f64, f64), AnalysisError> {
    let mut worst: f64 = 0.0;
    let mut seconds = 0.0;
    for (point, exact) in truth.pairs().take(most) {
        // An orbit that double precision sends elsewhere is an error as large as the kick.
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

/// Largest difference of a coordinate; NaN where one of them is none.
pub(super) fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    let difference = |(&a, &b): (&Dd, &Dd)| (a - b).to_f64().abs();
    a.iter().zip(b).map(difference).fold(0.0, nan_or_larger)
}

/// The larger of two numbers; NaN where one of them is none.
pub(super) fn nan_or_larger(largest: f64, value: f64) -> f64 {
    if largest.is_nan() || value <= largest { largest } else { value }
}

/// The points at which errors were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleSummary {
    /// Points compared.
    pub points: usize,
    /// Points left out: no image, or contacts other than those of the grazing passages.
    pub excluded: usize,
}

/// Errors over a sample; `null` where a map has no finite image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// Largest.
    pub max: Option<f64>,
    /// Median.
    pub median: Option<f64>,
}

impl ErrorSummary {
    /// Whether every image was finite and no error above this.
    pub fn is_within(&self, tolerance: f64) -> bool {
        self.max.is_some_and(|error| error <= tolerance)
    }
}

/// Largest and median error of a map; `None` where an image is not finite.
pub(super) fn summarize(map: &dyn DiscreteMap, truth: &ExactImages) -> ErrorSummary {
    let mut errors = truth.errors(map);
    errors.sort_by(f64::total_cmp);
    let finite = |value: Option<&f64>| value.copied().filter(|value| value.is_finite());
    ErrorSummary { max: finite(errors.last()), median: finite(errors.get(errors.len() / 2)) }
}

/// The largest error of a coordinate at one point; not finite where the map has no image.
pub(super) fn error(map: &dyn DiscreteMap, point: &SamplePoint, truth: &[Dd]) -> f64 {
    errors(map, point, truth).into_iter().fold(0.0, nan_or_larger)
}

/// The error of each coordinate at one point; not finite where the map has no image.
pub(super) fn errors(map: &dyn DiscreteMap, point: &SamplePoint, truth: &[Dd]) -> Vec<f64> {
    let mut image = vec![0.0; map.dimension()];
    map.step(&point.state, &point.parameters, &mut image);
    let pairs = image.into_iter().zip(truth);
    pairs.map(|(value, &exact)| (Dd::from(value) - exact).to_f64().abs()).collect()
}

/// Rounds of which the fastest counts.
const ROUNDS: usize = 5;

/// The window of a map, its depths by one of orders high enough to know them.
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
    /// How many points there are, and how many were left out.
    pub fn summary(&self) -> SampleSummary {
        SampleSummary { points: self.points.len(), excluded: self.excluded }
    }

    /// The points that have images.
    pub fn points(&self) -> &[SamplePoint] {
        &self.points
    }

    /// The largest error of a coordinate at each point, of a map; not finite where it has no image.
    pub fn errors(&self, map: &dyn DiscreteMap) -> Vec<f64> {
        self.pairs().map(|(point, image)| error(map, point, image)).collect()
    }

    /// Nanoseconds of a return by direct simulation in double precision, one after another over the
    /// first points, the fastest of five rounds; and its largest error there.
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

/// Runs of which the median counts.
const RUNS: usize = 5;

/// Steps of one run.
const STEPS: usize = 500;

/// Multiply-adds of one run.
const MULTIPLY_ADDS: usize = 400_000;

/// Independent chains of multiply-adds: enough to fill the units.
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

/// Nanoseconds of one step of a map with its parameters frozen, at a point: the median of five
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

/// Nanoseconds of one multiply-add in double precision, sixteen chains of them in flight: the
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
