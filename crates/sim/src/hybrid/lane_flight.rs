//! Flights of several orbits from one section point to the next: [`DirectReturn`] in lanes.
//!
//! One idea: a return is a state machine with few states, and all lanes step at the same time. An
//! orbit flies to the section's own passage; to its next minimum or contact; behind a contact, to
//! the minimum that the approach would have had; from a minimum, to check for a minimum nearer to
//! the nominal return; or through the surface to the section. Sections differ in the states that
//! occur, and in the end of a return. An orbit that does anything else leaves the lanes, and the
//! scalar simulator flies it.

use super::lane_flow::{LaneAsked, LaneFlow, LaneLog, LaneStepEnd};
use super::motion::{LaneMotion, Sense};
use super::passage::Back;
use super::response::{PASSES, Rebound};
use super::return_map::{DirectReturn, LONGEST};
use super::system::HybridSystem;
use super::trajectory::ReturnSection;
use crate::interruption::check;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar, Vectorised, wide};

/// Largest number of steps of a return in lanes.
const MAX_STEPS: usize = 1000;

/// Returns in progress.
#[derive(Clone, Debug)]
pub(super) struct LaneFlight<F, const N: usize> {
    orbits: LaneOrbits<F, N>,
    section: ReturnSection,
    /// Nominal return times.
    duration: Lanes<N>,
    /// Whole periods by which the phase advances in a return.
    periods: Lanes<N>,
    /// Motions at the section points, later those at the last contacts.
    entry: LaneMotion<N>,
    /// Motions at the last minima, finally those at the next section points.
    passage: LaneMotion<N>,
    /// Masks: lanes before the section's own passage; among them, lanes that fly forward to it.
    first: LaneMask<N>,
    seeking: LaneMask<N>,
    /// Mask: lanes at the surface, before the reset.
    met: LaneMask<N>,
    /// Mask: lanes that fly behind a contact, or search on from a minimum behind it.
    behind: LaneMask<N>,
    /// Mask: lanes that search for a nearer minimum; then the remaining times of the return.
    looking: LaneMask<N>,
    early: Lanes<N>,
    /// Mask: lanes that fly through the surface to the section.
    last: LaneMask<N>,
    /// Mask: lanes at the next section point.
    done: LaneMask<N>,
    /// Times of the last resets.
    changed: Lanes<N>,
}

impl<F: LaneFlow<N>, const N: usize> LaneFlight<F, N> {
    /// Flight for return maps of one kind.
    pub(super) fn new(flow: F, scalar: [&DirectReturn<'_, f64>; N]) -> Self {
        let system = scalar[0].simulator.system();
        let (section, itinerary) = (scalar[0].section, &scalar[0].itinerary);
        let duration = Lanes::from_fn(|lane| scalar[lane].duration);
        let share = |number| Lanes::from_fn(|lane| scalar[lane].itinerary.share(number));
        let shares: Vec<_> = (0..itinerary.len()).map(share).collect();
        let log = LaneLog::new(duration, &shares, section.surface().is_some());
        let orbits = LaneOrbits::new(flow, system, log);
        Self {
            section,
            duration,
            periods: Lanes::splat(scalar[0].periods as f64),
            entry: orbits.motion.clone(),
            passage: orbits.motion.clone(),
            orbits,
            first: LaneMask::NONE,
            seeking: LaneMask::NONE,
            met: LaneMask::NONE,
            behind: LaneMask::NONE,
            looking: LaneMask::NONE,
            early: Lanes::splat(0.0),
            last: LaneMask::NONE,
            done: LaneMask::NONE,
            changed: Lanes::splat(f64::NEG_INFINITY),
        }
    }

    /// Flies the wanted lanes from full states at the section to the next section points. Returns
    /// the mask of lanes that reached them; no lane does without wide registers.
    pub(super) fn fly(&mut self, states: &[Lanes<N>], wanted: LaneMask<N>) -> LaneMask<N> {
        self.orbits.motion.state.copy_from_slice(states);
        self.orbits.alive = wanted;
        self.done = LaneMask::NONE;
        wide(Returning(self));
        self.done
    }

    /// Full states at the next section points, with the nominal advance of the phase removed.
    pub(super) fn states(&self) -> &[Lanes<N>] {
        &self.passage.state
    }

    /// Speed at which a passage of a lane made contact.
    pub(super) fn speed(&self, passage: usize, lane: usize) -> Option<f64> {
        self.orbits.log.speed(passage, lane)
    }
}

struct Returning<'t, F, const N: usize>(&'t mut LaneFlight<F, N>);

