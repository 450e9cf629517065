//! The return of an oscillator to a phase of its forcing, as a map that an atlas can hold.

use std::sync::Arc;

use super::cell::Cell;
use super::flight::{
    FieldResponse, Fields, Flight, Stopped, Watch, must_keep_sign, reset_state, series,
    time_of_minimum,
};
use super::patch::{Patch, Piece, SharedSpaces};
use super::region::{AxisInput, Region};
use super::tree::{Expansion, Tabulated};
use crate::flow::{InputKind, Integrator, Program, evaluate};
use crate::hybrid::{Event, EventKind, HybridError, HybridSystem, Outcome, Simulator};
use crate::jet::{Jet, JetSpace, implicit_root, power_series_at, power_series_with_slope_at};
use crate::model::Model;
use crate::numeric::converted;

/// Return of an oscillator to a phase of its forcing, over the states and chosen parameters.
///
/// Points and images hold the states in the model's order; a point holds the active parameters
/// after them. The scales of an image are the widths of the region.
#[derive(Clone, Debug)]
pub struct StroboscopicReturn<'a> {
    simulator: Simulator<'a, f64>,
    region: Region,
    fields: Fields,
    /// Gap, its rate and its acceleration in free flight, surface by surface; then the rate of the
    /// phase.
    senses: Program,
    /// Period of the phase.
    period: f64,
    /// All parameters of the model.
    parameters: Vec<f64>,
    states: usize,
    /// Spaces of the jets of all boxes.
    spaces: SharedSpaces,
    /// Receiver of the share of an expansion that is done.
    watch: Watch<'a>,
}

/// Terms of the depth beyond the order of the polynomials: its error counts by its root.
const DEPTH_ORDERS: usize = 4;
/// Newton steps to a minimum of a gap.
const NEWTON_STEPS: usize = 20;
/// Longest time from an event to the minimum of its gap, as a share of the return.
const NEAR: f64 = 0.25;
/// Time after a graze at which its trajectory is simulated again, as a share of the return.
const BEHIND: f64 = 1e-3;

/// Share of one of the flights of an expansion: the first, and if it meets a graze the one to the
/// graze and the two behind it.
const QUARTER: f64 = 0.25;
/// Most steps of one return.
const STEP_LIMIT: usize = 100_000;
/// Most events of a trajectory whose jets are computed.
const MOST_EVENTS: usize = 64;

/// Jets of the inputs of a box.
struct Inputs {
    /// Full state at the section.
    state: Vec<Jet<f64>>,
    /// All parameters.
    parameters: Vec<Jet<f64>>,
    /// Duration of the return without that at the centre.
    beyond: Jet<f64>,
}

/// Numbers at the centre of a box.
struct Centre {
    state: Vec<f64>,
    parameters: Vec<f64>,
    duration: f64,
}

impl<'a> StroboscopicReturn<'a> {
    /// Return of a model over a region; `system` is the model, lowered.
    ///
    /// # Errors
    ///
    /// [`HybridError`] if the simulator refuses the parameters of the model, or its phase does not
    /// advance.
    pub fn new(
        system: &'a HybridSystem,
        model: &Model,
        region: Region,
    ) -> Result<Self, HybridError> {
        let phase = model.phase.as_ref().ok_or(HybridError::NoPhase)?;
        let values = model.parameter_values();
        let parameters: Vec<f64> = converted(&values);
        let mut simulator = Simulator::new(system, &parameters)?;
        simulator.set_step_limit(STEP_LIMIT);
        simulator.forcing_period()?;
        let inputs = vec![InputKind::Variable; model.dimension() + parameters.len()];
        let senses = model.surfaces.iter().flat_map(|surface| {
            [surface.event, surface.normal_velocity, surface.normal_acceleration]
        });
        let senses: Vec<_> = senses.chain([phase.rate]).collect();
        Ok(Self {
            simulator,
            fields: Fields::new(model, &region.active(), &values),
            senses: Program::new(&model.graph, &senses, &inputs),
            period: phase.period.to_f64() * region.periods as f64,
            parameters,
            states: model.states.len(),
            region,
            spaces: SharedSpaces::default(),
            watch: Watch(&|_| {}),
        })
    }

