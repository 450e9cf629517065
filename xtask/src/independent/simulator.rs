//! Event-driven simulation: the flight is sampled, and a sample is cut where a watched function
//! falls through zero.

use super::extrapolation::{Flow, zero};
use super::formula::Formula;
use super::number::{Dual, Number};
use super::oscillator::{Oscillator, Response, along, along_twice, rates};

/// Limit of events in one return: a chatter with restitution 0.98 has six hundred, one of a stop
/// that is elastic at low speed does not end.
pub(super) const MOST_EVENTS: usize = 2_000;
/// Duration of a hop, as a share of the longest sample, below which the state comes to rest.
const LAST_HOP: f64 = 1e-5;
/// Time, as a share of a sample, within which falls count as one instant.
const SAME_INSTANT: f64 = 1e-11;
/// Distance of a minimum and a maximum, in samples, below which they are not looked for.
const NEAREST_TURNS: f64 = 1e-2;

/// Regime of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Free flight.
    Free,
    /// In contact with a compliant stop, while its release function times `sign` is positive.
    Held {
        /// Stop.
        stop: usize,
        /// Sign of the release function in contact.
        sign: f64,
    },
    /// At rest on a rigid stop, held by a force on one component.
    Resting {
        /// Stop.
        stop: usize,
        /// Component of the state that the force holds.
        component: usize,
    },
}

/// Event of a flight.
#[derive(Clone, Debug)]
pub struct Happening<N> {
    /// Time of the event.
    pub time: N,
    /// Stop of the event.
    pub stop: usize,
    /// Kind of the event.
    pub kind: Kind<N>,
    /// State at the event, before any response.
    pub state: Vec<N>,
}

/// Kind of an event, with speeds of the gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind<N> {
    /// Impact on a rigid stop.
    Impact {
        /// Speed before.
        speed: N,
        /// Speed after.
        rebound: N,
    },
    /// Beginning of a contact with a compliant stop.
    Begin {
        /// Speed of approach.
        speed: N,
    },
    /// End of a contact with a compliant stop.
    End {
        /// Speed of departure.
        speed: N,
    },
    /// Minimum of the gap, below zero only if the stop is ignored.
    Minimum {
        /// Lowest gap.
        gap: N,
    },
    /// End of a rest.
    Leave,
}

impl<N: Number> Happening<N> {
    /// Whether a stop begins or ceases to act.
    pub fn acts(&self) -> bool {
        !matches!(self.kind, Kind::Minimum { .. })
    }
}

impl<N: Number> Kind<N> {
    /// Speed at which a stop is met.
    pub fn speed(&self) -> Option<N> {
        match *self {
            Self::Impact { speed, .. } | Self::Begin { speed } => Some(speed),
            _ => None,
        }
    }
}

/// Reason for which a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The state is not finite.
    Diverged,
    /// Two stops hold the state at once.
    HeldTwice,
    /// A state must rest, but the holding force is unknown.
    NoRest,
    /// A response leaves the state moving into the stop.
    Through,
    /// More events than any return has.
    TooManyEvents,
}

/// Function whose zero is watched.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Watch {
    Gap(usize),
    Release,
}

/// Simulation of an oscillator.
#[derive(Clone, Debug)]
pub struct Simulator<'a, N> {
    /// Oscillator that is simulated.
    pub oscillator: &'a Oscillator,
    /// Values of the parameters.
    pub parameters: Vec<N>,
    /// Present state: states, then the phase.
    pub state: Vec<N>,
    /// Time since the state was set.
    pub time: N,
    /// Present regime.
    pub mode: Mode,
    /// Stop whose minima are reported and which does not act.
    pub ignored: Option<usize>,
    /// Longest time between two samples.
    sample: N,
    /// Function that was zero at the start of the present sample.
    fresh: Option<Watch>,
    /// Stops that are met at the same instant.
    pending: Vec<usize>,
}

impl<'a, N: Number> Simulator<'a, N> {
    /// Creates a simulation with at least one sample per `sample`, which must be shorter than any
    /// relevant feature.
    pub fn new(oscillator: &'a Oscillator, parameters: &[N], sample: f64) -> Self {
        Self {
            oscillator,
            parameters: parameters.to_vec(),
            state: vec![N::zero(); oscillator.states.len()],
            time: N::zero(),
            mode: Mode::Free,
            ignored: None,
            sample: N::of(sample),
            fresh: None,
            pending: Vec::new(),
        }
    }

