//! Tracing of branches and the choice of branches to follow, for a map or direct simulation.
//!
//! One idea: a [`BranchSource`] finds seeds, follows a branch through each and describes it. The
//! choice and order of the seeds, and the branches that branches lead to, are handled once for all
//! sources.

use std::collections::HashSet;

use nalgebra::{Complex, DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest};
use crate::analysis::periodic::{ContactItinerary, KeptOrbit, SectionPoints, TestKind};
use crate::analysis::progress::{Progress, Shard, place_of, resumed_if};
use crate::analysis::work::MOST_WORK;
use crate::continuation::{
    ContinuationEnd, ContinuationPoint, Curve, CurveEquations, Solution, StepControl, Turn,
    any_tangent, apart, between, corrected, follow, moved, normalised, searched, tangent_at,
    unit_vector, zero_near,
};
use crate::iteration::{PhaseCircle, parallel};
use crate::numeric::linear::solve;
use crate::numeric::{Dd, converted};

/// Special points nearer than this count as one, in the units of the unknowns.
const ONE: f64 = 1e-10;
/// Rounding of a component of a unit tangent from derivatives by differences in double-double.
const ROUNDING: f64 = 1e-9;
/// Relative difference up to which section points count as equal; orbits are equal if all their
/// variables are.
pub(super) const SAME: f64 = 1e-6;
/// Distance to the orbits of half the period below which a branch point is a period-doubling.
pub(super) const NEAR: f64 = 1e-3;
/// Largest distance of a special point from its refinement in double-double.
const FAR: f64 = 1e-5;
/// Largest residual of a guess that counts as a solution.
const KNOWN: f64 = 1e-11;
/// Distances from the period-doubling point at which the doubled branch is started.
const DOUBLED: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Most rounds in which branches lead to other branches.
const ROUNDS: usize = 8;

/// Start of a branch: an orbit.
#[derive(Clone, Debug, Serialize)]
pub(super) struct BranchSeed {
    pub(super) itinerary: ContactItinerary,
    /// Section points, all or the first one only.
    pub(super) states: Vec<Vec<f64>>,
    /// Depth variables of the contacts for a map; empty for direct simulation.
    pub(super) depth_variables: Vec<f64>,
    pub(super) parameter: f64,
    /// Section points in which direct simulation follows the branch.
    pub(super) points: SectionPoints,
    pub(super) way: SeedKind,
}

/// Direction in which the branch of a seed is followed.
#[derive(Clone, Debug, Serialize)]
pub(super) enum SeedKind {
    /// Both ways through the seed.
    Through,
    /// Direction of the unknowns, from the branch of half the period.
    Doubled(Vec<f64>),
    /// Direction of the unknowns, from the end of a branch with other section points.
    On(Vec<f64>),
}

impl BranchSeed {
    /// Seed of a branch that is followed both ways.
    pub(super) fn new(
        itinerary: &ContactItinerary,
        states: Vec<Vec<f64>>,
        depth_variables: Vec<f64>,
        parameter: f64,
    ) -> Self {
        let itinerary = itinerary.clone();
        let way = SeedKind::Through;
        let points = SectionPoints::Every;
        Self { itinerary, states, depth_variables, parameter, points, way }
    }

    /// Seed of the same orbit with its shortest period and its largest rotation of the itinerary;
    /// `circle` is the phase among the coordinates.
    pub(super) fn in_standard_form(mut self, circle: PhaseCircle) -> Self {
        let (standard, period, by) = standard_form(&self.itinerary, &self.states, circle);
        if !self.depth_variables.is_empty() {
            let skipped = self.itinerary.returns()[..by].iter().map(|made| made.len()).sum();
            self.depth_variables.truncate(standard.contacts());
            self.depth_variables.rotate_left(skipped);
        }
        self.states.truncate(period);
        self.states.rotate_left(by);
        self.itinerary = standard;
        self
    }

