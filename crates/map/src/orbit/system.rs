//! The extended system of a grazing orbit: the orbit closes, and touches its surfaces.
//!
//! Unknowns are the full state at the first graze, the period of an autonomous system, the times of
//! the further independent grazes, and the free parameters. Equations are `φ_T(X; p) − X = 0` in
//! the states (the phase closes by itself) and `h = 0`, `h' = 0` at every independent graze. A
//! symmetric orbit closes after half its period on its mirror image, `φ_{T/2}(X) + X = 0`. Closure
//! is imposed at the end or, from both sides, in the middle. See docs/mathematics/orbit.md.
//!
//! [`PeriodicFamily`] is closure without the grazes.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::effort::{Effort, Flight};
use super::free_flow::each_step;
use super::grazing_orbit::Grazes;
use super::newton::{Equations, Root, Scaled, Solved, unit_of};
use super::outcome::OrbitError;
use super::piecewise::{FlowEvent, PiecewiseFlow};
use super::section::Geometry;
use crate::flow::Step;
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};

/// Point of the period at which its two ends are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Matching {
    /// `φ_T(X) = X`: for strong damping, where the flow backwards is violent.
    AtEnd,
    /// `φ_{T/2}(X) = φ_{−T/2}(X)`: for strong instability, because each half grows only by the
    /// square root.
    AtMiddle,
}

/// Size of an orbit at rest, relative to the way of the surface, and of a state at rest, relative
/// to the others: rounding.
const AT_REST: f64 = 1e-12;
/// Size of a state, relative to the length of an orbit, below which it has a unit of its own.
const FAR_SMALLER: f64 = 1e-3;
/// Step along the flow, relative to `T/2π`, for the change of the states' rates.
const AHEAD: f64 = 1e-6;

/// Rate of a held component, relative to the largest, below which another one is held.
const OBLIQUE: f64 = 0.2;

/// Closure and grazes as equations in the unknowns (full state, period of an autonomous system,
/// graze times, free parameters).
#[derive(Clone, Debug)]
pub(super) struct ExtendedSystem {
    /// The passages of the orbit.
    pub(super) grazes: Grazes,
    pub(super) flow: PiecewiseFlow,
    /// Expressions at the surface of each passage.
    geometries: Vec<Geometry>,
    /// Length of the full state.
    pub(super) dimension: usize,
    /// Number of states, the phase not counted.
    pub(super) states: usize,
    phase_advance: Option<Dd>,
    base: Vec<Dd>,
    /// Indices of the free parameters.
    pub(super) free: Vec<usize>,
    matching: Matching,
    /// Counter and limit of the work, if there is one.
    effort: Option<Effort>,
}

/// A stretch of the flow with its derivatives in the full state and the requested parameters, and
/// the velocity at its end.
struct FlowStretch {
    state: Vec<f64>,
    jacobian: DMatrix<f64>,
    velocity: Vec<f64>,
}

impl ExtendedSystem {
    /// The system of a scene, with `base` for the parameters that are not free.
    pub(super) fn new(scene: &Scene, grazes: Grazes, base: &[Dd], free: &[usize]) -> Self {
        let model = &scene.model;
        let surfaces = grazes.surfaces.iter();
        Self {
            geometries: surfaces.map(|&at| Geometry::new(model, at)).collect(),
            grazes,
            flow: PiecewiseFlow::free(scene, &[]),
            dimension: model.dimension(),
            states: model.states.len(),
            phase_advance: Grazes::advance(scene),
            base: base.to_vec(),
            free: free.to_vec(),
            matching: Matching::AtEnd,
            effort: None,
        }
    }

    /// Counts the work of evaluations; they fail at the limit.
    pub(super) fn limited(self, effort: &Effort) -> Self {
        Self { effort: Some(effort.clone()), ..self }
    }

    /// Counts a stretch whose steps are known.
    pub(super) fn counted(&self, steps: usize, duration: f64) {
        if let Some(effort) = &self.effort {
            effort.counted(steps, duration);
        }
    }

    /// Checks the work limit.
    ///
    /// # Errors
    ///
    /// [`OrbitError::SearchTooLong`] at the limit of a search.
    pub(super) fn check_limit(&self) -> Result<(), OrbitError> {
        self.effort.as_ref().map_or(Ok(()), Effort::check)
    }

    /// State after a duration of either sign along the flow; the work is counted.
    ///
    /// # Errors
    ///
    /// [`OrbitError::SearchTooLong`] at the limit of a search.
    pub(super) fn flow<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<Vec<S>, OrbitError> {
        self.within_limit::<S, _>(duration, Flight::Numbers, |steps_left| {
            self.flow.flow_within(state, parameters, duration, steps_left)
        })
    }

