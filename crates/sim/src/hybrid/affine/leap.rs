//! Free flight to the next event over a span of several steps.
//!
//! One idea: the control points of every gap on one piece after another say that there is no event,
//! or that there is exactly one zero or one extremum, which is found there; what they leave open is
//! left to the general search, from the start of that piece.

use super::look::{Course, Found, Look};
use super::newton::{GapCourse, NodeVisit};
use super::polygon::{Polygon, ROUNDING};
use crate::flow::{AffineLeaps, LeapTables};
use crate::hybrid::passage::{Goal, Heading, Passage, Start};
use crate::hybrid::simulator::Stop;
use crate::numeric::{Kernel, Real};

/// Where a leap ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::hybrid) struct Leap<S> {
    /// Time flown.
    pub(in crate::hybrid) time: S,
    pub(in crate::hybrid) end: LeapEnd<S>,
}

/// Why a leap ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::hybrid) enum LeapEnd<S> {
    /// The time asked for, or the whole span where that is longer.
    Quiet,
    /// An event.
    Stop(Stop<S>),
    /// Nothing happened so far; what follows must be searched.
    Open,
}

/// What is asked of the gap of one surface.
#[derive(Clone, Copy, Debug)]
pub(in crate::hybrid) struct Asked<S> {
    /// Nothing for a surface that is flown through.
    pub(in crate::hybrid) goal: Option<Goal<S>>,
    pub(in crate::hybrid) start: Start<S>,
    /// Whether the flight stops at its minima.
    pub(in crate::hybrid) stops: bool,
}

impl<S: Real> Asked<S> {
    fn nothing() -> Self {
        let (before, within) = (Heading::Unknown, S::zero());
        Self {
            goal: None,
            start: Start::Inside { before, within },
            stops: false,
        }
    }
}

/// Working memory of leaps.
#[derive(Clone, Debug)]
pub(super) struct LeapBuffers<S: Real> {
    pub(super) visit: NodeVisit<AffineLeaps<S>>,
    pub(super) control: Vec<f64>,
    /// Per surface the rounding of the control points of its gap.
    pub(super) rounding: Vec<f64>,
    /// Per surface.
    pub(super) asked: Vec<Asked<S>>,
    /// Per surface the course of its gap on the present piece.
    courses: Vec<Course<S>>,
}

impl<S: Real> LeapBuffers<S> {
    pub(super) fn new(leaps: &AffineLeaps<S>, columns: usize, surfaces: usize) -> Self {
        Self {
            visit: NodeVisit::new(leaps, columns),
            control: vec![0.0; leaps.points()],
            rounding: vec![0.0; surfaces],
            asked: vec![Asked::nothing(); surfaces],
            courses: vec![Course::Straight(Heading::Unknown); surfaces],
        }
    }
}

/// A leap to be flown.
pub(super) struct Leaper<'t, S: Real> {
    pub(super) leaps: &'t AffineLeaps<S>,
    pub(super) extended: &'t [S],
    pub(super) buffers: &'t mut LeapBuffers<S>,
    /// The longest flight asked for.
    pub(super) longest: S,
    /// Per surface which way its gap goes where the leap ends.
    pub(super) headings: &'t mut [Heading],
    /// Minima at which the flight does not stop: time, surface, gap.
    pub(super) misses: &'t mut Vec<(S, usize, S)>,
    /// Where the states after the leap go.
    pub(super) states: &'t mut [S],
}

impl<S: Real> Kernel for Leaper<'_, S> {
    type Output = Leap<S>;

    #[inline(always)]
    fn run(mut self) -> Leap<S> {
        for (surface, rounding) in self.buffers.rounding.iter_mut().enumerate() {
            *rounding = ROUNDING * self.leaps.size(surface, self.extended);
        }
        self.buffers.visit.forget();
        let leap = self.fly();
        let visit = &mut self.buffers.visit;
        visit.states_at(leap.time, true, self.leaps, self.extended, self.states);
        leap
    }
}

