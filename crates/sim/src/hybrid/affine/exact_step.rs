//! Exact steps: free flight to the next event over a span of several Taylor steps, and backward to
//! the zero or the minimum of a gap; for one orbit, or for several in lanes.
//!
//! One idea: the control points of every gap, on one piece after another, show that there is no
//! event, or that there is exactly one zero or one extremum, which is then located. Undecided cases
//! are left to the general search, from the start of that piece. Lanes share steps, not times: each
//! lane has its own time and its own event, and a lane that is done on a piece waits for the
//! others.

use num_traits::Zero as _;

use super::enclosure::{Course, EnclosureTest, Found, WatchedGap};
use super::polygon::{Polygon, ROUNDING};
use super::zeros::{GapCourse, NodeVisit, is_convex};
use crate::flow::{Backend, NumberMask, RoundedNumber, SpanTables};
use crate::hybrid::motion::SAME_MINIMUM;
use crate::hybrid::passage::{Back, MinimumLog, Stop};
use crate::numeric::{Branched, Mask, Real, Scalar, Vectorised};

/// End of an exact step: the first event, or the longest time asked for, or the end of the span,
/// whichever comes first.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExactStep<S: Branched> {
    /// Time flown.
    pub(super) time: S,
    /// Masks: the step ends with a contact; the step ends at a minimum.
    pub(super) contact: S::Mask,
    pub(super) minimum: S::Mask,
    /// Number of the surface.
    pub(super) surface: S::Rounded,
    /// Gap at the minimum, and the time for which the gap is known to rise from there: with several
    /// surfaces 0, because another one may act before.
    pub(super) gap: S,
    pub(super) rises_for: S,
    /// Mask: nothing happened so far, and a general search must follow.
    pub(super) undecided: S::Mask,
}

impl<S: Real> ExactStep<S> {
    /// Event at the end of the step.
    #[inline(always)]
    pub(super) fn stop(&self) -> Option<Stop<S>> {
        let (surface, gap, rises_for) = (self.surface as usize, self.gap, self.rises_for);
        match (self.contact, self.minimum) {
            (true, _) => Some(Stop::Contact { surface }),
            (_, true) => Some(Stop::Minimum { gap, rises_for }),
            _ => None,
        }
    }
}

impl<S: Branched> ExactStep<S> {
    #[inline(always)]
    fn until(time: S) -> Self {
        Self {
            time,
            contact: S::Mask::NONE,
            minimum: S::Mask::NONE,
            surface: S::Rounded::zero(),
            gap: time,
            rises_for: S::zero(),
            undecided: S::Mask::NONE,
        }
    }

    /// Takes the event of a surface in the wanted lanes.
    #[inline(always)]
    fn take(&mut self, wanted: S::Mask, surface: usize, found: &Found<S>) {
        let surface = S::Rounded::from_f64(surface as f64);
        self.time = S::select(wanted, found.time, self.time);
        self.contact = (self.contact & !wanted) | (found.contact & wanted);
        self.minimum = (self.minimum & !wanted) | (found.minimum & wanted);
        self.surface = S::Rounded::select(wanted, surface, self.surface);
        self.gap = S::select(wanted, found.gap, self.gap);
        self.rises_for = S::select(wanted, found.rises_for, self.rises_for);
    }

    /// Ends the undecided lanes at a time, without an event.
    #[inline(always)]
    fn leave_undecided(&mut self, undecided: S::Mask, time: S) {
        self.time = S::select(undecided, time, self.time);
        self.contact &= !undecided;
        self.minimum &= !undecided;
        self.undecided |= undecided;
    }
}

/// Working memory of exact steps.
#[derive(Clone, Debug)]
pub(super) struct StepBuffers<B: Backend> {
    pub(super) visit: NodeVisit<B>,
    control: Vec<RoundedNumber<B>>,
    /// One entry per surface.
    pub(super) gaps: Vec<WatchedGap<B::Number>>,
}

impl<B: Backend> StepBuffers<B> {
    pub(super) fn new(tables: &SpanTables<B>) -> Self {
        Self {
            visit: NodeVisit::new(tables),
            control: vec![RoundedNumber::<B>::zero(); tables.points()],
            gaps: vec![WatchedGap::unasked(); tables.watches()],
        }
    }
}

