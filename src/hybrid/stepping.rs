//! One step of the simulator: expand, search every watched gap, take the state at the first event.

use super::motion::Motion;
use super::passage::{Gap, Goal, Passage, Start};
use super::simulator::{Approach, Simulator, Stop, SurfaceTools};
use super::system::{HybridSystem, Law, Regime, RegimeField, Watch};
use super::trajectory::{Event, EventKind, Outcome};
use crate::flow::{Integrator, Step, component_step};
use crate::numeric::Real;

impl<S: Real> Simulator<'_, S> {
    /// One Taylor step, cut at the first event.
    pub(super) fn step(
        &mut self,
        horizon: S,
        approach: Approach,
        record: &mut dyn FnMut(Event<S>),
    ) -> Result<Option<Stop<S>>, Outcome<S>> {
        let Self {
            system,
            parameters,
            motion,
            free,
            search,
            found,
            next,
            surfaces,
            near_miss,
            misses,
            ..
        } = self;
        let (integrator, regime) = present(system, motion.regime, free, surfaces);
        let Ok(step) = integrator.step(&motion.state, parameters) else {
            return Err(Outcome::Diverged { time: motion.time });
        };
        let admissible = admissible_length(&step, regime.watches.len());
        motion.last_step = admissible;
        let remaining = horizon - motion.time;
        let mut first = First {
            length: admissible.min(remaining),
            stop: None,
        };
        misses.clear();
        for (index, &watch) in regime.watches.iter().enumerate() {
            let value = step.watched_coefficients(2 * index);
            let slope = step.watched_coefficients(2 * index + 1);
            let (gap, start, goal) = match watch {
                Watch::Gap { surface } => {
                    let Some(goal) = goal(surface, approach, *near_miss) else {
                        continue;
                    };
                    (
                        Gap {
                            value,
                            slope,
                            sign: S::one(),
                        },
                        motion.start(surface),
                        goal,
                    )
                }
                Watch::Release => release_gap(motion, value, slope, first.length),
            };
            found.clear();
            search.search(&gap, first.length, start, goal, found);
            first.take(watch, found, approach, misses);
        }
        let First { length, stop } = first;
        if stop.is_none() && length < remaining && motion.time + length == motion.time {
            return Err(Outcome::Diverged { time: motion.time });
        }
        step.state_at(length, next);
        let whole = length == remaining;
        std::mem::swap(&mut motion.state, next);
        for &(time, surface, gap) in misses.iter().filter(|miss| miss.0 <= length) {
            record(Event {
                time: motion.time + time,
                surface,
                kind: EventKind::NearMiss { gap },
            });
        }
        motion.time = if whole { horizon } else { motion.time + length };
        self.settle(stop, approach);
        Ok(stop)
    }

    /// Updates what is remembered after a step: surfaces left behind, the phase.
    fn settle(&mut self, stop: Option<Stop<S>>, approach: Approach) {
        let motion = &mut self.motion;
        motion.at_minimum = match stop {
            Some(Stop::Minimum { .. }) => approach.stop_at,
            _ => None,
        };
        for (surface, tools) in self.surfaces.iter_mut().enumerate() {
            if let Some(rounding) = motion.leaving[surface]
                && tools
                    .sensor
                    .sense(&motion.state, &self.parameters)
                    .gap
                    .abs()
                    > rounding
            {
                motion.leaving[surface] = None;
            }
        }
        if let Some(phase) = &self.system.phase {
            motion.reduce_phase(phase.component, S::from_dd(phase.period));
        }
    }
}

/// The first event of a step so far.
struct First<S> {
    /// Its time; the end of the step where there is none.
    length: S,
    stop: Option<Stop<S>>,
}

impl<S: Real> First<S> {
    /// Takes over the passages of one watch, all before `length`; minima that do not stop are put to `misses`.
    fn take(
        &mut self,
        watch: Watch,
        found: &[Passage<S>],
        approach: Approach,
        misses: &mut Vec<(S, usize, S)>,
    ) {
        for &passage in found {
            let stop = match (passage, watch) {
                (Passage::Crossing { .. }, Watch::Gap { surface }) => Stop::Contact { surface },
                (Passage::Crossing { .. }, Watch::Release) => Stop::Release,
                (Passage::Minimum { gap, .. }, Watch::Gap { surface })
                    if approach.stop_at == Some(surface) =>
                {
                    Stop::Minimum { gap }
                }
                (Passage::Minimum { time, gap }, Watch::Gap { surface }) => {
                    misses.push((time, surface, gap));
                    continue;
                }
                (Passage::Minimum { .. }, Watch::Release) => continue,
            };
            *self = Self {
                length: passage.time(),
                stop: Some(stop),
            };
            return;
        }
    }
}

/// Length on which the state's and every watched function's polynomial meets the tolerance.
///
/// NOTE: a state at rest on a surface is a polynomial of any length while the force that will release
/// it is not.
pub(super) fn admissible_length<S: Real>(step: &Step<'_, S>, watches: usize) -> S {
    let length = (0..watches).fold(step.length.to_f64(), |length, watch| {
        let value = step.watched_coefficients(2 * watch);
        length.min(component_step(
            |degree| value[degree].magnitude(),
            value.len() - 1,
        ))
    });
    S::from_f64(length)
}

/// The present integrator and what is watched along it.
fn present<'s, 'a, S: Real>(
    system: &'a HybridSystem,
    regime: Regime,
    free: &'s mut Integrator<'a, S>,
    surfaces: &'s mut [SurfaceTools<'a, S>],
) -> (&'s mut Integrator<'a, S>, &'a RegimeField) {
    let (Regime::Contact { surface } | Regime::Stick { surface }) = regime else {
        return (free, &system.free);
    };
    let field = match &system.surfaces[surface].law {
        Law::Rigid { stick, .. } => stick.as_ref(),
        Law::Compliant { contact } => Some(contact),
    };
    match (surfaces[surface].held.as_mut(), field) {
        (Some(held), Some(field)) => (held, field),
        _ => (free, &system.free),
    }
}

fn goal<S: Real>(surface: usize, approach: Approach, near_miss: S) -> Option<Goal<S>> {
    let stops = approach.stop_at == Some(surface);
    if approach.ignored == Some(surface) {
        return stops.then_some(Goal::Minima);
    }
    Some(Goal::Crossing {
        near: if stops {
            S::from_f64(f64::INFINITY)
        } else {
            near_miss
        },
    })
}

/// The release function made positive; its sign is found on the regime's first step.
fn release_gap<'p, S: Real>(
    motion: &mut Motion<S>,
    value: &'p [S],
    slope: &'p [S],
    length: S,
) -> (Gap<'p, S>, Start<S>, Goal<S>) {
    let mut start = Start::Inside;
    if motion.release_sign == S::zero() {
        let size = value
            .iter()
            .rev()
            .fold(S::zero(), |size, c| (size * length).max(c.abs()));
        let rounding = S::from_f64(64.0 * S::ROUNDOFF) * size;
        let on_zero = value[0].abs() <= rounding;
        motion.release_sign = if on_zero {
            slope[0].signum()
        } else {
            value[0].signum()
        };
        start = if on_zero {
            Start::Leaving { rounding }
        } else {
            Start::Inside
        };
    }
    let gap = Gap {
        value,
        slope,
        sign: motion.release_sign,
    };
    (
        gap,
        start,
        Goal::Crossing {
            near: S::from_f64(-1.0),
        },
    )
}