impl<F: LaneFlow<N>, const N: usize> Vectorised for Returning<'_, F, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let flight = self.0;
        flight.start();
        for _ in 0..MAX_STEPS {
            if !flight.orbits.alive.any() {
                break;
            }
            check();
            flight.step();
        }
        flight.orbits.advance(&mut flight.passage, flight.periods);
    }
}

impl<F: LaneFlow<N>, const N: usize> LaneFlight<F, N> {
    /// Starts at section points.
    #[inline(always)]
    fn start(&mut self) {
        self.orbits.start();
        let (none, all) = (LaneMask::NONE, self.orbits.alive);
        (self.seeking, self.met, self.last) = (none, none, none);
        (self.behind, self.looking) = (none, none);
        self.first = all;
        self.changed = Lanes::splat(f64::NEG_INFINITY);
        match self.section {
            ReturnSection::Tangency { .. } => {}
            ReturnSection::GrazingPhase { .. } => self.seek_passage(),
            ReturnSection::OtherPhase => {
                self.first = none;
                self.orbits.start_anywhere();
            }
        }
    }

    /// Goes to the minimum nearest to the start, at most a quarter of the return time away: lanes
    /// that come from a minimum go back at once, the others fly forward.
    #[inline(always)]
    fn seek_passage(&mut self) {
        let all = self.orbits.alive;
        self.entry.take(all, &self.orbits.motion);
        let start = self.orbits.sense(all);
        self.orbits.alive &= !start.rests();
        let all = self.orbits.alive;
        let unresolved = self.unresolved(&start);
        let moves = all & !start.velocity.abs().is_at_most(unresolved);
        let after = moves & Lanes::splat(0.0).is_below(start.velocity);
        self.seeking = moves & !after;
        if after.any() {
            self.orbits.back_to_minimum(after, self.passage_limit());
        }
    }

    /// Continues from the section's own passages. Lanes beyond the surface, which are returned as a
    /// mask, are moved back to the surface; the others start at the section.
    #[inline(always)]
    fn pass(&mut self, wanted: LaneMask<N>) -> LaneMask<N> {
        let beyond = self.orbits.beyond(wanted);
        let free = wanted & !beyond;
        match self.section {
            ReturnSection::Tangency { .. } => self.orbits.motion.rises |= free,
            _ => self.orbits.motion.take(free, &self.entry),
        }
        if beyond.any() {
            self.orbits.back_to_surface(beyond, self.duration);
        }
        beyond
    }

    /// Flies to the next events, and handles each.
    #[inline(always)]
    fn step(&mut self) {
        let first = self.first & !self.seeking & self.orbits.alive;
        self.first &= self.seeking;
        let mut own = LaneMask::NONE;
        if first.any() {
            own = self.pass(first) & self.orbits.alive;
        }
        let met = (self.met & self.orbits.alive) | own;
        self.met = LaneMask::NONE;
        if met.any() {
            self.changed = Lanes::select(met, self.orbits.motion.time, self.changed);
            self.orbits.respond(met, own);
        }
        let horizon = self.horizon();
        let wanted = self.orbits.alive & self.orbits.motion.time.is_below(horizon);
        let end = self.orbits.step(horizon, self.asked(wanted, horizon));
        let flies_on = wanted & self.orbits.motion.time.is_below(horizon);
        let over = self.orbits.alive & !end.contact & !end.minimum & !flies_on;
        self.meet(end.contact);
        let (sought, looked) = (self.seeking, self.looking);
        self.orbits.motion.take(over & sought, &self.entry);
        self.seeking &= !(over | end.minimum);
        self.look_on(end.minimum & !sought & !looked, end.rises_for);
        self.accept(over & looked);
        self.end(over & !sought & !looked);
        self.reject(end.minimum & looked);
    }