    /// Seed of the orbit traversed twice, for a branch in a direction of the unknowns.
    pub(super) fn doubled(self, direction: &[f64]) -> Self {
        let returns = self.itinerary.returns().repeat(2);
        Self {
            itinerary: ContactItinerary::new(self.itinerary.passages(), returns),
            states: [self.states.clone(), self.states].concat(),
            depth_variables: self.depth_variables.repeat(2),
            way: SeedKind::Doubled(normalised(direction)),
            ..self
        }
    }
}

/// A branch from end to end.
#[derive(Serialize, Deserialize)]
#[serde(bound(serialize = "X: Serialize", deserialize = "X: Deserialize<'de>"))]
pub(super) struct TracedBranch<X> {
    pub(super) points: Vec<ContinuationPoint<f64, X>>,
    pub(super) turns: Vec<Turn>,
    pub(super) unresolved: Vec<[usize; 2]>,
    pub(super) ends: [ContinuationEnd; 2],
    /// Whether the branch starts at the end of another one.
    pub(super) continues: bool,
}

impl<X: Clone> TracedBranch<X> {
    /// Branch through an orbit, followed both ways.
    pub(super) fn through<C: CurveEquations<f64, Extra = X>>(
        equations: &mut C,
        start: &[f64],
        control: &StepControl,
    ) -> Option<Self> {
        let along = any_tangent(&equations.linearised(start)?.jacobian)?;
        let against: Vec<f64> = along.iter().map(|value| -value).collect();
        let on = follow(equations, start, &along, control)?;
        if on.end == ContinuationEnd::Closed {
            return Some(Self::of(on, false));
        }
        match follow(equations, start, &against, control) {
            Some(back) => Some(Self::joined(back, on)),
            // The bound on work keeps the part found so far.
            None if equations.is_spent() => {
                let ends = [ContinuationEnd::WorkLimit, on.end];
                Some(Self { ends, ..Self::of(on, false) })
            }
            None => None,
        }
    }

    /// Branch from an orbit on, on the side of `along`.
    pub(super) fn onward<C: CurveEquations<f64, Extra = X>>(
        equations: &mut C,
        start: &[f64],
        along: &[f64],
        control: &StepControl,
    ) -> Option<Self> {
        let tangent = tangent_at(&equations.linearised(start)?.jacobian, along)?;
        Some(Self::of(follow(equations, start, &tangent, control)?, true))
    }

    /// Branch of a single curve.
    fn of(curve: Curve<f64, X>, continues: bool) -> Self {
        let Curve { points, turns, unresolved, end } = curve;
        let unresolved = unresolved.into_iter().map(|(_, ends)| ends).collect();
        Self { points, turns, unresolved, ends: [end; 2], continues }
    }

    /// Branch of two curves from one point, the first one reversed.
    fn joined(back: Curve<f64, X>, on: Curve<f64, X>) -> Self {
        let last = back.points.len() - 1;
        let ends = [back.end, on.end];
        let turned = back.turns.iter().rev().map(|turn| Turn { point: last - turn.point, ..*turn });
        // Turns at the shared first point belong to both curves.
        let later = on.turns.iter().filter(|turn| turn.point > 0);
        let moved = later.map(|turn| Turn { point: last + turn.point, ..*turn });
        let turns = turned.chain(moved).collect();
        let before = back.unresolved.iter().map(|(_, [a, b])| [last - b, last - a]);
        let later = on.unresolved.iter().map(|(_, [a, b])| [last + a, last + b]);
        let unresolved = before.chain(later).collect();
        let points = back.points.into_iter().rev().chain(on.points.into_iter().skip(1)).collect();
        Self { points, turns, unresolved, ends, continues: false }
    }

    /// Indices of the points that are returned, with the test functions that vanish at each:
    /// special points that agree to rounding are merged.
    pub(super) fn orbits(&self) -> Vec<(usize, Vec<usize>)> {
        let mut orbits: Vec<(usize, Vec<usize>)> = Vec::with_capacity(self.points.len());
        for place in 0..self.points.len() {
            let mine = self.turns.iter().filter(|turn| turn.point == place);
            let mine: Vec<usize> = mine.map(|turn| turn.test).collect();
            let same = |before: usize| {
                apart(&self.points[before].unknowns, &self.points[place].unknowns) < ONE
            };
            match orbits.last_mut() {
                Some((before, turns)) if !turns.is_empty() && !mine.is_empty() && same(*before) => {
                    turns.extend(mine);
                    turns.sort_unstable();
                    turns.dedup();
                }
                _ => orbits.push((place, mine)),
            }
        }
        orbits
    }