    /// Forcing period, in time.
    pub fn forcing_period(&self) -> Option<N> {
        let rates = rates(&self.oscillator.flow, &self.state, &self.parameters);
        Some(N::exact(self.oscillator.period?) / *rates.last()?)
    }

    /// Sets a state in free flight, at time 0.
    pub fn place(&mut self, state: &[N]) {
        self.state = state.to_vec();
        self.time = N::zero();
        self.mode = Mode::Free;
        self.ignored = None;
        self.fresh = None;
        self.pending.clear();
    }

    /// Sets a state at a minimum of the gap of a stop, in free flight, at time 0.
    pub fn place_at_minimum(&mut self, state: &[N], stop: usize) {
        self.place(state);
        self.fresh = Some(Watch::Gap(stop));
    }

    /// Subtracts whole periods from the phase.
    pub fn reduce_phase(&mut self) {
        if let (Some(period), Some(phase)) = (self.oscillator.period, self.state.last_mut()) {
            let turns = (phase.double() / period.to_f64()).floor();
            *phase = *phase - N::of(turns) * N::exact(period);
        }
    }

    /// Gap of a stop and its derivative along the free flow.
    pub fn gap(&self, stop: usize) -> (N, N) {
        let gap = &self.oscillator.stops[stop].gap;
        along(gap, &self.oscillator.flow, &self.state, &self.parameters)
    }

    /// Gap of a stop with its first two derivatives along the free flow.
    pub fn gap_twice(&self, stop: usize) -> [N; 3] {
        let gap = &self.oscillator.stops[stop].gap;
        along_twice(gap, &self.oscillator.flow, &self.state, &self.parameters)
    }

    /// Simulates for a time, and returns the events.
    pub fn advance(&mut self, time: N) -> Result<Vec<Happening<N>>, Failure> {
        let until = self.time + time;
        let mut happened = Vec::new();
        while let Some(next) = self.next(until)? {
            happened.push(next);
            if happened.len() > MOST_EVENTS {
                return Err(Failure::TooManyEvents);
            }
        }
        Ok(happened)
    }

    /// Simulates to just after the next event; `None` if a time is reached first.
    pub fn next(&mut self, until: N) -> Result<Option<Happening<N>>, Failure> {
        loop {
            if let Some(stop) = self.pending.pop()
                && self.gap(stop).1.is_negative()
            {
                return self.respond(stop).map(Some);
            }
            if !(self.time - until).is_negative() {
                return Ok(None);
            }
            if let Some(found) = self.sample(until)? {
                return Ok(Some(found));
            }
        }
    }

    /// Flies without stops, for a time of either sign.
    pub fn fly(&mut self, time: N) -> Result<(), Failure> {
        let free = |state: &[N], out: &mut [N]| {
            self.oscillator.flow.values(state, &self.parameters, out);
        };
        let mut left = time;
        while left.double() != 0.0 {
            let sign = if left.is_negative() { -self.sample } else { self.sample };
            let length = if left.size() <= self.sample.size() { left } else { sign };
            let flown = Flow { rates: &free }.after(&self.state, length);
            self.state = flown.ok_or(Failure::Diverged)?;
            left = left - length;
        }
        self.time = self.time + time;
        Ok(())
    }

    /// Moves a state beyond a stop back along the free flow to the surface, within a time limit.
    pub fn back_to_surface(&mut self, stop: usize, longest: N) -> Result<(), Failure> {
        let this = self.clone();
        let free = |state: &[N], out: &mut [N]| {
            this.oscillator.flow.values(state, &this.parameters, out);
        };
        let flow = Flow { rates: &free };
        let gap = &self.oscillator.stops[stop].gap;
        let lost = Failure::Diverged;
        let sense = |state: &[N]| along(gap, &this.oscillator.flow, state, &this.parameters);
        let mut back = N::zero();
        while (back + longest).double() > 0.0 {
            let left = -(back + longest);
            let step = if (left + self.sample).is_negative() { -self.sample } else { left };
            let end = flow.after(&self.state, step).ok_or(lost)?;
            let at = |time: N| flow.after(&self.state, time).map(|state| sense(&state));
            let ((from, rises), (to, falls)) = (sense(&self.state), sense(&end));
            let mut top = (step, to);
            if to.is_negative() && rises.is_negative() && !falls.is_negative() {
                // NOTE: the state may come out and go in again.
                let slope = |time: N| at(time).map(|(_, slope)| slope);
                let time = zero(slope, (N::zero(), rises), (step, falls)).ok_or(lost)?;
                top = (time, at(time).ok_or(lost)?.0);
            }
            if !top.1.is_negative() {
                let height = |time: N| at(time).map(|(gap, _)| gap);
                let time = zero(height, (N::zero(), from), top).ok_or(lost)?;
                let there = flow.after(&self.state, time).ok_or(lost)?;
                self.time = self.time + back + time;
                self.state = there;
                return Ok(());
            }
            self.state = end;
            back = back + step;
        }
        Err(Failure::Through)
    }

