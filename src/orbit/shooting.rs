//! Closure alone, from a fixed phase and at fixed parameters: what finds a periodic orbit.

use nalgebra::DMatrix;

use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::newton::Equations;
use super::system::ExtendedSystem;

/// Closure of the period in the states.
#[derive(Clone, Debug)]
pub(super) struct Shooting {
    fixed: ExtendedSystem,
    phase: f64,
}

impl Shooting {
    /// Closure from this phase at these parameters, for a system of one graze.
    pub(super) fn new(system: &ExtendedSystem, phase: f64, parameters: &[f64]) -> Self {
        let parameters: Vec<Dd> = parameters.iter().map(|&value| Dd::from(value)).collect();
        Self {
            fixed: system.with(&parameters, &[]),
            phase,
        }
    }

    fn closure<S: Real>(&self, states: &[S]) -> Result<Vec<S>, OrbitError> {
        let start: Vec<S> = states
            .iter()
            .copied()
            .chain([S::from_f64(self.phase)])
            .collect();
        let mut residual = self.fixed.evaluate(&start)?;
        residual.truncate(states.len());
        Ok(residual)
    }
}

impl Equations for Shooting {
    fn linearised(&self, states: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let count = states.len();
        let start: Vec<f64> = states.iter().copied().chain([self.phase]).collect();
        let (residual, jacobian) = self.fixed.differentiate(&start)?;
        Ok((
            residual[..count].to_vec(),
            jacobian.view((0, 0), (count, count)).into_owned(),
        ))
    }

    fn residual(&self, states: &[f64]) -> Result<Vec<f64>, OrbitError> {
        self.closure(states)
    }

    fn residual_dd(&self, states: &[Dd]) -> Result<Vec<Dd>, OrbitError> {
        self.closure(states)
    }
}