    /// Times at which the present flights end at the latest.
    #[inline(always)]
    fn horizon(&self) -> Lanes<N> {
        let nominal = match self.section {
            ReturnSection::Tangency { .. } => self.duration * Lanes::splat(LONGEST),
            _ => Lanes::select(self.seeking, self.passage_limit(), self.duration),
        };
        Lanes::select(self.looking, self.duration + self.early, nominal)
    }

    /// Speeds of gaps whose minima are nearer than the rounding of the time.
    #[inline(always)]
    fn unresolved(&self, sense: &Sense<Lanes<N>>) -> Lanes<N> {
        sense.acceleration * self.duration * Lanes::splat(<f64 as Scalar>::ROUNDOFF)
    }

    /// Time within which the section's own passage is searched.
    #[inline(always)]
    fn passage_limit(&self) -> Lanes<N> {
        self.duration * Lanes::splat(0.25)
    }

    /// Goals of the present flights.
    #[inline(always)]
    fn asked(&self, wanted: LaneMask<N>, horizon: Lanes<N>) -> LaneAsked<N> {
        let ignoring = self.behind | self.looking | self.seeking;
        let (stopping, landing) = match self.section {
            ReturnSection::Tangency { .. } => (wanted, LaneMask::NONE),
            _ => (ignoring, wanted & !self.looking & !self.seeking),
        };
        LaneAsked {
            wanted,
            ignoring,
            stopping,
            blind: self.last,
            passing: self.looking,
            landing,
            longest: horizon - self.orbits.motion.time,
        }
    }

    /// Handles contacts: lanes whose contact may be the last fly on behind it; in the others, as
    /// before the phase at which the return began, the contact is real.
    #[inline(always)]
    fn meet(&mut self, contact: LaneMask<N>) {
        let real = match self.section {
            ReturnSection::OtherPhase => contact,
            ReturnSection::Tangency { .. } => LaneMask::NONE,
            ReturnSection::GrazingPhase { .. } => {
                contact & self.orbits.motion.time.is_below(Lanes::splat(0.0))
            }
        };
        let may_be_last = contact & !real;
        self.met |= real;
        self.entry.take(may_be_last, &self.orbits.motion);
        self.behind |= may_be_last;
    }

    /// Handles minima: a minimum after the nominal return, or one after which the gap rises long
    /// enough, is the nearest one; in the other lanes the search for a nearer minimum goes on.
    #[inline(always)]
    fn look_on(&mut self, minimum: LaneMask<N>, rises_for: Lanes<N>) {
        let motion = &self.orbits.motion;
        let early = self.duration - motion.time;
        let past = minimum & (early + early).is_at_most(rises_for);
        self.passage.take(minimum, motion);
        self.early = Lanes::select(minimum, early, self.early);
        self.looking |= minimum;
        self.accept(past);
    }

    /// Handles last minima that are nearest to the nominal return: they are section points, or the
    /// contacts before them are flown through.
    #[inline(always)]
    fn accept(&mut self, wanted: LaneMask<N>) {
        if let ReturnSection::Tangency { .. } = self.section {
            self.finish(wanted);
            return;
        }
        self.orbits.motion.take(wanted, &self.entry);
        self.looking &= !wanted;
        self.behind &= !wanted;
        self.last |= wanted;
    }