impl<S: Real> Leaper<'_, S> {
    #[inline(always)]
    fn fly(&mut self) -> Leap<S> {
        let quiet = self.longest.min(self.leaps.span());
        for piece in 0..self.leaps.pieces() {
            let start = self.leaps.piece() * piece as f64;
            if start >= quiet.to_f64() {
                break;
            }
            let end = start + self.leaps.piece();
            let Some(leap) = self.piece(piece, quiet) else {
                return Leap {
                    time: self.leaps.node(start).1,
                    end: LeapEnd::Open,
                };
            };
            if leap.end != LeapEnd::Quiet || end >= quiet.to_f64() {
                self.turn_at(leap.time);
                return leap;
            }
            self.go_on();
        }
        Leap {
            time: quiet,
            end: LeapEnd::Quiet,
        }
    }

    /// The first event on a piece before a time, or that time; `None` where a gap must be searched.
    #[inline(always)]
    fn piece(&mut self, piece: usize, quiet: S) -> Option<Leap<S>> {
        let known = self.misses.len();
        let mut first = Leap {
            time: quiet,
            end: LeapEnd::Quiet,
        };
        for surface in 0..self.buffers.asked.len() {
            let Some(found) = self.look(surface, piece, quiet) else {
                self.misses.truncate(known);
                return None;
            };
            self.buffers.courses[surface] = found.course;
            let stop = match found.passage {
                Some(Passage::Minimum { gap, .. }) if self.buffers.asked[surface].stops => {
                    let rises_for = match found.course {
                        Course::Valley { rises_for, .. } => rises_for,
                        _ => S::zero(),
                    };
                    Stop::Minimum { gap, rises_for }
                }
                Some(Passage::Minimum { time, gap }) => {
                    self.misses.push((time, surface, gap));
                    continue;
                }
                Some(Passage::Crossing { .. }) => Stop::Contact { surface },
                None => continue,
            };
            let time = found.passage.map_or(quiet, |passage| passage.time());
            let is_first = match first.end {
                LeapEnd::Quiet => time <= first.time,
                _ => time < first.time,
            };
            if is_first {
                let end = LeapEnd::Stop(stop);
                first = Leap { time, end };
            }
        }
        if self.misses.len() > known {
            self.misses.retain(|miss| miss.0 <= first.time);
        }
        Some(first)
    }

    /// What the control points of a gap on a piece tell of its events; `None` where that is not
    /// enough.
    #[inline(always)]
    fn look(&mut self, surface: usize, piece: usize, until: S) -> Option<Found<S>> {
        let Asked { goal, start, .. } = self.buffers.asked[surface];
        let Some(goal) = goal else {
            return Some(Found::quiet(Heading::Unknown));
        };
        let LeapBuffers {
            control,
            rounding,
            visit,
            ..
        } = &mut *self.buffers;
        self.leaps.look(surface, piece, self.extended, control);
        let look = Look {
            polygon: Polygon {
                points: control,
                rounding: rounding[surface],
            },
            start,
            goal,
            gap: GapCourse {
                leaps: self.leaps,
                extended: self.extended,
                surface,
                visit,
            },
            from: self.leaps.piece() * piece as f64,
            until,
        };
        look.found()
    }

    /// Which way the gaps go at a time of the present piece.
    #[inline(always)]
    fn turn_at(&mut self, time: S) {
        for surface in 0..self.buffers.asked.len() {
            self.headings[surface] = match self.buffers.courses[surface] {
                Course::Straight(heading) => heading,
                Course::Valley { minimum, .. } => Heading::falling(time < minimum),
                Course::Hill => {
                    let mut gap = GapCourse {
                        leaps: self.leaps,
                        extended: self.extended,
                        surface,
                        visit: &mut self.buffers.visit,
                    };
                    Heading::falling(gap.slope(time, true) < S::zero())
                }
            };
        }
    }

    /// Goes to the start of the next piece.
    #[inline(always)]
    fn go_on(&mut self) {
        let within = S::zero();
        let LeapBuffers { asked, courses, .. } = &mut *self.buffers;
        let surfaces = asked.iter_mut().zip(courses).zip(&mut *self.headings);
        for ((asked, course), heading) in surfaces {
            let before = match *course {
                Course::Straight(heading) => heading,
                Course::Valley { .. } => Heading::Rising,
                Course::Hill => Heading::Falling,
            };
            asked.start = Start::Inside { before, within };
            *heading = before;
        }
    }
}
