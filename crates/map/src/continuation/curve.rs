//! Tracing of a curve from a point on: steps, their points, and the zeros of test functions.

use std::array::from_fn;

use serde::{Deserialize, Serialize};

use super::CurveEquations;
use super::sampled::{SAMPLES, Zeros, places, zeros};
use super::step::{Chord, ContinuationPoint, StepControl, point_on, zero_between};
use super::vectors::{apart, dot, moved};
use crate::numeric::Real;

/// A piece of a curve.
#[derive(Clone, Debug)]
pub struct Curve<S, X = ()> {
    /// Points in order, special ones included.
    pub points: Vec<ContinuationPoint<S, X>>,
    /// Special points.
    pub turns: Vec<Turn>,
    /// Pairs of indices in `points` between which a test function may have more zeros than were
    /// found, with the index of the test function.
    pub unresolved: Vec<(usize, [usize; 2])>,
    /// Reason for the end.
    pub end: ContinuationEnd,
}

impl<S, X> Curve<S, X> {
    /// Adds a stretch that is not resolved, or extends the known one that ends where it begins.
    fn add_unresolved(&mut self, test: usize, ends: [usize; 2]) {
        let mut known = self.unresolved.iter_mut();
        match known.find(|(other, known)| *other == test && known[1] == ends[0]) {
            Some((_, known)) => known[1] = ends[1],
            None => self.unresolved.push((test, ends)),
        }
    }
}

/// A zero of a test function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Turn {
    /// Index of the point in [`Curve::points`].
    pub point: usize,
    /// Index of the test function.
    pub test: usize,
}

/// Reason why a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ContinuationEnd {
    /// An unknown is at the border of its range.
    Border {
        /// Index of the unknown.
        unknown: usize,
    },
    /// The curve returns to its first point.
    Closed,
    /// The equations end the curve here ([`CurveEquations::is_last`]).
    Last,
    /// No step succeeds, or too many consecutive steps left zeros unresolved.
    StepTooSmall,
    /// The largest number of steps was reached.
    StepLimit,
    /// The bound on work was reached ([`CurveEquations::is_spent`]).
    WorkLimit,
}

/// Cosine of the largest angle between the tangents of a step.
const STRAIGHT: f64 = 0.97;
/// Ratio of the next step's length to the last.
const GROWTH: f64 = 1.5;
/// Largest distance from a border at which a point counts as on it.
const AT_BORDER: f64 = 1e-10;
/// Largest distance, relative to the step, at which a curve has closed at its first point.
const CLOSED: f64 = 1e-4;

/// Follows a curve from a point near it, on the side of `along`.
///
/// `None` if Newton's method finds no point of the curve on the plane through `start` normal to
/// `along`, or no tangent there.
pub fn follow<S: Real, C: CurveEquations<S> + ?Sized>(
    equations: &mut C,
    start: &[S],
    along: &[S],
    control: &StepControl,
) -> Option<Curve<S, C::Extra>> {
    let first = point_on(equations, start, [start, along], along)?;
    let tests = first.tests.iter().enumerate();
    let zeros = tests.filter(|(_, test)| test.beyond_rounding() == S::zero());
    let turns = zeros.map(|(test, _)| Turn { point: 0, test }).collect();
    let mut follower = CurveFollower {
        curve: Curve {
            points: vec![first],
            turns,
            unresolved: Vec::new(),
            end: ContinuationEnd::StepLimit,
        },
        equations,
        control,
    };
    follower.curve.end = follower.follow();
    Some(follower.curve)
}

struct CurveFollower<'a, S, C: ?Sized, X> {
    equations: &'a mut C,
    control: &'a StepControl,
    curve: Curve<S, X>,
}

/// Position of a point relative to the range of the unknowns.
enum Within<S, X> {
    /// Inside.
    Range(ContinuationPoint<S, X>),
    /// Outside, beyond the border of an unknown; the point is where the curve crosses the border.
    Border(ContinuationPoint<S, X>, usize),
    /// Outside without a crossing: the curve was on the border of an unknown already (`Some`), or
    /// the crossing was not found (`None`).
    Beyond(Option<usize>),
}

/// Points of a step without its first, with their places in `(0, 1]`, and what its samples tell.
struct CurveStep<S, X> {
    points: Vec<(f64, ContinuationPoint<S, X>)>,
    resolution: Resolution,
}

/// Zeros of all test functions along a step, as far as its samples tell.
#[derive(Default)]
struct Resolution {
    /// Places between the sample places that separate zeros.
    parting: Vec<f64>,
    /// Test functions (indices) that may have more zeros, each with the place; `None` is the whole
    /// step.
    unresolved: Vec<(usize, Option<f64>)>,
    /// Whether the samples are too few to find all zeros on a step of this length.
    too_long: bool,
}

