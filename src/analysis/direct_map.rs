//! Direct simulation under the contract of every map.

use std::sync::{Mutex, PoisonError};

use super::AnalysisError;
use super::direct_image::{DirectEnd, DirectImage, SectionImage};
use crate::hybrid::HybridSystem;
use crate::iteration::{DiscreteMap, StepInfo};
use crate::model::Scene;
use crate::numeric::Scalar;
use crate::orbit::GrazingOrbit;

/// The section map by direct simulation in double precision, as a [`DiscreteMap`] in offsets.
///
/// [`StepInfo::contacts`] counts the contacts of the passage that the section is about;
/// [`StepInfo::depth`] is `v²/(2 h'')` of the impact speed `v`, which is `y²` to leading order.
///
/// Jacobians are central differences with steps of about `ε^(1/3)`: good to about `1e-9` away from
/// `y = 0`, where the map has no derivative, and wrong within a step of it.
#[derive(Debug)]
pub struct DirectMap<'a> {
    image: Mutex<DirectImage<'a, f64>>,
    dimension: usize,
    parameters: usize,
    normal_acceleration: f64,
}

impl<'a> DirectMap<'a> {
    /// The map of a scene about its grazing orbit; `system` is the scene's model, lowered.
    ///
    /// # Errors
    ///
    /// As [`DirectImage::new`].
    pub fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, AnalysisError> {
        let image = DirectImage::new(system, scene, orbit)?;
        Ok(Self {
            dimension: image.dimension(),
            parameters: image.parameters(),
            normal_acceleration: orbit.grazing_point().normal_acceleration.to_f64(),
            image: Mutex::new(image),
        })
    }

    /// Speed of the first contact that follows a section point; 0 without one, NaN without an image.
    pub fn impact_speed(&self, state: &[f64], parameters: &[f64]) -> f64 {
        self.simulate(state, parameters)
            .map_or(f64::NAN, |image| image.impact_speed)
    }

    /// The image with all that is known of it; `None` where the input is not finite.
    pub fn simulate(&self, state: &[f64], parameters: &[f64]) -> Option<SectionImage<f64>> {
        // A panic while the lock was held leaves nothing half-done: every image starts afresh.
        let mut image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        image.image(state, parameters).ok()
    }
}

impl Clone for DirectMap<'_> {
    fn clone(&self) -> Self {
        let image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        Self {
            image: Mutex::new(image.clone()),
            ..*self
        }
    }
}

impl DiscreteMap for DirectMap<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> usize {
        self.parameters
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let simulated = self
            .simulate(state, parameters)
            .filter(|simulated| simulated.end == DirectEnd::Returned);
        let Some(simulated) = simulated else {
            image.fill(f64::NAN);
            return StepInfo::default();
        };
        image.copy_from_slice(&simulated.offsets);
        let speed = simulated.impact_speed;
        let contacts = simulated.contacts as u32;
        let depth = if contacts > 0 {
            0.5 * speed * speed / self.normal_acceleration
        } else {
            0.0
        };
        StepInfo {
            contacts,
            depth,
            valid: false,
        }
        .checked(image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let step = f64::ROUNDOFF.cbrt();
        let (mut up, mut down) = (vec![0.0; self.dimension], vec![0.0; self.dimension]);
        let mut point = state.to_vec();
        for column in 0..self.dimension {
            point[column] = state[column] + step;
            self.step(&point, parameters, &mut up);
            point[column] = state[column] - step;
            self.step(&point, parameters, &mut down);
            point[column] = state[column];
            for row in 0..self.dimension {
                jacobian[row * self.dimension + column] = (up[row] - down[row]) / (2.0 * step);
            }
        }
        self.step(state, parameters, image)
    }
}