    /// Handles flights that end without an event. At a phase, the end is the section point. At a
    /// tangency section, a contact whose approach has no minimum is real, and without a contact
    /// there is no return.
    #[inline(always)]
    fn end(&mut self, wanted: LaneMask<N>) {
        if let ReturnSection::Tangency { .. } = self.section {
            self.orbits.alive &= !wanted | self.behind;
            self.reject(wanted & self.behind);
        } else {
            let reached = wanted & !self.pass_too_early(wanted & self.last);
            self.passage.take(reached, &self.orbits.motion);
            let late = self.acted_late(reached);
            self.finish(reached & !late);
        }
    }

    /// Mask of lanes at a section behind a contact that was flown through, whose way back is not
    /// known to lead to that contact: there the contact is real.
    #[inline(always)]
    fn pass_too_early(&mut self, wanted: LaneMask<N>) -> LaneMask<N> {
        if !wanted.any() {
            return wanted;
        }
        let there = self.orbits.sense(wanted);
        let falls = there.velocity.is_below(-self.unresolved(&there).abs());
        let is_beyond = there.gap.is_below(Lanes::splat(0.0));
        let early = wanted & (falls | (self.passage_limit().is_below(self.early) & !is_beyond));
        self.orbits.motion.take(early, &self.entry);
        self.last &= !early;
        self.met |= early;
        early
    }

    /// Mask of lanes at a grazing phase that could be mistaken for a passage, because a reset acted
    /// within the time in which the section's own passage is searched. These leave the lanes.
    #[inline(always)]
    fn acted_late(&mut self, wanted: LaneMask<N>) -> LaneMask<N> {
        let ReturnSection::GrazingPhase { .. } = self.section else {
            return LaneMask::NONE;
        };
        let limit = self.duration - self.passage_limit();
        let late = wanted & !self.last & !self.behind & limit.is_below(self.changed);
        self.orbits.alive &= !late;
        late
    }

    /// Ends returns at the next section points.
    #[inline(always)]
    fn finish(&mut self, wanted: LaneMask<N>) {
        self.done |= wanted;
        self.orbits.alive &= !wanted;
    }

    /// Handles last minima, if any, that are not section points: the flight continues from there,
    /// or with the contact before.
    #[inline(always)]
    fn reject(&mut self, wanted: LaneMask<N>) {
        let (real, orbits) = (wanted & self.behind, &mut self.orbits);
        let missed = wanted & !real;
        orbits.motion.take(missed, &self.passage);
        orbits.log.miss(missed, self.passage.time);
        orbits.motion.take(real, &self.entry);
        self.met |= real;
        self.looking &= !wanted;
        self.behind &= !wanted;
    }
}

/// Orbits in flight, with their flow.
#[derive(Clone, Debug)]
struct LaneOrbits<F, const N: usize> {
    flow: F,
    /// The phase: its index in a state, and its period.
    phase: Option<(usize, f64)>,
    /// Phases at the start.
    reference: Lanes<N>,
    motion: LaneMotion<N>,
    log: LaneLog<N>,
    /// Mask: lanes in flight, neither at the next section point nor out of the lanes.
    alive: LaneMask<N>,
}

impl<F: LaneFlow<N>, const N: usize> LaneOrbits<F, N> {
    fn new(flow: F, system: &HybridSystem, log: LaneLog<N>) -> Self {
        let phase = system.phase.as_ref();
        Self {
            flow,
            phase: phase.map(|phase| (phase.component, f64::from_dd(phase.period))),
            reference: Lanes::splat(0.0),
            motion: LaneMotion::new(system.dimension()),
            log,
            alive: LaneMask::NONE,
        }
    }

