//! Flights through impacts of one orbit.
//!
//! One idea: a simulator hands over its motion, and takes it back where the common kind of leaps
//! and impacts ends.

use super::extended::Extended;
use super::impacts::{Company, Impacts, Progress, Run, SURFACE, Timing};
use super::surface::SurfaceTables;
use crate::flow::AffineLeaps;
use crate::hybrid::motion::{Left, Motion};
use crate::hybrid::passage::Heading;
use crate::hybrid::simulator::Stop;
use crate::hybrid::trajectory::{Event, EventKind};
use crate::numeric::Real;

/// The harmonics of one orbit, and who takes its events.
pub(super) struct Alone<'t, S: Real> {
    pub(super) extended: &'t mut Extended<S>,
    pub(super) record: &'t mut dyn FnMut(Event<S>),
}

impl<S: Real> Alone<'_, S> {
    /// Flies to the horizon, or to an impact that is another matter; `None` where the next leap is,
    /// and for systems but of one mass or two under one force. `period` is that of the phase.
    pub(super) fn fly(
        self,
        leaps: &AffineLeaps<S>,
        surface: &SurfaceTables<S>,
        motion: &mut Motion<S>,
        horizon: S,
        period: S,
    ) -> Option<Stop<S>> {
        let states = self.extended.states();
        let mut run = Run {
            leaps,
            surface,
            company: self,
            state: &mut motion.state,
            progress: Progress {
                time: motion.time,
                turns: S::from_f64(motion.turns as f64),
                leaving: motion.leaving[SURFACE].is_some(),
                rounding: motion.leaving[SURFACE].unwrap_or(S::zero()),
            },
            timing: Timing {
                horizon,
                period,
                reference: motion.reference_phase,
                time_scale: motion.last_step,
            },
            wanted: true,
        };
        let left = match states {
            2 => S::dispatch_loops(Impacts::<_, _, 2, 5, 1>(&mut run)),
            4 => S::dispatch_loops(Impacts::<_, _, 4, 7, 2>(&mut run)),
            _ => return None,
        };
        let progress = run.progress;
        motion.time = progress.time;
        motion.turns = progress.turns.to_f64() as i64;
        motion.leaving[SURFACE] = progress.leaving.then_some(progress.rounding);
        if left.flown {
            motion.headings[SURFACE] = Heading::Unknown;
        }
        match left {
            Left { contact: true, .. } => Some(Stop::Contact { surface: SURFACE }),
            Left { open: true, .. } => None,
            _ => Some(Stop::Horizon),
        }
    }
}

impl<S: Real> Company<S> for Alone<'_, S> {
    #[inline(always)]
    fn harmonic(&mut self, phase: S, reference: S, _: bool) -> [S; 2] {
        self.extended.go_to_phase(phase, reference);
        self.extended.first()
    }

    #[inline(always)]
    fn record(&mut self, _: bool, time: S, speed: S, rebound: S) {
        (self.record)(Event {
            time,
            surface: SURFACE,
            kind: EventKind::Impact { speed, rebound },
        });
    }
}