    fn rates(&self, state: &[N], out: &mut [N]) {
        match self.mode {
            Mode::Free => self.oscillator.flow.values(state, &self.parameters, out),
            Mode::Held { .. } => self.held().0.values(state, &self.parameters, out),
            Mode::Resting { stop, component } => {
                self.oscillator.flow.values(state, &self.parameters, out);
                let gap = &self.oscillator.stops[stop].gap;
                let [_, _, turns] =
                    along_twice(gap, &self.oscillator.flow, state, &self.parameters);
                out[component] = out[component] - turns / self.push(stop, component, state);
            }
        }
    }

    /// Flow and release function of the present contact; those of the first stop in free flight.
    fn held(&self) -> (&'a Formula, &'a Formula) {
        let stop = match self.mode {
            Mode::Held { stop, .. } => stop,
            _ => 0,
        };
        match &self.oscillator.stops[stop].response {
            Response::Contact { flow, release } => (flow, release),
            Response::Impact(_) => (&self.oscillator.flow, &self.oscillator.stops[stop].gap),
        }
    }

    /// Derivative of the speed of a gap by a component.
    fn push(&self, stop: usize, component: usize, state: &[N]) -> N {
        let moved: Vec<Dual<N>> = state
            .iter()
            .enumerate()
            .map(|(place, &value)| {
                let slope = N::of(if place == component { 1.0 } else { 0.0 });
                Dual { value, slope }
            })
            .collect();
        let fixed = self.parameters.iter().map(|&value| Dual { value, slope: N::zero() });
        let fixed: Vec<Dual<N>> = fixed.collect();
        let gap = &self.oscillator.stops[stop].gap;
        along(gap, &self.oscillator.flow, &moved, &fixed).1.slope
    }

    fn watches(&self) -> Vec<Watch> {
        let (holding, release) = match self.mode {
            Mode::Free => (None, None),
            Mode::Held { stop, .. } | Mode::Resting { stop, .. } => {
                (Some(stop), Some(Watch::Release))
            }
        };
        let stops = (0..self.oscillator.stops.len()).filter(|&stop| holding != Some(stop));
        release.into_iter().chain(stops.map(Watch::Gap)).collect()
    }

    /// Value of a watched function at a state, and its derivative along the present flow.
    fn watched(&self, watch: Watch, state: &[N]) -> (N, N) {
        let free = &self.oscillator.flow;
        match (watch, self.mode) {
            (Watch::Gap(stop), Mode::Held { .. }) => {
                along(&self.oscillator.stops[stop].gap, self.held().0, state, &self.parameters)
            }
            (Watch::Gap(stop), _) => {
                along(&self.oscillator.stops[stop].gap, free, state, &self.parameters)
            }
            (Watch::Release, Mode::Held { sign, .. }) => {
                let (flow, release) = self.held();
                let (value, slope) = along(release, flow, state, &self.parameters);
                (N::of(sign) * value, N::of(sign) * slope)
            }
            (Watch::Release, Mode::Resting { stop, .. }) => {
                let gap = &self.oscillator.stops[stop].gap;
                let [_, _, turns] = along_twice(gap, free, state, &self.parameters);
                (-turns, N::zero())
            }
            (Watch::Release, Mode::Free) => (N::of(1.0), N::zero()),
        }
    }

    /// Time until a function that is zero and rises has its maximum, if that is near.
    fn time_to_turn(&self, watch: Watch) -> Option<N> {
        let free = &self.oscillator.flow;
        let (function, flow, sign) = match (watch, self.mode) {
            (Watch::Gap(stop), Mode::Held { .. }) => {
                (&self.oscillator.stops[stop].gap, self.held().0, 1.0)
            }
            (Watch::Gap(stop), _) => (&self.oscillator.stops[stop].gap, free, 1.0),
            (Watch::Release, Mode::Held { sign, .. }) => (self.held().1, self.held().0, sign),
            (Watch::Release, _) => return None,
        };
        let [_, slope, turns] = along_twice(function, flow, &self.state, &self.parameters);
        let (slope, turns) = (N::of(sign) * slope, N::of(sign) * turns);
        (turns.double() < 0.0 && slope.double() > 0.0).then(|| -(slope / turns))
    }

