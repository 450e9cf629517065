//! The extended system of a grazing orbit: the orbit closes, and touches the surface at its start.
//!
//! Unknowns are the full state at the graze, the period where no clock gives it, and the free parameters; equations
//! `φ_T(X; p) − X = 0` in the states (the phase closes by itself), `h = 0` and `h' = 0`. Closure may be asked for at the
//! end of the period or, from both sides, at its middle. See docs/mathematics/orbit.md.

use nalgebra::DMatrix;

use crate::flow::{Field, Integrator, flow_with_jacobian};
use crate::model::Scene;
use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::geometry::Geometry;
use super::newton::{Equations, Root, Solve, refine, solve};

/// Where the two ends of a period are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Matching {
    /// `φ_T(X) = X`: for strong damping, where the flow backwards is violent.
    AtEnd,
    /// `φ_{T/2}(X) = φ_{−T/2}(X)`: for strong instability, as each half grows by the square root only.
    AtMiddle,
}

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
    matching: Matching,
}

/// A stretch of the flow with its derivatives in the full state, the period and all parameters asked for.
struct Stretch {
    state: Vec<f64>,
    jacobian: DMatrix<f64>,
    velocity: Vec<f64>,
    /// Derivative of its duration in the period.
    share: f64,
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
            matching: Matching::AtEnd,
        }
    }

    /// The same equations, matched elsewhere.
    pub(super) fn matched(&self, matching: Matching) -> Self {
        Self {
            matching,
            ..self.clone()
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

    /// Ends of the period that closure compares, as parts of the period.
    fn ends(&self) -> [f64; 2] {
        match self.matching {
            Matching::AtEnd => [1.0, 0.0],
            Matching::AtMiddle => [0.5, -0.5],
        }
    }

    /// Closure in the states, `h`, `h'`.
    pub(super) fn evaluate<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, _) = self.period_and_slopes(unknowns, &parameters);
        let mut integrator = Integrator::new(&self.field);
        let [after, before] = self
            .ends()
            .map(|share| integrator.flow(state, &parameters, period * S::from_f64(share)));
        let (after, before) = (after?, before?);
        let local = self.geometry.at(state, &parameters);
        let closure = (0..self.states).map(|component| after[component] - before[component]);
        Ok(closure.chain([local.event(), local.velocity()]).collect())
    }

    /// Residuals and their derivatives in every unknown: a matrix of `states + 2` rows.
    pub(super) fn differentiate(
        &self,
        unknowns: &[f64],
    ) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (state, parameters) = (&unknowns[..self.dimension], self.parameters(unknowns));
        let [after, before] = self
            .ends()
            .map(|share| self.stretch(unknowns, &parameters, share));
        let (after, before) = (after?, before?);
        let local = self.geometry.at(state, &parameters);
        let mut jacobian = DMatrix::zeros(self.states + 2, self.unknowns());
        self.fill_closure(&mut jacobian, unknowns, &parameters, &after, 1.0);
        self.fill_closure(&mut jacobian, unknowns, &parameters, &before, -1.0);
        let parameter_inputs = self
            .free
            .iter()
            .map(|&parameter| self.dimension + parameter);
        let columns = (self.first_parameter()..)
            .zip(parameter_inputs)
            .chain((0..self.dimension).map(|i| (i, i)));
        let (event_slopes, velocity_slopes) = (local.event_gradient(), local.velocity_gradient());
        for (column, input) in columns {
            jacobian[(self.states, column)] = event_slopes[input];
            jacobian[(self.states + 1, column)] = velocity_slopes[input];
        }
        let closure =
            (0..self.states).map(|component| after.state[component] - before.state[component]);
        Ok((
            closure.chain([local.event(), local.velocity()]).collect(),
            jacobian,
        ))
    }

    /// The flow over a part of the period.
    fn stretch(
        &self,
        unknowns: &[f64],
        parameters: &[f64],
        share: f64,
    ) -> Result<Stretch, OrbitError> {
        let (period, _) = self.period_and_slopes(unknowns, parameters);
        let inputs: Vec<usize> = (0..self.dimension)
            .chain(
                self.free
                    .iter()
                    .map(|&parameter| self.dimension + parameter),
            )
            .collect();
        let start = &unknowns[..self.dimension];
        let (state, jacobian) =
            flow_with_jacobian(&self.field, start, parameters, share * period, &inputs)?;
        let velocity = self.geometry.at(&state, parameters).flow();
        Ok(Stretch {
            state,
            jacobian,
            velocity,
            share,
        })
    }

    /// Adds the derivatives of one end of the period to the closure's rows.
    fn fill_closure(
        &self,
        jacobian: &mut DMatrix<f64>,
        unknowns: &[f64],
        parameters: &[f64],
        end: &Stretch,
        sign: f64,
    ) {
        let (_, period_slopes) = self.period_and_slopes(unknowns, parameters);
        for row in 0..self.states {
            let by_period = end.velocity[row] * end.share;
            for column in 0..self.dimension {
                jacobian[(row, column)] += sign * end.jacobian[(row, column)];
            }
            if self.phase_advance.is_none() {
                jacobian[(row, self.dimension)] += sign * by_period;
            }
            for (number, &parameter) in self.free.iter().enumerate() {
                let slope = end.jacobian[(row, self.dimension + number)]
                    + by_period * period_slopes[parameter];
                jacobian[(row, self.first_parameter() + number)] += sign * slope;
            }
        }
    }
}

/// Newton's method with the period matched at its end, then at its middle; the end's failure if both fail.
pub(super) fn solve_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Vec<f64>>, OrbitError> {
    match solve(&system.matched(Matching::AtEnd), start, tolerance)? {
        Solve::Root(root) => Ok(Solve::Root(root)),
        Solve::Failed(failure) => Ok(
            match solve(&system.matched(Matching::AtMiddle), start, tolerance)? {
                Solve::Root(root) => Solve::Root(root),
                Solve::Failed(_) => Solve::Failed(failure),
            },
        ),
    }
}

/// Refinement with the period matched at its end, then at its middle.
pub(super) fn refine_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Root>, OrbitError> {
    match refine(&system.matched(Matching::AtEnd), start, tolerance) {
        Ok(Solve::Root(root)) => Ok(Solve::Root(root)),
        _ => refine(&system.matched(Matching::AtMiddle), start, tolerance),
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
