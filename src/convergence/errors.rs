//! Errors of a map over sample points, in the numbers in which it is run.

use super::data::ErrorSummary;
use super::sample::SamplePoint;
use super::truth::{Truth, distance};
use crate::iteration::DiscreteMap;
use crate::numeric::Dd;

/// Largest and median error of a map; `None` where an image is not finite.
pub(super) fn summarize(map: &dyn DiscreteMap, truth: &Truth) -> ErrorSummary {
    let pairs = truth.points.iter().zip(&truth.images);
    let mut errors: Vec<f64> = pairs
        .map(|(point, image)| error(map, point, image))
        .collect();
    errors.sort_by(f64::total_cmp);
    let finite = |value: Option<&f64>| value.copied().filter(|value| value.is_finite());
    ErrorSummary {
        max: finite(errors.last()),
        median: finite(errors.get(errors.len() / 2)),
    }
}

/// The largest error of a coordinate at one point; not finite where the map has no image.
pub(super) fn error(map: &dyn DiscreteMap, point: &SamplePoint, truth: &[Dd]) -> f64 {
    let mut image = vec![0.0; map.dimension()];
    map.step(&point.state, &point.parameters, &mut image);
    let image: Vec<Dd> = image.into_iter().map(Dd::from).collect();
    distance(&image, truth)
}
