//! The flow of a grazing orbit: the free flow, interrupted where the orbit hits a stop.
//!
//! Between hits the flow is smooth. A hit is transversal: the surface is met with a normal
//! velocity, so that its time is a smooth function of the start. At a rigid stop the state is
//! reset; a compliant stop replaces the field until its contact ends, and so does a rigid stop at
//! which the orbit comes to rest. Surfaces that the orbit only grazes do not act here.
//!
//! Jets pass an event with the time of the event as a jet `τ`, the root of `h(φ_τ(x)) = 0`: fly
//! `τ` along the field before, reset, fly `−τ` along the field after. The event then takes place
//! at a fixed time, and the result is the saltation matrix of Aizerman and Gantmakher, to any
//! order. See docs/mathematics/hits.md.

use super::outcome::OrbitError;
use super::section::Geometry;
use crate::flow::{
    Field, FlowError, InputKind, Integrator, Program, Step, evaluate, first_derivatives,
    flow_with_jacobian_within, jet_transport_taylor_within, local_series,
};
use crate::interruption::check;
use crate::jet::{Jet, JetSpace, implicit_root, power_series_with_slope_at};
use crate::model::{ExpressionGraph, NodeId, Response, Scene, stick_field};
use crate::numeric::polynomial::{CrossingDirection, crossings, evaluate as value_and_slope};
use crate::numeric::{Real, converted};
use nalgebra::DMatrix;
use std::collections::BTreeSet;

/// Free flow with the hits of a scene's grazing orbit.
#[derive(Clone, Debug)]
pub struct PiecewiseFlow {
    /// Free flight first, then the contacts with the stops that are hit.
    modes: Vec<Mode>,
    graph: ExpressionGraph,
    /// Number of functions watched for the caller.
    watched: usize,
    /// Whether a state at rest against a stop is known by its phase alone.
    forgets: bool,
}

/// A smooth field, and the events at which it ends.
#[derive(Clone, Debug)]
struct Mode {
    field: Field,
    exits: Vec<Exit>,
    /// Watched functions whose polynomials are looked at all along a step.
    looked_at: Vec<usize>,
    /// Surface in contact (index).
    contact: Option<usize>,
}

impl Mode {
    fn new(field: Field, exits: Vec<Exit>, shown: usize, contact: Option<usize>) -> Self {
        let looked_at = (0..shown).chain(exits.iter().map(|exit| exit.watched)).collect();
        Self { field, exits, looked_at, contact }
    }

    /// Length of a step on which the polynomials that are looked at are exact to rounding.
    fn length<S: Real>(&self, step: &Step<'_, S>) -> S {
        let lengths = self.looked_at.iter().map(|&watched| step.watched_length(watched).to_f64());
        let shortest = lengths.fold(f64::INFINITY, f64::min);
        if step.length.to_f64() <= shortest { step.length } else { S::from_f64(shortest) }
    }
}

/// Event that ends a mode.
#[derive(Clone, Debug)]
struct Exit {
    /// Surface that acts (index).
    surface: usize,
    /// Number of the event's function among those that the field watches.
    watched: usize,
    kind: ExitKind,
    /// Mode that follows; after an impact, that of a rebound.
    to: usize,
}

#[derive(Clone, Debug)]
enum ExitKind {
    /// The surface is met from the free side.
    Hit {
        /// Stays beyond the surface of at most this duration are those of a graze.
        brief: f64,
        /// State after the impact; `None` at a compliant stop.
        reset: Option<Box<Reset>>,
    },
    /// The release function of a contact changes its sign.
    Release {
        /// Number of coefficients of the gap's series that vanish there.
        vanishing: usize,
    },
}

impl Exit {
    /// Mode of rest against a rigid stop that is met.
    fn rest(&self) -> Option<usize> {
        match &self.kind {
            ExitKind::Hit { reset: Some(reset), .. } => reset.rest,
            ExitKind::Hit { reset: None, .. } | ExitKind::Release { .. } => None,
        }
    }
}

/// State after an impact.
#[derive(Clone, Debug)]
struct Reset {
    nodes: Vec<NodeId>,
    /// Expressions of the reset over jets.
    program: Program,
    /// Normal velocity over jets.
    normal: Program,
    /// Mode of rest against the stop; `None` if it has no stick field.
    rest: Option<usize>,
}

