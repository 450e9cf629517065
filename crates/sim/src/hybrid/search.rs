//! Search of one step: every local minimum of a gap and its first crossing, for one gap or for one
//! in every lane.
//!
//! A gap `g > 0` is a polynomial on the step `[0, L]`, its slope another. All stationary points are
//! isolated first (bisection with a bound on the second derivative, in `f64`) and refined in the
//! scalar type. Between them the gap is monotone, so that one comparison of signs per piece finds a
//! crossing. Two crossings within one step, the quick dip of a near graze, cannot be missed,
//! because there is a minimum between them.

use num_traits::Zero as _;

use super::passage::{Goal, Heading, MinimumLog, Start};
use super::stationary::StationaryPoints;
use crate::numeric::{Branched, Mask, NewtonSteps, Real, Scalar, polynomial};

/// A gap on one step: Taylor coefficients of `sign · value` and of its derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap<'p, S> {
    /// Coefficients of the watched function.
    pub(super) value: &'p [S],
    /// Coefficients of its time derivative.
    pub(super) slope: &'p [S],
    /// Factor of both, 1 or −1, that makes the gap positive.
    pub(super) sign: S,
    /// Surface of the gap.
    pub(super) surface: usize,
}

/// First events of steps, which end the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct SearchEnd<S: Branched> {
    /// Time of the event; the length of the step if there is none.
    pub(super) time: S,
    /// Mask: the event is a minimum; then its gap.
    pub(super) minimum: S::Mask,
    pub(super) gap: S,
    /// Mask: the gap falls through zero.
    pub(super) crossing: S::Mask,
    /// Mask: the gap falls at the end of a step without an event.
    pub(super) falls: S::Mask,
}

impl<S: Branched> Gap<'_, S> {
    #[inline(always)]
    fn at(&self, time: S) -> S {
        self.sign * polynomial::value(self.value, time)
    }

    /// Time for which a gap is convex after a minimum, from its second derivative there and a bound
    /// on the third; its series is accurate up to `length`.
    #[inline(always)]
    pub(super) fn rises_for(&self, time: S, length: S) -> S {
        let curvature = self.slope_and_curvature(time).1;
        let mut bound = S::zero();
        for (degree, coefficient) in self.slope.iter().enumerate().skip(2).rev() {
            let factor = S::from_f64((degree * (degree - 1)) as f64);
            bound = bound.mul_add(length, factor * coefficient.abs());
        }
        let convex = (curvature / bound).min(length - time);
        S::select(S::zero().is_below(curvature), convex, S::zero())
    }

    /// Value and slope of the gap.
    #[inline(always)]
    fn value_and_slope(&self, time: S) -> (S, S) {
        let (value, slope) = polynomial::value_and_slope(self.value, time);
        (self.sign * value, self.sign * slope)
    }

    /// Slope of the gap and its derivative.
    #[inline(always)]
    fn slope_and_curvature(&self, time: S) -> (S, S) {
        let (slope, curvature) = polynomial::value_and_slope(self.slope, time);
        (self.sign * slope, self.sign * curvature)
    }

    /// Refines times of stationary points, accurate to `f64`, by Newton's method on the slope.
    #[inline(always)]
    fn polish(&self, mut time: S, length: S, wanted: S::Mask) -> S {
        if S::ROUNDOFF >= f64::ROUNDOFF {
            return time.min(length);
        }
        let rounding = S::from_f64(2.0 * S::ROUNDOFF) * length;
        let longest = S::from_f64(1e-6) * length;
        let mut going = wanted;
        for _ in 0..6 {
            let (slope, curvature) = self.slope_and_curvature(time);
            let change = slope / curvature;
            going &= change.abs().is_at_most(longest);
            time = S::select(going, time - change, time);
            going &= !change.abs().is_at_most(rounding);
            if !going.any() {
                break;
            }
        }
        time.max(S::zero()).min(length)
    }

    /// Rounding of a gap: a few units in the last place of its largest term `|g_k| L^k`.
    #[inline(always)]
    fn noise(&self, length: S) -> S {
        let (length, mut largest) = (length.rounded(), S::Rounded::zero());
        for coefficient in self.value.iter().rev() {
            largest = (largest * length).max(coefficient.abs().rounded());
        }
        S::from_rounded(S::Rounded::from_f64(2.0 * S::ROUNDOFF) * largest)
    }
}

