//! The frame between offsets of a map and states of direct simulation: the section of a scene with
//! offsets and full states, the passages of a return, values of expressions, and escape bounds.

use serde::{Deserialize, Serialize};

use super::error::{AnalysisError, check_length};
use crate::expansion::LocalMap;
use crate::flow::{InputKind, Program};
use crate::hybrid::{NominalPassage, ReturnSection, Variation};
use crate::iteration::{Itinerary, PhaseCircle};
use crate::jet::TimeSeries;
use crate::model::{ExpressionGraph, Model, NodeId, Scene};
use crate::numeric::{Dd, Real, Scalar, converted, unbounded_number};
use crate::orbit::{
    FollowingHit, FollowingPassage, GrazingOrbit, PiecewiseFlow, PoincareSection,
    PoincareSectionKind,
};

/// Most Newton steps onto the tangency section; each doubles the number of correct digits.
const NEWTON_STEPS: usize = 40;

/// The section of a scene through its grazing orbit: converts offsets to full states and back.
///
/// State offsets are relative to the point where the grazing orbit at `p*` meets the section, at
/// all parameters; parameter offsets are relative to `p*`. On a tangency section the component that
/// is no coordinate is solved for from `h'(x, p) = 0`.
#[derive(Clone, Debug)]
pub struct SectionFrame<S: Real> {
    section: PoincareSection,
    origin: Vec<S>,
    grazing_parameters: Vec<S>,
    active: Vec<usize>,
    surface: usize,
    passages: Vec<FollowingPassage>,
    hits: Vec<FollowingHit>,
    tangency: Values<S>,
    gap: Values<S>,
    clock: Option<Clock<S>>,
    orbit_period: S,
    state: Vec<S>,
    parameters: Vec<S>,
}

/// The forcing: its rate as a function of the parameters, and the advance of its phase in a return.
#[derive(Clone, Debug)]
struct Clock<S: Real> {
    rate: Values<S>,
    advance: S,
    periods: usize,
}