impl Reset {
    /// Jets just after an impact.
    fn over_jets<S: Real>(&self, met: &[Jet<S>], parameters: &[Jet<S>]) -> Vec<Jet<S>> {
        let inputs: Vec<_> = met.iter().chain(parameters).cloned().collect();
        evaluate(&self.program, met[0].space(), &inputs)
    }

    /// State that has lost its normal velocity along the kick of the impact.
    fn state_at_rest<S: Real>(&self, met: &[S], parameters: &[S]) -> Result<Vec<S>, OrbitError> {
        let space = JetSpace::uniform(1, 0)?;
        let constant = |value: &S| Jet::constant(&space, *value);
        let [met, parameters] = [met, parameters].map(|values| values.iter().map(constant));
        let rest = self.to_rest(&met.collect::<Vec<_>>(), &parameters.collect::<Vec<_>>());
        Ok(rest.iter().map(Jet::head).collect())
    }

    /// Jets of a state that has lost its normal velocity along the kick of the impact.
    fn to_rest<S: Real>(&self, met: &[Jet<S>], parameters: &[Jet<S>]) -> Vec<Jet<S>> {
        let normal = |state: &[Jet<S>]| {
            let inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
            evaluate(&self.normal, met[0].space(), &inputs).remove(0)
        };
        let after = self.over_jets(met, parameters);
        let speed = -&normal(met);
        let total = &normal(&after) + &speed;
        let share = &speed / &total;
        let kicks = met.iter().zip(&after);
        kicks.map(|(met, after)| met + &(&share * &(after - met))).collect()
    }
}

/// An event of a piecewise flow.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowEvent<S> {
    /// Time since the start.
    pub time: S,
    /// Surface that acts (index).
    pub surface: usize,
    /// Full state just before the event.
    pub state: Vec<S>,
    /// Full state just after the event.
    pub after: Vec<S>,
    /// Whether the surface is met; otherwise its contact ends.
    pub meets: bool,
    /// Normal velocity `|h'|` at which the surface is met; 0 where its contact ends.
    pub speed: S,
    /// Whether the orbit comes to rest against the surface, at once or by ever smaller rebounds.
    pub rests: bool,
    mode: usize,
    exit: usize,
}

/// Jets at the end of a flight through events.
#[derive(Clone, Debug)]
pub struct JetsThrough<'f, S: Real> {
    /// Full state.
    pub state: Vec<Jet<S>>,
    /// Time of each event.
    pub times: Vec<Jet<S>>,
    /// Field at the end.
    pub(super) field: &'f Field,
}

impl<S: Real> FlowEvent<S> {
    /// The event in a flight that starts at a time.
    pub(super) fn since(&self, start: S) -> Self {
        Self { time: self.time - start, ..self.clone() }
    }

    /// The event over another scalar.
    pub fn converted<T: Real>(&self) -> FlowEvent<T> {
        let Self { time, surface, ref state, ref after, meets, speed, rests, mode, exit } = *self;
        FlowEvent {
            time: T::from_dd(time.to_dd()),
            surface,
            state: converted(state),
            after: converted(after),
            meets,
            speed: T::from_dd(speed.to_dd()),
            rests,
            mode,
            exit,
        }
    }
}

/// Flight of a piecewise flow: its end and its events.
#[derive(Clone, Debug)]
pub(super) struct Flown<S> {
    /// Full state at the end.
    pub(super) state: Vec<S>,
    pub(super) events: Vec<FlowEvent<S>>,
}

/// Most steps of one flight, and most products of series, which are reached earlier where a step
/// has more than twenty.
const MOST_STEPS: usize = 1_000_000;
const MOST_PRODUCTS: usize = 20 * MOST_STEPS;
/// Most events of one flight.
const MOST_EVENTS: usize = 256;
/// Longest stay beyond a surface, as a share of the forcing period, that passes for a graze and not
/// for a hit, for surfaces that the orbit both hits and grazes.
pub const BRIEF: f64 = 0.05;
/// Longest chatter, in times in which the acceleration towards the stop changes by itself: of what
/// is left where a rest is certain, and of all of it from the first impact.
const RESTING: f64 = 1e-3;
const CHATTERING: f64 = 0.5;
/// Rounding errors of the state within which a gap and its velocity are those of a rest.
const STILL: f64 = 1e3;
/// Coefficients of the gap's series that vanish where a rest ends: gap, velocity, acceleration.
const AT_REST: usize = 3;