    /// Looks ahead one sample and returns its first event.
    fn sample(&mut self, until: N) -> Result<Option<Happening<N>>, Failure> {
        let this = self.clone();
        let rates = |state: &[N], out: &mut [N]| this.rates(state, out);
        let flow = Flow { rates: &rates };
        let left = until - self.time;
        // NOTE: slightly after the turn, so that the next sample begins with a fall.
        let behind = |turn: N| turn * N::of(1.0625);
        let mut length = if (left - self.sample).is_negative() { left } else { self.sample };
        if let Some(turn) = self.fresh.and_then(|watch| self.time_to_turn(watch))
            && (behind(turn) - length).is_negative()
        {
            length = behind(turn);
        }
        let shortest = self.sample.double() * 1e-12;
        let end = loop {
            match flow.step(&self.state, length) {
                Some(end)
                    if length.double() > NEAREST_TURNS * self.sample.double()
                        && self.may_turn_twice(length, &end) =>
                {
                    length = length / N::of(2.0);
                }
                Some(end) => break end,
                None if length.double() < shortest => return Err(Failure::Diverged),
                None => length = length / N::of(2.0),
            }
        };
        let mut first: Option<(N, Watch, bool)> = None;
        let mut same = Vec::new();
        for watch in self.watches() {
            let found = self.fall(watch, &flow, length, &end)?;
            let Some((time, crosses)) = found else { continue };
            let near = SAME_INSTANT * self.sample.double();
            match first {
                Some((known, ..)) if (time - known).double() > near => {}
                Some((known, other, true)) if (time - known).double().abs() <= near && crosses => {
                    if let (Watch::Gap(_), Watch::Gap(stop)) = (other, watch) {
                        same.push(stop);
                    }
                }
                _ => {
                    same.clear();
                    first = Some((time, watch, crosses));
                }
            }
        }
        self.fresh = None;
        let Some((time, watch, crosses)) = first else {
            self.state = end;
            self.time = if (length - left).double() == 0.0 { until } else { self.time + length };
            return Ok(None);
        };
        self.state = flow.after(&self.state, time).ok_or(Failure::Diverged)?;
        self.time = self.time + time;
        self.pending = same;
        match watch {
            Watch::Gap(stop) if crosses => self.respond(stop).map(Some),
            Watch::Gap(stop) => {
                self.fresh = Some(watch);
                let (gap, _) = self.gap(stop);
                Ok(Some(self.happening(stop, Kind::Minimum { gap })))
            }
            Watch::Release => Ok(Some(self.release())),
        }
    }

    /// Whether a gap may have a minimum and a maximum within a sample: its slope moves towards zero
    /// at first and away from it at the end, and is small enough to reach zero.
    fn may_turn_twice(&self, length: N, end: &[N]) -> bool {
        let flow = match self.mode {
            Mode::Held { .. } => self.held().0,
            _ => &self.oscillator.flow,
        };
        let sense = |gap: &Formula, state: &[N]| {
            let [_, slope, bend] = along_twice(gap, flow, state, &self.parameters);
            (slope.double(), bend.double())
        };
        self.oscillator.stops.iter().any(|stop| {
            let (first, bends) = sense(&stop.gap, &self.state);
            let (last, unbends) = sense(&stop.gap, end);
            let reach = length.double() * bends.abs().max(unbends.abs());
            let comes_back = first * last > 0.0 && first * bends < 0.0 && last * unbends > 0.0;
            comes_back && first.abs().min(last.abs()) < reach
        })
    }