    /// Starts free flights at the states in the motions.
    #[inline(always)]
    fn start(&mut self) {
        self.flow.forget();
        self.log.forget();
        let (zero, motion) = (Lanes::splat(0.0), &mut self.motion);
        (motion.time, motion.turns) = (zero, zero);
        motion.leaving = LaneMask::NONE;
        motion.lose_headings(!LaneMask::NONE);
        if let Some((component, _)) = self.phase {
            self.reference = motion.state[component];
        }
    }

    /// Starts at states that may be at the surface, which they then leave. Lanes beyond it, or at
    /// rest on it, leave the lanes.
    #[inline(always)]
    fn start_anywhere(&mut self) {
        let start = self.sense(self.alive);
        let Sense { gap, rounding, .. } = start;
        self.alive &= !(gap.is_below(-rounding) | start.rests());
        self.motion.leaving = self.alive & gap.is_at_most(rounding);
        self.motion.rounding = rounding;
    }

    /// Normal motions at the surface.
    #[inline(always)]
    fn sense(&mut self, wanted: LaneMask<N>) -> Sense<Lanes<N>> {
        by_itself(Sensing { flow: &mut self.flow, motion: &self.motion, wanted })
    }

    /// Mask: the state is beyond the surface.
    #[inline(always)]
    fn beyond(&mut self, wanted: LaneMask<N>) -> LaneMask<N> {
        let [gap, _] = self.flow.approach(&self.motion, wanted);
        wanted & gap.is_below(Lanes::splat(0.0))
    }

    /// Flies to the next events. Undecided lanes leave the lanes, and do not count in the result.
    #[inline(always)]
    fn step(&mut self, horizon: Lanes<N>, asked: LaneAsked<N>) -> LaneStepEnd<N> {
        let Self { flow, motion, log, .. } = self;
        let mut end = by_itself(Stepping { flow, motion, horizon, asked, log });
        self.alive &= !end.undecided;
        end.contact &= self.alive;
        self.arrive(asked.wanted & self.alive, end.contact);
        end.contact &= self.alive;
        end.minimum &= self.alive;
        end
    }

    /// Completes flights: brings states at a contact onto the surface, and lets the others leave
    /// it.
    #[inline(always)]
    fn arrive(&mut self, flown: LaneMask<N>, contact: LaneMask<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        if contact.any() {
            motion.lose_headings(contact);
            motion.falls |= contact;
            self.alive &= !by_itself(Settling { flow, motion, wanted: contact });
        }
        flow.leave_behind(motion, flown & !contact);
        if let Some((component, period)) = self.phase {
            motion.reduce_phase(flown, component, self.reference, period);
        }
    }

    /// Goes back along the free flow to the minima of the gaps, at most a time. Lanes in which the
    /// way is not known leave the lanes.
    #[inline(always)]
    fn back_to_minimum(&mut self, wanted: LaneMask<N>, longest: Lanes<N>) {
        let known = self.retreat(Back::ToMinimum, wanted, longest);
        self.alive &= !wanted | known;
    }

    /// Goes back along the free flow to the surface, at most a return time. Lanes in which the way
    /// is not known leave the lanes.
    #[inline(always)]
    fn back_to_surface(&mut self, wanted: LaneMask<N>, duration: Lanes<N>) {
        self.motion.lose_headings(wanted);
        let earliest = self.motion.time - duration;
        let longest = self.motion.time - earliest;
        let known = self.retreat(Back::ToSurface, wanted, longest);
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        let stays = by_itself(Settling { flow, motion, wanted: known });
        self.alive &= !wanted | (known & !stays);
    }

    /// Goes back along the free flow, at most a time. Returns the mask of lanes in which the way is
    /// known.
    #[inline(always)]
    fn retreat(&mut self, goal: Back, wanted: LaneMask<N>, longest: Lanes<N>) -> LaneMask<N> {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        by_itself(Retreating { flow, motion, goal, wanted, longest })
    }