/// An exact step that is about to be taken.
pub(super) struct Stepper<'t, B: Backend, L> {
    pub(super) tables: &'t SpanTables<B>,
    pub(super) extended: &'t [B::Number],
    /// Conditions of the search for each gap; after the step, the headings at its end.
    pub(super) buffers: &'t mut StepBuffers<B>,
    /// Mask: the headings after the longest time are needed.
    pub(super) going_on: NumberMask<B>,
    /// Longest flight.
    pub(super) longest: B::Number,
    pub(super) log: L,
}

impl<B: Backend, L: MinimumLog<B::Number>> Stepper<'_, B, L> {
    /// Flies to the first event, or for the longest time.
    #[inline(always)]
    pub(super) fn fly(&mut self) -> ExactStep<B::Number> {
        let quiet = self.longest.min(self.tables.span());
        let mut step = ExactStep::until(quiet);
        let mut going = self.start();
        for piece in 0..self.tables.pieces() {
            let length = self.tables.piece();
            let from = length * RoundedNumber::<B>::from_f64(piece as f64);
            going &= from.is_below(quiet.rounded());
            if !going.any() {
                break;
            }
            let undecided = self.first_event(piece, from, quiet, going, &mut step);
            if undecided.any() {
                let (_, start) = self.tables.node(from);
                step.leave_undecided(undecided, start);
                going &= !undecided;
                if !going.any() {
                    break;
                }
            }
            let met = step.contact | step.minimum;
            let goes_on = going & !met & (from + length).is_below(quiet.rounded());
            self.turn(going, going & !goes_on, step.time);
            going = goes_on;
        }
        if self.buffers.gaps.len() > 1 {
            step.rises_for = B::Number::zero();
        }
        step
    }

    /// Prepares the gaps for a flight; returns the mask of lanes in which a gap is tested.
    #[inline(always)]
    fn start(&mut self) -> NumberMask<B> {
        self.buffers.visit.forget();
        let within = B::Number::from_f64(SAME_MINIMUM) * self.tables.time_scale();
        let mut wanted = NumberMask::<B>::NONE;
        for (surface, gap) in self.buffers.gaps.iter_mut().enumerate() {
            let size = self.tables.size(surface, self.extended);
            gap.rounding = RoundedNumber::<B>::from_f64(ROUNDING) * size;
            gap.within = within;
            wanted |= gap.wanted;
        }
        wanted
    }

    /// Enters the first event on a piece into a step that has none so far. Returns the mask of
    /// undecided lanes, in which the event does not count.
    #[inline(always)]
    fn first_event(
        &mut self,
        piece: usize,
        from: RoundedNumber<B>,
        quiet: B::Number,
        going: NumberMask<B>,
        step: &mut ExactStep<B::Number>,
    ) -> NumberMask<B> {
        let (mut undecided, mut passed) = (NumberMask::<B>::NONE, NumberMask::<B>::NONE);
        for surface in 0..self.buffers.gaps.len() {
            let gap = &mut self.buffers.gaps[surface];
            let wanted = going & gap.wanted & !undecided;
            if !wanted.any() {
                (gap.course, gap.passed) = (Course::unknown(quiet), NumberMask::<B>::NONE);
                continue;
            }
            let found = self.test(surface, piece, from, quiet, wanted);
            let gap = &mut self.buffers.gaps[surface];
            gap.course = found.course;
            gap.passed = found.minimum & !gap.stops;
            if gap.passed.any() {
                (gap.passed_time, gap.passed_gap) = (found.time, found.gap);
                passed |= gap.passed;
            }
            undecided |= found.undecided;
            let stops = (found.contact | (found.minimum & gap.stops)) & !found.undecided;
            if !stops.any() {
                continue;
            }
            let has_none = !(step.contact | step.minimum);
            let is_first =
                found.time.is_below(step.time) | (has_none & found.time.is_equal(step.time));
            // NOTE: a branch, so that one orbit does not wait for the comparison of the times.
            let taken = stops & is_first;
            if taken.any() {
                step.take(taken, surface, &found);
            }
        }
        if (passed & !undecided).any() {
            for (surface, gap) in self.buffers.gaps.iter().enumerate() {
                let in_time = gap.passed_time.is_at_most(step.time);
                let missed = gap.passed & !undecided & in_time;
                self.log.miss(missed, surface, gap.passed_time, gap.passed_gap);
            }
        }
        undecided
    }

    /// Tests a gap on a piece by its control points.
    #[inline(always)]
    fn test(
        &mut self,
        surface: usize,
        piece: usize,
        from: RoundedNumber<B>,
        until: B::Number,
        wanted: NumberMask<B>,
    ) -> Found<B::Number> {
        let StepBuffers { control, visit, gaps } = &mut *self.buffers;
        let (tables, extended, watched) = (self.tables, self.extended, &gaps[surface]);
        tables.control_points(surface, piece, extended, control);
        let mut test = EnclosureTest {
            polygon: Polygon { points: control, rounding: watched.rounding },
            watched,
            gap: GapCourse { tables, extended, surface, visit },
            from,
            until,
        };
        test.found(wanted)
    }

    /// Updates the headings of the gaps to those at the end of a piece, or at the time at which the
    /// flight ends.
    #[inline(always)]
    fn turn(&mut self, flown: NumberMask<B>, ends: NumberMask<B>, time: B::Number) {
        let StepBuffers { visit, gaps, .. } = &mut *self.buffers;
        for (surface, gap) in gaps.iter_mut().enumerate() {
            let Course { mut rises, mut falls, turns, lowest } = gap.course;
            let turned = ends & turns;
            let (valley, hill) = (turned & rises, turned & falls & self.going_on);
            // NOTE: a branch, so that one orbit does not wait for the time.
            if valley.any() {
                let before = valley & time.is_below(lowest);
                rises &= !before;
                falls |= before;
            }
            if hill.any() {
                let mut course =
                    GapCourse { tables: self.tables, extended: self.extended, surface, visit };
                let climbs = hill & !course.slope(time, hill).is_below(B::Number::zero());
                rises |= climbs;
                falls &= !climbs;
            }
            gap.rises = (gap.rises & !flown) | (rises & flown);
            gap.falls = (gap.falls & !flown) | (falls & flown);
            gap.leaving &= !flown;
            gap.within = B::Number::zero();
        }
    }
}