    /// Reasons for the ends; `border` translates the unknown that reached its border.
    pub(super) fn ends(&self, border: impl Fn(usize) -> BranchEnd) -> [BranchEnd; 2] {
        let ends = self.ends.map(|end| match end {
            ContinuationEnd::Border { unknown } => border(unknown),
            ContinuationEnd::Closed => BranchEnd::Closed,
            ContinuationEnd::Last => BranchEnd::Doubling,
            ContinuationEnd::StepTooSmall => BranchEnd::StepTooSmall,
            ContinuationEnd::StepLimit => BranchEnd::StepLimit,
            ContinuationEnd::WorkLimit => BranchEnd::WorkLimit,
        });
        if self.continues { [BranchEnd::Continued, ends[1]] } else { ends }
    }
}

impl<X: KeptOrbit> TracedBranch<X> {
    /// Whether a kept branch has the sizes and indices that its equations, with `count` unknowns,
    /// give: those at one of its points are computed anew.
    pub(super) fn fits<C: CurveEquations<f64, Extra = X>>(
        &self,
        itinerary: &ContactItinerary,
        equations: &mut C,
        count: usize,
    ) -> bool {
        let points = self.points.len();
        let sizes = |point: &ContinuationPoint<f64, X>| {
            [point.unknowns.len(), point.tangent.len()] == [count; 2]
        };
        if !self.points.iter().all(sizes) {
            return false;
        }
        // A point at the border of the equations may have no derivatives.
        let computed = [points / 2, 0].into_iter().find_map(|place| {
            let ContinuationPoint { unknowns, tangent, .. } = self.points.get(place)?;
            let (unknowns, tangent) = (unknowns.clone(), tangent.clone());
            let linearised = equations.linearised(&unknowns)?;
            Some(ContinuationPoint { unknowns, tangent, linearised, tests: Vec::new() })
        });
        let Some(computed) = computed else { return false };
        let tests = equations.tests(&computed).len();
        let is_like = |point: &ContinuationPoint<f64, X>| {
            let [kept, own] = [&point.linearised, &computed.linearised];
            point.tests.len() == tests
                && kept.residual.len() == own.residual.len()
                && kept.jacobian.shape() == own.jacobian.shape()
                && kept.extra.is_like(&own.extra, itinerary)
        };
        let is_border_known = |end: &ContinuationEnd| match *end {
            ContinuationEnd::Border { unknown } => unknown < count,
            _ => true,
        };
        self.points.iter().all(is_like)
            && self.turns.iter().all(|turn| turn.point < points && turn.test < tests)
            && self.unresolved.iter().flatten().all(|&point| point < points)
            && self.ends.iter().all(is_border_known)
    }
}

/// Result of a search from a seed.
#[derive(Serialize, Deserialize)]
#[serde(bound(serialize = "X: Serialize", deserialize = "X: Deserialize<'de>"))]
pub(super) struct SearchedBranch<X> {
    pub(super) trace: Option<TracedBranch<X>>,
    /// Work needed.
    pub(super) work: u64,
}

/// Kinds of kept pieces of branches.
#[derive(Clone, Copy)]
pub(super) enum BranchPiece {
    /// Result of the search from a seed.
    Trace,
    /// A branch in its final form.
    Branch,
    /// Flights of direct simulation.
    Flights,
}

/// Choice of branches that others lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::analysis) enum Follow {
    /// Branches of every itinerary.
    All,
    /// Branches of the itineraries asked for.
    Asked,
}

