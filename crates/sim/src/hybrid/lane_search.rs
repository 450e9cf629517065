//! Search of one step in lanes: [`PassageSearch`](super::search::PassageSearch) of several gaps at
//! once.
//!
//! One idea: in nearly all steps a gap turns twice at most, and what follows from that is masked
//! code, with the operations of one number. What is left is searched gap by gap, so that every lane
//! has the bits of the search of one.

use super::lane_motion::LaneStart;
use super::lane_newton::LaneNewton;
use super::lane_stationary::LaneStationary;
use super::passage::{Goal, Heading, Passage, Start};
use super::search::{Gap, PassageSearch, SETTLED};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Scalar, polynomial};

/// Gaps on one step: Taylor coefficients and those of their derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneGap<'p, const N: usize> {
    pub(super) value: &'p [Lanes<N>],
    pub(super) slope: &'p [Lanes<N>],
}

/// What is looked for: [`Goal`] in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneGoal<const N: usize> {
    /// Where minima of any depth are, and crossings are flown through.
    pub(super) minima: LaneMask<N>,
    /// Where minima end the search.
    pub(super) stopping: LaneMask<N>,
    /// The largest gap of a minimum elsewhere, the same in all lanes.
    pub(super) near: f64,
}

/// The first passages of steps that end them.
#[derive(Clone, Copy, Debug)]
pub(super) struct LanePassage<const N: usize> {
    /// When; the lengths of the steps where there is none.
    pub(super) time: Lanes<N>,
    pub(super) minimum: LaneMask<N>,
    pub(super) crossing: LaneMask<N>,
    /// Where there is a minimum before that, and when.
    pub(super) missed: LaneMask<N>,
    pub(super) missed_at: Lanes<N>,
    /// Where the gap falls at the end of a step without a passage.
    pub(super) falls: LaneMask<N>,
}

/// Working memory of the search.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneSearch<const N: usize> {
    stationary: LaneStationary<N>,
    alone: Alone,
}

/// Working memory of the search of one gap.
#[derive(Clone, Debug, Default)]
struct Alone {
    search: PassageSearch,
    value: Vec<f64>,
    slope: Vec<f64>,
    found: Vec<Passage<f64>>,
    /// Minima that do not end the search: lane, time.
    misses: Vec<(usize, f64)>,
}

/// Pieces of steps on which gaps are monotone: [`Piece`](super::search::Piece) in lanes.
#[derive(Clone, Copy)]
struct LanePiece<const N: usize> {
    left: (Lanes<N>, Lanes<N>),
    right: (Lanes<N>, Lanes<N>),
    /// Where there is one.
    exists: LaneMask<N>,
    falls: LaneMask<N>,
    /// Where the right end is a stationary point.
    turns: LaneMask<N>,
}

impl<const N: usize> LaneGap<'_, N> {
    /// Times and gaps where they turn, at places in units of the steps; the ends of the steps where
    /// they do not.
    #[inline(always)]
    fn turn(
        &self,
        place: Lanes<N>,
        turns: LaneMask<N>,
        end: (Lanes<N>, Lanes<N>),
    ) -> (Lanes<N>, Lanes<N>) {
        if !turns.any() {
            return end;
        }
        let time = (place * end.0).min(end.0);
        let value = polynomial::value(self.value, time);
        (
            Lanes::select(turns, time, end.0),
            Lanes::select(turns, value, end.1),
        )
    }
}

