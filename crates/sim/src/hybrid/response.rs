//! Response at a surface: reset, completed chatter, sticking, contact, release.
//!
//! A chatter, infinitely many impacts in finite time, is completed by its sum (Nordmark and
//! Piiroinen 2009). The normal motion between impacts is `h = v t − α t²/2 + j t³/6` with
//! `α = −h'' > 0` (pressing) and `j = h'''`, both along the free flow. One flight takes
//! `τ = 2v/α + 4 j v²/(3 α³)` and ends with the speed `v − 2 j v²/(3 α²)`; with the restitution `r`
//! the next flight starts with `r` times that speed and `α − j τ`. The sum is
//!
//! ```text
//! T = T₀ (1 + j T₀ / (3 α)),   T₀ = 2 v / (α (1 − r)),
//! ```
//!
//! with an error of order `T₀³`.

use super::motion::{Clearance, Regime, Sense};
use super::simulator::{Contact, Simulator};
use super::system::Law;
use super::trajectory::{Event, EventKind, Outcome};
use super::variation::{Change, ChangeKind};
use crate::numeric::{Branched, Mask, Real};

/// Share of an impact's speed with which a state that still moves inwards has passed the surface.
pub(super) const PASSES: f64 = 1e-6;

impl<S: Real> Simulator<'_, S> {
    /// Applies a surface's response at the present state, which is on the surface.
    #[inline(never)]
    pub(super) fn respond(
        &mut self,
        surface: usize,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<(), Outcome<S>> {
        let before = self.sense(surface);
        if before.velocity > S::zero() && before.acceleration > S::zero() {
            self.pass(surface, before, record);
            return Ok(());
        }
        match self.system.surfaces[surface].law {
            Law::Rigid { .. } => self.impact(surface, before, record),
            Law::Compliant { .. } => {
                self.check_alone(surface)?;
                self.check_held(surface, &before)?;
                let uncertainty = if before.velocity == S::zero() {
                    S::zero()
                } else {
                    (before.gap / before.velocity).abs() * S::from_f64(4.0)
                };
                let turn = if before.acceleration > S::zero() {
                    -before.velocity / before.acceleration
                } else {
                    S::from_f64(f64::INFINITY)
                };
                let regime = self.motion.regime;
                self.begin_contact(surface, uncertainty, turn);
                self.note(ChangeKind::Begin, surface, regime);
                self.record(surface, EventKind::ContactBegin { speed: -before.velocity }, record);
                Ok(())
            }
        }
    }

    /// Leaves a surface without a response, because the contact lies within rounding of the gap's
    /// minimum, and behind it: a miss.
    fn pass(&mut self, surface: usize, sense: Sense<S>, record: &mut dyn FnMut(Event<S>)) {
        let gap = sense.gap.max(S::zero());
        if gap <= self.near_miss {
            self.record(surface, EventKind::NearMiss { gap }, record);
        }
        let regime = self.motion.regime;
        self.leave(surface, sense, residual(&sense));
        self.motion.regime = regime;
    }

    /// Fails if the state rests on a compliant surface onto which the free flow presses it and from
    /// which the contact pushes it at once: neither field keeps it there.
    fn check_held(&mut self, surface: usize, sense: &Sense<S>) -> Result<(), Outcome<S>> {
        let rests = sense.velocity == S::zero() && sense.acceleration < S::zero();
        let push = rests.then(|| self.contact_acceleration(surface)).flatten();
        match push.is_some_and(|push| push > S::zero()) {
            true => Err(Outcome::NoStickingField { surface, time: self.motion.time }),
            false => Ok(()),
        }
    }

    /// Fails if another surface holds the state already: no regime describes both.
    fn check_alone(&self, surface: usize) -> Result<(), Outcome<S>> {
        match self.motion.regime.surface() {
            Some(other) if other != surface => {
                let time = self.motion.time;
                Err(Outcome::HeldTwice { surfaces: [other, surface], time })
            }
            _ => Ok(()),
        }
    }

    /// Fails if two surfaces hold the state at its start.
    pub(super) fn check_placed(&self) -> Result<(), Outcome<S>> {
        match self.held_twice {
            Some(surfaces) => Err(Outcome::HeldTwice { surfaces, time: self.motion.time }),
            None => Ok(()),
        }
    }

    /// Fails if another rigid surface is met at the same instant and the two resets do not commute;
    /// `next` holds the state before.
    fn check_order(&mut self, surface: usize) -> Result<(), Outcome<S>> {
        for other in 0..self.surfaces.len() {
            if other != surface && self.is_close(other) && !self.resets_commute(surface, other) {
                let surfaces = [surface.min(other), surface.max(other)];
                return Err(Outcome::HitTogether { surfaces, time: self.motion.time });
            }
        }
        Ok(())
    }

    /// Whether the state is on a surface, to within rounding.
    pub(super) fn is_close(&mut self, surface: usize) -> bool {
        let clearance = self.clearance(surface);
        clearance.gap.abs() <= clearance.slack()
    }

    /// Whether a surface is met now, to within rounding: the state is on it and moves into it.
    pub(super) fn is_met(&mut self, surface: usize) -> bool {
        self.motion.leaving[surface].is_none()
            && self.motion.regime.surface() != Some(surface)
            && self.is_close(surface)
            && self.sense(surface).approaches()
    }

    /// Whether the resets of two surfaces, both met in the state `next`, give the same state in
    /// either order.
    #[cold]
    fn resets_commute(&mut self, surface: usize, other: usize) -> bool {
        let before = self.work.next.clone();
        let (after, Some(second)) = (self.motion.state.clone(), self.hit(other, &before)) else {
            return true;
        };
        let after = self.hit(other, &after).unwrap_or(after);
        let second = self.hit(surface, &second).unwrap_or(second);
        let size = before.iter().chain(&after).fold(S::zero(), |size, x| size.max(x.abs()));
        largest_difference(&after, &second) <= size * S::from_f64(64.0 * S::ROUNDOFF)
    }

    /// State after the reset of a rigid surface, if a state on it moves into it.
    fn hit(&mut self, surface: usize, state: &[S]) -> Option<Vec<S>> {
        let tools = &mut self.surfaces[surface];
        let reset = tools.reset.as_mut()?;
        let meets = tools.sensor.sense(state, &self.parameters).approaches();
        meets.then(|| reset.evaluate(state, &self.parameters).to_vec())
    }

    /// Fails if the state is beyond a rigid surface other than `except`.
    pub(super) fn check_penetration(&mut self, except: Option<usize>) -> Result<(), Outcome<S>> {
        for surface in 0..self.surfaces.len() {
            let stuck = self.motion.regime == Regime::Stick { surface };
            let compliant = matches!(self.system.surfaces[surface].law, Law::Compliant { .. });
            if stuck
                || compliant
                || except == Some(surface)
                || self.motion.leaving[surface].is_some()
            {
                continue;
            }
            let clearance = self.clearance(surface);
            if clearance.gap < -clearance.slack() {
                let (time, gap) = (self.motion.time, clearance.gap);
                return Err(Outcome::Penetrating { surface, time, gap });
            }
        }
        Ok(())
    }

    /// The gap of a surface, with its rounding.
    #[inline(always)]
    pub(super) fn clearance(&mut self, surface: usize) -> Clearance<S> {
        if let Some(tools) = &mut self.affine
            && let Some(exact) = tools.clearance(surface, &self.motion, &self.parameters)
        {
            return exact;
        }
        let Sense { gap, rounding, .. } = self.sense(surface);
        Clearance { gap, rounding }
    }

    /// Normal motion at a surface.
    pub(super) fn sense(&mut self, surface: usize) -> Sense<S> {
        let exact = self
            .affine
            .as_mut()
            .and_then(|tools| tools.sense(surface, &self.motion, &self.parameters));
        exact.unwrap_or_else(|| {
            self.surfaces[surface].sensor.sense(&self.motion.state, &self.parameters)
        })
    }

    /// Records a change at a surface, if changes are recorded; `next` holds the state before an
    /// impact.
    fn note(&mut self, kind: ChangeKind, surface: usize, before: Regime) {
        let Self { changes: Some(changes), motion, work, .. } = self else { return };
        changes.truncate(motion.changes);
        let after = motion.state.clone();
        let state = if kind == ChangeKind::Impact { work.next.clone() } else { after.clone() };
        changes.push(Change {
            kind,
            surface,
            time: motion.time,
            states: [state, after],
            regimes: [before, motion.regime],
        });
        motion.changes = changes.len();
    }

    /// Whether the last recorded change is the beginning of a contact with this surface.
    fn has_just_begun(&self, surface: usize) -> bool {
        let last = self.changes.as_ref().zip(self.motion.changes.checked_sub(1));
        let last = last.and_then(|(changes, last)| changes.get(last));
        last.is_some_and(|last| last.kind == ChangeKind::Begin && last.surface == surface)
    }

    fn record(&self, surface: usize, kind: EventKind<S>, record: &mut dyn FnMut(Event<S>)) {
        record(Event { time: self.motion.time, surface, kind });
    }

    fn impact(
        &mut self,
        surface: usize,
        before: Sense<S>,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<(), Outcome<S>> {
        let after = self.reset(surface);
        let speed = -before.velocity;
        let rebound = Rebound::new(speed, &after);
        self.record(surface, EventKind::Impact { speed, rebound: after.velocity }, record);
        if after.velocity < -speed.abs() * S::from_f64(PASSES) {
            return Err(Outcome::GoesThrough { surface, time: self.motion.time });
        }
        self.check_order(surface)?;
        let regime = self.motion.regime;
        self.leave(surface, after, residual(&after));
        if let Regime::Contact { .. } = regime {
            self.motion.regime = regime;
        }
        self.note(ChangeKind::Impact, surface, regime);
        if let AfterImpact::Complete { duration } = rebound.follow(self.motion.last_step) {
            self.stick(surface, speed, after.velocity, duration, record)?;
        }
        self.check_penetration(Some(surface))
    }

    /// Applies the reset of a rigid surface; returns the normal motion after it. `next` holds the
    /// state before.
    fn reset(&mut self, surface: usize) -> Sense<S> {
        self.work.next.copy_from_slice(&self.motion.state);
        let exact = self
            .affine
            .as_mut()
            .is_some_and(|tools| tools.reset(surface, &mut self.motion, &self.parameters));
        if let Some(reset) = self.surfaces[surface].reset.as_mut().filter(|_| !exact) {
            let image = reset.evaluate(&self.work.next, &self.parameters);
            self.motion.state.copy_from_slice(image);
        }
        self.sense(surface)
    }

    /// Lets the state rest on rigid surfaces on which it was placed, if its speed is within
    /// rounding and it presses against them.
    pub(super) fn rest_where_placed(&mut self) -> Result<(), Outcome<S>> {
        for surface in 0..self.surfaces.len() {
            if self.motion.leaving[surface].is_some()
                && matches!(self.system.surfaces[surface].law, Law::Rigid { .. })
            {
                let before = self.placed(surface);
                if before.rests() {
                    let after = self.reset(surface);
                    let (speed, rebound) = (-before.velocity, after.velocity);
                    self.stick(surface, speed, rebound, S::zero(), &mut |_| {})?;
                }
            }
        }
        Ok(())
    }

    /// Whether placing the state anew would reproduce its regime at a surface: held where it is
    /// held now, and free where it is free. At a passage the state must be free, and beyond the
    /// surface the answer is no.
    pub(super) fn tells_hold(&mut self, surface: usize, is_passage: bool) -> bool {
        let is_held = self.motion.regime.surface() == Some(surface);
        let Clearance { gap, rounding } = self.clearance(surface);
        if gap > rounding && !is_held {
            return true;
        }
        if let Law::Rigid { .. } = self.system.surfaces[surface].law {
            let sense = self.placed(surface);
            if sense.gap > sense.rounding {
                return !is_held;
            }
            return !is_held || sense.rests() || sense.acceleration >= S::zero();
        }
        if gap >= -rounding || is_passage {
            return !is_held && gap >= -rounding;
        }
        is_held == (self.contact_beyond(surface) != Some(Contact::Released))
    }

    /// Starts free flight from a surface whose gap is zero up to a residual.
    fn leave(&mut self, surface: usize, sense: Sense<S>, residual: S) {
        self.motion.regime = Regime::Free;
        self.motion.changed = self.motion.time;
        self.motion.lose_headings();
        self.motion.leaving[surface] = Some(sense.rounding.max(residual));
    }

    /// Enters the stick field; `next` holds the state before the last impact.
    ///
    /// A reset that moves a state at rest on the surface (a tangential restitution) would act on
    /// and on; no field describes this.
    fn stick(
        &mut self,
        surface: usize,
        speed: S,
        rebound: S,
        duration: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<(), Outcome<S>> {
        self.check_alone(surface)?;
        let kick = largest_difference(&self.motion.state, &self.work.next);
        self.remove_normal_velocity(surface, speed, rebound);
        if self.surfaces[surface].held.is_none() || self.reset_moves(surface, kick) {
            return Err(Outcome::NoStickingField { surface, time: self.motion.time });
        }
        let regime = std::mem::replace(&mut self.motion.regime, Regime::Stick { surface });
        self.note(ChangeKind::Rest, surface, regime);
        self.motion.release_sign = S::one();
        let time = self.motion.time + duration;
        if duration > S::zero() {
            record(Event { time, surface, kind: EventKind::ChatterEnd { duration } });
        }
        record(Event { time, surface, kind: EventKind::Stick });
        Ok(())
    }

    /// Brings the normal velocity to zero along the last impact's kick; `next` holds the state
    /// before it.
    ///
    /// The kick changes the normal velocity from `-speed` to `rebound`; a second, corrected share
    /// removes the remainder due to rounding and a curved reset.
    fn remove_normal_velocity(&mut self, surface: usize, speed: S, rebound: S) {
        let total = speed + rebound;
        if total == S::zero() {
            return;
        }
        let mut share = speed / total;
        let after: Vec<S> = self.motion.state.clone();
        for _ in 0..2 {
            for (i, value) in self.motion.state.iter_mut().enumerate() {
                *value = self.work.next[i] + (after[i] - self.work.next[i]) * share;
            }
            share -= self.sense(surface).velocity / total;
        }
    }

    /// Whether the reset moves the present state, which has no normal velocity, by more than a
    /// share of the last kick.
    fn reset_moves(&mut self, surface: usize, kick: S) -> bool {
        let Some(reset) = &mut self.surfaces[surface].reset else {
            return false;
        };
        let state = &self.motion.state;
        let size = state.iter().fold(S::zero(), |size, x| size.max(x.abs()));
        let rounding = size * S::from_f64(64.0 * S::ROUNDOFF);
        let image = reset.evaluate(state, &self.parameters);
        largest_difference(image, state) > kick * S::from_f64(AT_REST) + rounding
    }

    /// Ends the present contact or sticking.
    pub(super) fn release(&mut self, record: &mut dyn FnMut(Event<S>)) {
        let Some(surface) = self.motion.regime.surface() else { return };
        let sense = self.sense(surface);
        let kind = match self.motion.regime {
            Regime::Contact { .. } => EventKind::ContactEnd { speed: sense.velocity },
            _ => EventKind::Release,
        };
        self.record(surface, kind, record);
        let residual = match self.motion.regime {
            // NOTE: a contact that ends at once; the approach may still go on, to a depth within
            // rounding.
            Regime::Contact { .. } if sense.velocity < S::zero() => {
                residual(&sense) + approach_depth(&sense)
            }
            Regime::Contact { .. } => S::zero(),
            _ => residual(&sense),
        };
        let (regime, sign) = (self.motion.regime, self.motion.release_sign);
        self.leave(surface, sense, residual);
        match regime {
            Regime::Contact { .. } if sign == S::zero() && self.has_just_begun(surface) => {
                self.motion.changes -= 1;
            }
            Regime::Contact { .. } => self.note(ChangeKind::Release, surface, regime),
            _ => self.note(ChangeKind::Rest, surface, regime),
        }
    }
}

/// Twice the depth to which an approach goes on along the free flow; 0 if that flow does not turn.
fn approach_depth<S: Real>(sense: &Sense<S>) -> S {
    if sense.acceleration > S::zero() {
        sense.velocity * sense.velocity / sense.acceleration
    } else {
        S::zero()
    }
}

/// Allowed deviation from zero of the gap of a state on a surface.
fn residual<S: Real>(sense: &Sense<S>) -> S {
    sense.gap.abs() * S::from_f64(4.0)
}

/// Share of an impact's kick by which a reset may move a state at rest.
const AT_REST: f64 = 1e-6;

fn largest_difference<S: Real>(a: &[S], b: &[S]) -> S {
    let differences = a.iter().zip(b).map(|(&a, &b)| (a - b).abs());
    differences.fold(S::zero(), S::max)
}

/// Normal motion just after an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rebound<S> {
    /// Speed before the impact.
    pub(crate) speed: S,
    /// Speed after the impact.
    pub(crate) rebound: S,
    /// `h''` along the free flow.
    pub(crate) acceleration: S,
    /// `h'''` along the free flow.
    pub(crate) jerk: S,
}

/// Continuation after an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AfterImpact<S> {
    /// A free flight.
    Flight,
    /// The remaining impacts are summed; the contact is sustained after this duration.
    Complete {
        /// Sum of the remaining flights.
        duration: S,
    },
}

