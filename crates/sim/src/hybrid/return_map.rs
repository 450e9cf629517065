//! The return map by simulation: the section map with which local maps are compared.
//!
//! A point of a tangency section is a local minimum of the gap along the *free* flow, of any depth.
//! A point beyond the surface is virtual: it is moved back along the free flow to the surface, then
//! the contact and the following flight are simulated; on the last approach to the section the
//! surface is again ignored. A stroboscopic section at the grazing phase is treated in the same
//! way, with the passage nearest to the section in place of the section point.

use super::HybridError;
use super::motion::{Clearance, Motion, Regime, Sense};
use super::passage::{Approach, Back, Ignored, Stop};
use super::simulator::{Simulator, check_finite};
use super::system::HybridSystem;
use super::trajectory::{
    Event, EventKind, Itinerary, Log, NominalPassage, Outcome, Return, ReturnOutcome, ReturnSection,
};
use crate::numeric::Real;

/// The return map of a section by direct simulation.
///
/// ```text
/// P = P_smooth ∘ D,  evaluated with the contact as it is: no expansion
/// ```
#[derive(Clone, Debug)]
pub struct DirectReturn<'a, S: Real> {
    pub(super) simulator: Simulator<'a, S>,
    pub(super) section: ReturnSection,
    pub(super) itinerary: Itinerary,
    pub(super) duration: S,
    pub(super) periods: i64,
    /// Whether the first minimum of the gap after [`FIRST_AFTER`] ends a return.
    pub(super) ends_at_first: bool,
    entry: Motion<S>,
    passage: Motion<S>,
    log: Log<S>,
}

/// Longest return to a tangency section, in nominal return times.
///
/// NOTE: an orbit that comes back every few periods takes a whole number of them, to rounding; the
/// limit is not a whole number.
pub(super) const LONGEST: f64 = 16.5;

/// Share of the nominal time after which the first minimum of the gap may end a return; sooner ones
/// are those of rebounds.
const FIRST_AFTER: f64 = 0.25;

/// A minimum of a gap behind surfaces that were flown through.
#[derive(Clone, Copy, Debug)]
struct PassedMinimum<S> {
    /// Time for which the gap is known to rise from there.
    rises_for: S,
    /// Surfaces that were flown through.
    ignored: Ignored,
}