/// Extent to which branches of direct simulation are followed.
#[derive(Clone, Debug)]
pub(in crate::analysis) struct Extent {
    /// Choice of the branches that other branches lead to.
    pub(in crate::analysis) follow: Follow,
    /// Graze at which branches may begin; `None`: the grazes that are found.
    pub(in crate::analysis) graze: Option<GrazeStart>,
    /// Most work for the seeds of one itinerary, in products of series.
    pub(in crate::analysis) most_work: u64,
}

impl Extent {
    /// Extent with a choice of branches, from the grazes that are found, within [`MOST_WORK`].
    pub(in crate::analysis) fn to(follow: Follow) -> Self {
        Self { follow, graze: None, most_work: MOST_WORK }
    }
}

/// Graze of the orbit without contact: section point and value of the varied parameter, in offsets.
pub(in crate::analysis) type GrazeStart = (Vec<f64>, f64);

/// Branches by itinerary.
pub(super) type Traces<X> = Vec<(ContactItinerary, Vec<TracedBranch<X>>)>;

/// Finds and describes the orbits of branches: implemented by a map and by direct simulation.
pub(super) trait BranchSource: Sync {
    /// Data of an orbit beside its equations.
    type Orbit: Clone + Serialize + DeserializeOwned + KeptOrbit + Send + Sync;
    /// Data shared by the seeds of all itineraries.
    type SeedData: Sync;

    /// Request, and receiver of progress.
    fn asked(&self) -> (&BranchRequest, &dyn Progress);
    fn seed_data(&self) -> Self::SeedData;
    /// Itineraries that were found and are none of those asked for: repetitions of one of them, by
    /// orbits that repeat later than their passages do.
    fn repeated(&self, _: &Self::SeedData) -> Vec<ContactItinerary> {
        Vec::new()
    }
    /// Seeds for the branches of an itinerary.
    fn seeds(&self, itinerary: &ContactItinerary, data: &Self::SeedData) -> Vec<BranchSeed>;
    /// Branch of an itinerary through a seed, if it is not among those known, with at most `most`
    /// work.
    fn trace(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        known: &[TracedBranch<Self::Orbit>],
        most: u64,
    ) -> SearchedBranch<Self::Orbit>;
    /// Whether a kept branch has the sizes and indices of the equations of its itinerary.
    fn fits(&self, itinerary: &ContactItinerary, trace: &TracedBranch<Self::Orbit>) -> bool;
    /// Most work for the seeds of an itinerary, in all rounds together.
    fn most_work(&self) -> u64 {
        u64::MAX
    }
    /// Notes an itinerary that was not followed completely.
    fn cut_short(&self, _: &ContactItinerary) {}
    /// Seeds of the branches that a branch leads to: with one contact more or less at a graze, with
    /// the doubled period at a flip.
    fn led_to(
        &self,
        itinerary: &ContactItinerary,
        trace: &TracedBranch<Self::Orbit>,
    ) -> Vec<BranchSeed>;
    /// Branch in its final form, with special points solved for.
    fn branch(&self, itinerary: &ContactItinerary, trace: &TracedBranch<Self::Orbit>) -> Branch;

    /// Adds the branches of an itinerary through seeds to those known, within the work left for the
    /// itinerary.
    ///
    /// Seeds always come in the same order, so that a seed, the number of branches known and the
    /// work left determine the result.
    fn traces(
        &self,
        itinerary: &ContactItinerary,
        seeds: Vec<BranchSeed>,
        (mut traces, left): (Vec<TracedBranch<Self::Orbit>>, &mut u64),
    ) -> Vec<TracedBranch<Self::Orbit>> {
        let (_, progress) = self.asked();
        let mut looked_at = HashSet::new();
        for seed in seeds {
            // An equal seed finds no new branch.
            if !looked_at.insert(place_of(BranchPiece::Trace as u64, &(traces.len(), &seed))) {
                continue;
            }
            if *left == 0 {
                self.cut_short(itinerary);
                break;
            }
            let place =
                place_of(BranchPiece::Trace as u64, &(itinerary, traces.len(), &seed, *left));
            let search = || self.trace(itinerary, &seed, &traces, *left);
            let fits = |found: &SearchedBranch<Self::Orbit>| {
                found.trace.as_ref().is_none_or(|trace| self.fits(itinerary, trace))
            };
            let SearchedBranch { trace, work } = resumed_if(progress, &place, fits, search);
            *left = left.saturating_sub(work);
            traces.extend(trace);
        }
        traces
    }