impl PiecewiseFlow {
    /// The flow of a scene; its fields watch `watched`, and the kinds of the parameters are given.
    pub fn new(scene: &Scene, watched: &[NodeId], parameters: &[InputKind]) -> Self {
        Self::build(scene, scene.model.graph.clone(), (watched, true), parameters)
    }

    /// The flow of a scene as [`new`](Self::new), with `watched` nodes of a larger graph, which are
    /// looked at where a step begins.
    pub(super) fn of_graph(
        scene: &Scene,
        graph: ExpressionGraph,
        watched: &[NodeId],
        parameters: &[InputKind],
    ) -> Self {
        Self::build(scene, graph, (watched, false), parameters)
    }

    /// The flow of a scene, which evaluates the functions `watched` for the caller: anywhere on a
    /// step if `all_along`, otherwise only where a step begins.
    fn build(
        scene: &Scene,
        mut graph: ExpressionGraph,
        (watched, all_along): (&[NodeId], bool),
        parameters: &[InputKind],
    ) -> Self {
        let model = &scene.model;
        let hits = &scene.grazing.hits.surfaces;
        // Events follow the functions that the caller watches.
        let event = |number: usize| watched.len() + number;
        let events = hits.iter().map(|&surface| model.surfaces[surface].event);
        let all: Vec<NodeId> = watched.iter().copied().chain(events).collect();
        let brief = brief(scene);
        let states = (0..model.dimension()).map(|_| InputKind::Variable);
        let inputs: Vec<InputKind> = states.chain(parameters.iter().copied()).collect();
        let compliant =
            |surface: &usize| matches!(model.surfaces[*surface].response, Response::Contact { .. });
        let contacts: Vec<usize> = hits.iter().copied().filter(compliant).collect();
        let stuck = hits.iter().filter_map(|&surface| {
            Some((surface, stick_field(&mut graph, model, &model.surfaces[surface])?))
        });
        let stuck: Vec<(usize, Vec<NodeId>)> = stuck.collect();
        let exits = hits.iter().enumerate().map(|(number, &surface)| {
            let grazed = scene.grazing.passages.contains(&surface);
            let brief = if grazed { brief } else { 0.0 };
            let rest = stuck.iter().position(|(at, _)| *at == surface);
            let reset = match &model.surfaces[surface].response {
                Response::Impact { reset } => Some(Box::new(Reset {
                    program: Program::new(&graph, reset, &inputs),
                    nodes: reset.clone(),
                    normal: Program::new(
                        &graph,
                        &[model.surfaces[surface].normal_velocity],
                        &inputs,
                    ),
                    rest: rest.map(|rest| 1 + contacts.len() + rest),
                })),
                Response::Contact { .. } => None,
            };
            let contact = contacts.iter().position(|&at| at == surface);
            Exit {
                surface,
                watched: event(number),
                kind: ExitKind::Hit { brief, reset },
                to: contact.map_or(0, |contact| 1 + contact),
            }
        });
        let shown = if all_along { watched.len() } else { 0 };
        let free = Field::new(&graph, &model.flow, &all, parameters);
        let free = Mode::new(free, exits.collect(), shown, None);
        let held = |surface: usize, field: &[NodeId], release: NodeId, vanishing: usize| {
            let watched: Vec<NodeId> = all.iter().copied().chain([release]).collect();
            let kind = ExitKind::Release { vanishing };
            let release = Exit { surface, watched: all.len(), kind, to: 0 };
            let field = Field::new(&graph, field, &watched, parameters);
            Mode::new(field, vec![release], shown, Some(surface))
        };
        let contact = |&surface: &usize| match &model.surfaces[surface].response {
            Response::Contact { field, release } => Some(held(surface, field, *release, 0)),
            Response::Impact { .. } => None,
        };
        let rest = |(surface, field): &(usize, Vec<NodeId>)| {
            held(*surface, field, model.surfaces[*surface].normal_acceleration, AT_REST)
        };
        let contacts = contacts.iter().filter_map(contact);
        let modes = std::iter::once(free).chain(contacts).chain(stuck.iter().map(rest)).collect();
        Self { modes, graph, watched: watched.len(), forgets: forgets(scene) }
    }

