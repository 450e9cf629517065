//! Minima of the event functions along a stretch of the flow of an orbit, and corners on it.
//!
//! An orbit has no Taylor series at a corner, where `abs`, `sign`, `min` or `max` changes branch,
//! nor where a square root, a logarithm or a real power has the argument 0.

use std::ops::Range;

use super::outcome::{NamedValues, NotLocated, OrbitError};
use super::piecewise::{FlightPart, PiecewiseFlow, gap_along};
use crate::flow::{Integrator, Step, bound_but, horner};
use crate::model::{CornerOperation, Model, NodeId, Response, Scene, Surface};
use crate::numeric::polynomial::{CrossingDirection, ExtremumKind, crossings, extrema};

/// A minimum of an event function.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Minimum {
    /// Surface of the event function (index).
    pub(super) surface: usize,
    /// Time since the start.
    pub(super) time: f64,
    /// Full state at the minimum.
    pub(super) state: Vec<f64>,
    /// Event function at the minimum.
    pub(super) event: f64,
}

/// Minima along a stretch, and the largest values of the event functions.
#[derive(Clone, Debug)]
pub(super) struct Gaps {
    /// Minima of all surfaces, sorted by time.
    pub(super) minima: Vec<Minimum>,
    /// Largest value of each event function.
    pub(super) largest: Vec<f64>,
    /// Number of Taylor steps in the stretch.
    pub(super) steps: usize,
}

/// Largest value of an event function along an orbit, relative to the lowest, that counts as a
/// touch.
const TOUCH: f64 = 1e-9;

impl Gaps {
    /// The first surface beyond which the whole stretch lies, except for a touch, with the largest
    /// value of its event function.
    pub(super) fn beyond(&self) -> Option<(usize, f64)> {
        let mut surfaces = self.largest.iter().copied().enumerate();
        surfaces.find(|&(surface, largest)| {
            let mine = self.minima.iter().filter(|minimum| minimum.surface == surface);
            let lowest = mine.map(|minimum| minimum.event).fold(largest, f64::min);
            lowest < 0.0 && largest <= -TOUCH * lowest
        })
    }

    /// The minima strictly inside a range of times.
    pub(super) fn between(&self, times: Range<f64>) -> impl Iterator<Item = &Minimum> {
        let within =
            move |minimum: &&Minimum| times.start < minimum.time && minimum.time < times.end;
        self.minima.iter().filter(within)
    }
}

/// The flow of a scene's orbit, which watches the event function of every surface.
pub(super) fn watching(scene: &Scene) -> PiecewiseFlow {
    let surfaces = scene.model.surfaces.iter();
    let watched: Vec<_> = surfaces.map(|surface| surface.event).collect();
    PiecewiseFlow::free(scene, &watched)
}

/// Minima of every event function on `(0, duration]` along a [`watching`] flow. Where the orbit
/// hits a surface, it has no minimum of that surface; another surface that it is beyond there has
/// one.
///
/// Along a step the event function is a polynomial in time; all zeros of its derivative are
/// isolated, whatever their number.
pub(super) fn gaps(
    flow: &PiecewiseFlow,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
) -> Result<Gaps, OrbitError> {
    let none =
        || Gaps { minima: Vec::new(), largest: vec![f64::NEG_INFINITY; flow.watched()], steps: 0 };
    let mut found = none();
    let mut ends = vec![f64::INFINITY; flow.watched()];
    let look = |passed: FlightPart<'_, '_, f64>| -> Option<()> {
        let (elapsed, length, state, step, contact, released) = match passed {
            FlightPart::Step { elapsed, length, start, step, contact, released } => {
                (elapsed, length, start, step, contact, released)
            }
            FlightPart::Event(event) => {
                let beyond = ends.iter().enumerate().filter(|&(surface, &end)| {
                    end < 0.0 && surface != event.surface && event.meets
                });
                found.minima.extend(beyond.map(|(surface, &end)| Minimum {
                    surface,
                    time: event.time,
                    state: event.state.clone(),
                    event: end,
                }));
                return None;
            }
            FlightPart::Again => {
                found = none();
                ends.fill(f64::INFINITY);
                return None;
            }
        };
        found.steps += 1;
        for (surface, end) in ends.iter_mut().enumerate() {
            let event = &gap_along(step, surface, released);
            *end = horner(event, length);
            found.largest[surface] = found.largest[surface].max(horner(event, 0.0));
            if contact == Some(surface) {
                continue;
            }
            for turn in extrema(event, length) {
                if turn.kind == ExtremumKind::Maximum {
                    found.largest[surface] = found.largest[surface].max(turn.value);
                    continue;
                }
                let mut there = state.to_vec();
                step.state_at(turn.time, &mut there);
                found.minima.push(Minimum {
                    surface,
                    time: elapsed + turn.time,
                    state: there,
                    event: turn.value,
                });
            }
        }
        None
    };
    flow.each(start, parameters, duration, &mut flow.most_steps(), look)?;
    found.minima.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(found)
}

