//! Flights of several orbits from one tangency to the next: [`DirectReturn`](super::DirectReturn) in lanes.
//!
//! One idea: every orbit does one of three things, and all leap together. It approaches its next minimum or contact;
//! or it flies on behind a contact, to the minimum that the approach would have had; or it looks whether a minimum
//! nearer to the nominal return follows. What does none of these leaves the lanes.

use super::chatter::{AfterImpact, Rebound};
use super::lane_flow::{LaneAsked, LaneFlow};
use super::lane_motion::LaneMotion;
use super::system::HybridSystem;
use crate::numeric::{Branched, Kernel, LaneMask, Lanes, Mask, Scalar, wide};

/// Most leaps, or steps, of a return in lanes.
const MAX_LEAPS: usize = 1000;

/// Orbits on their way, and what they fly by.
#[derive(Clone, Debug)]
pub(super) struct LaneFlight<F, const N: usize> {
    flow: F,
    /// The phase: its place in a state, its period.
    phase: Option<(usize, f64)>,
    /// Nominal return times.
    duration: Lanes<N>,
    /// Whole periods by which the phase advances in a return.
    periods: Lanes<N>,
    /// Phases at the start.
    reference: Lanes<N>,
    motion: LaneMotion<N>,
    /// Where the surface was met last.
    entry: LaneMotion<N>,
    /// The minimum reached last.
    passage: LaneMotion<N>,
    /// Those that fly behind a contact, or look from a minimum behind it.
    behind: LaneMask<N>,
    /// Those that look for a nearer minimum, and the times that are left.
    looking: LaneMask<N>,
    early: Lanes<N>,
    /// Speeds at which the section's own passages met the surface, and where they did.
    speed: Lanes<N>,
    met: LaneMask<N>,
    /// Under way, and at the next section point.
    alive: LaneMask<N>,
    done: LaneMask<N>,
}

impl<F: LaneFlow<N>, const N: usize> LaneFlight<F, N> {
    pub(super) fn new(flow: F, system: &HybridSystem, duration: Lanes<N>, periods: i64) -> Self {
        let (zero, motion) = (Lanes::splat(0.0), LaneMotion::new(system.dimension()));
        let phase = system.phase.as_ref();
        Self {
            flow,
            phase: phase.map(|phase| (phase.component, f64::from_dd(phase.period))),
            duration,
            periods: Lanes::splat(periods as f64),
            reference: zero,
            entry: motion.clone(),
            passage: motion.clone(),
            motion,
            behind: LaneMask::NONE,
            looking: LaneMask::NONE,
            early: zero,
            speed: zero,
            met: LaneMask::NONE,
            alive: LaneMask::NONE,
            done: LaneMask::NONE,
        }
    }

    /// Flies the wanted lanes from full states at the section to the next; those that came there, none without wide registers.
    pub(super) fn fly(&mut self, states: &[Lanes<N>], wanted: LaneMask<N>) -> LaneMask<N> {
        self.motion.state.copy_from_slice(states);
        self.alive = wanted;
        self.done = LaneMask::NONE;
        wide(Returning(self));
        self.done
    }

    /// The full states there, the nominal advance of the phase removed.
    pub(super) fn states(&self) -> &[Lanes<N>] {
        &self.passage.state
    }

    /// The speed at which the own passage of a lane met the surface.
    pub(super) fn speed(&self, lane: usize) -> Option<f64> {
        self.met.holds(lane).then(|| self.speed[lane])
    }
}

struct Returning<'t, F, const N: usize>(&'t mut LaneFlight<F, N>);

impl<F: LaneFlow<N>, const N: usize> Kernel for Returning<'_, F, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let flight = self.0;
        flight.start();
        for _ in 0..MAX_LEAPS {
            if !flight.alive.any() {
                break;
            }
            flight.leap();
        }
        if let Some((component, period)) = flight.phase {
            let turns = flight.passage.turns - flight.periods;
            flight.passage.state[component] += turns * Lanes::splat(period);
        }
    }
}

impl<F: LaneFlow<N>, const N: usize> LaneFlight<F, N> {
    /// From section points; those beyond the surface are taken back to it, and through the contact.
    #[inline(always)]
    fn start(&mut self) {
        self.flow.forget();
        let (zero, motion) = (Lanes::splat(0.0), &mut self.motion);
        (motion.time, motion.turns) = (zero, zero);
        motion.leaving = LaneMask::NONE;
        motion.falls = LaneMask::NONE;
        if let Some((component, _)) = self.phase {
            self.reference = motion.state[component];
        }
        (self.behind, self.looking) = (LaneMask::NONE, LaneMask::NONE);
        let [gap, _] = self.flow.approach(motion, self.alive);
        let beyond = self.alive & gap.is_below(zero);
        motion.rises = self.alive & !beyond;
        self.met = LaneMask::NONE;
        if beyond.any() {
            let known = self.flow.retreat(motion, beyond, self.duration);
            let stays = self.flow.settle(motion, known);
            self.met = known & !stays;
            self.alive &= !beyond | self.met;
            self.speed = self.respond(self.met);
        }
    }