    /// Branches of the itineraries in `own`, and the work left for each.
    fn first(
        &self,
        own: &[&ContactItinerary],
        data: &Self::SeedData,
    ) -> (Traces<Self::Orbit>, Vec<u64>) {
        let (_, progress) = self.asked();
        progress.expect(own.len() as u64);
        let found = parallel::map(own, |&itinerary| {
            let (seeds, mut left) = (self.seeds(itinerary, data), self.most_work());
            let traces = self.traces(itinerary, seeds, (Vec::new(), &mut left));
            progress.advance(1);
            ((itinerary.clone(), traces), left)
        });
        found.into_iter().unzip()
    }

    /// All branches, with those that they lead to, repeatedly.
    fn all(&self, follow: Follow) -> Traces<Self::Orbit> {
        let (asked, data) = (&self.asked().0.itineraries, self.seed_data());
        let repeated = self.repeated(&data);
        let own: Vec<&ContactItinerary> = asked.iter().chain(&repeated).collect();
        let (mut found, mut left) = self.first(&own, &data);
        let mut looked_at = vec![0; found.len()];
        for _ in 0..ROUNDS {
            let mut seeds: Vec<BranchSeed> = Vec::new();
            for ((itinerary, traces), looked_at) in found.iter().zip(&mut looked_at) {
                let new = traces[*looked_at..].iter();
                seeds.extend(new.flat_map(|trace| self.led_to(itinerary, trace)));
                *looked_at = traces.len();
            }
            seeds.retain(|seed| follow == Follow::All || asked.contains(&seed.itinerary));
            if seeds.is_empty() {
                break;
            }
            for seed in &seeds {
                if !found.iter().any(|(itinerary, _)| *itinerary == seed.itinerary) {
                    found.push((seed.itinerary.clone(), Vec::new()));
                    looked_at.push(0);
                    left.push(self.most_work());
                }
            }
            let (_, progress) = self.asked();
            progress.expect(found.len() as u64);
            parallel::map(found.iter_mut().zip(&mut left), |((itinerary, traces), left)| {
                let mine = seeds.iter().filter(|seed| seed.itinerary == *itinerary).cloned();
                let known = std::mem::take(traces);
                *traces = self.traces(itinerary, mine.collect(), (known, left));
                progress.advance(1);
            });
        }
        found.sort_by_key(|(itinerary, _)| itinerary.period());
        found
    }

    /// Branches in their final form.
    fn described(&self, found: &Traces<Self::Orbit>) -> Vec<Branch> {
        let traces = found.iter().flat_map(|(of, traces)| traces.iter().map(move |t| (of, t)));
        let (_, progress) = self.asked();
        progress.expect(traces.clone().count() as u64);
        parallel::map(traces, |(itinerary, trace)| {
            let place = place_of(BranchPiece::Branch as u64, &(itinerary, trace));
            let states = trace.points[0].linearised.extra.states();
            let sizes = [states.len(), states[0].len(), self.asked().0.at.len()];
            let fits = |branch: &Branch| branch.fits(itinerary, sizes);
            let branch = resumed_if(progress, &place, fits, || self.branch(itinerary, trace));
            progress.advance(1);
            branch
        })
    }

    /// Computes a share of the branches of the itineraries asked for.
    fn find_share(&self, shard: &Shard<'_>) {
        let own = shard.own_of(&self.asked().0.itineraries);
        self.described(&self.first(&own, &self.seed_data()).0);
    }
}

/// Orbit at the parameter of a guess; the guess itself if it is a solution.
pub(super) fn solved<C: CurveEquations<f64>>(
    equations: &mut C,
    guess: &[f64],
) -> Option<Solution<f64, C::Extra>> {
    let there = equations.linearised(guess)?;
    match there.residual.amax() <= KNOWN {
        true => Some((guess.to_vec(), there)),
        false => searched(equations, guess, guess.len() - 1),
    }
}