impl<const N: usize> LaneSearch<N> {
    /// The first passages of gaps on `[0, length]`.
    #[inline(always)]
    pub(super) fn search(
        &mut self,
        gap: LaneGap<'_, N>,
        length: Lanes<N>,
        start: LaneStart<N>,
        goal: LaneGoal<N>,
        wanted: LaneMask<N>,
    ) -> LanePassage<N> {
        let zero = Lanes::splat(0.0);
        let turning = self.stationary.isolate(gap.slope, length, wanted);
        let first_falls = gap.slope[0].is_below(zero);
        let head = (zero, gap.value[0]);
        let end = (length, polynomial::value(gap.value, length));
        let turns = turning.found;
        let first = gap.turn(turning.places[0], turns[0], end);
        let second = gap.turn(turning.places[1], turns[1], end);
        let (all, none) = (!LaneMask::NONE, LaneMask::NONE);
        let pieces = [
            LanePiece {
                left: head,
                right: first,
                exists: all,
                falls: first_falls,
                turns: turns[0],
            },
            LanePiece {
                left: first,
                right: second,
                exists: turns[0],
                falls: !first_falls,
                turns: turns[1],
            },
            LanePiece {
                left: second,
                right: end,
                exists: turns[1],
                falls: first_falls,
                turns: none,
            },
        ];
        let at_start = start.fell & !first_falls & goal.admits(head.1);
        let mut passage = LanePassage {
            time: length,
            minimum: wanted & at_start & goal.stopping,
            crossing: LaneMask::NONE,
            missed: wanted & at_start & !goal.stopping,
            missed_at: zero,
            falls: (first_falls & (!turns[0] | turns[1])) | (!first_falls & turns[0] & !turns[1]),
        };
        passage.time = Lanes::select(passage.minimum, zero, passage.time);
        let mut open = turning.open & wanted;
        let mut falling = pieces[0];
        for piece in &pieces {
            let left = wanted & piece.exists & !passage.minimum & !passage.crossing;
            if !left.any() {
                break;
            }
            let left = left & !piece.is_rounding(&start);
            let crosses = left & piece.crosses() & !goal.minima;
            let lowest = left & !crosses & piece.falls & piece.turns & goal.admits(piece.right.1);
            let stops = lowest & goal.stopping;
            let missed = lowest & !stops;
            open |= missed & passage.missed;
            passage.missed |= missed;
            passage.missed_at = Lanes::select(missed, piece.right.0, passage.missed_at);
            passage.minimum |= stops;
            passage.time = Lanes::select(stops, piece.right.0, passage.time);
            passage.crossing |= crosses;
            falling = piece.or(crosses, &falling);
        }
        let crossing = passage.crossing & !open;
        if crossing.any() {
            open |= falling.fall(&gap, length, crossing, &mut passage.time);
        }
        passage.missed &= !open;
        self.alone.misses.clear();
        for lane in open.lanes() {
            self.alone
                .search(lane, gap, length[lane], &start, &goal, &mut passage);
        }
        passage
    }

    /// Minima of the last search that are not among the passages: lane, time.
    #[inline(always)]
    pub(super) fn further_misses(&self) -> &[(usize, f64)] {
        &self.alone.misses
    }
}

impl<const N: usize> LanePassage<N> {
    /// None on steps of these lengths.
    #[inline(always)]
    pub(super) fn none(length: Lanes<N>) -> Self {
        let none = LaneMask::NONE;
        Self {
            time: length,
            minimum: none,
            crossing: none,
            missed: none,
            missed_at: length,
            falls: none,
        }
    }
}

impl Alone {
    /// The passages of one gap.
    #[cold]
    #[inline(never)]
    fn search<const N: usize>(
        &mut self,
        lane: usize,
        gap: LaneGap<'_, N>,
        length: f64,
        start: &LaneStart<N>,
        goal: &LaneGoal<N>,
        passage: &mut LanePassage<N>,
    ) {
        let fill = |out: &mut Vec<f64>, coefficients: &[Lanes<N>]| {
            out.clear();
            out.extend(coefficients.iter().map(|coefficient| coefficient[lane]));
        };
        fill(&mut self.value, gap.value);
        fill(&mut self.slope, gap.slope);
        self.found.clear();
        let gap = Gap {
            value: &self.value,
            slope: &self.slope,
            sign: 1.0,
        };
        let stops = goal.stopping.holds(lane);
        let (start, goal) = (start.of(lane), goal.of(lane));
        let heading = self
            .search
            .search(&gap, length, start, goal, &mut self.found);
        let mut event = None;
        for &found in &self.found {
            match found {
                Passage::Minimum { time, .. } if !stops => self.misses.push((lane, time)),
                _ => {
                    event = Some(found);
                    break;
                }
            }
        }
        passage.time[lane] = event.map_or(length, |event| event.time());
        let (minimum, crossing) = (&mut passage.minimum, &mut passage.crossing);
        minimum.set(lane, matches!(event, Some(Passage::Minimum { .. })));
        crossing.set(lane, matches!(event, Some(Passage::Crossing { .. })));
        passage.falls.set(lane, heading == Heading::Falling);
    }
}

impl<const N: usize> LaneStart<N> {
    fn of(&self, lane: usize) -> Start<f64> {
        if self.leaving.holds(lane) {
            return Start::Leaving {
                rounding: self.rounding[lane],
            };
        }
        let before = match (self.rose.holds(lane), self.fell.holds(lane)) {
            (true, _) => Heading::Rising,
            (_, true) => Heading::Falling,
            _ => Heading::Unknown,
        };
        Start::Inside {
            before,
            within: self.within[lane],
        }
    }
}