impl<S: Real> SectionFrame<S> {
    /// The frame of the section itself.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        Self::about(scene, orbit, &orbit.section_point)
    }

    /// The frame of the section moved along the orbit to the graze, where `D` acts.
    pub fn at_graze(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        Self::about(scene, orbit, &orbit.grazing_point().state)
    }

    fn about(scene: &Scene, orbit: &GrazingOrbit, origin: &[Dd]) -> Self {
        let model = &scene.model;
        let surface = orbit.grazing_point().surface;
        let phase = model.phase.as_ref();
        Self {
            section: orbit.section.clone(),
            origin: converted(origin),
            grazing_parameters: converted(orbit.parameters()),
            active: scene.expansion.active.clone(),
            surface,
            passages: orbit.passages_after_section(scene),
            hits: orbit.hits_after_section(scene),
            tangency: tangency(model, surface, orbit.section.eliminated),
            gap: Values::new(model, &model.graph, &[model.surfaces[surface].event]),
            clock: phase.map(|clock| Clock {
                rate: Values::new(model, &model.graph, &[clock.rate]),
                advance: S::from_dd(clock.period * Dd::from(scene.grazing.periods as f64)),
                periods: scene.grazing.periods,
            }),
            orbit_period: S::from_dd(orbit.period),
            state: converted(origin),
            parameters: converted(orbit.parameters()),
        }
    }

    /// The frame of a map that makes `returns` returns at once.
    pub(super) fn over(mut self, returns: usize) -> Self {
        if let Some(clock) = &mut self.clock {
            clock.advance *= S::from_f64(returns as f64);
            clock.periods *= returns;
        }
        self.orbit_period *= S::from_f64(returns as f64);
        let later = |number: usize, passage: &FollowingPassage| FollowingPassage {
            share: (number as f64 + passage.share) / returns as f64,
            ..*passage
        };
        let passages = std::mem::take(&mut self.passages);
        let numbers = 0..returns;
        let passages = numbers.flat_map(|number| passages.iter().map(move |p| later(number, p)));
        self.passages = passages.collect();
        let hits = (0..returns).flat_map(|number| {
            let share = move |hit: &FollowingHit| (number as f64 + hit.share) / returns as f64;
            self.hits.iter().map(move |hit| FollowingHit { share: share(hit), ..*hit })
        });
        self.hits = hits.collect();
        self
    }

    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.section.coordinates.len()
    }

    /// Number of active parameters.
    pub fn active(&self) -> usize {
        self.active.len()
    }

    /// Index of the surface that grazes first.
    pub fn surface(&self) -> usize {
        self.surface
    }

    /// Kind of section.
    pub fn kind(&self) -> PoincareSectionKind {
        self.section.kind
    }

    /// The section as direct simulation takes it.
    pub fn return_section(&self) -> ReturnSection {
        match (self.section.kind, self.passages.first()) {
            (PoincareSectionKind::Stroboscopic { .. }, Some(first)) if first.share == 0.0 => {
                ReturnSection::GrazingPhase { surface: first.surface }
            }
            (PoincareSectionKind::Stroboscopic { .. }, _) => ReturnSection::OtherPhase,
            (PoincareSectionKind::Tangency, _) => ReturnSection::Tangency { surface: self.surface },
        }
    }

    /// Grazing passages of one return of nominal length `duration`, in the order in which they
    /// follow the section, then its hits.
    pub fn nominal_passages(&self, duration: S) -> Vec<NominalPassage> {
        let passages = self.passages.iter().map(|at| (at.surface, at.share, [false; 2]));
        let hits = self.hits.iter().map(|at| (at.surface, at.share, [true, at.rests]));
        let nominal = passages.chain(hits).map(|(surface, share, [hit, rests])| NominalPassage {
            surface,
            time: share * duration.to_f64(),
            hit,
            rests,
        });
        nominal.collect()
    }

    /// Indices in [`GrazingOrbit::passages`] of these passages.
    pub fn passage_places(&self) -> Vec<usize> {
        self.passages.iter().map(|passage| passage.place).collect()
    }

    /// Whole periods by which the phase advances in one return; 0 for an autonomous system.
    pub fn periods(&self) -> usize {
        self.clock.as_ref().map_or(0, |clock| clock.periods)
    }

    /// Advance of the phase in one return; 0 for an autonomous system.
    pub fn advance(&self) -> S {
        self.clock.as_ref().map_or(S::zero(), |clock| clock.advance)
    }

    /// Sets the full state and the parameters from offsets; read them with [`state`](Self::state)
    /// and [`parameters`](Self::parameters).
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`].
    pub fn place(&mut self, offsets: &[S], parameter_offsets: &[S]) -> Result<(), AnalysisError> {
        check_length("offsets of the state", self.dimension(), offsets.len())?;
        check_length("offsets of the parameters", self.active.len(), parameter_offsets.len())?;
        self.state.copy_from_slice(&self.origin);
        for (&component, &offset) in self.section.coordinates.iter().zip(offsets) {
            self.state[component] += offset;
        }
        self.parameters.copy_from_slice(&self.grazing_parameters);
        for (&parameter, &offset) in self.active.iter().zip(parameter_offsets) {
            self.parameters[parameter] += offset;
        }
        if self.section.kind == PoincareSectionKind::Tangency {
            self.solve_tangency();
        }
        Ok(())
    }

    /// Full state set by the last [`place`](Self::place).
    pub fn state(&self) -> &[S] {
        &self.state
    }

    /// Gap of the section's surface at the last state placed.
    pub(super) fn gap(&mut self) -> S {
        self.gap.evaluate(&self.state, &self.parameters).get(0)
    }

    /// Phase of the last state placed, and phase of the section point; `None` for an autonomous
    /// system.
    pub fn phase(&self) -> Option<(S, S)> {
        let last = self.state.len().checked_sub(1)?;
        self.clock.as_ref().map(|_| (self.state[last], self.origin[last]))
    }

    /// All parameters of the model at the last [`place`](Self::place).
    pub fn parameters(&self) -> &[S] {
        &self.parameters
    }

    /// Nominal return time at the last parameters placed.
    pub fn duration(&mut self) -> S {
        let (state, parameters) = (&self.state, &self.parameters);
        self.clock.as_mut().map_or(self.orbit_period, |clock| {
            clock.advance / clock.rate.evaluate(state, parameters).get(0)
        })
    }

    /// Offsets of the coordinates of a full state.
    pub fn offsets(&self, state: &[S]) -> Vec<S> {
        self.offset_values(|component| state[component]).collect()
    }

    /// Offsets of the coordinates of a full state, given by its components.
    pub(super) fn offset_values(&self, state: impl Fn(usize) -> S) -> impl Iterator<Item = S> {
        let coordinates = self.section.coordinates.iter();
        coordinates.map(move |&component| state(component) - self.origin[component])
    }

    /// Components of the full state that are coordinates of the section.
    pub(super) fn components(&self) -> &[usize] {
        &self.section.coordinates
    }

    /// Component of the full state that is no coordinate of the section.
    pub(super) fn eliminated(&self) -> usize {
        self.section.eliminated
    }

    /// Unit directions of the coordinates and then of the active parameters in `free`.
    pub(super) fn directions(&self, free: &[usize]) -> Vec<Variation<S>> {
        let states = self.section.coordinates.iter();
        let states = states.map(|&component| self.direction(Some(component), None));
        let parameters = free.iter().map(|&place| self.direction(None, Some(self.active[place])));
        states.chain(parameters).collect()
    }

    /// Unit directions of all components of the full state.
    pub(super) fn state_directions(&self) -> Vec<Variation<S>> {
        (0..self.state.len()).map(|component| self.direction(Some(component), None)).collect()
    }

    fn direction(&self, component: Option<usize>, parameter: Option<usize>) -> Variation<S> {
        let unit = |size: usize, place: Option<usize>| {
            (0..size).map(move |other| match place == Some(other) {
                true => S::one(),
                false => S::zero(),
            })
        };
        Variation {
            state: unit(self.state.len(), component).collect(),
            parameters: unit(self.parameters.len(), parameter).collect(),
        }
    }

    /// Solves `h' = 0` for the eliminated component by Newton's method.
    fn solve_tangency(&mut self) {
        let eliminated = self.section.eliminated;
        newton_to_rounding(self.state[eliminated], NEWTON_STEPS, |value| {
            self.state[eliminated] = value;
            let values = self.tangency.evaluate(&self.state, &self.parameters);
            Some(values.get(0) / values.get(1))
        });
    }
}