    /// Lets stays beyond a surface of at most a duration pass as grazes.
    pub(super) fn graze(&mut self, surface: usize, longest: f64) {
        for exit in self.modes[0].exits.iter_mut().filter(|exit| exit.surface == surface) {
            if let ExitKind::Hit { brief, .. } = &mut exit.kind {
                *brief = longest;
            }
        }
    }

    /// The flow of a scene with all parameters as arguments.
    pub fn free(scene: &Scene, watched: &[NodeId]) -> Self {
        let parameters = vec![InputKind::Variable; scene.model.parameters.len()];
        Self::new(scene, watched, &parameters)
    }

    /// The field of free flight.
    pub(super) fn field(&self) -> &Field {
        &self.modes[0].field
    }

    /// The fields of free flight and of all contacts.
    pub(super) fn fields(&self) -> impl Iterator<Item = &Field> {
        self.modes.iter().map(|mode| &mode.field)
    }

    /// Most steps of one flight.
    pub(super) fn most_steps(&self) -> usize {
        let products = self.fields().map(|field| field.time_program().products());
        (MOST_PRODUCTS / products.max().unwrap_or(0).max(1)).min(MOST_STEPS)
    }

    /// Number of functions watched for the caller.
    pub(super) fn watched(&self) -> usize {
        self.watched
    }

    /// Whether the orbit hits a stop.
    pub(super) fn hits(&self) -> bool {
        !self.modes[0].exits.is_empty()
    }

    /// State after a duration. Backwards no stop acts: a negative duration is one without hits.
    ///
    /// # Errors
    ///
    /// [`OrbitError::Flow`] if the flow fails, [`OrbitError::ManyHits`] if it hits too often.
    pub fn flow<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<Vec<S>, OrbitError> {
        if !self.hits() || duration < S::zero() {
            return Ok(Integrator::new(self.field()).flow(state, parameters, duration)?);
        }
        Ok(self.fly(state, parameters, duration, &mut self.most_steps())?.state)
    }

    /// State after a duration of at least 0, and the events on the way.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow).
    pub fn flight<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<(Vec<S>, Vec<FlowEvent<S>>), OrbitError> {
        let Flown { state, events } =
            self.fly(state, parameters, duration, &mut self.most_steps())?;
        Ok((state, events))
    }

    /// Events of a flight.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow).
    pub fn events<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<Vec<FlowEvent<S>>, OrbitError> {
        Ok(self.fly(state, parameters, duration, &mut self.most_steps())?.events)
    }