    /// Tells the share of each expansion that is done, from 0 to 1, on the way. A receiver may be
    /// told less than before.
    pub fn watched(self, watch: &'a (dyn Fn(f64) + Sync)) -> Self {
        Self { watch: Watch(watch), ..self }
    }

    /// Region of the map.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// Surfaces that the return of a point hits, in order; `None` if it does not return.
    pub fn word(&mut self, point: &[f64]) -> Option<Vec<usize>> {
        let duration = self.place(point).ok()?;
        let run = self.simulator.run(duration).ok()?;
        let is_hit = |event: &Event<f64>| {
            matches!(event.kind, EventKind::Impact { .. } | EventKind::ContactBegin { .. })
        };
        let hits = run.events.iter().filter(|event| is_hit(event)).map(|event| event.surface);
        (run.outcome == Outcome::Completed).then(|| hits.collect())
    }

    /// Places a point in the simulator; returns the duration of its return.
    fn place(&mut self, point: &[f64]) -> Result<f64, HybridError> {
        let axes = self.region.axes.iter().zip(point);
        let mut state = vec![self.region.phase; self.states + 1];
        for (axis, &value) in axes {
            match axis.input {
                AxisInput::State(component) => state[component] = value,
                AxisInput::Parameter(parameter) => self.parameters[parameter] = value,
            }
        }
        self.simulator.set_parameters(&self.parameters)?;
        self.simulator.set_state(&state)?;
        Ok(self.simulator.forcing_period()? * self.region.periods as f64)
    }

    /// Events of a simulated trajectory; fails unless all are transversal contacts and misses.
    fn events(
        &mut self,
        state: &[f64],
        duration: f64,
        start: f64,
    ) -> Result<Vec<Event<f64>>, Stopped> {
        self.simulator.set_state(state).map_err(|_| Stopped::Failed)?;
        let run = self.simulator.run(duration).map_err(|_| Stopped::Failed)?;
        let unusable = |event: &Event<f64>| {
            matches!(
                event.kind,
                EventKind::ChatterEnd { .. } | EventKind::Stick | EventKind::Release
            )
        };
        if run.outcome != Outcome::Completed
            || run.events.len() > MOST_EVENTS
            || run.events.iter().any(unusable)
        {
            return Err(Stopped::Failed);
        }
        let later = |event: Event<f64>| Event { time: event.time + start, ..event };
        Ok(run.events.into_iter().map(later).collect())
    }

    /// Gap, rate and acceleration of a surface in free flight.
    fn sense(&self, state: &[f64], parameters: &[f64], surface: usize) -> [f64; 3] {
        let mut tape = vec![0.0; self.senses.slots()];
        tape[..state.len()].copy_from_slice(state);
        tape[state.len()..state.len() + parameters.len()].copy_from_slice(parameters);
        self.senses.evaluate_values(&mut tape);
        [0, 1, 2].map(|of| tape[self.senses.output(3 * surface + of)])
    }

    fn inputs(&self, space: &Arc<JetSpace>, cell: &Cell, centre: &Centre) -> Inputs {
        let constant = |&value: &f64| Jet::constant(space, value);
        let mut state: Vec<_> = centre.state.iter().map(constant).collect();
        let mut parameters: Vec<_> = centre.parameters.iter().map(constant).collect();
        for (place, axis) in self.region.axes.iter().enumerate() {
            let offset = Jet::variable(space, place, 0.0).scale(cell.half[place]);
            let value = offset.add_constant(cell.centre[place]);
            match axis.input {
                AxisInput::State(component) => state[component] = value,
                AxisInput::Parameter(parameter) => parameters[parameter] = value,
            }
        }
        let all: Vec<_> = state.iter().chain(&parameters).cloned().collect();
        let rate = evaluate(&self.senses, space, &all).pop();
        let rate = rate.unwrap_or_else(|| Jet::constant(space, 1.0));
        let duration = &Jet::constant(space, self.period) / &rate;
        Inputs { state, parameters, beyond: duration.add_constant(-duration.head()) }
    }

