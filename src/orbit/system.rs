//! The extended system of a grazing orbit: the orbit closes, and touches the surface at its start.
//!
//! Unknowns are the full state at the graze, the period where no clock gives it, and the free parameters; equations
//! `φ_T(X; p) − X = 0` in the states (the phase closes by itself), `h = 0` and `h' = 0`. See
//! docs/mathematics/orbit.md.

use nalgebra::DMatrix;

use crate::flow::{Field, Integrator};
use crate::model::Scene;
use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::geometry::Geometry;
use super::newton::Equations;
use super::variation::flow_with_variations;

/// Closure and graze in the unknowns (full state, period of an autonomous system, free parameters).
#[derive(Clone, Debug)]
pub(super) struct ExtendedSystem {
    pub(super) geometry: Geometry,
    pub(super) field: Field,
    dimension: usize,
    states: usize,
    phase_advance: Option<Dd>,
    base: Vec<Dd>,
    free: Vec<usize>,
}

impl ExtendedSystem {
    /// The system of a scene whose other parameters are `base`.
    pub(super) fn new(scene: &Scene, surface: usize, base: &[Dd], free: &[usize]) -> Self {
        let model = &scene.model;
        let periods = Dd::from(scene.grazing.periods as f64);
        Self {
            geometry: Geometry::new(model, surface),
            field: Field::free(model, &[]),
            dimension: model.dimension(),
            states: model.states.len(),
            phase_advance: model.phase.as_ref().map(|phase| phase.period * periods),
            base: base.to_vec(),
            free: free.to_vec(),
        }
    }

    /// The same equations with the other parameters changed and one parameter free.
    pub(super) fn with(&self, base: &[Dd], free: &[usize]) -> Self {
        Self {
            base: base.to_vec(),
            free: free.to_vec(),
            ..self.clone()
        }
    }

    /// Number of states, the phase not counted.
    pub(super) fn states(&self) -> usize {
        self.states
    }

    /// Length of the full state.
    pub(super) fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.dimension + usize::from(self.phase_advance.is_none()) + self.free.len()
    }

    /// Position of the first free parameter among the unknowns.
    pub(super) fn first_parameter(&self) -> usize {
        self.unknowns() - self.free.len()
    }

    /// Unknowns from their parts; `period` is used only where no clock gives it.
    pub(super) fn assemble<S: Real>(&self, state: &[S], period: S, parameters: &[S]) -> Vec<S> {
        let period = self.phase_advance.is_none().then_some(period);
        let free = self.free.iter().map(|&parameter| parameters[parameter]);
        state.iter().copied().chain(period).chain(free).collect()
    }

    /// All parameters at these unknowns.
    pub(super) fn parameters<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        let mut parameters: Vec<S> = self.base.iter().map(|&value| S::from_dd(value)).collect();
        for (&parameter, &value) in self.free.iter().zip(&unknowns[self.first_parameter()..]) {
            parameters[parameter] = value;
        }
        parameters
    }

    /// Duration of one period of the orbit.
    pub(super) fn period<S: Real>(&self, unknowns: &[S]) -> S {
        self.period_and_slopes(unknowns, &self.parameters(unknowns))
            .0
    }

    /// The period and its derivatives in all parameters: `T = advance/rate(p)`.
    fn period_and_slopes<S: Real>(&self, unknowns: &[S], parameters: &[S]) -> (S, Vec<S>) {
        let local = self.geometry.at(&unknowns[..self.dimension], parameters);
        match (self.phase_advance, local.clock()) {
            (Some(advance), Some((rate, slopes))) => {
                let period = S::from_dd(advance) / rate;
                let slopes = slopes[self.dimension..]
                    .iter()
                    .map(|&slope| -(period / rate) * slope)
                    .collect();
                (period, slopes)
            }
            _ => (unknowns[self.dimension], vec![S::zero(); parameters.len()]),
        }
    }

    /// Closure in the states, `h`, `h'`.
    pub(super) fn evaluate<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, _) = self.period_and_slopes(unknowns, &parameters);
        let end = Integrator::new(&self.field).flow(state, &parameters, period)?;
        let local = self.geometry.at(state, &parameters);
        let closure = (0..self.states).map(|component| end[component] - state[component]);
        Ok(closure.chain([local.event(), local.velocity()]).collect())
    }

    /// Residuals and their derivatives in every unknown: a matrix of `states + 2` rows.
    pub(super) fn differentiate(
        &self,
        unknowns: &[f64],
    ) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, period_slopes) = self.period_and_slopes(unknowns, &parameters);
        let end = flow_with_variations(&self.field, state, &parameters, &self.free, period)?;
        let velocity = self.geometry.at(&end.state, &parameters).flow();
        let local = self.geometry.at(state, &parameters);
        let (event_slopes, velocity_slopes) = (local.event_gradient(), local.velocity_gradient());
        let mut jacobian = DMatrix::zeros(self.states + 2, self.unknowns());
        for column in 0..self.dimension {
            for row in 0..self.states {
                jacobian[(row, column)] =
                    end.jacobian[row][column] - if row == column { 1.0 } else { 0.0 };
            }
            jacobian[(self.states, column)] = event_slopes[column];
            jacobian[(self.states + 1, column)] = velocity_slopes[column];
        }
        if self.phase_advance.is_none() {
            for row in 0..self.states {
                jacobian[(row, self.dimension)] = velocity[row];
            }
        }
        for (number, &parameter) in self.free.iter().enumerate() {
            let column = self.first_parameter() + number;
            for row in 0..self.states {
                jacobian[(row, column)] = end.jacobian[row][self.dimension + number]
                    + velocity[row] * period_slopes[parameter];
            }
            jacobian[(self.states, column)] = event_slopes[self.dimension + parameter];
            jacobian[(self.states + 1, column)] = velocity_slopes[self.dimension + parameter];
        }
        let closure = (0..self.states).map(|component| end.state[component] - state[component]);
        Ok((
            closure.chain([local.event(), local.velocity()]).collect(),
            jacobian,
        ))
    }
}

impl Equations for ExtendedSystem {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        self.differentiate(unknowns)
    }

    fn residual(&self, unknowns: &[f64]) -> Result<Vec<f64>, OrbitError> {
        self.evaluate(unknowns)
    }

    fn residual_dd(&self, unknowns: &[Dd]) -> Result<Vec<Dd>, OrbitError> {
        self.evaluate(unknowns)
    }
}

/// Closure alone, from a fixed phase and at fixed parameters: what finds a periodic orbit.
#[derive(Clone, Debug)]
pub(super) struct Shooting {
    fixed: ExtendedSystem,
    phase: f64,
}

impl Shooting {
    /// Closure from this phase at these parameters.
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
