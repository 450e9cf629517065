//! What the control points of one gap on one piece of a span tell of its events.
//!
//! One idea: no event, or exactly one zero or one extremum, which is found; anything else is left open.

use super::newton::{GapCourse, Turn};
use super::polygon::{Piece, Polygon, Shape, Zeros};
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
    pub(super) polygon: Polygon<'t>,
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
        if let Goal::Crossing { near } = self.goal {
            if near <= S::zero() {
                match self.polygon.zeros(self.start.is_on_zero()) {
                    Zeros::None => return Some(Found::quiet(Heading::Unknown)),
                    Zeros::OneFall { place } => return self.contact(place),
                    Zeros::Unknown => {}
                }
            } else if near.is_finite() && self.polygon.is_above(near.to_f64()) {
                return Some(Found::quiet(Heading::Unknown));
            }
        }
        let shape = self.polygon.shape(self.start.rose());
        match shape {
            Shape::Unknown => None,
            Shape::Valley { place } => self.valley(place),
            Shape::Rising | Shape::Hill if self.start.fell() => None,
            Shape::Rising => Some(Found::quiet(Heading::Rising)),
            Shape::Hill | Shape::Falling => self.fall(shape),
        }
    }

    /// A gap that falls at the end.
    #[inline(always)]
    fn fall(self, shape: Shape) -> Option<Found<S>> {
        let course = match shape {
            Shape::Hill => Course::Hill,
            _ => Course::Straight(Heading::Falling),
        };
        let passage = None;
        match (self.goal, self.polygon.ends_above()) {
            (Goal::Minima, _) | (_, Some(true)) => Some(Found { course, passage }),
            _ => match self.polygon.zeros(self.start.is_on_zero()) {
                Zeros::OneFall { place } => self.contact(place),
                _ => None,
            },
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
        let near = self.polygon.fall_before(minimum, piece)?;
        let (time, found) = self.gap.fall(near, true);
        (found && time >= S::from_f64(self.from) && time <= minimum.time).then_some(time)
    }

    /// A time of the span from a share of the piece.
    fn time(&self, share: f64) -> f64 {
        self.from + share * self.gap.leaps.piece()
    }
}
