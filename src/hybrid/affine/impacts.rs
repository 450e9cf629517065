//! Free flights from impact to impact, all in one kernel.
//!
//! One idea: where contacts alone are asked for, at one rigid surface at rest, most leaps are quiet or end with a contact that
//! control points tell of (`contacts`), and most impacts send the state away again. These are one piece of code on numbers in fixed
//! places; what is anything else is left to the general way, from where it begins.

use super::contacts::{Contacts, FirstContact};
use super::extended::Extended;
use super::surface::{FixedSurface, SurfaceTables};
use crate::flow::{AffineLeaps, FixedLeaps, FixedVisit};
use crate::hybrid::chatter::Rebound;
use crate::hybrid::landing::REDUCED;
use crate::hybrid::motion::Motion;
use crate::hybrid::passage::Heading;
use crate::hybrid::response::PASSES;
use crate::hybrid::simulator::Stop;
use crate::hybrid::trajectory::{Event, EventKind};
use crate::numeric::{Kernel, Real, widest};

/// The surface at which impacts are flown.
const SURFACE: usize = 0;

/// Most leaps of a run.
const MAX_LEAPS: usize = 1000;

/// What a run of free flights and impacts is given.
pub(super) struct Run<'t, S: Real> {
    pub(super) extended: &'t mut Extended<S>,
    pub(super) motion: &'t mut Motion<S>,
    pub(super) horizon: S,
    /// Period of the phase.
    pub(super) period: S,
    pub(super) record: &'t mut dyn FnMut(Event<S>),
}

impl<'t, S: Real> Run<'t, S> {
    /// Flies to the horizon, or to an impact that is another matter; `None` where the next leap is, and for systems but of
    /// one mass or two under one force.
    pub(super) fn fly(
        self,
        leaps: &'t AffineLeaps<S>,
        surface: &'t SurfaceTables<S>,
    ) -> Option<Stop<S>> {
        let run = self;
        match run.extended.states() {
            2 => widest(Impacts::<S, 2, 5, 1> {
                leaps,
                surface,
                run,
            }),
            4 => widest(Impacts::<S, 4, 7, 2> {
                leaps,
                surface,
                run,
            }),
            _ => None,
        }
    }
}

/// A run of a system of as many states and columns.
struct Impacts<'t, S: Real, const STATES: usize, const C: usize, const B: usize> {
    leaps: &'t AffineLeaps<S>,
    surface: &'t SurfaceTables<S>,
    run: Run<'t, S>,
}

/// A run under way.
struct Flying<'t, S: Real, const STATES: usize, const C: usize, const B: usize> {
    leaps: FixedLeaps<'t, AffineLeaps<S>, C, B>,
    surface: FixedSurface<'t, S, C, B>,
    phase_rate: S,
    run: Run<'t, S>,
}

/// The moving point.
struct Point<S, const STATES: usize, const C: usize> {
    states: [S; STATES],
    phase: S,
    extended: [S; C],
    time: S,
    turns: i64,
    /// Rounding of the gap where the surface has just been left.
    leaving: Option<S>,
}

/// How a leap ends.
#[derive(PartialEq)]
enum Flown {
    Quiet,
    Contact,
}

impl<S: Real, const STATES: usize, const C: usize, const B: usize> Kernel
    for Impacts<'_, S, STATES, C, B>
{
    type Output = Option<Stop<S>>;

    #[inline(always)]
    fn run(self) -> Option<Stop<S>> {
        let flying = Flying::<S, STATES, C, B> {
            leaps: FixedLeaps::new(self.leaps)?,
            surface: FixedSurface::new(self.surface)?,
            phase_rate: self.leaps.phase_rate(),
            run: self.run,
        };
        flying.fly()
    }
}