impl<S: Real> Gap<'_, S> {
    /// Heading of the gap at a time.
    pub(super) fn heading(&self, time: S) -> Heading {
        Heading::falling(self.sign * polynomial::value(self.slope, time) < S::zero())
    }
}

/// Search of one gap.
pub(super) fn search_scalar<S: Real>(
    points: &mut StationaryPoints<f64>,
    gap: Gap<'_, S>,
    length: S,
    start: Start<S>,
    goal: Goal<S>,
    log: impl MinimumLog<S>,
) -> SearchEnd<S> {
    search(points, gap, length, start, goal, true, log)
}

/// Finds the first event on `[0, length]` that ends the search. Minima before it that do not end
/// the search are passed to `log`, in order of time.
///
/// A gap that fell before the step and does not fall at its start has its minimum there, between
/// two steps and inside neither. A concave gap has its maximum there: it fell, or rises, by
/// rounding.
#[inline(always)]
pub(super) fn search<S: Branched>(
    points: &mut StationaryPoints<S::Rounded>,
    gap: Gap<'_, S>,
    length: S,
    start: Start<S>,
    goal: Goal<S>,
    wanted: S::Mask,
    mut log: impl MinimumLog<S>,
) -> SearchEnd<S> {
    let zero = S::zero();
    points.isolate(gap.slope, length.rounded(), wanted);
    let mut falls = (gap.sign * gap.slope[0]).is_below(zero);
    let mut left = (zero, gap.sign * gap.value[0]);
    let mut end = SearchEnd::none(length);
    let is_concave = (gap.sign * gap.slope[1]).is_below(zero);
    let turned = wanted & start.fell & !falls & !is_concave & goal.admits(left.1);
    end.meet_minima(turned, left, gap.surface, &goal, &mut log);
    let mut falling = MonotonePiece { left, right: left };
    let mut exists = wanted;
    for index in 0..=points.turns.len() {
        let going = exists & !end.minimum & !end.crossing;
        if !going.any() {
            break;
        }
        let (mut time, mut turns) = (length, S::Mask::NONE);
        if let Some(turn) = points.turns.get(index) {
            turns = turn.exists;
            let place = S::from_rounded(turn.place) * length;
            time = S::select(turns, gap.polish(place, length, turns), length);
        }
        let right = (time, gap.at(time));
        let piece = MonotonePiece { left, right };
        let going = going & !piece.is_rounding(turns, &start);
        let crosses = going & piece.crosses() & !goal.minima;
        let lowest = going & !crosses & falls & turns & goal.admits(right.1);
        end.meet_minima(lowest, right, gap.surface, &goal, &mut log);
        end.crossing |= crosses;
        falling = piece.or(crosses, &falling);
        left = right;
        falls = (falls & !turns) | (!falls & turns);
        exists &= turns;
    }
    end.falls = falls;
    if end.crossing.any() {
        let time = falling.fall(&gap, length, end.crossing);
        end.time = S::select(end.crossing, time, end.time);
    }
    end
}

impl<S: Branched> SearchEnd<S> {
    /// No event on steps of these lengths.
    #[inline(always)]
    pub(super) fn none(length: S) -> Self {
        let none = S::Mask::NONE;
        Self { time: length, minimum: none, gap: length, crossing: none, falls: none }
    }

    /// Ends the search at minima, given by time and gap, or passes them to `log`.
    #[inline(always)]
    fn meet_minima(
        &mut self,
        minima: S::Mask,
        (time, gap): (S, S),
        surface: usize,
        goal: &Goal<S>,
        log: &mut impl MinimumLog<S>,
    ) {
        if minima.is_over() {
            return;
        }
        let stops = minima & goal.stopping;
        log.miss(minima & !stops, surface, time, gap);
        self.minimum |= stops;
        self.time = S::select(stops, time, self.time);
        self.gap = S::select(stops, gap, self.gap);
    }
}

/// A piece of a step on which the gap is monotone: time and gap of its ends.
#[derive(Clone, Copy)]
struct MonotonePiece<S> {
    left: (S, S),
    right: (S, S),
}

impl<S: Branched> MonotonePiece<S> {
    /// Selects this piece where a mask is true, the other piece elsewhere.
    #[inline(always)]
    fn or(&self, mask: S::Mask, other: &Self) -> Self {
        Self {
            left: (
                S::select(mask, self.left.0, other.left.0),
                S::select(mask, self.left.1, other.left.1),
            ),
            right: (
                S::select(mask, self.right.0, other.right.0),
                S::select(mask, self.right.1, other.right.1),
            ),
        }
    }

