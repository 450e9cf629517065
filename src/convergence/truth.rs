//! The truth: images by direct simulation in double-double.

use rayon::prelude::*;

use super::ConvergenceError;
use super::sample::SamplePoint;
use crate::analysis::{AnalysisError, DirectEnd, DirectImage, SectionImage};
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// Sample points with their images.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    /// Points that can be compared.
    pub(super) points: Vec<SamplePoint>,
    /// Their images.
    pub(super) images: Vec<Vec<Dd>>,
    /// Points left out.
    pub(super) excluded: usize,
}

impl Truth {
    /// Takes in further points.
    pub(super) fn append(&mut self, other: Self) {
        self.points.extend(other.points);
        self.images.extend(other.images);
        self.excluded += other.excluded;
    }
}

/// Simulates all points in double-double, side by side.
pub(super) fn truth(
    system: &HybridSystem,
    scene: &Scene,
    orbit: &GrazingOrbit,
    points: Vec<SamplePoint>,
) -> Result<Truth, ConvergenceError> {
    let direct = DirectImage::<Dd>::new(system, scene, orbit)?;
    let images: Vec<_> = points
        .par_iter()
        .map_init(|| direct.clone(), |direct, point| image(direct, point))
        .collect::<Result<_, _>>()?;
    let mut truth = Truth::default();
    for (point, image) in points.into_iter().zip(images) {
        match image {
            Some(image) => {
                truth.points.push(point);
                truth.images.push(image);
            }
            None => truth.excluded += 1,
        }
    }
    Ok(truth)
}

/// The image of a point after which the orbit returns with no contact but those of grazing
/// passages, if any.
///
/// A point that makes none counts: a map that sees one there errs by its kick.
pub(super) fn image<S: Real>(
    direct: &mut DirectImage<'_, S>,
    point: &SamplePoint,
) -> Result<Option<Vec<S>>, AnalysisError> {
    let convert = |values: &[f64]| {
        let values = values.iter();
        values.map(|&value| S::from_f64(value)).collect::<Vec<_>>()
    };
    let image = direct.image(&convert(&point.state), &convert(&point.parameters))?;
    let comparable = image.end == DirectEnd::Returned && image.extra_contacts == 0;
    Ok(comparable.then_some(image.offsets))
}

/// Whether an image tells the order of a map: it has contacts, and none but those of its passages.
pub(super) fn tells_order<S>(image: &SectionImage<S>) -> bool {
    image.end == DirectEnd::Returned && image.contacts > 0 && image.extra_contacts == 0
}

/// Largest difference of a coordinate; NaN where one of them is none.
pub(super) fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    let difference = |(&a, &b): (&Dd, &Dd)| (a - b).to_f64().abs();
    let larger = |max: f64, value: f64| {
        if max.is_nan() || value <= max {
            max
        } else {
            value
        }
    };
    a.iter().zip(b).map(difference).fold(0.0, larger)
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
