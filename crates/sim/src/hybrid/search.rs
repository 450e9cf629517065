//! Search of one step: every local minimum of a gap and its first crossing.
//!
//! A gap `g > 0` is a polynomial on the step `[0, L]`, its slope another. All stationary points are
//! isolated first (bisection with a bound on the second derivative, in `f64`) and polished in the
//! scalar; between them the gap is monotone, so one sign comparison per piece finds a crossing. Two
//! crossings within one step, the quick dip of a near graze, cannot be missed: they have a minimum
//! between them.

use super::passage::{Goal, Heading, Passage, Start};
use super::stationary::StationaryPoints;
use crate::numeric::polynomial;
use crate::numeric::{Bracket, Branched, NewtonStep, NewtonSteps, Real, Scalar};

/// A gap on one step: Taylor coefficients of `sign · value` and of its derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap<'p, S> {
    /// Coefficients of the watched function.
    pub(crate) value: &'p [S],
    /// Coefficients of its time derivative.
    pub(crate) slope: &'p [S],
    /// Factor of both, 1 or −1, that makes the gap positive.
    pub(crate) sign: S,
}

impl<S: Real> Gap<'_, S> {
    fn at(&self, time: S) -> S {
        self.sign * polynomial::value(self.value, time)
    }

    /// Which way it goes at a time.
    pub(crate) fn heading(&self, time: S) -> Heading {
        Heading::falling(self.sign * polynomial::value(self.slope, time) < S::zero())
    }

    /// For how long after a minimum it is known to rise, its series being good up to a length.
    pub(crate) fn rises_for(&self, time: S, length: S) -> S {
        rises_for(self.slope, self.sign, time, length)
    }

    /// Value and slope.
    fn value_and_slope(&self, time: S) -> (S, S) {
        let (value, slope) = polynomial::value_and_slope(self.value, time);
        (self.sign * value, self.sign * slope)
    }

    /// Value of the slope and of its derivative.
    fn slope_and_curvature(&self, time: S) -> (S, S) {
        let (slope, curvature) = polynomial::value_and_slope(self.slope, time);
        (self.sign * slope, self.sign * curvature)
    }
}

/// For how long after a minimum a gap is convex, by its second derivative there and a bound of the
/// third.
#[inline(always)]
pub(super) fn rises_for<S: Branched>(slope: &[S], sign: S, time: S, length: S) -> S {
    let curvature = sign * polynomial::value_and_slope(slope, time).1;
    let mut bound = S::zero();
    for (degree, coefficient) in slope.iter().enumerate().skip(2).rev() {
        let factor = S::from_f64((degree * (degree - 1)) as f64);
        bound = bound.mul_add(length, factor * coefficient.abs());
    }
    let convex = (curvature / bound).min(length - time);
    S::select(S::zero().is_below(curvature), convex, S::zero())
}

/// Working memory of the search.
#[derive(Clone, Debug, Default)]
pub(crate) struct PassageSearch {
    stationary: StationaryPoints,
}

impl PassageSearch {
    /// Appends the gap's passages on `[0, length]`, in order of time, up to its first crossing;
    /// which way the gap goes at the end, by the minima and maxima that were found.
    ///
    /// A gap that fell before the step and does not fall at its start has its minimum there,
    /// between two steps and inside neither.
    pub(crate) fn search<S: Real>(
        &mut self,
        gap: &Gap<'_, S>,
        length: S,
        start: Start<S>,
        goal: Goal<S>,
        found: &mut Vec<Passage<S>>,
    ) -> Heading {
        self.stationary.isolate(gap.slope, length.to_f64());
        let roots = &self.stationary.roots;
        let mut left = (S::zero(), gap.sign * gap.value[0]);
        let mut falls = gap.sign * gap.slope[0] < S::zero();
        let turned = start.fell() && !falls;
        if turned && goal.admits(left.1) {
            let (time, gap) = left;
            found.push(Passage::Minimum { time, gap });
        }
        for index in 0..=roots.len() {
            let stationary = roots.get(index).copied();
            let time = stationary.map_or(length, |root| {
                polish_stationary(gap, S::from_f64(root) * length, length)
            });
            let right = (time, gap.at(time));
            let piece = Piece {
                left,
                right,
                falls,
                stationary: stationary.is_some(),
            };
            if let Some(passage) = piece.passage(gap, length, start, goal) {
                found.push(passage);
                if matches!(passage, Passage::Crossing { .. }) {
                    break;
                }
            }
            left = right;
            falls ^= stationary.is_some();
        }
        Heading::falling(falls)
    }
}