    /// Time at which a watched function falls through zero within a sample, or has a minimum above
    /// it (`false`).
    fn fall(
        &self,
        watch: Watch,
        flow: &Flow<'_, N>,
        length: N,
        end: &[N],
    ) -> Result<Option<(N, bool)>, Failure> {
        let at = |time: N| flow.after(&self.state, time);
        let value = |time: N| at(time).map(|state| self.watched(watch, &state).0);
        let slope = |time: N| at(time).map(|state| self.watched(watch, &state).1);
        let lost = Failure::Diverged;
        let ((from, falls), (to, rises)) =
            (self.watched(watch, &self.state), self.watched(watch, end));
        if !(from.double().is_finite() && to.double().is_finite()) {
            return Err(lost);
        }
        let start = (N::zero(), from);
        let turns = falls.is_negative() && !rises.is_negative();
        let is_fresh = self.fresh == Some(watch);
        if self.ignored.map(Watch::Gap) == Some(watch) {
            if !turns || is_fresh {
                return Ok(None);
            }
            let time = zero(slope, (N::zero(), falls), (length, rises)).ok_or(lost)?;
            return Ok(Some((time, false)));
        }
        if is_fresh || from.is_negative() {
            // It has to rise before it can fall.
            let peak = !falls.is_negative() && rises.is_negative();
            if !to.is_negative() || !peak {
                return Ok(None);
            }
            let top = zero(slope, (N::zero(), falls), (length, rises)).ok_or(lost)?;
            let height = value(top).ok_or(lost)?;
            if height.is_negative() || top.double() == 0.0 {
                return Ok(None);
            }
            return Ok(zero(value, (top, height), (length, to)).map(|time| (time, true)));
        }
        if to.is_negative() {
            return Ok(zero(value, start, (length, to)).map(|time| (time, true)));
        }
        if turns {
            let time = zero(slope, (N::zero(), falls), (length, rises)).ok_or(lost)?;
            let least = value(time).ok_or(lost)?;
            if least.is_negative() {
                return Ok(zero(value, start, (time, least)).map(|time| (time, true)));
            }
            return Ok((watch != Watch::Release).then_some((time, false)));
        }
        Ok(None)
    }

    fn happening(&self, stop: usize, kind: Kind<N>) -> Happening<N> {
        Happening { time: self.time, stop, kind, state: self.state.clone() }
    }

    /// Applies the response of a stop to the state that meets it.
    pub fn respond(&mut self, stop: usize) -> Result<Happening<N>, Failure> {
        let speed = -self.gap(stop).1;
        let mut told = self.happening(stop, Kind::Begin { speed });
        match &self.oscillator.stops[stop].response {
            Response::Impact(jumps) => {
                let values: Vec<N> = jumps
                    .iter()
                    .map(|(_, jump)| jump.value(&self.state, &self.parameters))
                    .collect();
                for (&(component, _), &value) in jumps.iter().zip(&values) {
                    self.state[component] = value;
                }
                let [_, rebound, turns] = self.gap_twice(stop);
                told.kind = Kind::Impact { speed, rebound };
                let hop = self.sample.double() * LAST_HOP;
                let slow = rebound.double() < -0.5 * turns.double() * hop;
                if slow && (rebound.double() < speed.double()) {
                    self.rest(stop, jumps)?;
                } else if rebound.is_negative() {
                    return Err(Failure::Through);
                } else {
                    self.fresh = Some(Watch::Gap(stop));
                }
            }
            Response::Contact { flow, release } => {
                if self.mode != Mode::Free {
                    return Err(Failure::HeldTwice);
                }
                let [value, slope, turns] =
                    along_twice(release, flow, &self.state, &self.parameters);
                let rounding = 1e4 * N::EPSILON * slope.size().max(1.0);
                let leading = [(value, rounding), (slope, rounding)]
                    .into_iter()
                    .find_map(|(value, least)| (value.size() > least).then_some(value));
                let sign = leading.unwrap_or(turns).double().signum();
                self.mode = Mode::Held { stop, sign };
                self.fresh = (value.size() <= rounding).then_some(Watch::Release);
            }
        }
        Ok(told)
    }

    /// Puts the state at rest on a rigid stop.
    fn rest(&mut self, stop: usize, jumps: &[(usize, Formula)]) -> Result<(), Failure> {
        let (&[(component, _)], Mode::Free) = (jumps, self.mode) else {
            return Err(Failure::NoRest);
        };
        let push = self.push(stop, component, &self.state);
        let (_, speed) = self.gap(stop);
        self.state[component] = self.state[component] - speed / push;
        self.mode = Mode::Resting { stop, component };
        Ok(())
    }

    /// Ends a contact or a rest.
    fn release(&mut self) -> Happening<N> {
        let (stop, rests) = match self.mode {
            Mode::Held { stop, .. } => (stop, false),
            Mode::Resting { stop, .. } => (stop, true),
            Mode::Free => (0, false),
        };
        let (_, speed) = self.gap(stop);
        let told = self.happening(stop, if rests { Kind::Leave } else { Kind::End { speed } });
        self.mode = Mode::Free;
        self.fresh = Some(Watch::Gap(stop));
        told
    }
}