impl<S: Real, X: Clone, C: CurveEquations<S, Extra = X> + ?Sized> CurveFollower<'_, S, C, X> {
    fn follow(&mut self) -> ContinuationEnd {
        let mut length = self.control.first;
        let mut too_long = 0;
        for _ in 0..self.control.most {
            let here = self.curve.points[self.curve.points.len() - 1].clone();
            let Some((step, taken)) = self.step(&here, length) else {
                return self.no_step();
            };
            length = (GROWTH * taken).min(self.control.longest_at(&here.unknowns));
            let CurveStep { points, resolution } = step;
            too_long = if resolution.too_long { too_long + 1 } else { 0 };
            if too_long > self.control.unresolved {
                return ContinuationEnd::StepTooSmall;
            }
            let mut before = 0.0;
            for (place, next) in points {
                let from = self.curve.points.len() - 1;
                let end = self.add(next);
                for &(test, at) in &resolution.unresolved {
                    if at.is_none_or(|at| before < at && at <= place) {
                        self.curve.add_unresolved(test, [from, self.curve.points.len() - 1]);
                    }
                }
                if let Some(end) = end {
                    return end;
                }
                before = place;
            }
        }
        ContinuationEnd::StepLimit
    }

    /// Reason why there is no next point.
    fn no_step(&self) -> ContinuationEnd {
        match self.equations.is_spent() {
            true => ContinuationEnd::WorkLimit,
            false => ContinuationEnd::StepTooSmall,
        }
    }

    /// Next step and its length. If no step is short enough for all zeros to be known, the longest
    /// that the corrector can take.
    fn step(
        &mut self,
        here: &ContinuationPoint<S, X>,
        mut length: f64,
    ) -> Option<(CurveStep<S, X>, f64)> {
        let mut longest = None;
        while length >= self.control.shortest && !self.equations.is_spent() {
            match self.try_step(here, length) {
                Some(step) if step.resolution.too_long => {
                    longest = longest.or(Some((step, length)))
                }
                Some(step) => return Some((step, length)),
                None => {}
            }
            length *= 0.5;
        }
        longest
    }

    fn try_step(&mut self, here: &ContinuationPoint<S, X>, length: f64) -> Option<CurveStep<S, X>> {
        let straight = |point: &ContinuationPoint<S, X>| {
            dot(&point.tangent, &here.tangent).to_f64() > STRAIGHT
        };
        let predicted = moved(&here.unknowns, &here.tangent, S::from_f64(length));
        let planes = [&predicted[..], &here.tangent];
        let next = point_on(self.equations, &predicted, planes, &here.tangent)?;
        if apart(&next.unknowns, &predicted) > 0.3 * length || !straight(&next) {
            return None;
        }
        if next.tests.is_empty() {
            let points = vec![(1.0, next)];
            let resolution = Resolution::default();
            return self.is_passable(here, &points).then_some(CurveStep { points, resolution });
        }
        let chord = Chord::new([here, &next])?;
        let inner = &places()[1..SAMPLES - 1];
        let mut points = vec![(0.0, here.clone())];
        for &place in inner {
            let point = chord.point(self.equations, S::from_f64(place)).filter(|p| straight(p))?;
            points.push((place, point));
        }
        points.push((1.0, next.clone()));
        let resolution = resolution::<S, X>(&points);
        for &place in &resolution.parting {
            points.push((place, chord.point(self.equations, S::from_f64(place))?));
        }
        points.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        points.remove(0);
        self.is_passable(here, &points).then_some(CurveStep { points, resolution })
    }

    /// Whether the equations let the curve pass from point to point of a step.
    fn is_passable(
        &mut self,
        here: &ContinuationPoint<S, X>,
        points: &[(f64, ContinuationPoint<S, X>)],
    ) -> bool {
        let points = points.iter().map(|(_, point)| point);
        let mut pairs = std::iter::once(here).chain(points.clone()).zip(points);
        pairs.all(|(from, to)| self.equations.is_passable([from, to]))
    }

    /// Adds a point and the zeros before it; returns the reason if the curve ends there.
    fn add(&mut self, next: ContinuationPoint<S, X>) -> Option<ContinuationEnd> {
        let here = self.curve.points[self.curve.points.len() - 1].clone();
        let (next, border) = match self.within(&here, next) {
            Within::Range(next) => (next, None),
            Within::Border(next, unknown) => (next, Some(unknown)),
            Within::Beyond(Some(unknown)) => return Some(ContinuationEnd::Border { unknown }),
            Within::Beyond(None) => return Some(self.no_step()),
        };
        let mut found = Vec::new();
        for test in 0..here.tests.len() {
            let [a, b] = [&here, &next].map(|point| point.tests[test].beyond_rounding());
            if a == S::zero() || (a * b).to_f64() > 0.0 {
                continue;
            }
            let zero =
                zero_between(self.equations, [&here, &next], |point| point.tests[test].value);
            let Some(zero) = zero else { continue };
            let share = Chord::new([&here, &next]).map_or(S::one(), |c| c.share_of(&zero.unknowns));
            found.push((share.to_f64(), test, zero));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (share, test, zero) in found {
            // NOTE: a zero at the end of the interval is the end itself.
            if share >= 1.0 {
                continue;
            }
            let last = self.is_last(&zero);
            self.curve.turns.push(Turn { point: self.curve.points.len(), test });
            self.curve.points.push(zero);
            if last {
                return Some(ContinuationEnd::Last);
            }
        }
        for (test, value) in next.tests.iter().enumerate() {
            if value.beyond_rounding() == S::zero()
                && here.tests[test].beyond_rounding() != S::zero()
            {
                self.curve.turns.push(Turn { point: self.curve.points.len(), test });
            }
        }
        let closed = self.closes(&here, &next);
        let last = self.is_last(&next);
        self.curve.points.push(next);
        border
            .map(|unknown| ContinuationEnd::Border { unknown })
            .or(closed.then_some(ContinuationEnd::Closed))
            .or(last.then_some(ContinuationEnd::Last))
    }

    /// Whether the curve ends at a point that is added next.
    fn is_last(&mut self, next: &ContinuationPoint<S, X>) -> bool {
        let here = &self.curve.points[self.curve.points.len() - 1];
        self.equations.is_last([here, next])
    }

    /// The point, or the first point before it at which the curve crosses a border.
    fn within(
        &mut self,
        here: &ContinuationPoint<S, X>,
        next: ContinuationPoint<S, X>,
    ) -> Within<S, X> {
        let mut first: Option<(S, ContinuationPoint<S, X>, usize)> = None;
        for unknown in 0..next.unknowns.len() {
            let [lower, upper] = self.equations.range(unknown).map(S::from_f64);
            let value = next.unknowns[unknown];
            let border = match value {
                value if value > upper => upper,
                value if value < lower => lower,
                _ => continue,
            };
            if (here.unknowns[unknown] - border).magnitude() <= AT_BORDER {
                return Within::Beyond(Some(unknown));
            }
            let beyond = |point: &ContinuationPoint<S, X>| point.unknowns[unknown] - border;
            let Some(mut at) = zero_between(self.equations, [here, &next], beyond) else {
                return Within::Beyond(None);
            };
            at.unknowns[unknown] = border;
            let share = Chord::new([here, &next]).map_or(S::one(), |c| c.share_of(&at.unknowns));
            if first.as_ref().is_none_or(|(least, ..)| share < *least) {
                first = Some((share, at, unknown));
            }
        }
        match first {
            Some((_, point, unknown)) => Within::Border(point, unknown),
            None => Within::Range(next),
        }
    }

    /// Whether the first point of the curve lies between two later points.
    fn closes(&mut self, here: &ContinuationPoint<S, X>, next: &ContinuationPoint<S, X>) -> bool {
        if self.curve.points.len() <= SAMPLES {
            return false;
        }
        let mut first = self.curve.points[0].unknowns.clone();
        self.equations.bring_near(&mut first, &here.unknowns);
        let Some(chord) = Chord::new([here, next]) else {
            return false;
        };
        let share = chord.share_of(&first);
        if !(S::zero()..=S::one()).contains(&share) {
            return false;
        }
        let length = apart(&here.unknowns, &next.unknowns);
        if apart(&here.unknowns, &first) > 2.0 * length {
            return false;
        }
        let there = chord.point(self.equations, share);
        there.is_some_and(|there| apart(&there.unknowns, &first) < CLOSED * length)
    }
}

