//! Several orbits at one rigid surface, between the section points of any section: their flights,
//! their impacts.
//!
//! One idea: which flights a return is made of is told elsewhere; how each is flown, and what
//! happens where it ends, is the same for all.

use super::backward::Back;
use super::chatter::Rebound;
use super::lane_flow::{LaneAsked, LaneFlow, LaneLeap};
use super::lane_log::LaneLog;
use super::lane_motion::LaneMotion;
use super::response::PASSES;
use super::sensing::Sense;
use super::system::HybridSystem;
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar};

/// Orbits on their way, and what they fly by.
#[derive(Clone, Debug)]
pub(super) struct LaneOrbits<F, const N: usize> {
    flow: F,
    /// The phase: its place in a state, its period.
    phase: Option<(usize, f64)>,
    /// Phases at the start.
    reference: Lanes<N>,
    pub(super) motion: LaneMotion<N>,
    pub(super) log: LaneLog<N>,
    /// Under way: neither at the next section point nor out of the lanes.
    pub(super) alive: LaneMask<N>,
}

impl<F: LaneFlow<N>, const N: usize> LaneOrbits<F, N> {
    pub(super) fn new(flow: F, system: &HybridSystem, log: LaneLog<N>) -> Self {
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

    /// Sets out from the states placed in the motions, in free flight.
    #[inline(always)]
    pub(super) fn start(&mut self) {
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

    /// The states may be at the surface, which they then leave. Those beyond it leave the lanes.
    #[inline(always)]
    pub(super) fn start_anywhere(&mut self) {
        let Sense { gap, rounding, .. } = self.sense(self.alive);
        self.alive &= !gap.is_below(-rounding);
        self.motion.leaving = self.alive & gap.is_at_most(rounding);
        self.motion.rounding = rounding;
    }

    /// The normal motion.
    #[inline(always)]
    pub(super) fn sense(&mut self, wanted: LaneMask<N>) -> Sense<Lanes<N>> {
        self.flow.sense(&self.motion, wanted)
    }

    /// Where the state is beyond the surface.
    #[inline(always)]
    pub(super) fn beyond(&mut self, wanted: LaneMask<N>) -> LaneMask<N> {
        let [gap, _] = self.flow.approach(&self.motion, wanted);
        wanted & gap.is_below(Lanes::splat(0.0))
    }

    /// Leaps to the next events. Those of which nothing is known leave the lanes, and take no part
    /// in the answer.
    #[inline(always)]
    pub(super) fn leap(&mut self, horizon: Lanes<N>, asked: LaneAsked<N>) -> LaneLeap<N> {
        let mut leap = self
            .flow
            .leap(&mut self.motion, horizon, asked, &mut self.log);
        self.alive &= !leap.open;
        leap.contact &= self.alive;
        self.arrive(asked.wanted & self.alive, leap.contact);
        leap.contact &= self.alive;
        leap.minimum &= self.alive;
        leap
    }

    /// Settles those that have flown: on the surface at a contact, away from it otherwise.
    #[inline(always)]
    fn arrive(&mut self, flown: LaneMask<N>, contact: LaneMask<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        if contact.any() {
            motion.lose_headings(contact);
            motion.falls |= contact;
            self.alive &= !flow.settle(motion, contact);
        }
        flow.leave_behind(motion, flown & !contact);
        if let Some((component, period)) = self.phase {
            motion.reduce_phase(flown, component, self.reference, period);
        }
    }

    /// Goes back along the free flow to where the gaps were least, a time at most. Where that is
    /// not known they leave the lanes.
    #[inline(always)]
    pub(super) fn back_to_minimum(&mut self, wanted: LaneMask<N>, longest: Lanes<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        self.alive &= !wanted | flow.retreat(motion, Back::ToMinimum, wanted, longest);
    }

    /// Goes back along the free flow to the surface, a return time at most. Where that is not known
    /// they leave the lanes.
    #[inline(always)]
    pub(super) fn back_to_surface(&mut self, wanted: LaneMask<N>, duration: Lanes<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        motion.lose_headings(wanted);
        let earliest = motion.time - duration;
        let longest = motion.time - earliest;
        let known = flow.retreat(motion, Back::ToSurface, wanted, longest);
        let stays = flow.settle(motion, known);
        self.alive &= !wanted | (known & !stays);
    }

    /// Applies the reset; `own` says where this is the section's own passage. Those that penetrate,
    /// chatter or move away already leave the lanes.
    #[inline(always)]
    pub(super) fn respond(&mut self, wanted: LaneMask<N>, own: LaneMask<N>) {
        let (flow, motion) = (&mut self.flow, &mut self.motion);
        let before = flow.sense(motion, wanted);
        let (speed, zero) = (-before.velocity, Lanes::splat(0.0));
        self.alive &= !(wanted & speed.is_below(zero));
        self.log.meet(own, speed);
        self.log.contact(wanted, motion.time, &before);
        flow.reset(motion, wanted);
        let after = flow.sense(motion, wanted);
        let least = -speed.map(f64::abs) * Lanes::splat(PASSES);
        self.alive &= !(wanted & after.velocity.is_below(least));
        motion.lose_headings(wanted);
        motion.leaving |= wanted;
        let residual = after.gap.abs() * Lanes::splat(4.0);
        motion.rounding = Lanes::select(wanted, after.rounding.max(residual), motion.rounding);
        let rebound = Rebound::new(speed, &after);
        self.alive &= !wanted | rebound.flies_on(wanted, flow.time_scale(motion));
    }

    /// The states with a number of whole periods taken off their phases.
    #[inline(always)]
    pub(super) fn advance(&self, motion: &mut LaneMotion<N>, periods: Lanes<N>) {
        if let Some((component, period)) = self.phase {
            let turns = motion.turns - periods;
            motion.state[component] += turns * Lanes::splat(period);
        }
    }
}
