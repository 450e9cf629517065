//! Where a sweep starts: the periodic orbit without contact.

use nalgebra::{DMatrix, DVector};

use crate::expansion::{LocalMap, Stage};
use crate::iteration::{DiscreteMap, InterpretedMap};

/// Newton steps before giving up.
const NEWTON_STEPS: usize = 30;

/// The fixed point of `P_smooth` as a function of the parameters.
#[derive(Clone, Debug)]
pub struct SmoothFixedPoint {
    smooth: InterpretedMap,
}

impl SmoothFixedPoint {
    /// Fixed points of the legs of a map.
    pub fn new(map: &LocalMap) -> Self {
        let mut legs = map.clone();
        legs.stages.retain(|stage| matches!(stage, Stage::Leg(_)));
        Self {
            smooth: InterpretedMap::new(&legs),
        }
    }

    /// The fixed point next to the section's origin, by Newton's method from there; the origin
    /// itself where that does not converge.
    pub fn at(&self, parameters: &[f64]) -> Vec<f64> {
        let dimension = self.smooth.dimension();
        let mut point = DVector::zeros(dimension);
        for _ in 0..NEWTON_STEPS {
            let Some(step) = self.newton_step(&point, parameters) else {
                return vec![0.0; dimension];
            };
            let size = step.amax();
            point -= step;
            // A step this small leaves an error of its square.
            if size <= 1e-9 * point.amax() || size == 0.0 {
                return point.as_slice().to_vec();
            }
        }
        vec![0.0; dimension]
    }

    /// `(∂P/∂x − 1)⁻¹ (P(x) − x)`.
    fn newton_step(&self, point: &DVector<f64>, parameters: &[f64]) -> Option<DVector<f64>> {
        let dimension = point.len();
        let mut image = vec![0.0; dimension];
        let mut rows = vec![0.0; dimension * dimension];
        let info = self
            .smooth
            .step_jacobian(point.as_slice(), parameters, &mut image, &mut rows);
        if !info.valid {
            return None;
        }
        let jacobian = DMatrix::from_row_slice(dimension, dimension, &rows);
        let defect = DVector::from_vec(image) - point;
        let step = (jacobian - DMatrix::identity(dimension, dimension))
            .lu()
            .solve(&defect)?;
        step.iter().all(|value| value.is_finite()).then_some(step)
    }
}