/// Resolution of the zeros of test functions by the samples of a step.
fn resolution<S: Real, X>(points: &[(f64, ContinuationPoint<S, X>)]) -> Resolution {
    let mut found = Resolution::default();
    for test in 0..points[0].1.tests.len() {
        let of = |place: usize| points[place].1.tests[test];
        let samples: [f64; SAMPLES] = from_fn(|place| of(place).value.to_f64());
        let noise = (0..SAMPLES).map(|place| of(place).noise()).fold(0.0, f64::max);
        match zeros(&samples, noise) {
            Zeros::Parted(places) => found.parting.extend(places),
            Zeros::Rounding(places) => {
                found.unresolved.extend(places.into_iter().map(|at| (test, Some(at))));
            }
            Zeros::TooLong => {
                found.too_long = true;
                found.unresolved.push((test, None));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::continuation::{Linearised, TestValue, zero_near};
    use crate::numeric::{Dd, Scalar};

    /// The circle `x² + y² = 1`, with tests `x − 1/2` and the turn of `y`.
    struct Circle {
        upper: f64,
        /// Number of evaluations left.
        left: usize,
    }

    impl<S: Real> CurveEquations<S> for Circle {
        type Extra = ();

        fn linearised(&mut self, u: &[S]) -> Option<Linearised<S>> {
            self.left = self.left.checked_sub(1)?;
            let two = S::from_f64(2.0);
            Some(Linearised {
                residual: DVector::from_vec(vec![u[0] * u[0] + u[1] * u[1] - S::one()]),
                jacobian: DMatrix::from_row_slice(1, 2, &[two * u[0], two * u[1]]),
                extra: (),
            })
        }

        fn tests(&self, point: &ContinuationPoint<S>) -> Vec<TestValue<S>> {
            let value = point.unknowns[0] - S::from_f64(0.5);
            vec![TestValue { value, size: 1.0 }, TestValue::turn(point, 1)]
        }

        fn is_spent(&self) -> bool {
            self.left == 0
        }

        fn range(&self, unknown: usize) -> [f64; 2] {
            if unknown == 1 { [-2.0, self.upper] } else { [f64::NEG_INFINITY, f64::INFINITY] }
        }
    }

    #[test]
    fn a_curve_whose_work_is_done_ends_with_what_it_has() {
        let mut circle = Circle { upper: 2.0, left: 200 };
        let curve = follow(&mut circle, &[-1.0, 0.0], &[0.0, 1.0], &StepControl::DEFAULT);
        let curve: Curve<f64> = curve.expect("a circle");
        assert_eq!(curve.end, ContinuationEnd::WorkLimit);
        let points: Vec<&Vec<f64>> = curve.points.iter().map(|point| &point.unknowns).collect();
        // More points than the start, all on the circle to the tolerance of the corrector.
        assert!(points.len() > 2, "{points:?}");
        for point in points {
            assert!((point[0].hypot(point[1]) - 1.0).abs() < 1e-11, "{point:?}");
        }
    }

    #[test]
    fn a_circle_closes_and_has_its_zeros_to_rounding() {
        let mut circle = Circle { upper: 2.0, left: usize::MAX };
        let start = [-1.0, 0.0];
        let curve = follow(&mut circle, &start, &[0.0, 1.0], &StepControl::DEFAULT);
        let curve: Curve<f64> = curve.expect("a circle");
        assert_eq!(curve.end, ContinuationEnd::Closed);
        assert!(curve.unresolved.is_empty());
        let zeros: Vec<(usize, [f64; 2])> = curve
            .turns
            .iter()
            .map(|turn| {
                let unknowns = &curve.points[turn.point].unknowns;
                (turn.test, [unknowns[0], unknowns[1]])
            })
            .collect();
        let height = 0.75_f64.sqrt();
        let expected = [(1, [0.0, 1.0]), (0, [0.5, height]), (0, [0.5, -height]), (1, [0.0, -1.0])];
        assert_eq!(zeros.len(), 4, "{zeros:?}");
        for ((test, at), (expected_test, expected)) in zeros.iter().zip(expected) {
            assert_eq!(*test, expected_test);
            let error = (at[0] - expected[0]).abs().max((at[1] - expected[1]).abs());
            assert!(error < 1e-15, "{at:?} {expected:?}");
        }
    }

    #[test]
    fn a_curve_ends_on_the_border_and_zeros_are_refined_in_double_double() {
        let mut circle = Circle { upper: 0.9, left: usize::MAX };
        let curve = follow(&mut circle, &[-1.0, 0.0], &[0.0, 1.0], &StepControl::DEFAULT);
        let curve: Curve<f64> = curve.expect("a circle");
        assert_eq!(curve.end, ContinuationEnd::Border { unknown: 1 });
        assert_eq!(curve.points.last().map(|point| point.unknowns[1]), Some(0.9));
        let near = [0.5 + 1e-13, 0.75_f64.sqrt()].map(Dd::from);
        let tangent = [-(0.75_f64.sqrt()), 0.5].map(Dd::from);
        let value = |point: &ContinuationPoint<Dd>| point.tests[0].value;
        let zero = zero_near(&mut circle, &near, &tangent, value).expect("a zero");
        let exact = Dd::from(0.75).sqrt();
        assert!((zero.unknowns[1] - exact).magnitude() < 1e-30, "{zero:?}");
    }
}
