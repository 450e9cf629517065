//! A branch as it is followed, whatever its orbits are of.

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest};
use crate::analysis::continuation::{
    Course, CourseEnd, CurveEquations, CurvePoint, StepControl, Turn, follow, tangent_at,
};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{Progress, place_of, resumed};
use crate::iteration::PassageSet;
use crate::numeric::linear::solve;

/// Special points nearer than this are one, in the units of the unknowns.
pub(super) const ONE: f64 = 1e-10;
/// Rounding of a component of a unit tangent, by derivatives that are differences in
/// double-double.
const ROUNDING: f64 = 1e-9;
/// Section points are the same where they agree to this share of themselves.
const SAME: f64 = 1e-6;
/// Rounds in which branches lead to others.
const ROUNDS: usize = 8;

/// A branch from its one end to the other.
#[derive(Serialize, Deserialize)]
#[serde(bound(serialize = "X: Serialize", deserialize = "X: Deserialize<'de>"))]
pub(super) struct Trace<X> {
    pub(super) points: Vec<CurvePoint<f64, X>>,
    pub(super) turns: Vec<Turn>,
    pub(super) unresolved: Vec<[usize; 2]>,
    pub(super) ends: [CourseEnd; 2],
    /// Whether it begins where another ends.
    pub(super) continues: bool,
}

impl<X: Clone> Trace<X> {
    /// The branch through an orbit, both ways.
    pub(super) fn through<C: CurveEquations<f64, Extra = X>>(
        equations: &mut C,
        start: &[f64],
        control: &StepControl,
    ) -> Option<Self> {
        let linearised = equations.linearised(start)?;
        let units = (0..start.len()).rev().map(|place| unit_vector(start.len(), place));
        let mut tangents = units.filter_map(|unit| tangent_at(&linearised.jacobian, &unit));
        let along = tangents.next()?;
        let against: Vec<f64> = along.iter().map(|value| -value).collect();
        let on = follow(equations, start, &along, control)?;
        if on.end == CourseEnd::Closed {
            let unresolved = on.unresolved.iter().map(|(_, ends)| *ends).collect();
            let ends = [on.end, on.end];
            return Some(Self {
                points: on.points,
                turns: on.turns,
                unresolved,
                ends,
                continues: false,
            });
        }
        let back = follow(equations, start, &against, control)?;
        Some(Self::joined(back, on))
    }

    /// The branch from an orbit on, on the side of `along`.
    pub(super) fn onward<C: CurveEquations<f64, Extra = X>>(
        equations: &mut C,
        start: &[f64],
        along: &[f64],
        control: &StepControl,
    ) -> Option<Self> {
        let tangent = tangent_at(&equations.linearised(start)?.jacobian, along)?;
        let on = follow(equations, start, &tangent, control)?;
        let unresolved = on.unresolved.iter().map(|(_, ends)| *ends).collect();
        let ends = [on.end; 2];
        let continues = true;
        Some(Self { points: on.points, turns: on.turns, unresolved, ends, continues })
    }

    /// Two courses from one point, the first backwards.
    fn joined(back: Course<f64, X>, on: Course<f64, X>) -> Self {
        let last = back.points.len() - 1;
        let ends = [back.end, on.end];
        let turned = back.turns.iter().rev().map(|turn| Turn { point: last - turn.point, ..*turn });
        // Those of the first point are among both.
        let later = on.turns.iter().filter(|turn| turn.point > 0);
        let moved = later.map(|turn| Turn { point: last + turn.point, ..*turn });
        let turns = turned.chain(moved).collect();
        let before = back.unresolved.iter().map(|(_, [a, b])| [last - b, last - a]);
        let later = on.unresolved.iter().map(|(_, [a, b])| [last + a, last + b]);
        let unresolved = before.chain(later).collect();
        let points = back.points.into_iter().rev().chain(on.points.into_iter().skip(1)).collect();
        Self { points, turns, unresolved, ends, continues: false }
    }

    /// The places of the points that are given out, with the test functions that vanish at each:
    /// special points that agree to rounding are one.
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

    /// Why it ends, where the unknown of a border is given a meaning.
    pub(super) fn ends(&self, border: impl Fn(usize) -> BranchEnd) -> [BranchEnd; 2] {
        let ends = self.ends.map(|end| match end {
            CourseEnd::Border { unknown } => border(unknown),
            CourseEnd::Closed => BranchEnd::Closed,
            CourseEnd::Last => BranchEnd::Doubling,
            CourseEnd::StepTooSmall => BranchEnd::StepTooSmall,
            CourseEnd::StepLimit => BranchEnd::StepLimit,
        });
        if self.continues { [BranchEnd::Continued, ends[1]] } else { ends }
    }
}

/// The kinds of pieces that are kept of branches.
#[derive(Clone, Copy)]
pub(super) enum Piece {
    /// What is found through a seed.
    Trace,
    /// A branch as it is given out, by what was followed.
    Branch,
    /// What simulation settles on.
    Flights,
}

/// The branch through a seed, beside so many that are known, unless an earlier run kept it: the
/// same seeds come in the same order, so that these numbers decide it.
pub(super) fn through_seed<X: Serialize + DeserializeOwned>(
    progress: &dyn Progress,
    itinerary: &ContactItinerary,
    known: usize,
    seed: &impl Serialize,
    follow: impl FnOnce() -> Option<Trace<X>>,
) -> Option<Trace<X>> {
    resumed(progress, &place_of(Piece::Trace as u64, &(itinerary, known, seed)), follow)
}