    /// Applies the reset; `own` marks lanes at the section's own passage. Lanes that penetrate,
    /// chatter, or move away already leave the lanes.
    #[inline(always)]
    fn respond(&mut self, wanted: LaneMask<N>, own: LaneMask<N>) {
        let before = self.sense(wanted);
        let (speed, zero) = (-before.velocity, Lanes::splat(0.0));
        self.alive &= !(wanted & speed.is_below(zero));
        self.log.meet(own, speed);
        self.log.contact(wanted, self.motion.time, &before);
        self.flow.reset(&mut self.motion, wanted);
        let after = self.sense(wanted);
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        let least = -speed.map(f64::abs) * Lanes::splat(PASSES);
        self.alive &= !(wanted & after.velocity.is_below(least));
        motion.lose_headings(wanted);
        motion.leaving |= wanted;
        let residual = after.gap.abs() * Lanes::splat(4.0);
        motion.rounding = Lanes::select(wanted, after.rounding.max(residual), motion.rounding);
        let rebound = Rebound::new(speed, &after);
        self.alive &= !wanted | rebound.flies_on(wanted, flow.time_scale(motion));
    }

    /// Subtracts a number of whole periods from the phases.
    #[inline(always)]
    fn advance(&self, motion: &mut LaneMotion<N>, periods: Lanes<N>) {
        if let Some((component, period)) = self.phase {
            let turns = motion.turns - periods;
            motion.state[component] += turns * Lanes::splat(period);
        }
    }
}

/// Runs a part of a flight that is compiled separately.
///
/// NOTE: in one function with all callers, the parts would take the compiler minutes: its work on a
/// loop over lanes grows with the number of such loops in the function.
#[inline(always)]
fn by_itself<K: Vectorised>(part: K) -> K::Output {
    wide(part).expect("flights in lanes are flown in wide registers alone")
}

/// Vectorised work: free flight to the first events.
struct Stepping<'t, F, const N: usize> {
    flow: &'t mut F,
    motion: &'t mut LaneMotion<N>,
    horizon: Lanes<N>,
    asked: LaneAsked<N>,
    log: &'t mut LaneLog<N>,
}

impl<F: LaneFlow<N>, const N: usize> Vectorised for Stepping<'_, F, N> {
    type Output = LaneStepEnd<N>;

    #[inline(always)]
    fn run(self) -> LaneStepEnd<N> {
        self.flow.step(self.motion, self.horizon, self.asked, self.log)
    }
}

/// Vectorised work: flight back along the free flow.
struct Retreating<'t, F, const N: usize> {
    flow: &'t mut F,
    motion: &'t mut LaneMotion<N>,
    goal: Back,
    wanted: LaneMask<N>,
    longest: Lanes<N>,
}

impl<F: LaneFlow<N>, const N: usize> Vectorised for Retreating<'_, F, N> {
    type Output = LaneMask<N>;

    #[inline(always)]
    fn run(self) -> LaneMask<N> {
        self.flow.retreat(self.motion, self.goal, self.wanted, self.longest)
    }
}

/// Vectorised work: last step onto the surface.
struct Settling<'t, F, const N: usize> {
    flow: &'t mut F,
    motion: &'t mut LaneMotion<N>,
    wanted: LaneMask<N>,
}

impl<F: LaneFlow<N>, const N: usize> Vectorised for Settling<'_, F, N> {
    type Output = LaneMask<N>;

    #[inline(always)]
    fn run(self) -> LaneMask<N> {
        self.flow.settle(self.motion, self.wanted)
    }
}

/// Vectorised work: evaluation of the normal motion.
struct Sensing<'t, F, const N: usize> {
    flow: &'t mut F,
    motion: &'t LaneMotion<N>,
    wanted: LaneMask<N>,
}

impl<F: LaneFlow<N>, const N: usize> Vectorised for Sensing<'_, F, N> {
    type Output = Sense<Lanes<N>>;

    #[inline(always)]
    fn run(self) -> Sense<Lanes<N>> {
        self.flow.sense(self.motion, self.wanted)
    }
}