    /// State after a duration, in a limited number of steps, which is lowered by the steps taken.
    pub(super) fn flow_within<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
        steps_left: &mut usize,
    ) -> Result<Vec<S>, OrbitError> {
        if !self.hits() || duration < S::zero() {
            let mut integrator = Integrator::new(self.field());
            return Ok(integrator.flow_within(state, parameters, duration, steps_left)?);
        }
        Ok(self.fly(state, parameters, duration, steps_left)?.state)
    }

    /// State after a duration and its derivatives in the given inputs, as
    /// [`flow_with_jacobian_within`].
    pub(super) fn flow_with_jacobian_within<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
        inputs: &[usize],
        steps_left: &mut usize,
    ) -> Result<(Vec<S>, DMatrix<S>), OrbitError> {
        if !self.hits() || duration < S::zero() {
            let field = self.field();
            return Ok(flow_with_jacobian_within(
                field, state, parameters, duration, inputs, steps_left,
            )?);
        }
        let events = self.fly(state, parameters, duration, steps_left)?.events;
        first_derivatives(state, parameters, inputs, |start, parameters| {
            let fly = |field: &Field, jets: &[Jet<S>], duration| -> Result<_, OrbitError> {
                Ok(jet_transport_taylor_within(field, jets, parameters, duration, steps_left)?)
            };
            Ok(self.jets(start, parameters, duration, &events, fly)?.state)
        })
    }

    /// Jets of the state after a duration, through the events of the flight of their heads, and the
    /// jets of the times of the events; `fly` carries jets along one field.
    ///
    /// # Errors
    ///
    /// Those of `fly`; [`OrbitError::Jet`] if an event is not transversal.
    pub fn jets<S: Real, E: From<OrbitError>>(
        &self,
        start: &[Jet<S>],
        parameters: &[Jet<S>],
        duration: S,
        events: &[FlowEvent<S>],
        mut fly: impl FnMut(&Field, &[Jet<S>], S) -> Result<Vec<Jet<S>>, E>,
    ) -> Result<JetsThrough<'_, S>, E> {
        let heads = |jets: &[Jet<S>]| -> Vec<S> { jets.iter().map(Jet::head).collect() };
        let mut mode = self.first_mode(&heads(start), &heads(parameters));
        let (mut jets, mut elapsed, mut times) = (start.to_vec(), S::zero(), Vec::new());
        for event in events {
            jets = fly(&self.modes[mode].field, &jets, event.time - elapsed)?;
            let (after, time) = self.through(event, &jets, parameters)?;
            (jets, elapsed, mode) = (after, event.time, self.following(event));
            times.push(time.add_constant(event.time));
        }
        let state = fly(&self.modes[mode].field, &jets, duration - elapsed)?;
        Ok(JetsThrough { state, times, field: &self.modes[mode].field })
    }

    fn exit<S>(&self, event: &FlowEvent<S>) -> &Exit {
        &self.modes[event.mode].exits[event.exit]
    }

    /// Mode after an event.
    fn following<S>(&self, event: &FlowEvent<S>) -> usize {
        let exit = self.exit(event);
        exit.rest().filter(|_| event.rests).unwrap_or(exit.to)
    }

    /// Jets just after an event, moved to the time of the event of their heads, and the jet of the
    /// time from there to the event.
    fn through<S: Real>(
        &self,
        event: &FlowEvent<S>,
        jets: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<(Vec<Jet<S>>, Jet<S>), OrbitError> {
        let (space, exit) = (jets[0].space(), self.exit(event));
        let order = (space.order() + 1).max(2);
        let before = local_series(&self.modes[event.mode].field, jets, parameters, order);
        let function = before.watched(exit.watched);
        let time =
            implicit_root(&Jet::zero(space), |time| power_series_with_slope_at(function, time))?;
        let met = before.state_at(&time);
        let after = match &exit.kind {
            ExitKind::Hit { reset: Some(reset), .. } if event.rests => {
                reset.to_rest(&met, parameters)
            }
            ExitKind::Hit { reset: Some(reset), .. } => reset.over_jets(&met, parameters),
            _ => met,
        };
        let field = &self.modes[self.following(event)].field;
        let behind = local_series(field, &after, parameters, order);
        Ok((behind.state_at(&-&time), time))
    }

    /// Flies for a duration of at least 0, in a limited number of steps, which is lowered by the
    /// steps taken.
    pub(super) fn fly<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        duration: S,
        steps_left: &mut usize,
    ) -> Result<Flown<S>, OrbitError> {
        let mut events = Vec::new();
        let mut end = state.to_vec();
        let look = |passed: FlightPart<'_, '_, S>| -> Option<()> {
            match passed {
                FlightPart::Step { length, step, .. } => step.state_at(length, &mut end),
                FlightPart::Event(event) => {
                    end.copy_from_slice(&event.after);
                    events.push(event.clone());
                }
                FlightPart::Again => events.clear(),
            }
            None
        };
        self.each(state, parameters, duration, steps_left, look)?;
        Ok(Flown { state: end, events })
    }

    /// Flies for a duration of at least 0 and shows every step and every event until `look`
    /// returns a value.
    pub(super) fn each<S: Real, T>(
        &self,
        start: &[S],
        parameters: &[S],
        duration: S,
        steps_left: &mut usize,
        mut look: impl FnMut(FlightPart<'_, '_, S>) -> Option<T>,
    ) -> Result<Option<T>, OrbitError> {
        let mut rests = BTreeSet::new();
        loop {
            let flown = (start, parameters, duration);
            match self.each_until_rest(flown, steps_left, &rests, &mut look)? {
                Ok(found) => return Ok(found),
                Err(event) => {
                    rests.insert(event);
                    look(FlightPart::Again);
                }
            }
        }
    }

    /// Flies as [`each`](Self::each), with rest after the events of some numbers; returns the
    /// number of a further event after which the orbit comes to rest, as soon as this is certain.
    fn each_until_rest<S: Real, T>(
        &self,
        (start, parameters, duration): (&[S], &[S], S),
        steps_left: &mut usize,
        rests: &BTreeSet<usize>,
        look: &mut impl FnMut(FlightPart<'_, '_, S>) -> Option<T>,
    ) -> Result<Result<Option<T>, usize>, OrbitError> {
        let limit = *steps_left;
        let mut flights: Vec<Integrator<'_, S>> =
            self.modes.iter().map(|mode| Integrator::new(&mode.field)).collect();
        let (mut state, mut elapsed) = (start.to_vec(), S::zero());
        let mut mode = self.first_mode(&state, parameters);
        let (mut sign, mut events) = (None, 0);
        // Surface that was just released from a rest, and the impacts that may be a chatter.
        let mut released = None;
        let mut chatter = Chatter::default();
        while elapsed < duration {
            if *steps_left == 0 {
                let remaining = (duration - elapsed).to_f64();
                return Err(FlowError::TooManySteps { limit, remaining }.into());
            }
            *steps_left -= 1;
            check();
            let step = flights[mode].step(&state, parameters)?;
            let remaining = duration - elapsed;
            let resolved = self.modes[mode].length(&step);
            let whole = if resolved < remaining { resolved } else { remaining };
            let met = self.first_exit(mode, &step, whole, (&mut sign, released));
            let length = met.map_or(whole, |(time, _)| time);
            let contact = self.modes[mode].contact;
            let start = &state;
            let passed =
                FlightPart::Step { elapsed, length, start, step: &step, contact, released };
            if let Some(found) = look(passed) {
                return Ok(Ok(Some(found)));
            }
            released = None;
            step.state_at(length, &mut state);
            let slope = |watched| {
                let coefficients = step.watched_coefficients(watched);
                value_and_slope(coefficients, length).1
            };
            let speed = met.map(|(_, exit)| slope(self.modes[mode].exits[exit].watched).abs());
            elapsed = if length == remaining { duration } else { elapsed + length };
            let Some((_, exit)) = met else { continue };
            events += 1;
            let Exit { surface, kind, .. } = &self.modes[mode].exits[exit];
            if events > MOST_EVENTS {
                let surface = *surface;
                return Err(OrbitError::ManyHits { surface, limit: MOST_EVENTS });
            }
            let meets = matches!(kind, ExitKind::Hit { .. });
            let before = state.clone();
            let speed = speed.filter(|_| meets).unwrap_or(S::zero());
            let mut at_rest = false;
            match kind {
                ExitKind::Hit { reset: Some(reset), .. } => {
                    let number = events - 1;
                    state = self.reset(reset, &before, parameters);
                    at_rest = rests.contains(&number);
                    if !at_rest && reset.rest.is_some() {
                        let ahead = flights[0].step(&state, parameters)?;
                        let gap = ahead.watched_coefficients(self.modes[mode].exits[exit].watched);
                        match chatter.after(number, *surface, speed, gap) {
                            Rebound::Rests => at_rest = true,
                            Rebound::Leaves => {}
                            Rebound::Chatters { first, left } => {
                                if self.forgets && left < duration - elapsed {
                                    return Ok(Err(first));
                                }
                            }
                        }
                    }
                    if at_rest {
                        state = reset.state_at_rest(&before, parameters)?;
                    }
                }
                ExitKind::Hit { reset: None, .. } => {}
                ExitKind::Release { vanishing } => {
                    released = Some(Released { surface: *surface, vanishing: *vanishing });
                }
            }
            let event = FlowEvent {
                time: elapsed,
                surface: *surface,
                state: before,
                after: state.clone(),
                meets,
                speed,
                rests: at_rest,
                mode,
                exit,
            };
            (mode, sign) = (self.following(&event), None);
            if let Some(found) = look(FlightPart::Event(&event)) {
                return Ok(Ok(Some(found)));
            }
        }
        Ok(Ok(None))
    }

    /// Surface against which a state rests.
    pub(super) fn rests_at<S: Real>(&self, state: &[S], parameters: &[S]) -> Option<usize> {
        let mode = &self.modes[self.first_mode(state, parameters)];
        let is_release =
            |exit: &Exit| matches!(exit.kind, ExitKind::Release { vanishing: AT_REST });
        mode.contact.filter(|_| mode.exits.iter().any(is_release))
    }

    /// Mode of a flight that starts at a state: a contact if the state is beyond a compliant stop
    /// that is not grazed, or rests against a rigid stop.
    fn first_mode<S: Real>(&self, state: &[S], parameters: &[S]) -> usize {
        let free = &self.modes[0];
        let lasting = |exit: &&Exit| {
            exit.to > 0 && matches!(exit.kind, ExitKind::Hit { brief, .. } if brief == 0.0)
        };
        if !free.exits.iter().any(|exit| lasting(&exit) || exit.rest().is_some()) {
            return 0;
        }
        let mut integrator = Integrator::new(&free.field);
        let Ok(step) = integrator.step(state, parameters) else { return 0 };
        let size = state.iter().fold(S::zero(), |size, value| size.max(value.abs()));
        let rounding = size * S::from_f64(STILL * S::ROUNDOFF);
        let rests = |exit: &&Exit| {
            let gap = step.watched_coefficients(exit.watched);
            gap[..2].iter().all(|value| value.abs() <= rounding) && gap[2] < S::zero()
        };
        if let Some(rest) = free.exits.iter().filter(rests).find_map(Exit::rest) {
            return rest;
        }
        let beyond = |exit: &&Exit| step.watched_coefficients(exit.watched)[0] < S::zero();
        free.exits.iter().filter(lasting).find(beyond).map_or(0, |exit| exit.to)
    }

    /// First event within a length of a step, as its time and the number of the exit.
    fn first_exit<S: Real>(
        &self,
        mode: usize,
        step: &Step<'_, S>,
        length: S,
        (sign, released): (&mut Option<S>, Option<Released>),
    ) -> Option<(S, usize)> {
        let exits = self.modes[mode].exits.iter().enumerate();
        let times = exits.filter_map(|(number, exit)| {
            let function = step.watched_coefficients(exit.watched);
            // The gap over a power of the time has the same signs, without the rounding of zeros.
            let function = &function[vanishing(released, exit.surface)..];
            let leaves = match exit.kind {
                ExitKind::Hit { .. } => CrossingDirection::Entering,
                ExitKind::Release { .. } => leaving(function, sign),
            };
            let crossings = crossings(function, length).into_iter();
            let mut there = crossings.filter(|crossing| crossing.direction == leaves);
            let counts = |time: &S| match exit.kind {
                ExitKind::Hit { brief, .. } => lasts(function, *time, brief),
                ExitKind::Release { .. } => true,
            };
            let time = there.find_map(|crossing| Some(crossing.time).filter(counts))?;
            Some((time, number))
        });
        times.min_by(|a, b| a.0.to_f64().total_cmp(&b.0.to_f64()))
    }

    fn reset<S: Real>(&self, reset: &Reset, state: &[S], parameters: &[S]) -> Vec<S> {
        let inputs: Vec<S> = state.iter().chain(parameters).copied().collect();
        let mut values = Vec::new();
        self.graph.evaluate(&inputs, &mut values);
        reset.nodes.iter().map(|node| values[node.index()]).collect()
    }
}