/// The phase as a coordinate of a section, if it is one.
pub(super) fn phase_circle<S: Real>(scene: &Scene, orbit: &GrazingOrbit) -> PhaseCircle<S> {
    let last = scene.model.dimension() - 1;
    let place = orbit.section.coordinates.iter().position(|&component| component == last);
    let phase = scene.model.phase.as_ref().zip(place);
    phase.map_or_else(PhaseCircle::none, |(phase, place)| {
        PhaseCircle::new(place, S::from_dd(phase.period))
    })
}

/// Newton's method in one variable: `step` returns the step to subtract at a point. Ends when the
/// steps no longer shrink, so that rounding is reached, or after `most` steps; returns the last
/// point at which `step` was called.
///
/// `None` if `step` returns `None`.
pub(super) fn newton_to_rounding<S: Real>(
    start: S,
    most: usize,
    mut step: impl FnMut(S) -> Option<S>,
) -> Option<S> {
    let (mut at, mut last) = (start, f64::INFINITY);
    let mut next = step(at)?;
    for _ in 0..most {
        let size = next.magnitude();
        if size == 0.0 || !size.is_finite() || size >= last {
            break;
        }
        (at, last) = (at - next, size);
        next = step(at)?;
    }
    Some(at)
}

/// `h'` and its derivative by the eliminated component.
fn tangency<S: Real>(model: &Model, surface: usize, eliminated: usize) -> Values<S> {
    let mut graph = model.graph.clone();
    let velocity = model.surfaces[surface].normal_velocity;
    let slope = graph.derivative(velocity, eliminated);
    Values::new(model, &graph, &[velocity, slope])
}

/// Surfaces met by the passages of one return, in the order in which they follow the section.
pub fn itinerary(scene: &Scene, orbit: &GrazingOrbit) -> Itinerary {
    let following = orbit.passages_after_section(scene);
    let grazes = |&surface: &usize| following.iter().any(|passage| passage.surface == surface);
    let surfaces: Vec<usize> = (0..scene.model.surfaces.len()).filter(grazes).collect();
    let name = |&surface: &usize| scene.model.surfaces[surface].name.clone();
    let position = |passage: &FollowingPassage| {
        let place = surfaces.iter().position(|&known| known == passage.surface);
        place.unwrap_or(0)
    };
    let hits =
        |&surface: &usize| orbit.hits.iter().filter(|hit| hit.surface == surface).count() as u32;
    Itinerary {
        surfaces: surfaces.iter().map(name).collect(),
        passages: following.iter().map(position).collect(),
        nominal_hits: surfaces.iter().map(hits).collect(),
        periods: scene.grazing.periods,
    }
}

/// Expressions of a graph as a program that computes their values.
#[derive(Clone, Debug)]
pub(super) struct Values<S: Scalar> {
    program: Program,
    tape: Vec<S>,
}

impl<S: Scalar> Values<S> {
    /// Expressions in the inputs of a model: the full state, then all parameters.
    pub(super) fn new(model: &Model, graph: &ExpressionGraph, outputs: &[NodeId]) -> Self {
        let inputs = vec![InputKind::Variable; model.dimension() + model.parameters.len()];
        let program = Program::new(graph, outputs, &inputs);
        let tape = vec![S::zero(); program.slots()];
        Self { program, tape }
    }