    /// Events along the flow in a duration of at least 0; the work is counted.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow).
    pub(super) fn events(
        &self,
        state: &[f64],
        parameters: &[f64],
        duration: f64,
    ) -> Result<Vec<FlowEvent<f64>>, OrbitError> {
        self.within_limit(duration, Flight::Numbers, |steps_left| {
            Ok(self.flow.fly(state, parameters, duration, steps_left)?.events)
        })
    }

    /// Steps along the flow as [`each_step`]; the work is counted.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow).
    pub(super) fn each_step<T>(
        &self,
        state: &[f64],
        parameters: &[f64],
        duration: f64,
        look: impl FnMut(f64, f64, &[f64], &Step<'_, f64>) -> Option<T>,
    ) -> Result<Option<T>, OrbitError> {
        self.within_limit(duration, Flight::Numbers, |steps_left| {
            each_step(&self.flow, state, parameters, duration, steps_left, look)
        })
    }

    /// State as from [`flow`](Self::flow), with its derivatives in the given inputs.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow).
    pub(super) fn flow_with_jacobian<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
        inputs: &[usize],
    ) -> Result<(Vec<S>, DMatrix<S>), OrbitError> {
        self.within_limit::<S, _>(duration, Flight::Jets, |steps_left| {
            self.flow.flow_with_jacobian_within(state, parameters, duration, inputs, steps_left)
        })
    }

    /// Runs a flight in the steps that the limit leaves, and counts them.
    fn within_limit<S: Real, T>(
        &self,
        duration: S,
        of: Flight,
        fly: impl FnOnce(&mut usize) -> Result<T, OrbitError>,
    ) -> Result<T, OrbitError> {
        match &self.effort {
            None => fly(&mut self.flow.most_steps()),
            Some(effort) => effort.fly::<S, _>(duration.to_f64(), of, fly),
        }
    }

    /// Sets the point of matching.
    pub(super) fn matched(&self, matching: Matching) -> Self {
        Self { matching, ..self.clone() }
    }

    /// Point of matching to try where closure at the end fails. Backwards no stop acts, so that an
    /// orbit with hits closes at its end alone.
    pub(super) fn other_matching(&self) -> Matching {
        match self.flow.hits() {
            true => Matching::AtEnd,
            false => Matching::AtMiddle,
        }
    }

    /// Sets the fixed and the free parameters.
    pub(super) fn with(&self, base: &[Dd], free: &[usize]) -> Self {
        Self { base: base.to_vec(), free: free.to_vec(), ..self.clone() }
    }

    /// Reduces the system to closure and the first graze, with one free parameter.
    pub(super) fn first_graze(&self, parameter: usize) -> Self {
        Self {
            grazes: self.grazes.first(),
            geometries: self.geometries[..1].to_vec(),
            free: vec![parameter],
            ..self.clone()
        }
    }

    /// Expressions at the surface of a passage; the first also gives the flow and the clock.
    pub(super) fn geometry(&self, passage: usize) -> &Geometry {
        &self.geometries[passage]
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.first_parameter() + self.free.len()
    }

    /// Position of the second graze's time among the unknowns.
    fn first_time(&self) -> usize {
        self.dimension + usize::from(self.phase_advance.is_none())
    }

    /// Position of the first free parameter among the unknowns.
    pub(super) fn first_parameter(&self) -> usize {
        self.first_time() + self.grazes.independent - 1
    }

    fn equations(&self) -> usize {
        self.states + 2 * self.grazes.independent
    }

    /// Assembles the unknowns from their parts. `period` is used only for an autonomous system;
    /// `times` are the times of the independent grazes after the first.
    pub(super) fn assemble<S: Real>(
        &self,
        state: &[S],
        period: S,
        times: &[S],
        parameters: &[S],
    ) -> Vec<S> {
        let period = self.phase_advance.is_none().then_some(period);
        let free = self.free.iter().map(|&parameter| parameters[parameter]);
        let state = state.iter().chain(&period).chain(times).copied();
        state.chain(free).collect()
    }