    /// Compliant surface in contact at a start.
    fn first_contact(&self, centre: &Centre) -> Option<usize> {
        let compliant = self.fields.responses.iter().enumerate();
        let compliant =
            compliant.filter(|(_, response)| matches!(response, FieldResponse::Compliant(_)));
        let mut beyond = compliant.filter(|&(surface, _)| {
            self.sense(&centre.state, &centre.parameters, surface)[0] < 0.0
        });
        beyond.next().map(|(surface, _)| surface)
    }

    fn piece(&mut self, cell: &Cell, order: usize) -> Result<Piece, Stopped> {
        let duration = self.place(&cell.centre).map_err(|_| Stopped::Failed)?;
        let state = self.simulator.state().to_vec();
        let centre = Centre { state, parameters: self.parameters.clone(), duration };
        let events = self.events(&centre.state, duration, 0.0)?;
        let space = self.spaces.of(&vec![1; cell.centre.len()], order)?;
        let inputs = self.inputs(&space, cell, &centre);
        let all: Vec<_> = inputs.state.iter().chain(&inputs.parameters).cloned().collect();
        let senses = evaluate(&self.senses, &space, &all);
        for surface in 0..self.fields.responses.len() {
            must_keep_sign(senses[3 * surface].clone()).map_err(Stopped::Crossing)?;
        }
        let contact = self.first_contact(&centre);
        let Watch(told) = self.watch;
        let watch = |time: f64| told(QUARTER * (time / duration));
        let (state, watch) = (inputs.state.clone(), Watch(&watch));
        let mut flight = Flight::new(&self.fields, state, &inputs.parameters, contact, watch);
        match flight.pass_all(&events) {
            Ok(()) => {
                let image = flight.end(duration, &inputs.beyond)?;
                Ok(Piece::Smooth(Patch::new(&image[..self.states])))
            }
            Err(Stopped::Graze(number, crossing)) => {
                let rigid = matches!(
                    self.fields.responses[events[number].surface],
                    FieldResponse::Rigid(_)
                );
                if !rigid || !flight.is_free() {
                    return Err(Stopped::Crossing(crossing));
                }
                self.grazed(cell, order, &centre, (&events[..=number], contact))
            }
            Err(stopped) => Err(stopped),
        }
    }