    /// Applies the reset; the speeds at which the surface is met. Those that penetrate or chatter leave the lanes.
    #[inline(always)]
    fn respond(&mut self, wanted: LaneMask<N>) -> Lanes<N> {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        let [_, velocity] = flow.approach(motion, wanted);
        let speed = -velocity;
        flow.reset(motion, wanted);
        let after = flow.sense(motion, wanted);
        let least = -speed.map(f64::abs) * Lanes::splat(1e-6);
        self.alive &= !(wanted & after.velocity.is_below(least));
        motion.lose_headings(wanted);
        motion.leaving |= wanted;
        let residual = after.gap.abs() * Lanes::splat(4.0);
        motion.rounding = Lanes::select(wanted, after.rounding.max(residual), motion.rounding);
        let falls_back = wanted & after.acceleration.is_below(Lanes::splat(0.0));
        let time_scale = flow.time_scale(motion);
        for lane in falls_back.lanes() {
            let rebound = Rebound {
                speed: speed[lane],
                rebound: after.velocity[lane],
                acceleration: after.acceleration[lane],
                jerk: after.jerk[lane],
            };
            if rebound.follow(time_scale[lane]) != AfterImpact::Flight {
                self.alive &= !LaneMask::from_fn(|other| other == lane);
            }
        }
        speed
    }

    /// Leaps to the next events, and goes on from each.
    #[inline(always)]
    fn leap(&mut self) {
        let nominal = self.duration * Lanes::splat(3.0);
        let horizon = Lanes::select(self.looking, self.duration + self.early, nominal);
        let wanted = self.alive & self.motion.time.is_below(horizon);
        let asked = LaneAsked {
            wanted,
            ignoring: self.behind | self.looking,
            passing: self.looking,
            longest: horizon - self.motion.time,
        };
        let leap = self.flow.leap(&mut self.motion, horizon, asked);
        self.alive &= !leap.open;
        let contact = leap.contact & self.alive;
        self.arrive(wanted & self.alive, contact);
        let minimum = leap.minimum & self.alive;
        let flies_on = wanted & self.motion.time.is_below(horizon);
        let over = self.alive & !contact & !minimum & !flies_on;
        self.entry.take(contact, &self.motion);
        self.behind |= contact;
        let looked = self.looking;
        self.look_on(minimum & !looked, leap.rises_for);
        self.return_at(over & looked);
        self.reject((minimum & looked) | (over & !looked & self.behind));
        self.alive &= !(over & !looked & !self.behind);
    }

    /// Settles those that have flown: on the surface at a contact, away from it otherwise.
    #[inline(always)]
    fn arrive(&mut self, flown: LaneMask<N>, contact: LaneMask<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        if contact.any() {
            motion.lose_headings(contact);
            self.alive &= !flow.settle(motion, contact);
        }
        flow.leave_behind(motion, flown & !contact);
        if let Some((component, period)) = self.phase {
            motion.reduce_phase(flown, component, self.reference, period);
        }
    }

    /// From minima: those past the nominal return, and those after which the gap rises for long, are section points; the
    /// others look for a nearer one.
    #[inline(always)]
    fn look_on(&mut self, minimum: LaneMask<N>, rises_for: Lanes<N>) {
        let early = self.duration - self.motion.time;
        let past = minimum & (early + early).is_at_most(rises_for);
        self.passage.take(minimum, &self.motion);
        self.early = Lanes::select(minimum, early, self.early);
        self.looking |= minimum;
        self.return_at(past);
    }

    /// The minima reached last are section points.
    #[inline(always)]
    fn return_at(&mut self, wanted: LaneMask<N>) {
        self.done |= wanted;
        self.alive &= !wanted;
    }

    /// The minima reached last, if any, are no section points: on from there, or through the contact before.
    #[inline(always)]
    fn reject(&mut self, wanted: LaneMask<N>) {
        let real = wanted & self.behind;
        self.motion.take(wanted & !real, &self.passage);
        self.looking &= !wanted;
        self.behind &= !wanted;
        if real.any() {
            self.motion.take(real, &self.entry);
            self.respond(real);
        }
    }
}