/// A step or an event of a flight.
pub(super) enum FlightPart<'p, 's, S: Real> {
    /// A stretch of one smooth field.
    Step {
        /// Time since the start at the beginning of the stretch.
        elapsed: S,
        length: S,
        /// Full state at the beginning of the stretch.
        start: &'p [S],
        step: &'p Step<'s, S>,
        /// Surface in contact (index).
        contact: Option<usize>,
        /// Contact that ends where the stretch begins.
        released: Option<Released>,
    },
    /// A hit, or the end of a contact.
    Event(&'p FlowEvent<S>),
    /// The flight is shown again from its start: the orbit comes to rest after an impact that was
    /// shown with a rebound.
    Again,
}

/// Contact that has just ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Released {
    surface: usize,
    /// Number of coefficients of the gap's series that vanish there.
    vanishing: usize,
}

/// Number of coefficients of a surface's gap that vanish where a contact ends.
fn vanishing(released: Option<Released>, surface: usize) -> usize {
    released.filter(|one| one.surface == surface).map_or(0, |one| one.vanishing)
}

/// Series of a surface's gap along a stretch, exactly 0 in the coefficients that vanish where the
/// contact before it ends.
pub(super) fn gap_along<S: Real>(
    step: &Step<'_, S>,
    surface: usize,
    released: Option<Released>,
) -> Vec<S> {
    let mut gap = step.watched_coefficients(surface).to_vec();
    gap[..vanishing(released, surface)].fill(S::zero());
    gap
}

