//! The event-driven simulator.
//!
//! Taylor steps of the present regime's field. On each step the watched gaps are searched
//! ([`search`](super::search)), the state is moved to the first event, and the surface's response
//! is applied.
//!
//! The simulator advances by durations, by forcing periods, or from stop to stop; responses and
//! releases on the way are applied.
//!
//! A state is brought onto the surface to which it was flown. The time of an event is the root of a
//! polynomial, and the state there is the value of others: it lies beside the surface by the
//! rounding of its largest component, and a stiff contact multiplies that distance by its
//! acceleration. One Newton step along the *free* flow,
//!
//! ```text
//! x += f s,   t += s,   s = −g(x) / L_f g(x),
//! ```
//!
//! leaves the rounding of `g` alone. `g` is the gap where a contact begins, the release function
//! where one ends; see docs/mathematics/direct-simulation.md for why the free flow serves both.

use super::HybridError;
use super::affine::AffineTools;
use super::motion::{Clearance, Evaluator, Motion, Regime, Sense, Sensor, rounding_of};
use super::passage::{
    Approach, Flight as _, Landing, REDUCED, Stop, TaylorFlight, ends_before_turn,
};
use super::stationary::StationaryPoints;
use super::system::{HybridSystem, Law, ReleaseSlopes, SurfaceLaw, Watch};
use super::trajectory::{Event, Outcome, Trajectory};
use super::variation::Change;
use crate::flow::Integrator;
use crate::interruption::check;
use crate::numeric::Real;

/// Direct simulation of a [`HybridSystem`] over `f64` or double-double.
///
/// Memory is allocated once: stepping allocates nothing.
#[derive(Clone, Debug)]
pub struct Simulator<'a, S: Real> {
    pub(super) system: &'a HybridSystem,
    pub(super) parameters: Vec<S>,
    pub(super) motion: Motion<S>,
    pub(super) free: Integrator<'a, S>,
    /// The exact flow, if free flight is affine.
    pub(super) affine: Option<AffineTools<'a, S>>,
    pub(super) work: Work<S>,
    /// A gap and its slope, in reversed time.
    pub(super) reversed: (Vec<S>, Vec<S>),
    pub(super) surfaces: Vec<SurfaceTools<'a, S>>,
    pub(super) near_miss: S,
    step_limit: usize,
    /// Number of steps since the state was placed, or since the start of the call that advances it.
    pub(super) steps: usize,
    /// Two surfaces that hold the state at its start: no regime describes both.
    pub(super) held_twice: Option<[usize; 2]>,
    /// Changes at surfaces, if they are recorded; see [`Motion::changes`].
    pub(super) changes: Option<Vec<Change<S>>>,
}

/// Working memory of a step.
#[derive(Clone, Debug)]
pub(super) struct Work<S> {
    pub(super) points: StationaryPoints<f64>,
    /// State after a step, or before an impact.
    pub(super) next: Vec<S>,
    /// Value and slope of the function whose zero ends a flight, and the rates of the free flow
    /// there.
    pub(super) landing: Vec<S>,
    /// Minima without contact: time in the step, surface, gap.
    pub(super) misses: Vec<(S, usize, S)>,
}

/// Working memory of one surface.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTools<'a, S: Real> {
    pub(super) sensor: Sensor<'a, S>,
    /// The gap at the beginning of a contact.
    pub(super) contact: Evaluator<'a, S>,
    pub(super) reset: Option<Evaluator<'a, S>>,
    /// Release function of a compliant surface at the end of a contact, followed by the sizes of
    /// its terms.
    pub(super) release: Option<Evaluator<'a, S>>,
    pub(super) release_slopes: Option<SlopeTools<'a, S>>,
    /// Contact field that may have no series on the surface.
    pub(super) rough: Option<RoughTools<'a, S>>,
    /// Integrator of the contact field or the stick field.
    pub(super) held: Option<Integrator<'a, S>>,
}