/// Newton's method on the slope from a root good to `f64`.
fn polish_stationary<S: Real>(gap: &Gap<'_, S>, mut time: S, length: S) -> S {
    if S::ROUNDOFF >= f64::ROUNDOFF {
        return time.min(length);
    }
    let rounding = S::from_f64(2.0 * S::ROUNDOFF) * length;
    for _ in 0..6 {
        let (slope, curvature) = gap.slope_and_curvature(time);
        let change = slope / curvature;
        if !change.is_finite() || change.abs() > S::from_f64(1e-6) * length {
            break;
        }
        time -= change;
        if change.abs() <= rounding {
            break;
        }
    }
    time.max(S::zero()).min(length)
}

/// A piece of a step on which the gap is monotone.
struct Piece<S> {
    left: (S, S),
    right: (S, S),
    /// Whether it falls, by its slope: near a minimum values do not tell.
    falls: bool,
    /// Whether the right end is a stationary point.
    stationary: bool,
}

impl<S: Real> Piece<S> {
    fn passage(
        &self,
        gap: &Gap<'_, S>,
        length: S,
        start: Start<S>,
        goal: Goal<S>,
    ) -> Option<Passage<S>> {
        let ((_, left), (time, right)) = (self.left, self.right);
        if self.is_rounding(start) {
            return None;
        }
        match goal {
            Goal::Crossing { .. } if right < S::zero() && right < left => Some(Passage::Crossing {
                time: self.crossing(gap, length),
            }),
            _ => (self.falls && self.stationary && goal.admits(right))
                .then_some(Passage::Minimum { time, gap: right }),
        }
    }

    /// Whether the fall is no event: rounding on the zero just left, or the minimum that the step
    /// before ended with.
    fn is_rounding(&self, start: Start<S>) -> bool {
        match start {
            Start::Inside { before, within } => {
                before == Heading::Rising && self.stationary && self.right.0 < within
            }
            Start::Leaving { rounding } => self.left.1 <= rounding && self.right.1 >= -rounding,
        }
    }

    /// Time at which the gap falls through 0.
    fn crossing(&self, gap: &Gap<'_, S>, length: S) -> S {
        let ((start, left), (end, right)) = (self.left, self.right);
        match Bracket::new(start, end, left, right) {
            Ok(bracket) if left > S::zero() => {
                let guess = self.guess(gap, left, right);
                falls_through_zero(gap, bracket.newton_steps(guess, S::zero()), length)
            }
            _ => start,
        }
    }

    /// Start of the iteration: a parabola about the minimum the piece ends at, or about the maximum
    /// it starts at, whichever is nearer to the zero; a chord otherwise.
    fn guess(&self, gap: &Gap<'_, S>, left: S, right: S) -> S {
        let (start, end) = (self.left.0, self.right.0);
        let from_end = -right < left;
        let (base, height) = if from_end {
            (end, right)
        } else {
            (start, left)
        };
        let (slope, curvature) = gap.slope_and_curvature(base);
        // Zero of height + slope s + curvature s²/2 on the piece's side of the base.
        let root = (slope * slope - (height + height) * curvature).sqrt();
        let time = base + (height + height) / (root - slope);
        if time > start && time < end {
            time
        } else {
            start + (end - start) * (left / (left - right))
        }
    }
}

/// The zero of a gap that falls.
///
/// After a step `Δ` the error is about `Δ² |h''/2h'|`; `h''` is taken from the last two slopes, and
/// twice as large.
fn falls_through_zero<S: Real>(gap: &Gap<'_, S>, mut search: NewtonSteps<S>, length: S) -> S {
    let rounding = S::from_f64(0.25 * S::ROUNDOFF) * length;
    let least = S::from_f64(4.0) / length;
    let mut before = None;
    for step in 0..MAX_NEWTON {
        let time = search.at();
        let (value, slope) = gap.value_and_slope(time);
        let is_last = |next: S| {
            before.is_some_and(|(last, last_slope)| {
                let bend: S = (slope - last_slope) / ((time - last) * slope);
                let change = next - time;
                (bend.abs() + least) * change * change <= rounding
            })
        };
        let is_noise = || step >= SETTLED && value.abs() <= noise(gap, length);
        match search.advance(value, slope) {
            NewtonStep::Settled(root) => return root,
            NewtonStep::Newton(next) if is_last(next) || is_noise() => return next,
            NewtonStep::Kept(_) if is_noise() => return time,
            _ => before = Some((time, slope)),
        }
    }
    search.at()
}