    /// Piece of a box in which the last of `events` may be a graze.
    fn grazed(
        &mut self,
        cell: &Cell,
        order: usize,
        centre: &Centre,
        (events, contact): (&[Event<f64>], Option<usize>),
    ) -> Result<Piece, Stopped> {
        let (graze, before) = events.split_last().ok_or(Stopped::Failed)?;
        let (surface, axes) = (graze.surface, cell.centre.len());
        let fine = self.spaces.of(&vec![1; axes], order + DEPTH_ORDERS)?;
        let plain = self.spaces.of(&vec![1; axes], order)?;
        let weights: Vec<u32> = (0..axes).map(|_| 2).chain([1]).collect();
        let deep = self.spaces.of(&weights, 2 * order)?;
        let inputs = self.inputs(&fine, cell, centre);
        let Watch(told) = self.watch;
        let quarter = |number: f64, share: f64| told(QUARTER * (number + share));
        let watch = |time: f64| quarter(1.0, time / centre.duration);
        let watch = Watch(&watch);
        let mut flight =
            Flight::new(&self.fields, inputs.state, &inputs.parameters, contact, watch);
        flight.pass_all(before)?;
        flight.fly_to(graze.time)?;
        let at: Vec<f64> = flight.state.iter().map(Jet::head).collect();
        let minimum = graze.time + self.time_to_minimum(&at, centre, surface)?;
        let earliest = before.last().map_or(0.0, |event| event.time);
        if !(earliest..centre.duration).contains(&minimum) {
            return Err(Stopped::Failed);
        }
        flight.fly_to(minimum)?;
        let around = flight.series();
        let gap = around.watched(surface);
        let late = time_of_minimum(gap)?;
        let least = power_series_at(gap, &late);
        let met = around.state_at(&late);
        let swing: f64 = least.coefficients()[1..].iter().map(|value| value.abs()).sum();
        let deepest = swing - least.head();
        let rest = centre.duration - minimum;
        let at: Vec<f64> = met.iter().map(Jet::head).collect();
        let events = self.events_behind(&at, centre, surface, rest)?;

        let missing = Behind::new(&plain, &met, &inputs.parameters, &(&inputs.beyond - &late));
        let watch = |time: f64| quarter(2.0, time / rest);
        let flown = (missing.state.clone(), Watch(&watch));
        let missing = missing.fly(&self.fields, flown, &events, rest)?;
        let missing = Patch::new(&missing[..self.states]);
        if deepest <= 0.0 {
            return Ok(Piece::Smooth(missing));
        }
        let touching = Behind::new(&deep, &met, &inputs.parameters, &(&inputs.beyond - &late));
        let depth = Jet::variable(&deep, axes, 0.0).scale(deepest.sqrt());
        let touched = touching.touched(&self.fields, surface, &depth)?;
        let watch = |time: f64| quarter(3.0, time / rest);
        let touching = touching.fly(&self.fields, (touched, Watch(&watch)), &events, rest)?;
        Ok(Piece::Grazed {
            depth: Patch::new(&[least.scale(-1.0 / deepest)]),
            missing,
            touching: Patch::new(&touching[..self.states]),
        })
    }

    /// Time from a state to the minimum of a gap nearby, along the free flow.
    fn time_to_minimum(
        &self,
        state: &[f64],
        centre: &Centre,
        surface: usize,
    ) -> Result<f64, Stopped> {
        let mut integrator = Integrator::new(&self.fields.free);
        let mut time = 0.0;
        for _ in 0..NEWTON_STEPS {
            let at = integrator.flow(state, &centre.parameters, time)?;
            let [_, rate, acceleration] = self.sense(&at, &centre.parameters, surface);
            let step = rate / acceleration;
            time -= step;
            if acceleration <= 0.0 || !time.is_finite() || time.abs() > NEAR * centre.duration {
                return Err(Stopped::Failed);
            }
            if step.abs() <= 1e-12 * centre.duration {
                return Ok(time);
            }
        }
        Err(Stopped::Failed)
    }

    /// Events behind a minimum of a gap along the free flow, in the time since the minimum.
    ///
    /// NOTE: the state at the minimum may lie beyond the surface; the simulation starts where the
    /// flow has left it.
    fn events_behind(
        &mut self,
        state: &[f64],
        centre: &Centre,
        surface: usize,
        rest: f64,
    ) -> Result<Vec<Event<f64>>, Stopped> {
        let [gap, _, acceleration] = self.sense(state, &centre.parameters, surface);
        let leaving = 2.0 * (2.0 * (-gap).max(0.0) / acceleration).sqrt();
        let start = leaving.max(BEHIND * centre.duration);
        if start >= rest || start.is_nan() {
            return Err(Stopped::Failed);
        }
        let mut integrator = Integrator::new(&self.fields.free);
        let state = integrator.flow(state, &centre.parameters, start)?;
        self.events(&state, rest - start, start)
    }
}

/// Jets behind a graze, in one space.
struct Behind {
    /// Full state at the minimum of the gap, without contact.
    state: Vec<Jet<f64>>,
    parameters: Vec<Jet<f64>>,
    /// Time of the section beyond that of the centre, from the minimum.
    beyond: Jet<f64>,
}