impl<S: Branched> Rebound<S> {
    /// Rebound of an impact at this speed, from the normal motion after it.
    #[inline(always)]
    pub(crate) fn new(speed: S, after: &Sense<S>) -> Self {
        Self { speed, rebound: after.velocity, acceleration: after.acceleration, jerk: after.jerk }
    }

    /// Mask: a free flight follows. In other lanes the chatter's leading duration is below
    /// `ε^(1/4)` of the time scale on which the normal acceleration changes.
    ///
    /// At that duration the series' error, `T₀³`, equals the error of the impacts' times due to
    /// rounding of the position, about `ε/T₀`.
    #[inline(always)]
    pub(crate) fn flies_on(&self, wanted: S::Mask, time_scale: S) -> S::Mask {
        let zero = S::zero();
        let pressed = wanted & !zero.is_at_most(self.acceleration);
        if !pressed.any() {
            return wanted;
        }
        let pressing = -self.acceleration;
        let change = self.jerk.abs() * time_scale;
        let changes = pressing.is_below(change);
        let time_scale = S::select(changes, time_scale * pressing / change, time_scale);
        let limit = time_scale * S::from_f64(S::ROUNDOFF.sqrt().sqrt());
        let lasts = self.speed.is_at_most(self.rebound) | limit.is_below(self.leading());
        wanted & (!pressed | (lasts & !self.rebound.is_at_most(zero)))
    }