impl<S: Real, const STATES: usize, const C: usize, const B: usize> Flying<'_, S, STATES, C, B> {
    #[inline(always)]
    fn fly(mut self) -> Option<Stop<S>> {
        let motion = &*self.run.motion;
        let phase = *motion.state.get(STATES)?;
        self.run.extended.go_to_phase(phase, motion.reference_phase);
        let mut point = Point {
            states: *motion.state.first_chunk()?,
            phase,
            extended: *self.run.extended.values.first_chunk()?,
            time: motion.time,
            turns: motion.turns,
            leaving: motion.leaving[SURFACE],
        };
        let mut stop = None;
        let mut flown = 0;
        while flown < MAX_LEAPS {
            if point.time >= self.run.horizon {
                stop = Some(Stop::Horizon);
                break;
            }
            let Some(end) = self.leap(&mut point) else {
                break;
            };
            flown += 1;
            if end == Flown::Contact && !self.impact(&mut point) {
                stop = Some(Stop::Contact { surface: SURFACE });
                break;
            }
        }
        let motion = self.run.motion;
        motion.state[..STATES].copy_from_slice(&point.states);
        motion.state[STATES] = point.phase;
        (motion.time, motion.turns) = (point.time, point.turns);
        motion.leaving[SURFACE] = point.leaving;
        if flown > 0 {
            motion.headings[SURFACE] = Heading::Unknown;
        }
        stop
    }

    /// Puts the extended state to the present state.
    #[inline(always)]
    fn extend(&mut self, point: &mut Point<S, STATES, C>) {
        if self
            .run
            .extended
            .go_to_phase(point.phase, self.run.motion.reference_phase)
        {
            let harmonics = &self.run.extended.values[STATES..C];
            point.extended[STATES..].copy_from_slice(harmonics);
        }
        point.extended[..STATES].copy_from_slice(&point.states);
    }

    /// A leap to the contact or to the horizon; `None` where control points do not decide.
    #[inline(always)]
    fn leap(&mut self, point: &mut Point<S, STATES, C>) -> Option<Flown> {
        let longest = self.run.horizon - point.time;
        self.extend(point);
        let mut visit = FixedVisit::none();
        let quiet = longest.min(self.leaps.span());
        let FirstContact { time, met, open } = Contacts {
            leaps: &self.leaps,
            extended: &point.extended,
            until: quiet,
            visit: &mut visit,
        }
        .first(true, point.leaving.is_some());
        if open {
            return None;
        }
        let contact = met.then_some(time);
        let start = self.leaps.go_to(time.to_f64(), &point.extended, &mut visit);
        point.states = self.leaps.states_at(time - start, &visit);
        point.phase = self.phase_rate.mul_add(time, point.phase);
        point.time = if time == longest {
            self.run.horizon
        } else {
            point.time + time
        };
        if contact.is_some() {
            self.settle(point);
        }
        if time > S::zero() {
            self.tidy(point, contact.is_some());
        }
        Some(match contact {
            Some(_) => Flown::Contact,
            None => Flown::Quiet,
        })
    }

    /// Brings the state onto the surface that it has landed beside.
    #[inline(always)]
    fn settle(&mut self, point: &mut Point<S, STATES, C>) {
        self.extend(point);
        let landing = self.surface.contact.times(&point.extended);
        let landing = landing.as_flattened();
        let (value, slope) = (landing[0], landing[1]);
        if value == S::zero() || slope >= S::zero() {
            return;
        }
        let shift = -value / slope;
        let beside = (point.states, point.phase);
        for (state, &rate) in point.states.iter_mut().zip(&landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        point.phase = self.phase_rate.mul_add(shift, point.phase);
        let after = self.gap(point).abs();
        if after <= value.abs() * S::from_f64(REDUCED) {
            point.time += shift;
        } else {
            (point.states, point.phase) = beside;
        }
    }

    #[inline(always)]
    fn gap(&self, point: &Point<S, STATES, C>) -> S {
        self.surface.all.clearance(&point.states).gap
    }

    /// Forgets that the surface was left where it is no longer near, and keeps the phase near its reference.
    #[inline(always)]
    fn tidy(&mut self, point: &mut Point<S, STATES, C>, is_contact: bool) {
        if let Some(rounding) = point.leaving
            && !is_contact
            && self.gap(point).abs() > rounding
        {
            point.leaving = None;
        }
        let period = self.run.period;
        let half = period * S::from_f64(0.5);
        while point.phase - self.run.motion.reference_phase >= half {
            point.phase -= period;
            point.turns += 1;
        }
    }

    /// Applies the reset; `false` where more follows than a free flight, the state as it was.
    #[inline(always)]
    fn impact(&mut self, point: &mut Point<S, STATES, C>) -> bool {
        self.extend(point);
        let speed = -self.surface.sense(&point.extended).velocity;
        let image = self.surface.reset.times(&point.extended);
        let mut states = point.states;
        states.copy_from_slice(&image.as_flattened()[..STATES]);
        let mut extended = point.extended;
        extended[..STATES].copy_from_slice(&states);
        let after = self.surface.sense(&extended);
        let rebound = Rebound::new(speed, &after);
        let passes = after.velocity < -speed.abs() * S::from_f64(PASSES);
        if !rebound.flies_on(!passes, self.run.motion.last_step) {
            return false;
        }
        (self.run.record)(Event {
            time: point.time,
            surface: SURFACE,
            kind: EventKind::Impact {
                speed,
                rebound: after.velocity,
            },
        });
        point.states = states;
        let residual = after.gap.abs() * S::from_f64(4.0);
        point.leaving = Some(after.rounding.max(residual));
        true
    }
}

#[cfg(test)]
mod tests;
