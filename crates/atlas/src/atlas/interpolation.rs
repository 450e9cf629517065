//! Polynomials on a box from values of a map at points of the box.
//!
//! The polynomials are those of least squares, at twice as many points as coefficients. The points
//! lie denser towards the faces, as Chebyshev's do, so that the error is nearly that of the best
//! polynomial.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::cell::Cell;
use super::patch::{Patch, Piece};
use super::tree::{Expansion, distance};
use crate::jet::{Jet, JetError, JetSpace};
use crate::numeric::low_discrepancy;

/// Points for each coefficient.
const POINTS: usize = 2;
/// Fewest points for each axis that tell along which axis the labels change.
const PROBES: usize = 8;
/// Error of a fit, in its largest residual: between its points it is larger.
const RESIDUALS: f64 = 2.0;
/// Correlation with an axis that is no chance, in standard errors.
const SIGNIFICANT: f64 = 1.5;

/// Polynomials of an order, fitted to a map on any box.
///
/// ```
/// use grazemap_atlas::atlas::{Cell, Expansion, Interpolation, Piece};
/// let fit = Interpolation::new(1, 5)?;
/// let cell = Cell::whole(&[[0.0, 0.2]]);
/// let found = fit.expand(&cell, &[1.0], |point, image| {
///     image[0] = point[0].exp();
///     Some(0)
/// });
/// let Expansion::Piece(Piece::Smooth(patch), Some(error)) = found else { panic!("one label") };
/// let mut value = [0.0];
/// patch.evaluate(&[0.5], &mut Vec::new(), &mut value); // at 0.15
/// assert!((value[0] - 0.15_f64.exp()).abs() <= error && error < 1e-9);
/// # Ok::<(), grazemap_atlas::jet::JetError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Interpolation {
    space: Arc<JetSpace>,
    /// Points of the unit cube.
    points: Vec<Vec<f64>>,
    /// Coefficients by values, row by row.
    weights: Vec<f64>,
}

impl Interpolation {
    /// Polynomials of `axes` variables up to a total degree.
    ///
    /// # Errors
    ///
    /// As [`JetSpace::new`].
    pub fn new(axes: usize, order: usize) -> Result<Self, JetError> {
        let space = JetSpace::uniform(axes, order)?;
        let dense = |index| {
            let unit = low_discrepancy(index, axes).into_iter();
            unit.map(|share| 0.5 - 0.5 * (PI * share).cos()).collect::<Vec<f64>>()
        };
        let points: Vec<Vec<f64>> = (0..POINTS * space.len()).map(dense).collect();
        let mut monomials = Vec::new();
        let rows = points.iter().flat_map(|unit| {
            let local: Vec<f64> = unit.iter().map(|share| 2.0 * share - 1.0).collect();
            space.monomials_at(&local, &mut monomials);
            monomials.clone()
        });
        let matrix = DMatrix::from_row_iterator(points.len(), space.len(), rows);
        let (q, r) = matrix.qr().unpack();
        let weights = r.solve_upper_triangular(&q.transpose());
        let weights = weights.expect("twice as many points as coefficients determine these");
        let weights = weights.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>());
        Ok(Self { weights: weights.collect(), space, points })
    }

    /// Number of images that a fit takes.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Fits polynomials to a map on a box, whose components have these scales. `value` writes the
    /// image of a point and returns a label, such as a word of contacts; `None` without an image.
    ///
    /// Unresolved if the labels differ. The crossing is then a linear estimate of where they
    /// change.
    pub fn expand(
        &self,
        cell: &Cell,
        scales: &[f64],
        mut value: impl FnMut(&[f64], &mut [f64]) -> Option<u64>,
    ) -> Expansion {
        let components = scales.len();
        let mut values = vec![0.0; self.points.len() * components];
        let mut labels = Vec::with_capacity(self.points.len());
        for (unit, image) in self.points.iter().zip(values.chunks_exact_mut(components)) {
            labels.push(value(&cell.point(unit), image));
            let differs = labels.last() != labels.first() || labels[0].is_none();
            if differs && labels.len() >= PROBES * cell.centre.len() {
                return Expansion::Unresolved { crossing: self.crossing(&labels) };
            }
        }
        if labels.iter().any(|label| label.is_none() || *label != labels[0]) {
            return Expansion::Unresolved { crossing: self.crossing(&labels) };
        }
        let mut coefficients = vec![0.0; self.space.len() * components];
        let rows = self.weights.chunks_exact(self.points.len());
        for (row, sums) in rows.zip(coefficients.chunks_exact_mut(components)) {
            for (weight, image) in row.iter().zip(values.chunks_exact(components)) {
                for (sum, value) in sums.iter_mut().zip(image) {
                    *sum += weight * value;
                }
            }
        }
        let patch = Patch::of(Arc::clone(&self.space), components, coefficients);
        let error = RESIDUALS * self.residual(&patch, &values, scales);
        Expansion::Piece(Piece::Smooth(patch), Some(error))
    }

    /// Largest residual of a patch at the points, in the scales of its components.
    fn residual(&self, patch: &Patch, values: &[f64], scales: &[f64]) -> f64 {
        let mut image = vec![0.0; scales.len()];
        let mut monomials = Vec::new();
        let mut local = Vec::new();
        let rows = self.points.iter().zip(values.chunks_exact(scales.len()));
        rows.fold(0.0, |largest, (unit, exact)| {
            local.clear();
            local.extend(unit.iter().map(|share| 2.0 * share - 1.0));
            patch.evaluate(&local, &mut monomials, &mut image);
            largest.max(distance(&image, exact, scales))
        })
    }

    /// Linear estimate of where the labels of the first points differ from the first one; `None` if
    /// they are strewn along all axes alike.
    fn crossing(&self, labels: &[Option<u64>]) -> Option<Jet<f64>> {
        let count = labels.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| (0..labels.len()).map(of).sum::<f64>() / count;
        let side = |point: usize| f64::from(u8::from(labels[point] == labels[0]));
        let middle = mean(&side);
        let spread = (middle * (1.0 - middle)).sqrt();
        let slope = |axis: usize| {
            let share = |point: usize| 2.0 * self.points[point][axis] - 1.0;
            let centre = mean(&share);
            mean(&|point| (side(point) - middle) * (share(point) - centre))
        };
        let slopes: Vec<f64> = (0..self.space.variables()).map(slope).collect();
        let largest = slopes.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        let mut crossing = Jet::zero(&self.space);
        for (axis, slope) in slopes.into_iter().enumerate() {
            crossing += &Jet::variable(&self.space, axis, 0.0).scale(slope);
        }
        (largest > SIGNIFICANT * spread / count.sqrt()).then_some(crossing)
    }
}