/// Steps along a flow for a duration, until `look` returns a value, in a limited number of steps,
/// which is lowered by the steps taken. Arguments of `look` are the time since the start, the
/// length of the step, the state at its start and the step.
pub(super) fn each_step<T>(
    flow: &PiecewiseFlow,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
    steps_left: &mut usize,
    mut look: impl FnMut(f64, f64, &[f64], &Step<'_, f64>) -> Option<T>,
) -> Result<Option<T>, OrbitError> {
    let steps = |passed: FlightPart<'_, '_, f64>| match passed {
        FlightPart::Step { elapsed, length, start, step, .. } => look(elapsed, length, start, step),
        FlightPart::Event(_) | FlightPart::Again => None,
    };
    flow.each(start, parameters, duration, steps_left, steps)
}

/// An argument within this distance of its corner, relative to its variation, is on the corner.
const ON_THE_CORNER: f64 = 1e-12;
/// Largest argument that is 0 where a flow stops: its steps shrink in proportion to the distance.
const AT_ZERO: f64 = 1e-9;
/// Factor to round states in messages to nine decimals.
const DECIMALS: f64 = 1e9;

/// Operations with a corner in the free field, the event functions and the resets of a scene.
pub(super) struct Corners<'a> {
    scene: &'a Scene,
    /// Flow that watches the arguments of the operations.
    flow: PiecewiseFlow,
    operations: Vec<Operation>,
}

/// An operation with a corner.
struct Operation {
    function: &'static str,
    place: Place,
}

/// Place of an operation in the model.
#[derive(Clone, Copy)]
enum Place {
    /// Rate of a state; the whole orbit depends on it.
    Rate(usize),
    /// Event function of a surface; its minima are searched along the whole orbit.
    Event(usize),
    /// State after the impact with a surface; only its series at a graze of that surface matters.
    Reset {
        /// Index of the surface.
        surface: usize,
        /// Index of the state.
        state: usize,
    },
    /// Rate of a state in contact with a surface that the orbit hits.
    Contact {
        /// Index of the surface.
        surface: usize,
        /// Index of the state.
        state: usize,
    },
}

impl Place {
    /// Key of the expression in the scene.
    fn key(self, model: &Model) -> String {
        match self {
            Place::Rate(state) => format!("model.flow.{}", model.states[state]),
            Place::Event(surface) => format!("model.surface.{surface}.event"),
            Place::Reset { surface, state } => {
                format!("model.surface.{surface}.impact.{}", model.states[state])
            }
            Place::Contact { surface, state } => {
                format!("model.surface.{surface}.contact.{}", model.states[state])
            }
        }
    }

    /// Surface at whose grazes alone the operation matters; `None` if it matters everywhere.
    fn surface(self) -> Option<usize> {
        match self {
            Place::Rate(_) | Place::Event(_) | Place::Contact { .. } => None,
            Place::Reset { surface, .. } => Some(surface),
        }
    }
}

impl<'a> Corners<'a> {
    /// Operations whose arguments depend on a state, an adjusted or active parameter, or one of
    /// `others`; `None` if there are none.
    pub(super) fn of(scene: &'a Scene, others: &[usize]) -> Option<Self> {
        let mut graph = scene.model.graph.clone();
        let dimension = scene.model.dimension();
        let free = [&scene.grazing.solve_for, &scene.expansion.active, others];
        let parameter = |input: usize| free.iter().any(|free| free.contains(&(input - dimension)));
        let moves = |input: usize| input < dimension || parameter(input);
        let (mut operations, mut arguments) = (Vec::new(), Vec::new());
        for (place, expression) in expressions(scene) {
            for corner in graph.corner_operations(expression) {
                let mut inputs = graph.dependencies(corner.argument).into_iter();
                if inputs.any(moves) {
                    arguments.push(corner.argument);
                    let function = corner.function;
                    operations.push(Operation { function, place });
                }
            }
        }
        let model = &scene.model;
        let all: Vec<usize> = (0..model.parameters.len()).collect();
        let kinds = bound_but(&all, &model.parameter_values());
        (!operations.is_empty()).then(|| Self {
            flow: PiecewiseFlow::of_graph(scene, graph, &arguments, &kinds),
            scene,
            operations,
        })
    }

    /// The first corner at a graze of an orbit or along one period from the first graze. Grazes are
    /// given by surface and state.
    pub(super) fn of_orbit(
        &self,
        grazes: &[(usize, Vec<f64>)],
        parameters: &[f64],
        period: f64,
    ) -> Result<Option<NotLocated>, OrbitError> {
        for (surface, state) in grazes {
            if let Some(corner) = self.at(*surface, state, parameters)? {
                return Ok(Some(corner));
            }
        }
        match grazes.first() {
            Some((_, start)) => self.along(start, parameters, period),
            None => Ok(None),
        }
    }