/// Motion after an impact.
enum Rebound<S> {
    /// The orbit leaves the stop.
    Leaves,
    /// The orbit rests against the stop at once.
    Rests,
    /// The orbit comes to rest by ever smaller rebounds.
    Chatters {
        /// Number of the first of these impacts.
        first: usize,
        /// Time that they still take.
        left: S,
    },
}

/// Impacts on one surface in succession that lead to a rest if they go on so.
#[derive(Default)]
struct Chatter {
    surface: usize,
    /// Number of the first of them, if there is one.
    first: Option<usize>,
    /// Number of the last of them.
    last: usize,
}

impl Chatter {
    /// Motion after the impact of a number, met at a speed, with a series of the gap in the free
    /// flight behind it.
    ///
    /// A rebound `v` under the acceleration `−α` towards the stop takes `2v/α`, and with the
    /// restitution `r` all rebounds together `2v/(α(1−r))`. They end in a rest if `α` is far from
    /// 0 so long.
    fn after<S: Real>(&mut self, number: usize, surface: usize, speed: S, gap: &[S]) -> Rebound<S> {
        let two = S::from_f64(2.0);
        let (rebound, pull) = (gap[1], -(two * gap[2]));
        let jerk = (S::from_f64(6.0) * gap[3]).abs();
        if pull <= S::zero() {
            self.first = None;
            return Rebound::Leaves;
        }
        if rebound <= speed * S::from_f64(64.0 * S::ROUNDOFF) {
            self.first = None;
            return Rebound::Rests;
        }
        let left = two * rebound / (pull * (S::one() - rebound / speed));
        // Both sides times the jerk.
        let within = |share: f64| left > S::zero() && left * jerk < pull * S::from_f64(share);
        if !within(CHATTERING) {
            self.first = None;
            return Rebound::Leaves;
        }
        let goes_on = self.surface == surface && self.last + 1 == number;
        let first = self.first.filter(|_| goes_on).unwrap_or(number);
        *self = Self { surface, first: Some(first), last: number };
        if within(RESTING) { Rebound::Chatters { first, left } } else { Rebound::Leaves }
    }
}