/// Compiles returns here, once, for the scalars of other packages.
///
/// NOTE: instances of generic functions that are never inlined are shared with dependants, which
/// would otherwise compile the whole simulator again. Steps and responses, which have other callers
/// too, are never inlined for that reason.
macro_rules! compile_for {
    ($($instances:ident: $number:ty),*) => {$(
        #[cfg(not(test))]
        #[used]
        static $instances: (
            fn(&mut DirectReturn<'static, $number>, &[$number]) -> ReturnOf<$number>,
            fn(&mut DirectReturn<'static, $number>, &[$number], $number) -> Result<(), HybridError>,
        ) = (DirectReturn::<$number>::image, DirectReturn::<$number>::set_parameters);
    )*};
}

#[cfg(not(test))]
type ReturnOf<S> = Result<Return<S>, HybridError>;

compile_for!(IN_F64: f64, IN_DOUBLE_DOUBLE: crate::numeric::Dd);

impl<'a, S: Real> DirectReturn<'a, S> {
    /// The return map of a section; `duration` is the nominal return time, `periods` the number of
    /// whole periods by which the phase advances in it (0 for an autonomous system).
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`],
    /// [`HybridError::NoSuchSurface`].
    #[inline(never)]
    pub fn new(
        system: &'a HybridSystem,
        parameters: &[S],
        section: ReturnSection,
        duration: S,
        periods: usize,
    ) -> Result<Self, HybridError> {
        let surfaces = system.surfaces();
        if let Some(surface) = section.surface().filter(|&surface| surface >= surfaces) {
            return Err(HybridError::NoSuchSurface { surface, surfaces });
        }
        check_finite(&[duration], 0)?;
        let motion = Motion::new(system.dimension(), surfaces);
        Ok(Self {
            simulator: Simulator::new(system, parameters)?,
            section,
            itinerary: Itinerary::of_section(section),
            duration,
            periods: periods as i64,
            ends_at_first: false,
            entry: motion.clone(),
            passage: motion,
            log: Log::new(),
        })
    }

    /// The return map over whole forcing periods: duration `periods · period / rate`.
    ///
    /// # Errors
    ///
    /// The errors of [`new`](Self::new), and [`HybridError::NoPhase`], [`HybridError::PhaseRate`].
    pub fn over_periods(
        system: &'a HybridSystem,
        parameters: &[S],
        section: ReturnSection,
        periods: usize,
    ) -> Result<Self, HybridError> {
        let period = Simulator::new(system, parameters)?.forcing_period()?;
        Self::new(system, parameters, section, period * S::from_f64(periods as f64), periods)
    }

    /// Sets all grazing passages and hits of the nominal return; [`Return::passages`] then reports
    /// the grazing passages.
    ///
    /// The first passage of a tangency section, and of a section at a grazing phase, is that of the
    /// section itself, at time 0 and known without being named. A section between passages has none
    /// until they are named.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoSuchSurface`]; [`HybridError::PassageTime`] if a passage is not within the
    /// return; [`HybridError::FirstPassage`] if the first one is not that of the section.
    pub fn with_passages(mut self, passages: &[NominalPassage]) -> Result<Self, HybridError> {
        let surfaces = self.simulator.system().surfaces();
        let duration = self.duration.to_f64();
        self.itinerary = Itinerary::new(self.section, passages, duration, surfaces)?;
        Ok(self)
    }

    /// Changes the parameters and the nominal return time; passages keep their shares of it.
    ///
    /// # Errors
    ///
    /// [`HybridError::ParameterLength`], [`HybridError::NotFinite`].
    #[inline(never)]
    pub fn set_parameters(&mut self, parameters: &[S], duration: S) -> Result<(), HybridError> {
        check_finite(&[duration], 0)?;
        self.duration = duration;
        self.simulator.set_parameters(parameters)
    }

    /// Limits the steps of one return (default: ten million).
    pub fn set_step_limit(&mut self, limit: usize) {
        self.simulator.set_step_limit(limit);
    }

    /// Ends returns at the first minimum of the gap after a quarter of the nominal time, if the
    /// return of a full state at a tangency section, that of the nominal orbit, meets no minimum
    /// before its end.
    ///
    /// Without forcing nothing but the motion tells the time of a return, and impacts may shorten
    /// it: the minimum nearest to the nominal time is then that of the second period.
    ///
    /// # Errors
    ///
    /// The errors of [`image`](Self::image).
    pub fn ending_at_first(mut self, nominal: &[S]) -> Result<Self, HybridError> {
        let ReturnSection::Tangency { surface: own } = self.section else { return Ok(self) };
        self.image(nominal)?;
        let mut events = self.log.events.iter();
        let is_minimum = |event: &Event<S>| matches!(event.kind, EventKind::NearMiss { .. });
        self.ends_at_first = !events.any(|event| event.surface == own && is_minimum(event));
        Ok(self)
    }

    /// Number of steps of the last return, without those back to the surface from a start beyond
    /// it.
    pub fn steps(&self) -> usize {
        self.simulator.steps
    }

    /// The next section point from a full state at the section.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    #[inline(never)]
    pub fn image(&mut self, state: &[S]) -> Result<Return<S>, HybridError> {
        let own = match self.section {
            ReturnSection::Tangency { surface } => Some(surface),
            _ => None,
        };
        self.simulator.set_virtual_state(state, own)?;
        let mut log = std::mem::replace(&mut self.log, Log::new());
        log.clear();
        let flown = self.fly_return(&mut log);
        let image = self.report(&log, flown.unwrap_or_else(ReturnOutcome::Ended));
        self.log = log;
        Ok(image)
    }

    /// The gap at the first passage of a full state at the section, along the free flow with the
    /// surface ignored: `−y²` of a contact. `None` if there is no passage, or if another surface
    /// acts before.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    #[inline(never)]
    pub fn first_gap(&mut self, state: &[S]) -> Result<Option<S>, HybridError> {
        self.simulator.set_state(state)?;
        let Some((surface, share)) = self.itinerary.first() else { return Ok(None) };
        let found = match self.section {
            ReturnSection::Tangency { .. } => true,
            ReturnSection::GrazingPhase { .. } => {
                self.leave_contact(surface);
                self.find_first_passage(surface)
            }
            ReturnSection::OtherPhase => {
                self.reach_passage_at(surface, self.duration * S::from_f64(share))
            }
        };
        Ok(found.then(|| self.simulator.sense(surface).gap))
    }

    /// Turns a section point in contact with a surface into a point of the free flow.
    fn leave_contact(&mut self, surface: usize) {
        if self.simulator.regime() == (Regime::Contact { surface }) {
            self.simulator.motion.regime = Regime::Free;
            self.simulator.motion.lose_headings();
        }
    }

    /// Flies with the surface ignored to the minimum of its gap that is nearest to a time. Returns
    /// whether there is one within half of the return time, before which no surface acts.
    fn reach_passage_at(&mut self, surface: usize, time: S) -> bool {
        self.simulator.motion.leaving[surface] = None;
        self.entry.copy_from(&self.simulator.motion);
        let mut nearest = None;
        let reach = self.passage_limit() + self.passage_limit();
        let limit = time + reach;
        let ignored = Ignored::Surface(surface);
        while let Ok(Some(_)) = self.reach_minimum(surface, ignored, limit, &mut Log::unread()) {
            let apart = (self.simulator.time() - time).abs();
            if !self.flew_freely_from(&self.entry) || nearest.is_some_and(|least| apart >= least) {
                break;
            }
            nearest = Some(apart);
            self.passage.copy_from(&self.simulator.motion);
        }
        self.simulator.motion.copy_from(&self.passage);
        nearest.is_some_and(|apart| apart <= reach)
    }

    fn fly_return(&mut self, log: &mut Log<S>) -> Result<ReturnOutcome<S>, Outcome<S>> {
        self.simulator.rest_where_placed()?;
        match self.section {
            ReturnSection::Tangency { surface } => self.tangency(surface, log),
            ReturnSection::GrazingPhase { surface } => self.grazing_phase(surface, log),
            ReturnSection::OtherPhase => self.whole_period(log),
        }
    }

    /// Return of a tangency section: from one local minimum of the gap to the one nearest in time
    /// to the nominal return, or to the first one that [ends it](Self::ending_at_first).
    fn tangency(
        &mut self,
        surface: usize,
        log: &mut Log<S>,
    ) -> Result<ReturnOutcome<S>, Outcome<S>> {
        let start = self.simulator.sense(surface);
        self.simulator.motion.leaving[surface] = None;
        if start.gap < S::zero() {
            if let Some(untold) = self.enter(surface, log)? {
                return Ok(untold);
            }
        } else {
            self.simulator.check_placed()?;
            self.simulator.motion.set_at_minimum(surface);
        }
        let horizon = self.duration * S::from_f64(LONGEST);
        loop {
            let approach = Approach { stop_at: Some(surface), ..Approach::default() };
            match self.next_stop(horizon, approach, log)? {
                Stop::Minimum { gap, rises_for } => {
                    if self.is_final(surface, Ignored::Surface(surface), rises_for) {
                        let is_free = self.simulator.regime() == Regime::Free;
                        return Ok(self.told_but(is_free.then_some(surface)));
                    }
                    let time = self.simulator.time();
                    log.events.push(Event { time, surface, kind: EventKind::NearMiss { gap } });
                }
                Stop::Contact { surface: met }
                    if self.meets(surface, met) && self.may_be_last(surface) =>
                {
                    self.entry.copy_from(&self.simulator.motion);
                    let logged = log.events.len();
                    // NOTE: a deep approach may meet a singularity behind the surface; then its
                    // contact is real.
                    let minimum = self.pass_through(surface, horizon, log).unwrap_or(None);
                    if minimum.is_some_and(|minimum| {
                        self.is_final(surface, minimum.ignored, minimum.rises_for)
                    }) {
                        return Ok(self.returned_through(surface));
                    }
                    log.events.truncate(logged);
                    self.simulator.motion.copy_from(&self.entry);
                    self.respond(met, log)?;
                }
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon | Stop::Release => {
                    return Ok(ReturnOutcome::NoReturn { time: self.simulator.time() });
                }
            }
        }
    }

    /// Return of a grazing phase: from the section to the same phase, exactly the nominal duration
    /// later.
    fn grazing_phase(
        &mut self,
        surface: usize,
        log: &mut Log<S>,
    ) -> Result<ReturnOutcome<S>, Outcome<S>> {
        self.simulator.check_placed()?;
        if self.reach_first_passage(surface) {
            if let Some(untold) = self.enter(surface, log)? {
                return Ok(untold);
            }
        } else {
            self.restart();
            self.simulator.check_penetration(None)?;
        }
        loop {
            match self.next_stop(self.duration, Approach::default(), log)? {
                Stop::Contact { surface: met }
                    if self.meets(surface, met) && self.may_be_last(surface) =>
                {
                    self.entry.copy_from(&self.simulator.motion);
                    let logged = log.events.len();
                    if self.approach_is_last(surface, log) {
                        return Ok(self.returned_through(surface));
                    }
                    log.events.truncate(logged);
                    self.simulator.motion.copy_from(&self.entry);
                    self.respond(met, log)?;
                }
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon | Stop::Minimum { .. } | Stop::Release => break,
            }
        }
        if self.looks_like_passage(surface) {
            return Ok(ReturnOutcome::Ambiguous { surface });
        }
        Ok(self.returned())
    }

    /// Whether the section is reached behind the contact at which the simulator stands, with the
    /// surface ignored. If so the simulator is left at the section; otherwise its state is
    /// undefined.
    ///
    /// The contact's minimum must be the one nearest to the section along the flight, and the gap
    /// must rise at the section, so that the way back from there leads to that minimum.
    fn approach_is_last(&mut self, surface: usize, log: &mut Log<S>) -> bool {
        let logged = log.events.len();
        let mut early = S::zero();
        let ignored = match self.meets_others(surface) {
            true => Ignored::All,
            false => Ignored::Surface(surface),
        };
        match self.reach_minimum(surface, ignored, self.duration, log) {
            Err(_) => return false,
            Ok(None) => {}
            Ok(Some(rises_for)) => {
                if !self.is_final(surface, ignored, rises_for) {
                    return false;
                }
                early = self.duration - self.simulator.time();
                log.events.truncate(logged);
                self.simulator.motion.copy_from(&self.entry);
                let ignoring = Approach { ignored, ..Approach::default() };
                if self.fly(ignoring, log).is_err() {
                    return false;
                }
                let there = self.simulator.sense(surface);
                if there.velocity < -self.unresolved(&there).abs() {
                    return false;
                }
            }
        }
        let is_free = self.flew_freely_from(&self.entry);
        let is_near =
            early <= self.passage_limit() || self.simulator.clearance(surface).gap < S::zero();
        is_free && is_near
    }

    /// Return of any other phase: everything is simulated for the nominal duration.
    fn whole_period(&mut self, log: &mut Log<S>) -> Result<ReturnOutcome<S>, Outcome<S>> {
        self.simulator.check_placed()?;
        self.simulator.check_penetration(None)?;
        self.fly(Approach::default(), log)?;
        Ok(self.returned())
    }

    /// Outcome at a section point behind a contact with the surface, which was flown through.
    ///
    /// A return that starts at a point of the tangency section places the state where the contact
    /// begins, any other return at the section.
    fn returned_through(&mut self, surface: usize) -> ReturnOutcome<S> {
        if self.flew_freely_from(&self.entry) {
            let is_phase = matches!(self.section, ReturnSection::GrazingPhase { .. });
            if is_phase || self.others(surface).next().is_none() {
                return self.told_but(Some(surface));
            }
            self.passage.copy_from(&self.simulator.motion);
            self.simulator.motion.copy_from(&self.entry);
            let outcome = self.told_but(Some(surface));
            self.simulator.motion.copy_from(&self.passage);
            return outcome;
        }
        let holding = self.held_elsewhere(surface).unwrap_or(surface);
        ReturnOutcome::Ambiguous { surface: holding }
    }

    /// Outcome at a section point if everything before was simulated.
    fn returned(&mut self) -> ReturnOutcome<S> {
        self.told_but(None)
    }

    /// Outcome at a section point: ambiguous if placing the state anew would not reproduce which
    /// surfaces hold it. The surface `passed`, behind which the section point lies, is not checked.
    fn told_but(&mut self, passed: Option<usize>) -> ReturnOutcome<S> {
        if self.simulator.motion.changed == S::from_f64(f64::NEG_INFINITY) {
            return ReturnOutcome::Returned;
        }
        let surfaces = self.simulator.system().surfaces();
        let is_passage = |surface| self.section.surface() == Some(surface);
        let untold = (0..surfaces).find(|&surface| {
            passed != Some(surface) && !self.simulator.tells_hold(surface, is_passage(surface))
        });
        untold.map_or(ReturnOutcome::Returned, |surface| ReturnOutcome::Ambiguous { surface })
    }

    /// Whether no surface has acted since an earlier motion, or acts now.
    fn flew_freely_from(&self, earlier: &Motion<S>) -> bool {
        let motion = &self.simulator.motion;
        (earlier.regime, motion.regime) == (Regime::Free, Regime::Free)
            && earlier.changed == motion.changed
    }

    /// Whether the state rests on a surface other than this one.
    fn rests_elsewhere(&self, surface: usize) -> bool {
        matches!(self.simulator.regime(), Regime::Stick { surface: other } if other != surface)
    }

    /// Surface other than this one that holds the state.
    fn held_elsewhere(&self, surface: usize) -> Option<usize> {
        self.simulator.regime().surface().filter(|&other| other != surface)
    }

    /// Speed of a gap whose minimum is nearer than the rounding of the time: such a minimum cannot
    /// be flown to, and need not be.
    fn unresolved(&self, sense: &Sense<S>) -> S {
        sense.acceleration * self.duration * S::from_f64(S::ROUNDOFF)
    }

    /// Time within which the section's own passage is searched: a quarter of the return time.
    fn passage_limit(&self) -> S {
        self.duration * S::from_f64(0.25)
    }

    /// Whether a simulated state at the section could be mistaken for one behind a contact that did
    /// not happen, because a surface acted shortly before.
    fn looks_like_passage(&mut self, surface: usize) -> bool {
        let acted = self.simulator.motion.changed;
        if acted <= self.simulator.time() - self.passage_limit()
            || self.simulator.sense(surface).velocity <= S::zero()
        {
            return false;
        }
        let found = self.reach_first_passage(surface);
        self.simulator.motion.copy_from(&self.entry);
        found
    }

    /// Moves a section point, placed before, to the start of a trajectory: back to the surface if
    /// it lies beyond it by more than rounding. Returns that surface, if so.
    pub(super) fn physical_start(&mut self) -> Result<Option<usize>, Outcome<S>> {
        let placed = self.simulator.check_placed();
        self.simulator.rest_where_placed()?;
        let Some(surface) = self.section.surface() else {
            return placed.map(|()| None);
        };
        self.entry.copy_from(&self.simulator.motion);
        let is_tangency = matches!(self.section, ReturnSection::Tangency { .. });
        let beyond = match is_tangency {
            true => !self.rests_elsewhere(surface),
            false => self.reach_first_passage(surface),
        };
        let sense = self.simulator.sense(surface);
        if beyond && sense.gap < -sense.rounding {
            self.back_to_surface(surface)?;
            if self.held_elsewhere(surface).is_none() {
                return Ok(Some(surface));
            }
        }
        placed?;
        self.restart();
        if is_tangency {
            self.simulator.motion.leaving[surface] = None;
            self.simulator.motion.set_at_minimum(surface);
        }
        Ok(None)
    }

    /// Moves a virtual section point back to the surface, and through the contact. Returns the
    /// outcome if another surface holds the state.
    fn enter(
        &mut self,
        surface: usize,
        log: &mut Log<S>,
    ) -> Result<Option<ReturnOutcome<S>>, Outcome<S>> {
        if !self.rests_elsewhere(surface) {
            self.back_to_surface(surface)?;
        }
        if let Some(holding) = self.held_elsewhere(surface) {
            return Ok(Some(ReturnOutcome::Ambiguous { surface: holding }));
        }
        log.own = Some(-self.simulator.sense(surface).velocity);
        self.respond(surface, log)?;
        Ok(None)
    }

    /// Moves a virtual section point back to the surface along the free flow of all surfaces, as
    /// far as a return may have flown beyond the surface to its section point.
    fn back_to_surface(&mut self, surface: usize) -> Result<(), Outcome<S>> {
        self.simulator.motion.regime = Regime::Free;
        self.simulator.motion.lose_headings();
        let first = self.simulator.time() - self.duration * S::from_f64(LONGEST);
        while self.simulator.time() > first {
            let earliest = first.max(self.simulator.time() - self.duration);
            if self.simulator.back(surface, Back::ToSurface, earliest)? {
                self.simulator.place_at_others(surface);
                return self.simulator.check_placed();
            }
        }
        let gap = self.simulator.sense(surface).gap;
        Err(Outcome::Penetrating { surface, time: self.simulator.time(), gap })
    }

    /// Flies to the local minimum of the gap nearest to the present state, forward or backward, at
    /// most a quarter of the return time; stays if there is none. `entry` keeps the present state.
    /// Returns whether the state lies beyond the surface.
    ///
    /// There is no minimum if another surface holds the state, acts on the way, or lies on the way.
    fn reach_first_passage(&mut self, surface: usize) -> bool {
        if !self.find_first_passage(surface) {
            self.simulator.motion.copy_from(&self.entry);
        }
        self.simulator.sense(surface).gap < S::zero()
    }

    /// Flies like [`reach_first_passage`](Self::reach_first_passage), but ends anywhere if there is
    /// no minimum; returns whether there is one.
    fn find_first_passage(&mut self, surface: usize) -> bool {
        let is_stuck = self.simulator.regime() == Regime::Stick { surface };
        if !is_stuck {
            self.simulator.motion.leaving[surface] = None;
        }
        self.entry.copy_from(&self.simulator.motion);
        if is_stuck || self.held_elsewhere(surface).is_some() {
            return false;
        }
        let start = self.simulator.sense(surface);
        let unresolved = self.unresolved(&start);
        let is_free = self.simulator.regime() == Regime::Free;
        let now = self.simulator.time();
        // NOTE: beyond the surface there may be a singularity; then there is no passage.
        if start.velocity.abs() <= unresolved {
            true
        } else if start.velocity > S::zero() {
            let earliest = now - self.passage_limit();
            self.simulator.back(surface, Back::ToMinimum, earliest).unwrap_or(false)
                && self.is_clear_of_others(surface)
        } else {
            is_free && {
                let limit = now + self.passage_limit();
                let ignored = Ignored::Surface(surface);
                let minimum = self.reach_minimum(surface, ignored, limit, &mut Log::unread());
                minimum.is_ok_and(|minimum| minimum.is_some()) && self.flew_freely_from(&self.entry)
            }
        }
    }

    /// Whether the state, at a minimum of a surface's gap, is beyond no other surface, or only
    /// beyond surfaces that are met at the same instant as that one.
    fn is_clear_of_others(&mut self, surface: usize) -> bool {
        let beyond: Vec<usize> = self.others(surface).filter(|&o| self.is_beyond(o)).collect();
        if beyond.is_empty() {
            return true;
        }
        self.passage.copy_from(&self.simulator.motion);
        let earliest = self.simulator.time() - self.duration;
        let is_met = self.simulator.sense(surface).gap < S::zero()
            && self.simulator.back(surface, Back::ToSurface, earliest).unwrap_or(false);
        let clear = is_met
            && self.others(surface).all(|other| match beyond.contains(&other) {
                true => self.simulator.is_close(other),
                false => !self.is_beyond(other),
            });
        self.simulator.motion.copy_from(&self.passage);
        clear
    }

    fn is_beyond(&mut self, surface: usize) -> bool {
        let Clearance { gap, rounding } = self.simulator.clearance(surface);
        gap < -rounding
    }

    /// All surfaces except this one.
    fn others(&self, surface: usize) -> impl Iterator<Item = usize> + use<S> {
        (0..self.simulator.system().surfaces()).filter(move |&other| other != surface)
    }

    /// Whether `surface` is met together with the surface `met`, or is that surface.
    fn meets(&mut self, surface: usize, met: usize) -> bool {
        met == surface || self.simulator.is_met(surface)
    }

    /// Whether other surfaces are met at the present state.
    fn meets_others(&mut self, surface: usize) -> bool {
        self.others(surface).any(|other| self.simulator.is_met(other))
    }

    /// Restarts from the section point in `entry`.
    fn restart(&mut self) {
        let last_step = self.simulator.motion.last_step;
        self.simulator.motion.copy_from(&self.entry);
        self.simulator.motion.last_step = last_step;
    }

    /// Flies to the next minimum of a surface's gap with surfaces ignored, including this one.
    /// With none ignored, the surface is flown through unless the contact is a hit of the nominal
    /// return. Returns the time for which the gap is known to rise from there; `None` if the
    /// horizon came first.
    fn reach_minimum(
        &mut self,
        surface: usize,
        ignored: Ignored,
        horizon: S,
        log: &mut Log<S>,
    ) -> Result<Option<S>, Outcome<S>> {
        let approach = Approach { ignored, stop_at: Some(surface), ..Approach::default() };
        loop {
            match self.next_stop(horizon, approach, log)? {
                Stop::Minimum { rises_for, .. } => return Ok(Some(rises_for)),
                Stop::Contact { surface: met }
                    if ignored == Ignored::None
                        && self.meets(surface, met)
                        && !self.is_expected_hit(surface) =>
                {
                    let minimum = self.pass_through(surface, horizon, log)?;
                    return Ok(minimum.map(|minimum| minimum.rises_for));
                }
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon | Stop::Release => return Ok(None),
            }
        }
    }

    /// Flies through a surface that is met, and through any surface met behind it, to the minimum
    /// of its gap; `None` if the horizon came first.
    fn pass_through(
        &mut self,
        surface: usize,
        horizon: S,
        log: &mut Log<S>,
    ) -> Result<Option<PassedMinimum<S>>, Outcome<S>> {
        let mut ignored = Ignored::Surface(surface);
        loop {
            let approach = Approach { ignored, stop_at: Some(surface), ..Approach::default() };
            match self.next_stop(horizon, approach, log)? {
                Stop::Minimum { rises_for, .. } => {
                    return Ok(Some(PassedMinimum { rises_for, ignored }));
                }
                Stop::Contact { .. } => ignored = Ignored::All,
                Stop::Horizon | Stop::Release => return Ok(None),
            }
        }
    }

    /// Flies to the nominal return time.
    fn fly(&mut self, approach: Approach, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        loop {
            match self.next_stop(self.duration, approach, log)? {
                Stop::Contact { surface } => self.respond(surface, log)?,
                Stop::Horizon => return Ok(()),
                Stop::Minimum { .. } | Stop::Release => {}
            }
        }
    }

    /// Whether the minimum at which the simulator stands is nearer to the nominal return than the
    /// next one, or the first one that ends a return.
    ///
    /// The next minimum, with some surfaces ignored and the others acting, is searched as far
    /// beyond the nominal return as the present one lies before it, unless the gap is known to
    /// rise for so long. From a minimum without contact, hits of the nominal return act, also those
    /// of the surface itself. The simulator is then put back.
    fn is_final(&mut self, surface: usize, ignored: Ignored, rises_for: S) -> bool {
        let time = self.simulator.time();
        let early = self.duration - time;
        let is_first = self.ends_at_first && time >= self.duration * S::from_f64(FIRST_AFTER);
        if early + early <= rises_for || is_first {
            return true;
        }
        self.passage.copy_from(&self.simulator.motion);
        let horizon = self.duration + early;
        let log = &mut Log::unread();
        let is_clear = self.simulator.sense(surface).gap >= S::zero();
        let ignored = if self.itinerary.has_hits() && is_clear { Ignored::None } else { ignored };
        let nearer = self.reach_minimum(surface, ignored, horizon, log).unwrap_or(None);
        self.simulator.motion.copy_from(&self.passage);
        nearer.is_none()
    }

    fn next_stop(
        &mut self,
        horizon: S,
        approach: Approach,
        log: &mut Log<S>,
    ) -> Result<Stop<S>, Outcome<S>> {
        let approach = Approach { unrecorded: log.is_unread, ..approach };
        self.simulator.next_stop(horizon, approach, &mut log.recorder())
    }

    /// Applies a surface's response; the contact is logged at the time of the minimum that its
    /// approach would have had.
    fn respond(&mut self, surface: usize, log: &mut Log<S>) -> Result<(), Outcome<S>> {
        let lead = self.lead(surface);
        let contact = log.events.len();
        let responded = self.simulator.respond(surface, &mut log.recorder());
        if let Some(contact) = log.events.get_mut(contact) {
            contact.time += lead;
        }
        responded
    }

    /// Whether the next section point may lie behind the contact at which the simulator stands: the
    /// contact is no hit of the nominal return, and at a phase does not come before the section
    /// point at which this return began. Tangencies behind contacts that follow each other fast are
    /// not in the order of the contacts.
    fn may_be_last(&mut self, surface: usize) -> bool {
        let follows = match self.section {
            ReturnSection::Tangency { .. } => true,
            _ => self.simulator.time() >= S::zero(),
        };
        follows && !self.is_expected_hit(surface)
    }

    /// Whether the contact at which the simulator stands is a hit of the nominal return, and no
    /// passage.
    fn is_expected_hit(&mut self, surface: usize) -> bool {
        if !self.itinerary.has_hits() {
            return false;
        }
        let time = self.simulator.time() + self.lead(surface);
        self.itinerary.expects_hit(surface, (time / self.duration).to_f64())
    }

    /// Time from the surface to the minimum of its gap along the free flow, to leading order, at
    /// most a quarter of the return time; 0 if the flow does not turn.
    fn lead(&mut self, surface: usize) -> S {
        let sense = self.simulator.sense(surface);
        if sense.acceleration <= S::zero() {
            return S::zero();
        }
        (-sense.velocity / sense.acceleration).min(self.passage_limit())
    }

    fn report(&self, log: &Log<S>, outcome: ReturnOutcome<S>) -> Return<S> {
        let mut passages = self.itinerary.speeds(log, self.duration.to_f64());
        let hits = log.hits(self.simulator.system().surfaces());
        let met = passages.iter().flatten().count();
        let all: usize = hits.iter().sum();
        let named = passages.iter().zip(self.itinerary.hits());
        let missed = named.filter(|(speed, hit)| *hit && speed.is_none()).count();
        let [rebounds, others] = self.itinerary.rests(log, self.duration.to_f64());
        let mut is_hit = self.itinerary.hits();
        passages.retain(|_| is_hit.next() != Some(true));
        let contacts = passages.iter().flatten().count();
        Return {
            state: self.simulator.state_after_advance(self.periods),
            elapsed: self.simulator.time(),
            contacts,
            extra_contacts: all - (met + rebounds).min(all) + missed + others,
            passages,
            hits,
            impact_speeds: log.contact_speeds(),
            first_speed: self.itinerary.first_speed(log, self.duration.to_f64()),
            passed: log.passed(),
            near_misses: log.near_misses(),
            outcome,
        }
    }
}
