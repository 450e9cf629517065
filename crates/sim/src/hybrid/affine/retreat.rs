//! Free flight backward to where a gap was zero or least, where it is convex along the way.
//!
//! One idea: a convex gap that is negative now was zero once, and one that rises now was least
//! once, as far back as the series about the present goes.

use super::newton::{GapCourse, NodeVisit, is_convex};
use crate::flow::{LeapTables, NumberMask};
use crate::hybrid::backward::Back;
use crate::numeric::{Branched, Kernel, Mask};
use num_traits::Zero as _;

/// A retreat to be flown.
pub(super) struct Retreat<'t, T: LeapTables> {
    pub(super) leaps: &'t T,
    pub(super) extended: &'t [T::Number],
    pub(super) visit: &'t mut NodeVisit<T>,
    pub(super) surface: usize,
    pub(super) goal: Back,
    pub(super) longest: T::Number,
    /// Where it is asked for.
    pub(super) wanted: NumberMask<T>,
    /// Where the states go.
    pub(super) states: &'t mut [T::Number],
}

impl<T: LeapTables> Kernel for Retreat<'_, T> {
    type Output = (T::Number, NumberMask<T>);

    /// The time it takes, and where it is known; the states are those there.
    #[inline(always)]
    fn run(self) -> (T::Number, NumberMask<T>) {
        let (visit, zero) = (self.visit, T::Number::zero());
        visit.forget();
        let mut gap = GapCourse {
            leaps: self.leaps,
            extended: self.extended,
            surface: self.surface,
            visit,
        };
        let (start, _) = self.leaps.node(zero.rounded());
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
        let known = found & is_reached & is_convex(series, self.leaps.reach().rounded());
        if known.any() {
            visit.states_at(time, known, self.leaps, self.extended, self.states);
        }
        (-time, known)
    }
}