    /// Mask: the gap falls below zero.
    #[inline(always)]
    fn crosses(&self) -> S::Mask {
        let (left, right) = (self.left.1, self.right.1);
        right.is_below(S::zero()) & right.is_below(left)
    }

    /// Mask: the fall is not an event, but rounding at the zero just left, or the minimum at the
    /// end of the previous step. `turns` marks pieces that end at a stationary point.
    #[inline(always)]
    fn is_rounding(&self, turns: S::Mask, start: &Start<S>) -> S::Mask {
        let (left, right) = (self.left.1, self.right.1);
        let on_zero = left.is_at_most(start.rounding) & (-start.rounding).is_at_most(right);
        let same = start.rose & turns & self.right.0.is_below(start.within);
        (start.leaving & on_zero) | same
    }

    /// Times at which gaps fall through zero, by Newton's method.
    ///
    /// After a step `Δ` the error is about `Δ² |h''/2h'|`; `h''` is estimated from the last two
    /// slopes and doubled.
    #[inline(always)]
    fn fall(&self, gap: &Gap<'_, S>, length: S, wanted: S::Mask) -> S {
        let ((start, left), (end, _)) = (self.left, self.right);
        let mut going = wanted & S::zero().is_below(left);
        let mut times = start;
        if !going.any() {
            return times;
        }
        let mut search = NewtonSteps::new([start, end], going, self.guess(gap), S::zero());
        let rounding = S::from_f64(0.25 * S::ROUNDOFF) * length;
        let least = S::from_f64(4.0) / length;
        let mut before = (length, length);
        for step in 0..MAX_NEWTON {
            let time = search.at();
            let (value, slope) = gap.value_and_slope(time);
            let moved = search.advance(value, slope);
            let mut ends = moved.settled;
            if step > 0 {
                let (last, last_slope) = before;
                let bend = (slope - last_slope) / ((time - last) * slope);
                let change = moved.next - time;
                let error = (bend.abs() + least) * change * change;
                ends |= moved.newton & error.is_at_most(rounding);
            }
            let mut next = moved.next;
            if step >= SETTLED {
                let is_noise = value.abs().is_at_most(gap.noise(length));
                let kept = is_noise & !moved.newton & !moved.settled;
                next = S::select(kept, time, next);
                ends |= is_noise;
            }
            times = S::select(going, next, times);
            going &= !ends;
            if !going.any() {
                break;
            }
            before = (time, slope);
            S::carried(&mut search);
            S::carried(&mut before);
        }
        times
    }

    /// Start of the iteration: the zero of a parabola about the minimum at the end of the piece, or
    /// about the maximum at its start, whichever is nearer; a chord otherwise.
    #[inline(always)]
    fn guess(&self, gap: &Gap<'_, S>) -> S {
        let ((start, left), (end, right)) = (self.left, self.right);
        let from_end = (-right).is_below(left);
        let base = S::select(from_end, end, start);
        let height = S::select(from_end, right, left);
        let (slope, curvature) = gap.slope_and_curvature(base);
        // Zero of height + slope s + curvature s²/2 on the piece's side of the base.
        let root = (slope * slope - (height + height) * curvature).sqrt();
        let time = base + (height + height) / (root - slope);
        let inside = start.is_below(time) & time.is_below(end);
        let chord = start + (end - start) * (left / (left - right));
        S::select(inside, time, chord)
    }
}

/// Largest number of Newton and bisection steps to a crossing.
const MAX_NEWTON: usize = 200;