    /// The first corner at a graze of a surface.
    fn at(
        &self,
        surface: usize,
        state: &[f64],
        parameters: &[f64],
    ) -> Result<Option<NotLocated>, OrbitError> {
        let mut integrator = Integrator::<f64>::new(self.flow.field());
        let step = integrator.step(state, parameters)?;
        let near = |&number: &usize| begins_at_zero(step.watched_coefficients(number), step.length);
        let first = self.at_grazes_of(surface).find(near);
        Ok(first.map(|number| self.met(number, state)))
    }

    /// Indices of the operations that matter at a graze of a surface.
    fn at_grazes_of(&self, surface: usize) -> impl Iterator<Item = usize> {
        let operations = self.operations.iter().enumerate();
        let there =
            operations.filter(move |(_, at)| at.place.surface().is_none_or(|of| of == surface));
        there.map(|(number, _)| number)
    }

    /// Arguments, at every graze, of the operations that matter there.
    pub(super) fn arguments(
        &self,
        grazes: &[(usize, Vec<f64>)],
        parameters: &[f64],
    ) -> Result<Vec<f64>, OrbitError> {
        let mut integrator = Integrator::<f64>::new(self.flow.field());
        let mut arguments = Vec::new();
        for (surface, state) in grazes {
            let step = integrator.step(state, parameters)?;
            let numbers = self.at_grazes_of(*surface);
            arguments.extend(numbers.map(|number| step.watched_coefficients(number)[0]));
        }
        Ok(arguments)
    }

    /// Description of the corner of an argument, by its index among [`arguments`](Self::arguments).
    pub(super) fn of_argument(
        &self,
        grazes: &[(usize, Vec<f64>)],
        index: usize,
    ) -> Option<NotLocated> {
        let mut all = grazes.iter().flat_map(|(surface, state)| {
            let numbers = self.at_grazes_of(*surface);
            numbers.map(move |number| (number, state))
        });
        all.nth(index).map(|(number, state)| self.met(number, state))
    }

    /// The first corner that the flow crosses within a duration from a point.
    pub(super) fn along(
        &self,
        start: &[f64],
        parameters: &[f64],
        duration: f64,
    ) -> Result<Option<NotLocated>, OrbitError> {
        let mut signs = vec![0.0; self.operations.len()];
        let mut most = self.flow.most_steps();
        each_step(&self.flow, start, parameters, duration, &mut most, |_, length, state, step| {
            let arguments = signs.iter_mut().enumerate();
            let everywhere =
                arguments.filter(|&(number, _)| self.operations[number].place.surface().is_none());
            let changes = everywhere.filter_map(|(number, sign)| {
                let argument = step.watched_coefficients(number);
                Some((first_sign_change(argument, length, sign)?, number))
            });
            let (time, number) = changes.min_by(|a, b| a.0.total_cmp(&b.0))?;
            let mut there = state.to_vec();
            step.state_at(time, &mut there);
            Some(self.met(number, &there))
        })
    }

    fn met(&self, number: usize, state: &[f64]) -> NotLocated {
        let Operation { function, place } = self.operations[number];
        let model = &self.scene.model;
        NotLocated::Corner { function, key: place.key(model), at: named(model, state) }
    }
}

/// A square root, logarithm or real power of the free flow, an event function, a reset or the
/// contact of a stop that the orbit hits, whose argument is 0 at the place where a flow from
/// `start` stops; `None` if the flow goes on for the duration, or stops for another reason.
pub(super) fn singular(
    scene: &Scene,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
) -> Option<NotLocated> {
    let (model, mut last) = (&scene.model, start.to_vec());
    let flow = watching(scene);
    let mut most = flow.most_steps();
    let flown = each_step(&flow, start, parameters, duration, &mut most, |_, length, _, step| {
        step.state_at(length, &mut last);
        None::<()>
    });
    flown.err()?;
    let inputs: Vec<f64> = last.iter().chain(parameters).copied().collect();
    let mut values = Vec::new();
    model.graph.evaluate(&inputs, &mut values);
    let all = expressions(scene).chain(contacts(scene));
    let singular = all.flat_map(|(place, expression)| {
        let operations = model.graph.singular_operations(expression).into_iter();
        operations.map(move |operation| (place, operation))
    });
    let mut at_zero =
        singular.filter(|(_, operation)| values[operation.argument.index()].abs() <= AT_ZERO);
    let (place, CornerOperation { function, .. }) = at_zero.next()?;
    Some(NotLocated::NoSeries { function, key: place.key(model), at: named(model, &last) })
}