/// Free flight backward to the zero or the minimum of a gap that is convex along the way.
///
/// A convex gap that is negative now was zero before, and one that rises now had a minimum before.
/// The search goes as far back as the series about the present time is accurate.
pub(super) struct BackwardStep<'t, B: Backend> {
    pub(super) tables: &'t SpanTables<B>,
    pub(super) extended: &'t [B::Number],
    pub(super) visit: &'t mut NodeVisit<B>,
    pub(super) surface: usize,
    pub(super) goal: Back,
    pub(super) longest: B::Number,
    /// Mask of the lanes that fly.
    pub(super) wanted: NumberMask<B>,
    /// States, overwritten by those at the goal.
    pub(super) states: &'t mut [B::Number],
}

impl<B: Backend> Vectorised for BackwardStep<'_, B> {
    type Output = (B::Number, NumberMask<B>);

    /// Returns the time of the flight, and the mask of lanes in which it is known; writes the
    /// states at the goal.
    #[inline(always)]
    fn run(self) -> (B::Number, NumberMask<B>) {
        let (visit, zero) = (self.visit, B::Number::zero());
        visit.forget();
        let mut gap = GapCourse {
            tables: self.tables,
            extended: self.extended,
            surface: self.surface,
            visit,
        };
        let (start, _) = self.tables.node(zero.rounded());
        let (time, found) = match self.goal {
            Back::ToSurface => {
                let fall = gap.fall_about(start, zero, self.wanted);
                (fall.time, fall.found)
            }
            Back::ToMinimum => {
                let turn = gap.turn_about(start, zero, self.wanted);
                (turn.time, turn.found)
            }
        };
        let series = &gap.visit.series;
        let starts_right = match self.goal {
            Back::ToSurface => series[0].is_below(zero),
            Back::ToMinimum => zero.is_below(series[1]),
        };
        let is_reached = starts_right & time.is_below(zero) & (-time).is_at_most(self.longest);
        let known = found & is_reached & is_convex(series, self.tables.reach().rounded());
        if known.any() {
            visit.states_at(time, known, self.tables, self.extended, self.states);
        }
        (-time, known)
    }
}