    /// Leading duration `T₀` of the chatter.
    #[inline(always)]
    fn leading(&self) -> S {
        let restitution = self.rebound / self.speed;
        (self.rebound + self.rebound) / (-self.acceleration * (S::one() - restitution))
    }
}

impl<S: Real> Rebound<S> {
    /// Completes the chatter if no [free flight](Self::flies_on) follows.
    #[inline(always)]
    pub(crate) fn follow(&self, time_scale: S) -> AfterImpact<S> {
        if self.flies_on(true, time_scale) {
            return AfterImpact::Flight;
        }
        if self.rebound <= S::zero() {
            return AfterImpact::Complete { duration: S::zero() };
        }
        let leading = self.leading();
        let correction = self.jerk * leading / (S::from_f64(3.0) * -self.acceleration);
        AfterImpact::Complete { duration: leading * (S::one() + correction) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Duration of impacts one by one, with the end of each flight found by Newton's method.
    fn summed(mut v: f64, mut alpha: f64, j: f64, r: f64) -> f64 {
        let mut total = 0.0;
        while v > 1e-18 {
            let mut t = 2.0 * v / alpha;
            for _ in 0..20 {
                t -= (v - alpha * t / 2.0 + j * t * t / 6.0) / (-alpha / 2.0 + j * t / 3.0);
            }
            let speed = -(v - alpha * t + j * t * t / 2.0);
            (v, alpha, total) = (r * speed, alpha - j * t, total + t);
        }
        total
    }

    #[test]
    fn completed_duration_agrees_with_impacts_one_by_one_to_third_order() {
        for (j, r) in [(0.0, 0.8), (1.5, 0.8), (-2.0, 0.5)] {
            let v = 1e-6;
            let rebound = Rebound { speed: v / r, rebound: v, acceleration: -3.0, jerk: j };
            let AfterImpact::Complete { duration } = rebound.follow(1.0) else {
                panic!("completes")
            };
            assert!((duration - summed(v, 3.0, j, r)).abs() < 1e-15, "{j} {r}");
        }
    }

    #[test]
    fn no_chatter_while_leaving_or_without_loss() {
        let flight = Rebound { speed: 1e-9, rebound: 1e-9, acceleration: -1.0, jerk: 0.0 };
        assert_eq!(flight.follow(1.0), AfterImpact::Flight);
        let leaving = Rebound { speed: 1e-9, rebound: 0.0, acceleration: 1.0, jerk: 0.0 };
        assert_eq!(leaving.follow(1.0), AfterImpact::Flight);
    }
}