    /// Evaluates all expressions; read them with [`get`](Self::get).
    pub(super) fn evaluate(&mut self, state: &[S], parameters: &[S]) -> &mut Self {
        self.tape[..state.len()].copy_from_slice(state);
        self.tape[state.len()..state.len() + parameters.len()].copy_from_slice(parameters);
        self.program.advance(&TimeSeries { order: 0 }, 0, &mut self.tape, &mut [S::zero()]);
        self
    }

    /// Value of one expression at the last state evaluated.
    pub(super) fn get(&self, output: usize) -> S {
        self.tape[self.program.output(output)]
    }
}

/// Number of points on the grazing orbit from which its extents are computed.
const SAMPLES: usize = 64;

/// Smallest extent of a moving coordinate along the grazing orbit, relative to the largest extent.
const STILL: f64 = 1e-9;

/// Escape bound of a coordinate of the section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EscapeBound {
    /// Name of the coordinate.
    pub coordinate: String,
    /// The bound in extents of the grazing orbit: `direct.escape` of the scene.
    pub extents: f64,
    /// Largest absolute offset; infinite for the phase, and for coordinates that do not move along
    /// the grazing orbit.
    #[serde(with = "unbounded_number")]
    pub offset: f64,
}

/// Escape bounds of all coordinates of the section: `direct.escape` of the scene times the extents
/// of the grazing orbit.
pub fn escape_bounds(scene: &Scene, orbit: &GrazingOrbit) -> Vec<EscapeBound> {
    let extents = extents(scene, orbit);
    let largest = extents.iter().copied().fold(0.0, f64::max);
    let times = scene.direct.escape;
    let coordinates = orbit.section_coordinates(scene).into_iter();
    let phase = phase_circle::<f64>(scene, orbit).phase().map(|(place, _)| place);
    let bound = |(place, ((name, _), extent)): (usize, ((&str, _), f64))| EscapeBound {
        coordinate: name.to_owned(),
        extents: times,
        offset: match Some(place) != phase && extent > STILL * largest {
            true => times * extent,
            false => f64::INFINITY,
        },
    };
    coordinates.zip(extents).enumerate().map(bound).collect()
}

/// Half-widths of the window of a map, enlarged where a share of them
/// ([`period_tolerance`](crate::iteration::OrbitRequest::period_tolerance)) would be below the
/// rounding of the coordinates.
pub(super) fn resolved_widths(scene: &Scene, orbit: &GrazingOrbit, map: &LocalMap) -> Vec<f64> {
    let point: Vec<f64> = converted(&orbit.section_point);
    let coordinates = orbit.section.coordinates.iter();
    let sizes = coordinates.zip(extents(scene, orbit)).zip(&map.window.state);
    let resolved = sizes.map(|((&component, extent), &width)| {
        let size = point[component].abs().max(extent);
        width.max(RESOLVED * size)
    });
    resolved.collect()
}

/// Smallest half-width relative to the size of a coordinate: 1e-8 of it equals 40 roundings.
const RESOLVED: f64 = 1e-6;

/// Difference of the largest and the smallest value of every coordinate along the grazing orbit;
/// 0 for an orbit at rest, which varies by rounding alone.
pub(super) fn extents(scene: &Scene, orbit: &GrazingOrbit) -> Vec<f64> {
    let samples = orbit_samples(scene, orbit);
    let coordinates = &orbit.section.coordinates;
    let values = samples.iter().flat_map(|sample| coordinates.iter().map(|&at| sample[at].abs()));
    let largest = values.fold(0.0, f64::max);
    let resolved = |extent: f64| if extent > AT_REST * largest { extent } else { 0.0 };
    coordinates.iter().map(|&component| resolved(extent(&samples, component))).collect()
}

/// Largest extent, relative to the largest coordinate, that may be due to rounding.
const AT_REST: f64 = 1e-13;

/// Difference of the largest and the smallest value of a component of full states.
pub(super) fn extent(samples: &[Vec<f64>], component: usize) -> f64 {
    let values = || samples.iter().map(|sample| sample[component]);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

/// Full states on the grazing orbit, evenly spaced in time over one period from the section.
pub(super) fn orbit_samples(scene: &Scene, orbit: &GrazingOrbit) -> Vec<Vec<f64>> {
    let flow = PiecewiseFlow::free(scene, &[]);
    let parameters: Vec<f64> = converted(orbit.parameters());
    let step = orbit.period.to_f64() / SAMPLES as f64;
    let mut samples = vec![converted(&orbit.section_point)];
    for _ in 0..SAMPLES {
        let last: &Vec<f64> = &samples[samples.len() - 1];
        let Ok(next) = flow.flow(last, &parameters, step) else { break };
        samples.push(next);
    }
    samples
}