/// The branches as they are given out, their special points solved for.
pub(super) fn described<X: Serialize + Sync>(
    progress: &dyn Progress,
    found: &Traces<X>,
    describe: impl Fn(&ContactItinerary, &Trace<X>) -> Branch + Sync,
) -> Vec<Branch> {
    let traces =
        found.iter().flat_map(|(itinerary, traces)| traces.iter().map(move |t| (itinerary, t)));
    let traces: Vec<_> = traces.collect();
    let branches = traces.into_par_iter().map(|(itinerary, trace)| {
        let place = place_of(Piece::Branch as u64, &(itinerary, trace));
        resumed(progress, &place, || describe(itinerary, trace))
    });
    branches.collect()
}

/// What belongs to an itinerary: an orbit from which a branch is followed.
pub(super) trait Of {
    fn itinerary(&self) -> &ContactItinerary;
}

/// Which branches are followed that others lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::analysis) enum Follow {
    /// Those of every itinerary.
    All,
    /// Those of the itineraries asked for.
    Asked,
}

impl Follow {
    /// Those of these seeds that are followed.
    pub(super) fn of<S: Of>(self, request: &BranchRequest, mut seeds: Vec<S>) -> Vec<S> {
        if self == Self::Asked {
            seeds.retain(|seed| request.itineraries.contains(seed.itinerary()));
        }
        seeds
    }
}

/// The branches of itineraries.
pub(super) type Traces<X> = Vec<(ContactItinerary, Vec<Trace<X>>)>;

/// Branches with those that they lead to, and so on: `led_to` says from where others begin, and
/// `followed` adds the branches of an itinerary through some of these seeds.
pub(super) fn with_those_led_to<X: Send, S: Clone + Sync>(
    mut found: Traces<X>,
    itinerary_of: impl Fn(&S) -> &ContactItinerary + Sync,
    led_to: impl Fn(&ContactItinerary, &Trace<X>) -> Vec<S>,
    followed: impl Fn(&ContactItinerary, Vec<S>, Vec<Trace<X>>) -> Vec<Trace<X>> + Sync,
) -> Traces<X> {
    let mut looked_at = vec![0; found.len()];
    for _ in 0..ROUNDS {
        let mut seeds: Vec<S> = Vec::new();
        for ((itinerary, traces), looked_at) in found.iter().zip(&mut looked_at) {
            seeds.extend(traces[*looked_at..].iter().flat_map(|trace| led_to(itinerary, trace)));
            *looked_at = traces.len();
        }
        if seeds.is_empty() {
            break;
        }
        for seed in &seeds {
            let known = |(itinerary, _): &(ContactItinerary, _)| itinerary == itinerary_of(seed);
            if !found.iter().any(known) {
                found.push((itinerary_of(seed).clone(), Vec::new()));
                looked_at.push(0);
            }
        }
        found.par_iter_mut().for_each(|(itinerary, traces)| {
            let mine = seeds.iter().filter(|seed| itinerary_of(seed) == itinerary).cloned();
            *traces = followed(itinerary, mine.collect(), std::mem::take(traces));
        });
    }
    found.sort_by_key(|(itinerary, _)| itinerary.period());
    found
}

/// The points of a branch with each branch point told once: where a branch doubles its parameter
/// turns too, and both zeros are found to half the digits.
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

/// The standard form of the itinerary of an orbit with these section points: how many returns of
/// it are its shortest period, and how many of those come before the first one.
pub(super) fn standard_form(
    itinerary: &ContactItinerary,
    states: &[Vec<f64>],
) -> (ContactItinerary, usize, usize) {
    let period = itinerary.period();
    let near = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()))
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

/// An itinerary with the contact of a passage made or left out.
pub(super) fn toggled(
    itinerary: &ContactItinerary,
    number: usize,
    passage: usize,
) -> ContactItinerary {
    let mut returns: Vec<PassageSet> = itinerary.returns().to_vec();
    match returns[number].contains(passage) {
        true => {
            returns[number] = returns[number].iter().filter(|&other| other != passage).collect();
        }
        false => returns[number].insert(passage),
    }
    ContactItinerary::new(itinerary.passages(), returns)
}

/// An itinerary gone through twice.
pub(super) fn twice(itinerary: &ContactItinerary) -> ContactItinerary {
    let returns = [itinerary.returns(), itinerary.returns()].concat();
    ContactItinerary::new(itinerary.passages(), returns)
}

/// The unit vector that a nearly singular matrix takes to the least length, by inverse iteration.
pub(super) fn null_vector(matrix: &nalgebra::DMatrix<f64>) -> Option<Vec<f64>> {
    let size = matrix.nrows();
    let shift = 1e-14 * matrix.amax();
    let mut shifted = matrix.clone();
    for place in 0..size {
        shifted[(place, place)] += shift;
    }
    let mut vector = nalgebra::DVector::from_fn(size, |place, _| 1.0 / (1.0 + place as f64));
    for _ in 0..3 {
        vector = solve(&shifted, &vector).ok()?.normalize();
    }
    vector.iter().all(|value| value.is_finite()).then(|| vector.iter().copied().collect())
}

/// A component of a unit tangent, or 0 where it is rounding: a parameter that changes with the
/// square of a speed does not change with it.
pub(super) fn exact_or_zero(component: f64) -> f64 {
    if component.abs() <= ROUNDING { 0.0 } else { component }
}

pub(super) fn unit_vector(size: usize, place: usize) -> Vec<f64> {
    let mut unit = vec![0.0; size];
    unit[place] = 1.0;
    unit
}

pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