/// Working memory of a contact field that may have no series on the surface.
#[derive(Clone, Debug)]
pub(super) struct RoughTools<'a, S: Real> {
    pub(super) rates: Evaluator<'a, S>,
    /// Integrator of the rates times a unit of time, the last parameter.
    pub(super) scaled: Integrator<'a, S>,
}

/// Slopes of a release function.
#[derive(Clone, Debug)]
pub(super) struct SlopeTools<'a, S: Real> {
    slopes: &'a ReleaseSlopes,
    evaluator: Evaluator<'a, S>,
}

/// Regime of a compliant contact for a state beyond its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contact<S> {
    /// The contact is over: the state flies freely, although the gap is negative.
    Released,
    /// The contact lasts until the release function, multiplied by `release_sign`, falls to zero.
    Lasting {
        /// Sign, or 0 if the first step has to find it.
        release_sign: S,
    },
}

/// Default limit on the number of steps.
const STEP_LIMIT: usize = 10_000_000;

/// Factor by which a gap exceeds the rounding of a bound on its terms where it is surely not zero.
const FAR: f64 = 1e3;

impl<'a, S: Real> Simulator<'a, S> {
    /// A simulator at the full state zero; see [`set_state`](Self::set_state).
    ///
    /// `parameters` is the model's full parameter vector.
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`].
    pub fn new(system: &'a HybridSystem, parameters: &[S]) -> Result<Self, HybridError> {
        let mut simulator = Self {
            system,
            parameters: parameters.to_vec(),
            motion: Motion::new(system.dimension, system.surfaces.len()),
            free: Integrator::new(&system.free.field),
            affine: system.affine.as_ref().map(AffineTools::new),
            work: Work {
                points: StationaryPoints::new(),
                next: vec![S::zero(); system.dimension],
                landing: vec![S::zero(); 2 + system.dimension],
                misses: Vec::new(),
            },
            reversed: (Vec::new(), Vec::new()),
            surfaces: system
                .surfaces
                .iter()
                .map(|law| SurfaceTools::new(law, system.dimension))
                .collect(),
            near_miss: S::from_f64(f64::INFINITY),
            step_limit: STEP_LIMIT,
            steps: 0,
            held_twice: None,
            changes: None,
        };
        simulator.set_parameters(parameters)?;
        Ok(simulator)
    }

    /// Changes the parameters.
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`].
    pub fn set_parameters(&mut self, parameters: &[S]) -> Result<(), HybridError> {
        let expected = self.system.parameters;
        if parameters.len() != expected {
            return Err(HybridError::ParameterLength { expected, found: parameters.len() });
        }
        check_finite(parameters, self.system.dimension)?;
        if self.parameters != parameters {
            self.parameters.copy_from_slice(parameters);
            self.affine.iter_mut().for_each(AffineTools::drop_tables);
            self.motion.lose_headings();
        }
        Ok(())
    }

    /// Limits reported near misses to gaps of at most this (default: every local minimum of a gap).
    pub fn set_near_miss_limit(&mut self, gap: S) {
        self.near_miss = gap;
    }

    /// Limits the number of steps of one call, or of a whole return (default: ten million).
    pub fn set_step_limit(&mut self, limit: usize) {
        self.step_limit = limit;
    }

    /// Places the full state at time 0: in free flight, or in contact if it lies beyond a compliant
    /// surface whose release function shows no release.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn set_state(&mut self, state: &[S]) -> Result<(), HybridError> {
        self.set_virtual_state(state, None)
    }

    /// Places a full state that a compliant surface does not hold, however far the state lies
    /// beyond it.
    ///
    /// # Errors
    ///
    /// The errors of [`set_state`](Self::set_state).
    pub(super) fn set_virtual_state(
        &mut self,
        state: &[S],
        beyond: Option<usize>,
    ) -> Result<(), HybridError> {
        let expected = self.system.dimension;
        if state.len() != expected {
            return Err(HybridError::StateLength { expected, found: state.len() });
        }
        check_finite(state, 0)?;
        self.affine.iter_mut().for_each(AffineTools::forget);
        let motion = &mut self.motion;
        motion.state.copy_from_slice(state);
        motion.time = S::zero();
        motion.turns = 0;
        self.steps = 0;
        motion.lose_headings();
        motion.slides = 0;
        motion.regime = Regime::Free;
        motion.changed = S::from_f64(f64::NEG_INFINITY);
        motion.changes = 0;
        self.held_twice = None;
        if let Some(phase) = &self.system.phase {
            motion.reference_phase = state[phase.component];
        }
        for surface in 0..self.surfaces.len() {
            let is_compliant = matches!(self.system.surfaces[surface].law, Law::Compliant { .. });
            if is_compliant && beyond == Some(surface) {
                self.motion.leaving[surface] = None;
                continue;
            }
            let Sense { gap, rounding, .. } = self.placed(surface);
            self.place_at(surface, Clearance { gap, rounding }, rounding);
        }
        Ok(())
    }

    /// Normal motion of a placed state at a surface, with the rounding by which it may lie beside
    /// the surface.
    ///
    /// Where the coordinates vanish on a rigid surface, so do the terms of the gap. A state that
    /// was flown there lies beside the surface by the rounding of the terms of its flight, which
    /// are those of a Taylor step. That rounding counts for a state beyond the surface, which would
    /// penetrate it otherwise, and for a state at rest.
    pub(super) fn placed(&mut self, surface: usize) -> Sense<S> {
        let sense = self.sense(surface);
        let clearance = Clearance { gap: sense.gap, rounding: sense.rounding };
        let is_rigid = matches!(self.system.surfaces[surface].law, Law::Rigid { .. });
        let may_count = sense.gap < S::zero() || sense.acceleration < S::zero();
        if !is_rigid
            || !may_count
            || sense.gap.abs() <= clearance.slack()
            || !clearance.vanishes()
            || self.is_far_from(surface, sense.gap)
        {
            return sense;
        }
        let flown = Sense { rounding: self.flown_rounding(surface), ..sense };
        let is_beyond = sense.gap < S::zero() && -sense.gap <= flown.rounding;
        if is_beyond || flown.rests() { flown } else { sense }
    }

    /// Whether a gap is known to exceed the rounding of its terms along the free flow: the exact
    /// flow bounds these without an expansion.
    fn is_far_from(&mut self, surface: usize, gap: S) -> bool {
        let Self { affine, motion, parameters, .. } = self;
        let size = affine.as_mut().and_then(|tools| tools.gap_size(surface, motion, parameters));
        size.is_some_and(|size| rounding_of(&[size]) * S::from_f64(FAR) < gap.abs())
    }

    /// Rounding of a surface's gap along a Taylor step of the free flow from the present state: a
    /// few units in the last place of the largest term.
    fn flown_rounding(&mut self, surface: usize) -> S {
        let Self { system, motion, parameters, free, .. } = self;
        let watches = &system.free.watches;
        let Some(watch) = watches.iter().position(|&watch| watch == Watch::Gap { surface }) else {
            return S::zero();
        };
        let step = free.expand(&motion.state, parameters);
        let mut flight = TaylorFlight::new(step, watches.len(), 1.0);
        let length = flight.length();
        let terms = flight.polynomials(watch).0.iter().rev();
        let size = terms.fold(S::zero(), |size, term| (size * length).max(term.abs()));
        if size.is_finite() { rounding_of(&[size]) } else { S::zero() }
    }

    /// Places the state anew at all surfaces except the one on which it is: it may meet others at
    /// the same instant, and lie beyond them by rounding.
    pub(super) fn place_at_others(&mut self, surface: usize) {
        self.held_twice = None;
        for other in (0..self.surfaces.len()).filter(|&other| other != surface) {
            let clearance = self.clearance(other);
            self.place_at(other, clearance, clearance.slack());
        }
    }

    /// Places the state at a surface: leaving it, or in contact if it lies beyond it by more than a
    /// distance.
    fn place_at(&mut self, surface: usize, Clearance { gap, rounding }: Clearance<S>, beyond: S) {
        self.motion.leaving[surface] = (gap.abs() <= rounding).then_some(rounding);
        if gap < -beyond
            && let Some(held) = self.contact_beyond(surface)
        {
            self.place_in_contact(surface, held);
        }
    }

    fn place_in_contact(&mut self, surface: usize, held: Contact<S>) {
        match held {
            Contact::Released => self.motion.leaving[surface] = Some(S::zero()),
            Contact::Lasting { release_sign } => {
                if let Regime::Contact { surface: other } = self.motion.regime {
                    self.held_twice = Some([other, surface]);
                }
                let never = S::from_f64(f64::INFINITY);
                self.begin_contact(surface, S::zero(), never);
                self.motion.release_sign = release_sign;
            }
        }
    }

    /// Regime of the contact with a compliant surface beyond which the state lies; `None` for a
    /// rigid surface.
    ///
    /// From the beginning of a contact to the release, the release function keeps its sign.
    pub(super) fn contact_beyond(&mut self, surface: usize) -> Option<Contact<S>> {
        let gap = self.clearance(surface).gap;
        let dimension = self.system.dimension;
        let Self { motion, parameters, surfaces, work, .. } = self;
        let tools = &mut surfaces[surface];
        let entry = &mut work.next;
        entry.copy_from_slice(&motion.state);
        let sign = tools.release_slopes.as_mut()?.sign_beyond(gap, entry, parameters);
        let values = tools.release.as_mut()?.evaluate(&motion.state, parameters);
        let (value, rounding) = (values[0] * sign, rounding_of(&values[2 + dimension..]));
        // NOTE: if the force is zero to rounding, its slope gives the sign that it will have.
        let force = if value.abs() <= rounding { values[1] * sign } else { value };
        Some(if force < S::zero() {
            Contact::Released
        } else {
            Contact::Lasting { release_sign: sign }
        })
    }

    /// `h''` along the contact field of a compliant surface.
    pub(super) fn contact_acceleration(&mut self, surface: usize) -> Option<S> {
        let Self { motion, parameters, surfaces, .. } = self;
        let slopes = surfaces[surface].release_slopes.as_mut()?;
        Some(slopes.evaluator.evaluate(&motion.state, parameters)[3])
    }

    /// Enters the contact field of a compliant surface. The time of contact has an uncertainty;
    /// `turn` is the time after which the gap would turn.
    pub(super) fn begin_contact(&mut self, surface: usize, uncertainty: S, turn: S) {
        let dimension = self.system.dimension;
        let Self { motion, parameters, surfaces, .. } = self;
        motion.entry_uncertainty = uncertainty;
        motion.entry_turn = turn;
        motion.regime = Regime::Contact { surface };
        motion.changed = motion.time;
        motion.release_sign = S::zero();
        (motion.hop, motion.hops) = (S::zero(), 0);
        let tools = &mut surfaces[surface];
        let rounding = tools.release.as_mut().map(|release| {
            let values = release.evaluate(&motion.state, parameters);
            rounding_of(&values[2 + dimension..])
        });
        motion.release_rounding = rounding.unwrap_or(S::zero());
        let slopes = tools.release_slopes.as_mut();
        let sign = slopes.and_then(|slopes| slopes.sign_by_speed(&motion.state, parameters));
        motion.entry_sign = sign.unwrap_or(S::zero());
    }

    /// The full state; its phase is within half a period of the initial one.
    pub fn state(&self) -> &[S] {
        &self.motion.state
    }

    /// Time since the state was placed.
    pub fn time(&self) -> S {
        self.motion.time
    }

    /// Whole periods removed from the phase since the state was placed.
    pub fn turns(&self) -> i64 {
        self.motion.turns
    }

    /// The full state with a number of whole periods subtracted from its phase.
    pub(super) fn state_after_advance(&self, periods: i64) -> Vec<S> {
        let mut state = self.motion.state.clone();
        if let Some(phase) = &self.system.phase {
            let periods = S::from_f64((self.motion.turns - periods) as f64);
            state[phase.component] += periods * S::from_dd(phase.period);
        }
        state
    }

    /// The present regime.
    pub fn regime(&self) -> Regime {
        self.motion.regime
    }

    /// The simulated system.
    pub fn system(&self) -> &'a HybridSystem {
        self.system
    }

    /// The forcing period, in units of time.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoPhase`], [`HybridError::PhaseRate`].
    pub fn forcing_period(&self) -> Result<S, HybridError> {
        let phase = self.system.phase.as_ref().ok_or(HybridError::NoPhase)?;
        let mut rate = Evaluator::new(&phase.rate, 1);
        let rate = rate.evaluate(&self.motion.state, &self.parameters)[0];
        if rate > S::zero() {
            Ok(S::from_dd(phase.period) / rate)
        } else {
            Err(HybridError::PhaseRate { rate: rate.to_f64() })
        }
    }
}