/// Most Newton and bisection steps to a crossing.
const MAX_NEWTON: usize = 200;

/// Steps after which the rounding of the gap may end the iteration.
pub(super) const SETTLED: usize = 5;

/// Rounding of a gap: a few units in the last place of its largest term `|g_k| L^k`.
fn noise<S: Real>(gap: &Gap<'_, S>, length: S) -> S {
    let length = length.to_f64();
    let coefficients = gap.value.iter().rev();
    let largest = coefficients.fold(0.0, |size: f64, c| (size * length).max(c.to_f64().abs()));
    S::from_f64(2.0 * S::ROUNDOFF * largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    fn derivative(value: &[f64]) -> Vec<f64> {
        (1..value.len())
            .map(|k| k as f64 * value[k])
            .chain([0.0])
            .collect()
    }

    fn search<S: Real>(value: &[f64], start: Start<S>, goal: Goal<S>) -> Vec<Passage<S>> {
        let slope: Vec<S> = derivative(value).into_iter().map(S::from_f64).collect();
        let value: Vec<S> = value.iter().copied().map(S::from_f64).collect();
        let gap = Gap {
            value: &value,
            slope: &slope,
            sign: S::one(),
        };
        let mut found = Vec::new();
        PassageSearch::default().search(&gap, S::one(), start, goal, &mut found);
        found
    }

    fn inside<S: Real>() -> Start<S> {
        after(Heading::Unknown)
    }

    fn after<S: Real>(before: Heading) -> Start<S> {
        Start::Inside {
            before,
            within: S::from_f64(1e-7),
        }
    }

    #[test]
    fn a_minimum_between_two_steps_is_found_once() {
        let goal = Goal::Crossing { near: 1.0 };
        let rising = [0.25, 0.0, 1.0];
        let found = search::<f64>(&rising, after(Heading::Falling), goal);
        assert!(matches!(
            found[..],
            [Passage::Minimum {
                time: 0.0,
                gap: 0.25
            }]
        ));
        assert!(search::<f64>(&rising, after(Heading::Rising), goal).is_empty());
        let falling = [0.25, -1e-17, 1.0];
        assert_eq!(
            search::<f64>(&falling, after(Heading::Falling), goal).len(),
            1
        );
        assert!(search::<f64>(&falling, after(Heading::Rising), goal).is_empty());
    }

    #[test]
    fn a_dip_of_any_depth_between_two_positive_ends_is_found() {
        for exponent in 2..=14 {
            let y = 10f64.powi(-exponent / 2 - exponent % 2);
            // (t - 0.37)² - y²
            let value = [0.37 * 0.37 - y * y, -0.74, 1.0];
            let found = search::<Dd>(&value, inside(), Goal::Crossing { near: Dd::INFINITY });
            let [Passage::Crossing { time }] = found[..] else {
                panic!("{found:?}")
            };
            let gap = (time - Dd::from(0.37)) * (time - Dd::from(0.37));
            assert!((gap.to_f64() - y * y).abs() < 1e-16, "{y:e}");
        }
    }

    #[test]
    fn a_near_miss_is_a_minimum_and_not_a_crossing() {
        let value = [0.25 + 1e-12, -1.0, 1.0];
        let found = search::<f64>(&value, inside(), Goal::Crossing { near: 1.0 });
        let [Passage::Minimum { time, gap }] = found[..] else {
            panic!("{found:?}")
        };
        assert!((time - 0.5).abs() < 1e-15 && (gap - 1e-12).abs() < 1e-16);
        assert!(search::<f64>(&value, inside(), Goal::Crossing { near: 1e-13 }).is_empty());
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
        let found = search::<f64>(&value, inside(), Goal::Minima);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].time() - std::f64::consts::PI / 9.0).abs() < 1e-13);
    }

    #[test]
    fn rounding_on_the_surface_just_left_is_no_event() {
        let value = [-1e-17, -1e-17, 1.0];
        let leaving = Start::Leaving { rounding: 1e-15 };
        assert!(search::<f64>(&value, leaving, Goal::Crossing { near: 1.0 }).is_empty());
        let falling = [1e-17, -1e-17, -1.0];
        let found = search::<f64>(&falling, leaving, Goal::Crossing { near: 1.0 });
        assert!(matches!(found[..], [Passage::Crossing { .. }]));
    }
}