/// State with its names; the phase within its period.
fn named(model: &Model, state: &[f64]) -> NamedValues {
    let phase = model.phase.iter().map(|phase| (&phase.name, phase.period.to_f64()));
    let (states, clock) = state.split_at(model.states.len());
    let clock = clock.iter().zip(phase);
    let clock = clock.map(|(value, (name, period))| (name.clone(), value.rem_euclid(period)));
    let states = model.states.iter().cloned().zip(states.iter().copied());
    NamedValues(states.chain(clock).map(rounded).collect())
}

/// Expressions of the free flow, the event functions and the rigid impacts.
fn expressions(scene: &Scene) -> impl Iterator<Item = (Place, NodeId)> {
    let model = &scene.model;
    let rates = model.flow.iter().take(model.states.len()).enumerate();
    let rates = rates.map(|(state, &rate)| (Place::Rate(state), rate));
    let surfaces = model.surfaces.iter().enumerate();
    let events = surfaces.clone();
    let events = events.map(|(number, surface)| (Place::Event(number), surface.event));
    rates.chain(events).chain(surfaces.flat_map(resets))
}

/// Rates in contact with the compliant stops that the orbit hits.
fn contacts(scene: &Scene) -> impl Iterator<Item = (Place, NodeId)> {
    let hit = scene.grazing.hits.surfaces.iter();
    hit.flat_map(|&surface| {
        let field = match &scene.model.surfaces[surface].response {
            Response::Contact { field, .. } => field.as_slice(),
            Response::Impact { .. } => &[],
        };
        let rates = field.iter().take(scene.model.states.len()).enumerate();
        rates.map(move |(state, &rate)| (Place::Contact { surface, state }, rate))
    })
}

/// States after an impact; none for a compliant surface.
fn resets((surface, described): (usize, &Surface)) -> impl Iterator<Item = (Place, NodeId)> {
    let reset = match &described.response {
        Response::Impact { reset } => reset.as_slice(),
        Response::Contact { .. } => &[],
    };
    let resets = reset.iter().enumerate();
    resets.map(move |(state, &node)| (Place::Reset { surface, state }, node))
}

fn rounded((name, value): (String, f64)) -> (String, f64) {
    // Adding 0 removes the sign of a zero.
    (name, (value * DECIMALS).round() / DECIMALS + 0.0)
}

/// Whether a polynomial is zero at 0, relative to its terms on `[0, length]`.
fn begins_at_zero(coefficients: &[f64], length: f64) -> bool {
    let sizes: Vec<f64> = coefficients.iter().map(|value| value.abs()).collect();
    sizes[0] <= ON_THE_CORNER * horner(&sizes, length)
}

/// First time in `[0, length]` at which a polynomial has a sign other than `sign`. A `sign` of 0 is
/// unknown and is set.
fn first_sign_change(argument: &[f64], length: f64, sign: &mut f64) -> Option<f64> {
    let first = crossings(argument, length).into_iter().next();
    let here = match first.map(|crossing| crossing.direction) {
        Some(CrossingDirection::Entering) => 1.0,
        Some(CrossingDirection::Leaving) => -1.0,
        None => horner(argument, length),
    };
    if *sign == 0.0 && here != 0.0 {
        *sign = here.signum();
    }
    if here * *sign < 0.0 {
        return Some(0.0);
    }
    first.map(|crossing| crossing.time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;

    /// A harmonic oscillator `x = sin t` whose gap has two minima, at `x = -0.01` and `x = 0.01`.
    const DOUBLE_WELL: &str = r#"
[model]
states = ["x", "v"]
parameters = { half = 0.01, floor = 0.1 }
[model.flow]
x = "v"
v = "-x"
[[model.surface]]
name = "stop"
event = "floor + 1000*(x^2 - half^2)^2"
impact = { v = "-v" }
[grazing]
surface = "stop"
solve_for = "floor"
guess = { x = 0.01, v = 1.0 }
"#;

    #[test]
    fn minima_nearer_to_each_other_than_a_part_of_a_step_are_all_found() {
        let scene = Scene::parse(DOUBLE_WELL, "double_well.toml").expect("a scene");
        let flow = watching(&scene);
        let start = [-0.2_f64.sin(), 0.2_f64.cos()];
        let found = gaps(&flow, &start, &[0.01, 0.1], 0.4).expect("a smooth flow");
        let expected = [0.2 - 0.01_f64.asin(), 0.2 + 0.01_f64.asin()];
        assert_eq!(found.minima.len(), 2, "{found:?}");
        for (minimum, expected) in found.minima.iter().zip(expected) {
            // The terms of a step's polynomial reach 1000 x^4 = 2, of which rounding is 4e-16;
            // h'' = 0.8, and h' loses another digit or two.
            assert!((minimum.time - expected).abs() < 1e-12, "{minimum:?}");
            assert!((minimum.event - 0.1).abs() < 1e-13, "{minimum:?}");
        }
    }
}