impl<S: Real> Simulator<'_, S> {
    /// Simulates for a duration and collects the events.
    ///
    /// # Errors
    ///
    /// [`HybridError::NotFinite`] if the duration is not finite.
    pub fn run(&mut self, duration: S) -> Result<Trajectory<S>, HybridError> {
        let mut events = Vec::new();
        let outcome = self.advance(duration, &mut |event| events.push(event))?;
        Ok(Trajectory { events, state: self.motion.state.clone(), time: self.motion.time, outcome })
    }

    /// Simulates for a duration and calls `record` with every event; allocates nothing.
    ///
    /// # Errors
    ///
    /// [`HybridError::NotFinite`] if the duration is not finite.
    pub fn advance(
        &mut self,
        duration: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Outcome<S>, HybridError> {
        check_finite(&[duration], 0)?;
        let horizon = self.motion.time + duration;
        Ok(self.advance_to(horizon, record).err().unwrap_or(Outcome::Completed))
    }

    /// Simulates one forcing period; afterwards the phase is exactly the initial one.
    ///
    /// `period` is [`forcing_period`](Self::forcing_period), computed once per parameter vector.
    /// Time is measured from the start of the period.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoPhase`] for an autonomous system.
    pub fn advance_period(
        &mut self,
        period: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Outcome<S>, HybridError> {
        let component = self.system.phase.as_ref().ok_or(HybridError::NoPhase)?.component;
        self.motion.reference_phase = self.motion.state[component];
        (self.motion.time, self.motion.turns) = (S::zero(), 0);
        if let Err(outcome) = self.advance_to(period, record) {
            return Ok(outcome);
        }
        self.motion.state[component] = self.motion.reference_phase;
        Ok(Outcome::Completed)
    }

    fn advance_to(
        &mut self,
        horizon: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<(), Outcome<S>> {
        self.steps = 0;
        self.check_placed()?;
        self.check_penetration(None)?;
        loop {
            match self.next_stop(horizon, Approach::default(), record)? {
                Stop::Horizon => return Ok(()),
                Stop::Contact { surface } => self.respond(surface, record)?,
                Stop::Minimum { .. } | Stop::Release => {}
            }
        }
    }

    /// Flies to the next stop at or before a time; releases on the way are applied.
    pub(super) fn next_stop(
        &mut self,
        horizon: S,
        approach: Approach,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Stop<S>, Outcome<S>> {
        while self.steps < self.step_limit {
            if self.motion.time >= horizon {
                return Ok(Stop::Horizon);
            }
            self.steps += 1;
            check();
            let flown = match self.exact_step(horizon, approach, record) {
                Some(flown) => flown,
                None => self.step(horizon, approach, record)?,
            };
            match flown {
                None => {}
                Some(Stop::Release) => self.release(record),
                Some(stop) => return Ok(stop),
            }
        }
        Err(Outcome::StepLimit { limit: self.step_limit, time: self.motion.time })
    }

    /// Flies the contact with a compliant surface from a full state on it. Returns the state at the
    /// release and the time since. A rigid surface applies its reset, in no time.
    ///
    /// `None` if the contact has not ended after `longest`, if another surface is met before, or if
    /// the simulation ends otherwise.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoSuchSurface`], [`HybridError::StateLength`], [`HybridError::NotFinite`].
    #[inline(never)]
    pub fn contact_phase(
        &mut self,
        surface: usize,
        state: &[S],
        longest: S,
    ) -> Result<Option<(Vec<S>, S)>, HybridError> {
        let surfaces = self.surfaces.len();
        if surface >= surfaces {
            return Err(HybridError::NoSuchSurface { surface, surfaces });
        }
        check_finite(&[longest], 0)?;
        self.set_state(state)?;
        let released = self.fly_to_release(surface, longest).unwrap_or(false);
        Ok(released.then(|| (self.motion.state.clone(), self.motion.time)))
    }

    /// Applies the response and flies until the contact is over; returns whether it was before
    /// `horizon`.
    fn fly_to_release(&mut self, surface: usize, horizon: S) -> Result<bool, Outcome<S>> {
        self.respond(surface, &mut |_| {})?;
        while self.steps < self.step_limit {
            self.steps += 1;
            check();
            if self.regime() == Regime::Free {
                return Ok(true);
            }
            if self.motion.time >= horizon {
                return Ok(false);
            }
            match self.step(horizon, Approach::default(), &mut |_| {})? {
                None => {}
                Some(Stop::Release) => self.release(&mut |_| {}),
                Some(_) => return Ok(false),
            }
        }
        Ok(false)
    }

    /// Brings the state onto the zero beside which it has landed, if the flow crosses that zero
    /// transversally.
    ///
    /// NOTE: if the step does not halve the distance, or leads to the turn of `g`, `|g g''| ≥ g'²`,
    /// then the depth of the approach is within the rounding of `g`. A correction could restore
    /// nothing, and the state stays.
    #[inline(never)]
    pub(super) fn settle_on(&mut self, landing: Landing) {
        let falling = match landing {
            Landing::Contact { .. } => S::one(),
            Landing::Release { .. } => self.motion.release_sign,
        };
        let Some((value, slope)) = self.read_landing(landing) else {
            return;
        };
        if value == S::zero() || slope * falling >= S::zero() {
            return;
        }
        if let Landing::Contact { surface } = landing
            && !ends_before_turn(value, slope, self.sense(surface).acceleration)
        {
            return;
        }
        let shift = -value / slope;
        self.work.next.copy_from_slice(&self.motion.state);
        for (state, &rate) in self.motion.state.iter_mut().zip(&self.work.landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        let after = match landing {
            Landing::Contact { surface } => Some(self.clearance(surface).gap),
            Landing::Release { .. } => self
                .read_landing(landing)
                .filter(|after| (after.1 - slope).abs() < slope.abs())
                .map(|after| after.0),
        };
        if after.is_some_and(|after| after.abs() <= value.abs() * S::from_f64(REDUCED)) {
            self.motion.time += shift;
        } else {
            self.motion.state.copy_from_slice(&self.work.next);
        }
    }

    /// Brings the state onto the zero at the end of a compliant contact; at the end of a resting
    /// contact nothing jumps.
    pub(super) fn settle_on_release(&mut self) {
        if let Regime::Contact { surface } = self.motion.regime {
            self.settle_on(Landing::Release { surface });
        }
    }

    /// Value and slope of the function at the present state, also written to the working memory
    /// with the rates of the free flow; `None` for a surface that has no such function.
    #[inline(never)]
    pub(super) fn read_landing(&mut self, landing: Landing) -> Option<(S, S)> {
        let Self { affine, motion, parameters, work, surfaces, .. } = self;
        let values = &mut work.landing;
        let is_read = affine
            .as_mut()
            .is_some_and(|tools| tools.read_landing(landing, motion, parameters, values));
        if !is_read {
            let evaluator = match landing {
                Landing::Contact { surface } => Some(&mut surfaces[surface].contact),
                Landing::Release { surface } => surfaces[surface].release.as_mut(),
            }?;
            let found = evaluator.evaluate(&motion.state, parameters);
            let count = values.len();
            values.copy_from_slice(&found[..count]);
        }
        Some((values[0], values[1]))
    }
}

impl<'a, S: Real> SurfaceTools<'a, S> {
    fn new(surface: &'a SurfaceLaw, dimension: usize) -> Self {
        let (reset, release, held, rough) = match &surface.law {
            Law::Rigid { reset, stick } => (Some(reset), None, stick.as_ref(), None),
            Law::Compliant { contact, release, slopes, rough } => {
                (None, Some((release, &**slopes)), Some(contact), rough.as_deref())
            }
        };
        Self {
            sensor: Sensor::new(&surface.sensor, dimension),
            contact: Evaluator::new(&surface.landing, 2 + dimension),
            reset: reset.map(|reset| Evaluator::new(reset, dimension)),
            release: release.map(|(release, _)| Evaluator::new(release, 2 + 2 * dimension)),
            release_slopes: release.map(|(_, slopes)| SlopeTools {
                slopes,
                evaluator: Evaluator::new(&slopes.program, 4 + dimension),
            }),
            rough: rough.map(|rough| RoughTools {
                rates: Evaluator::new(&rough.rates, dimension),
                scaled: Integrator::new(&rough.scaled),
            }),
            held: held.map(|held| Integrator::new(&held.field)),
        }
    }
}

impl<S: Real> SlopeTools<'_, S> {
    /// Sign of the release function at a state on the surface with a speed `−h' > 0`, for a
    /// function that is zero at a graze; `None` if the function is zero on the whole surface.
    ///
    /// ```text
    /// ρ = h' ∂ρ/∂h' + O(h'²)   on   h = 0
    /// ```
    fn sign_by_speed(&mut self, state: &[S], parameters: &[S]) -> Option<S> {
        if !self.slopes.by_velocity {
            return None;
        }
        let values = self.evaluator.evaluate(state, parameters);
        let (slope, rounding) = (values[0], rounding_of(&values[4..]));
        (slope.abs() > rounding).then(|| -slope.signum())
    }

    /// Sign of the release function at the beginning of a contact, from a state beyond the surface,
    /// which is moved onto it: the sign due to the speed of approach, or that just after contact,
    /// `−∂ρ/∂h`; 0 if the function depends on neither.
    fn sign_beyond(&mut self, gap: S, state: &mut [S], parameters: &[S]) -> S {
        if let Some(component) = self.slopes.gap_component {
            let moves = self.evaluator.evaluate(state, parameters)[2];
            state[component] -= gap / moves;
        }
        self.sign_by_speed(state, parameters).unwrap_or_else(|| {
            let slope = self.evaluator.evaluate(state, parameters)[1];
            if slope == S::zero() { slope } else { -slope.signum() }
        })
    }
}

/// Fails at the first number that is not finite; `offset` is the position of the first number.
pub(super) fn check_finite<S: Real>(values: &[S], offset: usize) -> Result<(), HybridError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(position) => Err(HybridError::NotFinite { component: offset + position }),
        None => Ok(()),
    }
}