/// Direction in which a release function leaves the sign that it has in the contact. The sign is
/// that of its value where the contact begins, or of its slope if it vanishes there.
fn leaving<S: Real>(function: &[S], sign: &mut Option<S>) -> CrossingDirection {
    let sign = sign.get_or_insert_with(|| {
        let size = function.iter().fold(S::zero(), |size, value| size.max(value.abs()));
        let vanishes = function[0].abs() <= size * S::from_f64(64.0 * S::ROUNDOFF);
        if vanishes { function[1] } else { function[0] }
    });
    match *sign < S::zero() {
        true => CrossingDirection::Leaving,
        false => CrossingDirection::Entering,
    }
}

/// Whether the stay beyond a surface that begins at a time of a step lasts longer than `brief`, by
/// the velocity and acceleration there.
fn lasts<S: Real>(event: &[S], time: S, brief: f64) -> bool {
    if brief == 0.0 {
        return true;
    }
    let power = |power: usize| S::from_f64(power as f64);
    let slopes: Vec<S> = (1..event.len()).map(|at| event[at] * power(at)).collect();
    let (velocity, acceleration) = value_and_slope(&slopes, time);
    acceleration <= S::zero() || -S::from_f64(2.0) * velocity > acceleration * S::from_f64(brief)
}

/// Longest stay beyond a surface that counts as a graze; 0 without a phase.
fn brief(scene: &Scene) -> f64 {
    let Some(phase) = &scene.model.phase else { return 0.0 };
    let parameters: Vec<f64> = converted(&scene.model.parameter_values());
    let state = vec![0.0; scene.model.dimension()];
    let geometry = Geometry::new(&scene.model, 0);
    let clock = geometry.at(&state, &parameters).clock();
    clock.map_or(0.0, |(rate, _)| BRIEF * phase.period.to_f64() / rate)
}

/// Whether a state at rest against a stop is known by its phase alone: one degree of freedom, and a
/// rate of the phase that depends on parameters alone.
fn forgets(scene: &Scene) -> bool {
    let model = &scene.model;
    let is_steady = model.phase.as_ref().is_some_and(|phase| {
        let inputs = model.graph.dependencies(phase.rate);
        inputs.iter().all(|&input| input >= model.dimension())
    });
    is_steady && model.states.len() == 2
}