    /// All parameters at these unknowns.
    pub(super) fn parameters<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        let mut parameters: Vec<S> = converted(&self.base);
        for (&parameter, &value) in self.free.iter().zip(&unknowns[self.first_parameter()..]) {
            parameters[parameter] = value;
        }
        parameters
    }

    /// Unit of the states: from the size of the states and, because states may vanish at a graze,
    /// of their rates times `T/2π`. An orbit at rest in 0 has neither: its unit is how far the
    /// surface moves with the adjusted parameters.
    pub(super) fn length(&self, unknowns: &[f64]) -> f64 {
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, _) = self.period_and_slopes(unknowns, &parameters);
        let local = self.geometries[0].at(state, &parameters);
        let rates = local.flow();
        let reached = rates.iter().map(|rate| rate * period / TAU);
        let sizes = state[..self.states].iter().copied().chain(reached.take(self.states));
        let size = sizes.fold(0.0, |size, value| value.abs().max(size));
        let slopes = local.event_gradient();
        let (by_state, by_parameter) = slopes.split_at(self.dimension);
        let steepest = by_state.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        let moves = self.free.iter().map(|&free| (by_parameter[free] * parameters[free]).abs());
        let moves = moves.fold(0.0, f64::max) / steepest;
        unit_of(if size <= AT_REST * moves { moves } else { size })
    }

    /// The [length](Self::length) of an orbit, and the unit of each state: that length, or that of
    /// the state alone where it is far smaller, as a displacement of micrometres beside speeds of
    /// metres a second.
    pub(super) fn state_units(&self, unknowns: &[f64]) -> (f64, Vec<f64>) {
        let length = self.length(unknowns);
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, _) = self.period_and_slopes(unknowns, &parameters);
        let rates = |state: &[f64]| self.geometries[0].at(state, &parameters).flow();
        let (here, time) = (rates(state), period / TAU);
        // A displacement at rest in 0 has no rate; its acceleration is the change of its rate.
        let ahead = state.iter().zip(&here).map(|(value, rate)| value + AHEAD * time * rate);
        let ahead = rates(&ahead.collect::<Vec<_>>());
        let unit = |at: usize| {
            let change = (ahead[at] - here[at]) / AHEAD * time;
            let size = state[at].abs().max((here[at] * time).abs()).max(change.abs());
            match (AT_REST * length..FAR_SMALLER * length).contains(&size) {
                true => unit_of(size),
                false => length,
            }
        };
        (length, (0..self.states).map(unit).collect())
    }

    /// Sizes of the states' rates, in units.
    fn rates_in_units(&self, unknowns: &[f64], units: &[f64]) -> Vec<f64> {
        let state = &unknowns[..self.dimension];
        let rates = self.geometries[0].at(state, &self.parameters(unknowns)).flow();
        rates.iter().zip(units).map(|(rate, unit)| (rate / unit).abs()).collect()
    }

    /// Unit of the gap and of its rate at a passage, in units of the states.
    fn touch_units(&self, unknowns: &[f64], units: &[f64], length: f64) -> Vec<f64> {
        if units.iter().all(|unit| *unit == length) {
            return vec![length; 2 * self.geometries.len()];
        }
        let (state, parameters) = (&unknowns[..self.dimension], self.parameters(unknowns));
        let touches = self.geometries.iter().flat_map(|geometry| {
            let local = geometry.at(state, &parameters);
            [local.event_gradient(), local.velocity_gradient()].map(|slopes| {
                let sizes = slopes.iter().zip(units).map(|(slope, unit)| (slope * unit).abs());
                unit_of(sizes.fold(0.0, f64::max))
            })
        });
        touches.collect()
    }

    /// The system in units: those of the states, and the size of each adjusted parameter.
    pub(super) fn scaled(&self, unknowns: &[f64]) -> Scaled<'_, Self> {
        let (length, states) = self.state_units(unknowns);
        let mut units = vec![1.0; self.unknowns()];
        units[..self.states].copy_from_slice(&states);
        let parameters = self.first_parameter()..unknowns.len();
        for place in parameters {
            units[place] = unit_of(unknowns[place].abs());
        }
        let touches = self.touch_units(unknowns, &states, length);
        let residual_units = states.into_iter().chain(touches).collect();
        Scaled { equations: self, units, residual_units, length }
    }

    /// Times of the independent grazes; the first is 0.
    pub(super) fn times<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        let later = &unknowns[self.first_time()..self.first_parameter()];
        [S::zero()].iter().chain(later).copied().collect()
    }

    /// Duration of one period of the orbit.
    pub(super) fn period<S: Real>(&self, unknowns: &[S]) -> S {
        self.period_and_slopes(unknowns, &self.parameters(unknowns)).0
    }

    /// The period and its derivatives in all parameters: `T = advance/rate(p)`.
    fn period_and_slopes<S: Real>(&self, unknowns: &[S], parameters: &[S]) -> (S, Vec<S>) {
        let local = self.geometries[0].at(&unknowns[..self.dimension], parameters);
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

    /// Ends that closure compares: each as a share of the period, with the factor of its states in
    /// the difference.
    fn ends(&self) -> [(f64, f64); 2] {
        let (share, image) = (self.grazes.share(), self.grazes.image());
        match self.matching {
            Matching::AtEnd => [(share, 1.0), (0.0, -image)],
            Matching::AtMiddle => [(0.5 * share, 1.0), (-0.5 * share, -image)],
        }
    }

    /// Residuals: closure in the states, then `h`, `h'` at every independent graze.
    pub(super) fn evaluate<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let state = &unknowns[..self.dimension];
        let parameters = self.parameters(unknowns);
        let (period, _) = self.period_and_slopes(unknowns, &parameters);
        let mut residual = vec![S::zero(); self.states];
        for (share, factor) in self.ends() {
            let duration = period * S::from_f64(share);
            let end = self.flow(state, &parameters, duration)?;
            for (sum, &component) in residual.iter_mut().zip(&end) {
                *sum += component * S::from_f64(factor);
            }
        }
        for (time, geometry) in self.times(unknowns).into_iter().zip(&self.geometries) {
            let there = self.flow(state, &parameters, time)?;
            let local = geometry.at(&there, &parameters);
            residual.extend([local.event(), local.velocity()]);
        }
        Ok(residual)
    }

    /// Residuals and their derivatives in every unknown.
    pub(super) fn differentiate(
        &self,
        unknowns: &[f64],
    ) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let parameters = self.parameters(unknowns);
        let mut residual = vec![0.0; self.states];
        let mut jacobian = DMatrix::zeros(self.equations(), self.unknowns());
        for (share, factor) in self.ends() {
            let end = self.add_closure(&mut jacobian, unknowns, &parameters, share, factor)?;
            for (sum, component) in residual.iter_mut().zip(end) {
                *sum += factor * component;
            }
        }
        for (passage, time) in self.times(unknowns).into_iter().enumerate() {
            let touch = self.fill_touch(&mut jacobian, unknowns, &parameters, passage, time)?;
            residual.extend(touch);
        }
        Ok((residual, jacobian))
    }

    /// The flow over a duration from the first graze.
    fn stretch(
        &self,
        unknowns: &[f64],
        parameters: &[f64],
        duration: f64,
    ) -> Result<FlowStretch, OrbitError> {
        let free = self.free.iter().map(|&parameter| self.dimension + parameter);
        let inputs: Vec<usize> = (0..self.dimension).chain(free).collect();
        let start = &unknowns[..self.dimension];
        let (state, jacobian) = self.flow_with_jacobian(start, parameters, duration, &inputs)?;
        let velocity = self.geometries[0].at(&state, parameters).flow();
        Ok(FlowStretch { state, jacobian, velocity })
    }

    /// Adds the derivatives of one end to the closure's rows; returns the state there.
    fn add_closure(
        &self,
        jacobian: &mut DMatrix<f64>,
        unknowns: &[f64],
        parameters: &[f64],
        share: f64,
        factor: f64,
    ) -> Result<Vec<f64>, OrbitError> {
        let (period, period_slopes) = self.period_and_slopes(unknowns, parameters);
        let end = self.stretch(unknowns, parameters, share * period)?;
        for row in 0..self.states {
            let by_period = end.velocity[row] * share;
            for column in 0..self.dimension {
                jacobian[(row, column)] += factor * end.jacobian[(row, column)];
            }
            if self.phase_advance.is_none() {
                jacobian[(row, self.dimension)] += factor * by_period;
            }
            for (number, &parameter) in self.free.iter().enumerate() {
                let slope = end.jacobian[(row, self.dimension + number)]
                    + by_period * period_slopes[parameter];
                jacobian[(row, self.first_parameter() + number)] += factor * slope;
            }
        }
        Ok(end.state)
    }

    /// Fills the two rows of a graze; returns `h` and `h'` there.
    fn fill_touch(
        &self,
        jacobian: &mut DMatrix<f64>,
        unknowns: &[f64],
        parameters: &[f64],
        passage: usize,
        time: f64,
    ) -> Result<[f64; 2], OrbitError> {
        let there = self.stretch(unknowns, parameters, time)?;
        let local = self.geometries[passage].at(&there.state, parameters);
        let rows = [
            (local.event_gradient(), local.velocity()),
            (local.velocity_gradient(), local.acceleration()),
        ];
        for (number, (slopes, by_time)) in rows.into_iter().enumerate() {
            let row = self.states + 2 * passage + number;
            let carried = |column: usize| -> f64 {
                let column = there.jacobian.column(column);
                column.iter().zip(&slopes).map(|(a, b)| a * b).sum()
            };
            for column in 0..self.dimension {
                jacobian[(row, column)] = carried(column);
            }
            for (number, &parameter) in self.free.iter().enumerate() {
                jacobian[(row, self.first_parameter() + number)] =
                    carried(self.dimension + number) + slopes[self.dimension + parameter];
            }
            if passage > 0 {
                jacobian[(row, self.first_time() + passage - 1)] = by_time;
            }
        }
        Ok([local.event(), local.velocity()])
    }
}