/// Whether a solution has a shorter period; `is_repeated` compares its section points.
///
/// A guess counts as a solution though its residual may exceed a coordinate that is nearly zero, so
/// the orbit is corrected to rounding before it counts as one of its own.
pub(super) fn has_shorter_period<C: CurveEquations<f64>>(
    equations: &mut C,
    (unknowns, there): &Solution<f64, C::Extra>,
    is_repeated: impl Fn(&C, &C::Extra, f64) -> bool,
) -> bool {
    if is_repeated(equations, &there.extra, SAME) {
        return true;
    }
    let held = unit_vector(unknowns.len(), unknowns.len() - 1);
    let exact = corrected(equations, unknowns, unknowns, &held);
    exact.is_some_and(|(_, exact)| is_repeated(equations, &exact.extra, SAME))
}

/// First orbit of a doubled branch, in a direction from the period-doubling point; `is_repeated`
/// tells whether an orbit has half the period.
pub(super) fn first_doubled<C: CurveEquations<f64>>(
    equations: &mut C,
    origin: &[f64],
    direction: &[f64],
    is_repeated: impl Fn(&C, &C::Extra, f64) -> bool,
) -> Option<Solution<f64, C::Extra>> {
    DOUBLED.iter().find_map(|&distance| {
        let start = moved(origin, direction, distance);
        let found = corrected(equations, &start, &start, direction)?;
        (!is_repeated(equations, &found.1.extra, 0.1 * distance)).then_some(found)
    })
}

/// Whether an orbit lies on one of several polylines, within a multiple of the local distances plus
/// `slack`. The orbit is given by its first variables, from each possible starting point, and its
/// parameter.
pub(super) fn lies_on<C: CurveEquations<f64>>(
    equations: &mut C,
    (starts, parameter): (&[Vec<f64>], f64),
    lines: &[Vec<Vec<f64>>],
    slack: f64,
) -> bool {
    let near = |equations: &C, at: &[f64], within: f64| {
        starts.iter().any(|start| {
            let mut start = start.clone();
            equations.bring_near(&mut start, at);
            apart(&at[..start.len()], &start) <= within
        })
    };
    if lines.iter().flatten().any(|point| near(equations, point, SAME)) {
        return true;
    }
    lines.iter().flat_map(|points| points.windows(2)).any(|pair| {
        let [a, b] = [&pair[0], &pair[1]];
        let last = a.len() - 1;
        let passes = (a[last] - parameter) * (b[last] - parameter) <= 0.0;
        if !passes || !near(equations, a, 3.0 * apart(a, b) + slack) {
            return false;
        }
        let run = b[last] - a[last];
        let share = if run == 0.0 { 0.0 } else { (parameter - a[last]) / run };
        let guess = between(a, b, share);
        let there = corrected(equations, &guess, &guess, &unit_vector(guess.len(), last));
        there.is_some_and(|(there, _)| near(equations, &there, SAME))
    })
}

/// Refines a special point, a zero of test function `test`, to the rounding of double-double.
pub(super) fn refined<X, C: CurveEquations<Dd>>(
    fine: &mut C,
    point: &ContinuationPoint<f64, X>,
    test: usize,
) -> Option<ContinuationPoint<Dd, C::Extra>> {
    let (at, tangent) = (converted::<_, Dd>(&point.unknowns), converted::<_, Dd>(&point.tangent));
    let found = zero_near(fine, &at, &tangent, |point| point.tests[test].value)?;
    (apart(&converted(&found.unknowns), &point.unknowns) < FAR).then_some(found)
}