impl Behind {
    /// Jets of another space, whose first variables are the axes of the box.
    fn new(
        space: &Arc<JetSpace>,
        state: &[Jet<f64>],
        parameters: &[Jet<f64>],
        beyond: &Jet<f64>,
    ) -> Self {
        let places: Vec<_> = (0..beyond.space().variables()).map(Some).collect();
        let moved = |jet: &Jet<f64>| jet.reinterpret(space, &places);
        Self {
            state: state.iter().map(moved).collect(),
            parameters: parameters.iter().map(moved).collect(),
            beyond: moved(beyond),
        }
    }

    /// State at the minimum as if the contact had acted there: back by `y u` to the surface, the
    /// reset, and forward by `y u`.
    ///
    /// With the gap `−y² + a₂ t² + a₃ t³ + …` about the minimum and `t = −y u`, the time of contact
    /// follows from `−1 + a₂ u² − a₃ y u³ + a₄ y² u⁴ − … = 0`.
    fn touched(
        &self,
        fields: &Fields,
        surface: usize,
        depth: &Jet<f64>,
    ) -> Result<Vec<Jet<f64>>, Stopped> {
        let FieldResponse::Rigid(reset) = &fields.responses[surface] else {
            return Err(Stopped::Failed);
        };
        let space = depth.space();
        let around = series(&fields.free, &self.state, &self.parameters);
        let mut balance = vec![Jet::constant(space, -1.0), Jet::zero(space)];
        let mut power = Jet::constant(space, 1.0);
        for coefficient in &around.watched(surface)[2..] {
            balance.push(&power * coefficient);
            power = -&(&power * depth);
        }
        let curvature = balance[2].head();
        if curvature <= 0.0 || curvature.is_nan() {
            return Err(Stopped::Failed);
        }
        let first = Jet::constant(space, 1.0 / curvature.sqrt());
        let share = implicit_root(&first, |share| power_series_with_slope_at(&balance, share))?;
        let ago = depth * &share;
        let met = around.state_at(&-&ago);
        let after = reset_state(reset, &met, &self.parameters);
        Ok(series(&fields.free, &after, &self.parameters).state_at(&ago))
    }

    /// Flies from the minimum to the section.
    fn fly(
        &self,
        fields: &Fields,
        (state, watch): (Vec<Jet<f64>>, Watch<'_>),
        events: &[Event<f64>],
        rest: f64,
    ) -> Result<Vec<Jet<f64>>, Stopped> {
        let mut flight = Flight::new(fields, state, &self.parameters, None, watch);
        match flight.pass_all(events) {
            Err(Stopped::Graze(_, crossing)) => return Err(Stopped::Crossing(crossing)),
            passed => passed?,
        }
        flight.end(rest, &self.beyond)
    }
}

impl Tabulated for StroboscopicReturn<'_> {
    fn ranges(&self) -> Vec<[f64; 2]> {
        self.region.axes.iter().map(|axis| axis.range).collect()
    }

    fn scales(&self) -> Vec<f64> {
        let states = self.region.axes[..self.states].iter();
        states.map(|axis| axis.range[1] - axis.range[0]).collect()
    }

    fn image(&mut self, point: &[f64], image: &mut [f64]) -> bool {
        let Ok(duration) = self.place(point) else { return false };
        if self.simulator.advance(duration, &mut |_| {}) != Ok(Outcome::Completed) {
            return false;
        }
        image.copy_from_slice(&self.simulator.state()[..self.states]);
        true
    }

    fn expand(&mut self, cell: &Cell, order: usize) -> Expansion {
        match self.piece(cell, order) {
            Ok(piece) => Expansion::Piece(piece, None),
            Err(Stopped::Crossing(jet) | Stopped::Graze(_, jet)) => {
                Expansion::Unresolved { crossing: Some(*jet) }
            }
            Err(Stopped::Failed) => Expansion::Unresolved { crossing: None },
        }
    }
}