impl Equations for ExtendedSystem {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        self.differentiate(unknowns)
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        self.evaluate(unknowns)
    }
}

/// The component of the full state that all orbits of a family have alike at their start: the
/// phase, or without one the component that changes fastest there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeldComponent {
    place: usize,
    value: f64,
}

impl HeldComponent {
    /// Component of an orbit through a full state, in units of the states.
    pub(super) fn of(system: &ExtendedSystem, unknowns: &[f64], units: &[f64]) -> Self {
        let state = &unknowns[..system.dimension];
        let place = match system.phase_advance {
            Some(_) => system.states,
            None => {
                let rates = system.rates_in_units(unknowns, units).into_iter().enumerate();
                rates.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place)
            }
        };
        Self { place, value: state[place] }
    }

    /// Inserts the component among the unknowns of a family.
    pub(super) fn insert<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        let (before, after) = unknowns.split_at(self.place);
        [before, &[S::from_f64(self.value)], after].concat()
    }

    /// Removes the component from unknowns of the extended system.
    pub(super) fn remove(&self, mut unknowns: Vec<f64>) -> Vec<f64> {
        unknowns.remove(self.place);
        unknowns
    }

    /// Whether a flow passes the value at so small an angle that another component is to be held:
    /// its rate there, in units, is far from the largest.
    pub(super) fn is_oblique(
        &self,
        system: &ExtendedSystem,
        unknowns: &[f64],
        units: &[f64],
    ) -> bool {
        let rates = system.rates_in_units(unknowns, units);
        let largest = rates.iter().copied().fold(0.0, f64::max);
        system.phase_advance.is_none() && rates[self.place] < OBLIQUE * largest
    }
}

