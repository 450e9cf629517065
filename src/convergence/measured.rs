//! The error of a map as it is run, on points that nothing was chosen by.

use super::ConvergenceError;
use super::data::SampleSummary;
use super::errors::{error, summarize};
use super::family::MapFamily;
use super::rule::PROBE;
use super::sample::{SamplePoint, WindowSample};
use super::timing;
use super::truth::{Truth, truth};
use crate::analysis::DirectImage;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::DiscreteMap;
use crate::model::Scene;
use crate::numeric::decimal_above;
use crate::orbit::GrazingOrbit;

/// Number in the sequence of the first point: orders are chosen by the ones before it.
const FIRST: usize = 128;

/// Rounds of which the fastest counts.
const ROUNDS: usize = 5;

/// The largest error of a map on its window.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MeasuredError {
    /// Largest error of a coordinate, in the units of the offsets; `None` where an image is not
    /// finite.
    pub error: Option<f64>,
    /// What it was measured on.
    pub sample: SampleSummary,
}

impl MeasuredError {
    /// The error rounded up to two digits: the same number on machines whose arithmetic differs in
    /// the last place.
    pub fn rounded_up(&self) -> Option<f64> {
        self.error.map(|error| decimal_above(error, 2))
    }
}

/// Compares a map with direct simulation in double-double at the corners of the window and at fresh
/// points.
///
/// `local` has the window; `map` is what is run, in whatever shape and numbers, with whatever was
/// dropped.
///
/// # Errors
///
/// [`ConvergenceError`] if the window has no point to compare at, or direct simulation fails.
pub fn measured_error(
    scene: &Scene,
    orbit: &GrazingOrbit,
    local: &LocalMap,
    map: &dyn DiscreteMap,
    points: usize,
) -> Result<MeasuredError, ConvergenceError> {
    let sample = window_sample(scene, orbit, local)?;
    let exact = ExactImages::new(scene, orbit, sample.judging(FIRST, points))?;
    Ok(MeasuredError {
        error: summarize(map, &exact.truth).max,
        sample: exact.summary(),
    })
}

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

/// Points of a window with their images by direct simulation in double-double, to compare any
/// number of maps with.
#[derive(Clone, Debug)]
pub struct ExactImages {
    truth: Truth,
}

impl ExactImages {
    /// Simulates points side by side; those that do not return, or with contacts other than those
    /// of the grazing passages, are left out.
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
        let tried = points.len();
        let truth = truth(&system, scene, orbit, points)?;
        if truth.points.is_empty() {
            return Err(ConvergenceError::NoTruth { tried });
        }
        Ok(Self { truth })
    }

    /// How many points there are, and how many were left out.
    pub fn summary(&self) -> SampleSummary {
        SampleSummary {
            points: self.truth.points.len(),
            excluded: self.truth.excluded,
        }
    }

    /// The points that have images.
    pub fn points(&self) -> &[SamplePoint] {
        &self.truth.points
    }

    /// The largest error of a coordinate at each point, of a map; not finite where it has no image.
    pub fn errors(&self, map: &dyn DiscreteMap) -> Vec<f64> {
        let pairs = self.truth.points.iter().zip(&self.truth.images);
        pairs
            .map(|(point, image)| error(map, point, image))
            .collect()
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
        let mut first = self.truth.clone();
        first.points.truncate(points);
        first.images.truncate(points);
        let mut best = timing::direct(&mut direct, &first)?;
        for _ in 1..ROUNDS {
            let (period_ns, error) = timing::direct(&mut direct, &first)?;
            best = (best.0.min(period_ns), error);
        }
        Ok(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_rounded_up_to_two_digits() {
        let rounded = |error| {
            let sample = SampleSummary {
                points: 1,
                excluded: 0,
            };
            let error = Some(error);
            MeasuredError { error, sample }.rounded_up()
        };
        assert_eq!(rounded(1.234e-8), Some(1.3e-8));
        assert_eq!(rounded(9.96e-8), Some(1e-7));
        assert_eq!(rounded(0.0), Some(0.0));
    }
}