impl<const N: usize> LaneGoal<N> {
    fn of(&self, lane: usize) -> Goal<f64> {
        match self.minima.holds(lane) {
            true => Goal::Minima,
            false => Goal::Crossing { near: self.near },
        }
    }

    /// Whether minima with these gaps are looked for.
    #[inline(always)]
    fn admits(&self, gap: Lanes<N>) -> LaneMask<N> {
        let near = Lanes::splat(self.near);
        self.minima | (Lanes::splat(0.0).is_at_most(gap) & gap.is_at_most(near))
    }
}

impl<const N: usize> LanePiece<N> {
    /// The same, or another piece where a mask is false.
    #[inline(always)]
    fn or(&self, mask: LaneMask<N>, other: &Self) -> Self {
        let end = |one: (Lanes<N>, Lanes<N>), other: (Lanes<N>, Lanes<N>)| {
            (
                Lanes::select(mask, one.0, other.0),
                Lanes::select(mask, one.1, other.1),
            )
        };
        Self {
            left: end(self.left, other.left),
            right: end(self.right, other.right),
            ..*self
        }
    }

    /// Where gaps fall below zero.
    #[inline(always)]
    fn crosses(&self) -> LaneMask<N> {
        let (left, right) = (self.left.1, self.right.1);
        right.is_below(Lanes::splat(0.0)) & right.is_below(left)
    }

    /// Where a fall is rounding on the zero just left, or the minimum that the step before ended
    /// with.
    #[inline(always)]
    fn is_rounding(&self, start: &LaneStart<N>) -> LaneMask<N> {
        let (left, right) = (self.left.1, self.right.1);
        let on_zero = left.is_at_most(start.rounding) & (-start.rounding).is_at_most(right);
        let same = start.rose & self.turns & self.right.0.is_below(start.within);
        (start.leaving & on_zero) | same
    }

    /// Puts times to those at which gaps fall through zero; where they are not found.
    #[inline(always)]
    fn fall(
        &self,
        gap: &LaneGap<'_, N>,
        length: Lanes<N>,
        wanted: LaneMask<N>,
        times: &mut Lanes<N>,
    ) -> LaneMask<N> {
        let inside = wanted & Lanes::splat(0.0).is_below(self.left.1);
        *times = Lanes::select(wanted & !inside, self.left.0, *times);
        let ends = [self.left.0, self.right.0];
        let mut search = LaneNewton::new(ends, inside, self.guess(gap), Lanes::splat(0.0));
        let rounding = Lanes::splat(0.25 * <Lanes<N> as Scalar>::ROUNDOFF) * length;
        let least = Lanes::splat(4.0) / length;
        let (mut going, mut open) = (inside, LaneMask::NONE);
        let mut before = (length, length);
        for step in 0..SETTLED {
            let time = search.at;
            let (value, slope) = polynomial::value_and_slope(gap.value, time);
            let moved = search.advance(value, slope);
            let mut ends = moved.settled;
            if step > 0 {
                let (last, last_slope) = before;
                let bend = (slope - last_slope) / ((time - last) * slope);
                let change = moved.next - time;
                let error = (bend.abs() + least) * change * change;
                ends |= !moved.open & error.is_at_most(rounding);
            }
            *times = Lanes::select(going & ends, moved.next, *times);
            open |= going & moved.open & !ends;
            going &= !ends & !moved.open;
            if !going.any() {
                break;
            }
            before = (time, slope);
            Lanes::<N>::carried(&mut search);
            Lanes::<N>::carried(&mut before);
        }
        open | going
    }

    /// Starts of the iteration: as [`search`](super::search) guesses them.
    #[inline(always)]
    fn guess(&self, gap: &LaneGap<'_, N>) -> Lanes<N> {
        let ((start, left), (end, right)) = (self.left, self.right);
        let from_end = (-right).is_below(left);
        let base = Lanes::select(from_end, end, start);
        let height = Lanes::select(from_end, right, left);
        let (slope, curvature) = polynomial::value_and_slope(gap.slope, base);
        let root = (slope * slope - (height + height) * curvature).sqrt();
        let time = base + (height + height) / (root - slope);
        let inside = start.is_below(time) & time.is_below(end);
        let chord = start + (end - start) * (left / (left - right));
        Lanes::select(inside, time, chord)
    }
}