/// Closure of the period as equations in the states but the [held](HeldComponent) one, the period
/// of an autonomous system, and the free parameters of a system of one graze.
///
/// Without a free parameter its solutions are single orbits; with one there is one equation fewer
/// than unknowns, and they form the curve of periodic orbits.
#[derive(Clone, Debug)]
pub(super) struct PeriodicFamily {
    system: ExtendedSystem,
    held: HeldComponent,
}

impl PeriodicFamily {
    /// Orbits of a system with this component held.
    pub(super) fn new(system: &ExtendedSystem, held: HeldComponent) -> Self {
        Self { system: system.clone(), held }
    }
}

impl Equations for PeriodicFamily {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let count = self.system.states;
        let (residual, jacobian) = self.system.differentiate(&self.held.insert(unknowns))?;
        let closure = jacobian.rows(0, count).into_owned().remove_column(self.held.place);
        Ok((residual[..count].to_vec(), closure))
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let mut residual = self.system.evaluate(&self.held.insert(unknowns))?;
        residual.truncate(self.system.states);
        Ok(residual)
    }
}

/// Newton's method with the period matched at its end, then in its middle; if both fail, the
/// failure at the end is returned. The tolerance is one of residuals in the units of the start.
pub(super) fn solve_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Solved<Vec<f64>> {
    let matched = |matching| system.matched(matching).scaled(start).solve(start, tolerance);
    match matched(Matching::AtEnd)? {
        Err(failure) => Ok(matched(system.other_matching())?.map_err(|_| failure)),
        root => Ok(root),
    }
}

/// Refinement with the period matched at its end, then in its middle, to a tolerance relative to
/// the size of the scaled unknowns.
pub(super) fn refine_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Solved<Root> {
    let matched = |matching| system.matched(matching).scaled(start).refine(start, tolerance);
    match matched(Matching::AtEnd) {
        Ok(Ok(root)) => Ok(Ok(root)),
        _ => matched(system.other_matching()),
    }
}