/// Labels of a point at which test functions vanish. `near` and `on_circle` are the largest
/// distances of real multipliers and of complex pairs from their critical values.
pub(super) fn label_of(
    vanishing: impl Iterator<Item = TestKind>,
    multipliers: &[Complex<f64>],
    [near, on_circle]: [f64; 2],
) -> impl Iterator<Item = BranchLabel> {
    let is_near =
        |value: f64| multipliers.iter().any(|multiplier| (multiplier - value).norm() < near);
    let is_pair = |value: &Complex<f64>| value.im != 0.0 && (value.norm() - 1.0).abs() < on_circle;
    let [one, minus_one] = [1.0, -1.0].map(is_near);
    let circle = multipliers.iter().any(is_pair);
    vanishing.filter_map(move |test| match test {
        TestKind::Turn if one => Some(BranchLabel::SaddleNode),
        TestKind::Flip if minus_one => Some(BranchLabel::PeriodDoubling),
        TestKind::Contact(_) | TestKind::Passage(_) => Some(BranchLabel::Graze),
        TestKind::Crossing if one => Some(BranchLabel::BranchPoint),
        TestKind::Reciprocal if circle => Some(BranchLabel::NeimarkSacker),
        _ => None,
    })
}

/// First half of an itinerary that consists of two equal halves.
pub(super) fn halved(itinerary: &ContactItinerary) -> ContactItinerary {
    let returns = itinerary.returns()[..itinerary.period() / 2].to_vec();
    ContactItinerary::new(itinerary.passages(), returns)
}

/// Removes duplicate branch points: at a period-doubling the parameter of the doubled branch turns
/// too, and both zeros are found with half the digits.
pub(super) fn each_once(mut points: Vec<BranchPoint>) -> Vec<BranchPoint> {
    let is_branch_point = |point: &BranchPoint| {
        point.special.as_ref().is_some_and(|special| special.label == BranchLabel::BranchPoint)
    };
    points.dedup_by(|later, point| {
        is_branch_point(later)
            && is_branch_point(point)
            && later.orbit.parameters == point.orbit.parameters
    });
    points
}

/// Standard form of the itinerary of an orbit with the given section points; then the number of
/// returns in its shortest period, and the number of them before its first return.
fn standard_form(
    itinerary: &ContactItinerary,
    states: &[Vec<f64>],
    circle: PhaseCircle,
) -> (ContactItinerary, usize, usize) {
    let period = itinerary.period();
    let near = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).enumerate().all(|(place, (a, b))| {
            circle.shortest(place, a - b).abs() <= SAME * a.abs().max(b.abs())
        })
    };
    let repeats = |shorter: &usize| {
        period.is_multiple_of(*shorter)
            && itinerary.repeats_after(*shorter)
            && (0..period).all(|n| near(&states[n], &states[(n + shorter) % period]))
    };
    let shortest = (1..period).find(repeats).unwrap_or(period);
    let returns = itinerary.returns()[..shortest].to_vec();
    let shorter = ContactItinerary::new(itinerary.passages(), returns);
    let (standard, by) = shorter.largest_rotation();
    (standard, shortest, by)
}

/// Adds the contact of a passage to an itinerary, or removes it.
pub(super) fn toggled(
    itinerary: &ContactItinerary,
    number: usize,
    passage: usize,
) -> ContactItinerary {
    match itinerary.returns()[number].contains(passage) {
        true => itinerary.without_contact(number, passage),
        false => itinerary.with_contact(number, passage),
    }
}

/// Unit vector that a nearly singular matrix shortens most, by inverse iteration.
pub(super) fn null_vector(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let size = matrix.nrows();
    let shift = 1e-14 * matrix.amax();
    let mut shifted = matrix.clone();
    for place in 0..size {
        shifted[(place, place)] += shift;
    }
    let mut vector = DVector::from_fn(size, |place, _| 1.0 / (1.0 + place as f64));
    for _ in 0..3 {
        vector = solve(&shifted, &vector).ok()?.normalize();
    }
    vector.iter().all(|value| value.is_finite()).then(|| vector.iter().copied().collect())
}

/// Component of a unit tangent, or 0 if it is within rounding: a parameter that depends on the
/// square of a speed has derivative 0.
pub(super) fn exact_or_zero(component: f64) -> f64 {
    if component.abs() <= ROUNDING { 0.0 } else { component }
}