/// Number of steps after which the rounding of the gap may end the iteration.
const SETTLED: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    fn derivative(value: &[f64]) -> Vec<f64> {
        (1..value.len()).map(|k| k as f64 * value[k]).chain([0.0]).collect()
    }

    /// An event of one gap within a step.
    #[derive(Clone, Copy, Debug)]
    enum Passage<S> {
        Minimum { time: S, gap: S },
        Crossing { time: S },
    }

    fn passages<S: Real>(value: &[f64], start: Start<S>, goal: Goal<S>) -> Vec<Passage<S>> {
        let slope: Vec<S> = derivative(value).into_iter().map(S::from_f64).collect();
        let value: Vec<S> = value.iter().copied().map(S::from_f64).collect();
        let gap = Gap { value: &value, slope: &slope, sign: S::one(), surface: 0 };
        let (mut missed, mut points) = (Vec::new(), StationaryPoints::new());
        let end = search_scalar(&mut points, gap, S::one(), start, goal, &mut missed);
        let time = end.time;
        let minimum = |(time, _, gap)| Passage::Minimum { time, gap };
        let crossing = end.crossing.then_some(Passage::Crossing { time });
        missed.into_iter().map(minimum).chain(crossing).collect()
    }

    fn inside<S: Real>() -> Start<S> {
        after(Heading::Unknown)
    }

    fn after<S: Real>(before: Heading) -> Start<S> {
        Start::inside(before, S::from_f64(1e-7))
    }

    fn crossing<S: Real>(near: S) -> Goal<S> {
        Goal { minima: false, stopping: false, near }
    }

    #[test]
    fn a_minimum_between_two_steps_is_found_once() {
        let goal = crossing(1.0);
        let rising = [0.25, 0.0, 1.0];
        let found = passages::<f64>(&rising, after(Heading::Falling), goal);
        assert!(matches!(found[..], [Passage::Minimum { time: 0.0, gap: 0.25 }]));
        assert!(passages::<f64>(&rising, after(Heading::Rising), goal).is_empty());
        let falling = [0.25, -1e-17, 1.0];
        assert_eq!(passages::<f64>(&falling, after(Heading::Falling), goal).len(), 1);
        assert!(passages::<f64>(&falling, after(Heading::Rising), goal).is_empty());
    }

    /// Two stops opposite each other: where one gap is least the other one is largest, and a flight
    /// that stops at the minimum leaves the slopes of both at rounding.
    #[test]
    fn a_maximum_between_two_steps_is_no_minimum_whatever_the_signs_of_its_slopes() {
        for slope in [1e-17, 0.0, -1e-17] {
            for before in [Heading::Falling, Heading::Rising, Heading::Unknown] {
                let found = passages::<f64>(&[0.25, slope, -0.1], after(before), crossing(1.0));
                assert!(found.is_empty(), "{slope:e} {before:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_dip_of_any_depth_between_two_positive_ends_is_found() {
        for exponent in 2..=14 {
            let y = 10f64.powi(-exponent / 2 - exponent % 2);
            // (t - 0.37)² - y²
            let value = [0.37 * 0.37 - y * y, -0.74, 1.0];
            let found = passages::<Dd>(&value, inside(), crossing(Dd::INFINITY));
            let [Passage::Crossing { time }] = found[..] else { panic!("{found:?}") };
            let gap = (time - Dd::from(0.37)) * (time - Dd::from(0.37));
            assert!((gap.to_f64() - y * y).abs() < 1e-16, "{y:e}");
        }
    }

    #[test]
    fn a_near_miss_is_a_minimum_and_not_a_crossing() {
        let value = [0.25 + 1e-12, -1.0, 1.0];
        let found = passages::<f64>(&value, inside(), crossing(1.0));
        let [Passage::Minimum { time, gap }] = found[..] else { panic!("{found:?}") };
        assert!((time - 0.5).abs() < 1e-15 && (gap - 1e-12).abs() < 1e-16);
        assert!(passages::<f64>(&value, inside(), crossing(1e-13)).is_empty());
    }

    #[test]
    fn every_minimum_of_a_wave_is_found() {
        // cos(9 t) + 2 by its series of order 60; the minimum after π/9 is at π/3 > 1.
        let mut term = 1.0;
        let mut value = Vec::new();
        for k in 0..=60usize {
            value.push([term, 0.0, -term, 0.0][k % 4]);
            term *= 9.0 / (k + 1) as f64;
        }
        value[0] += 2.0;
        let minima = Goal { minima: true, ..crossing(1.0) };
        let found = passages::<f64>(&value, inside(), minima);
        let [Passage::Minimum { time, .. }] = found[..] else { panic!("{found:?}") };
        assert!((time - std::f64::consts::PI / 9.0).abs() < 1e-13);
    }

    #[test]
    fn rounding_on_the_surface_just_left_is_no_event() {
        let value = [-1e-17, -1e-17, 1.0];
        let leaving = Start::leaving(1e-15);
        assert!(passages::<f64>(&value, leaving, crossing(1.0)).is_empty());
        let falling = [1e-17, -1e-17, -1.0];
        let found = passages::<f64>(&falling, leaving, crossing(1.0));
        assert!(matches!(found[..], [Passage::Crossing { .. }]));
    }
}
