//! What the control points of one gap on one piece of a span tell of its events.
//!
//! One idea: no event, or exactly one zero or one extremum, which is found; anything else is left
//! open.

use super::newton::{GapCourse, Turn};
use super::polygon::{Piece, Polygon};
use crate::flow::{AffineLeaps, LeapTables};
use crate::hybrid::passage::{Goal, Heading, Passage, Start};
use crate::numeric::Real;

/// Which way a gap goes on a piece.
#[derive(Clone, Copy, Debug)]
pub(super) enum Course<S> {
    /// One way, or not known.
    Straight(Heading),
    /// It falls before this time and rises after, for so long at least.
    Valley { minimum: S, rises_for: S },
    /// It rises first and falls at the end.
    Hill,
}

/// What was found of a gap on a piece.
pub(super) struct Found<S> {
    pub(super) course: Course<S>,
    pub(super) passage: Option<Passage<S>>,
}

impl<S> Found<S> {
    pub(super) fn quiet(heading: Heading) -> Self {
        Self {
            course: Course::Straight(heading),
            passage: None,
        }
    }
}

/// A look at one gap on one piece.
pub(super) struct Look<'t, S: Real> {
    pub(super) polygon: Polygon<'t, f64>,
    pub(super) start: Start<S>,
    pub(super) goal: Goal<S>,
    pub(super) gap: GapCourse<'t, AffineLeaps<S>>,
    /// Start of the piece.
    pub(super) from: f64,
    /// The time up to which events are of interest.
    pub(super) until: S,
}

impl<S: Real> Look<'_, S> {
    #[inline(always)]
    pub(super) fn found(self) -> Option<Found<S>> {
        let polygon = self.polygon;
        if let Goal::Crossing { near } = self.goal {
            if near <= S::zero() {
                let on_zero = self.start.is_on_zero();
                if polygon.is_above(0.0, on_zero) {
                    return Some(Found::quiet(Heading::Unknown));
                }
                let fall = polygon.one_fall(on_zero);
                if fall.exists {
                    return self.contact(polygon.fall(&fall));
                }
            } else if near.is_finite() && polygon.is_above(near.to_f64(), false) {
                return Some(Found::quiet(Heading::Unknown));
            }
        }
        let shape = polygon.shape(self.start.rose());
        match (shape.falls, shape.turns) {
            _ if !shape.known => None,
            (true, true) => self.valley(polygon.turn(&shape)),
            (false, _) if self.start.fell() => None,
            (false, false) => Some(Found::quiet(Heading::Rising)),
            (false, true) => self.fall(Course::Hill),
            (true, false) => self.fall(Course::Straight(Heading::Falling)),
        }
    }

    /// A gap that falls at the end.
    #[inline(always)]
    fn fall(self, course: Course<S>) -> Option<Found<S>> {
        let polygon = self.polygon;
        let [_, ends_above] = polygon.ends_above();
        if self.goal == Goal::Minima || ends_above {
            let passage = None;
            return Some(Found { course, passage });
        }
        let fall = polygon.one_fall(self.start.is_on_zero());
        match fall.exists {
            true => self.contact(polygon.fall(&fall)),
            false => None,
        }
    }

    /// The one contact of the piece.
    #[inline(always)]
    fn contact(mut self, place: f64) -> Option<Found<S>> {
        let near = self.time(place);
        // A contact that lies later need not be found; the motion there is asked for in any case.
        if near > self.until.to_f64() && self.gap.value(self.until, true) > S::zero() {
            return Some(Found::quiet(Heading::Unknown));
        }
        let (time, found) = self.gap.fall(near, true);
        found.then_some(Found {
            course: Course::Straight(Heading::Unknown),
            passage: Some(Passage::Crossing { time }),
        })
    }

    /// A gap with one extremum, a minimum: that, or the contact before it.
    #[inline(always)]
    fn valley(mut self, place: f64) -> Option<Found<S>> {
        let turn = self.gap.turn(self.time(place), true);
        let from = S::from_f64(self.from);
        let end = from + S::from_f64(self.gap.leaps.piece());
        if !turn.found || turn.time < from || turn.time > end {
            return None;
        }
        match self.start {
            Start::Inside { before, within }
                if before == Heading::Rising && turn.time - from < within =>
            {
                return Some(Found::quiet(Heading::Rising));
            }
            Start::Leaving { rounding } if self.goal != Goal::Minima || turn.gap >= -rounding => {
                return None;
            }
            _ => {}
        }
        let passage = match self.goal {
            Goal::Crossing { .. } if turn.gap < S::zero() => {
                let time = self.contact_before(&turn)?;
                Some(Passage::Crossing { time })
            }
            goal => goal.admits(turn.gap).then_some(Passage::Minimum {
                time: turn.time,
                gap: turn.gap,
            }),
        };
        Some(Found {
            course: Course::Valley {
                minimum: turn.time,
                rises_for: turn.rises_for,
            },
            passage,
        })
    }

    /// Where a gap fell through zero before its minimum.
    #[inline(always)]
    fn contact_before(&mut self, minimum: &Turn<S>) -> Option<S> {
        let piece = Piece {
            from: self.from,
            length: self.gap.leaps.piece(),
            reach: self.gap.leaps.reach().to_f64(),
        };
        let (near, known) = self.polygon.fall_before(minimum, piece, true);
        let (time, found) = self.gap.fall(near, known);
        (found && time >= S::from_f64(self.from) && time <= minimum.time).then_some(time)
    }

    /// A time of the span from a share of the piece.
    fn time(&self, share: f64) -> f64 {
        self.from + share * self.gap.leaps.piece()
    }
}
