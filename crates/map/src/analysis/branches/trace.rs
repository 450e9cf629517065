//! A branch as it is followed, and which branches are, whatever their orbits are of.
//!
//! One idea: an [`Oracle`] finds seeds, follows a branch through each and describes it; which seeds
//! are followed, in what order, and where branches lead to others is written once.

use std::collections::HashSet;

use nalgebra::{Complex, DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest};
use crate::analysis::continuation::{
    Course, CourseEnd, CurveEquations, CurvePoint, Solution, StepControl, Turn, any_tangent, apart,
    between, corrected, follow, moved, normalised, searched, tangent_at, unit_vector, zero_near,
};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{Progress, Shard, place_of, resumed};
use crate::iteration::{PhaseCircle, parallel};
use crate::numeric::linear::solve;
use crate::numeric::{Dd, converted};

/// Special points nearer than this are one, in the units of the unknowns.
const ONE: f64 = 1e-10;
/// Rounding of a component of a unit tangent, by derivatives that are differences in
/// double-double.
const ROUNDING: f64 = 1e-9;
/// Section points are the same where they agree to this share of themselves, and orbits where all
/// their variables do.
pub(super) const SAME: f64 = 1e-6;
/// Orbits this near to those of half their period are where a branch doubles.
pub(super) const NEAR: f64 = 1e-3;
/// How far from a special point its refinement in double-double may lie.
const FAR: f64 = 1e-5;
/// Largest residual of an orbit that is known to be one.
const KNOWN: f64 = 1e-11;
/// Distances from the orbit that doubles at which the doubled branch begins.
const DOUBLED: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Rounds in which branches lead to others.
const ROUNDS: usize = 8;

/// An orbit from which a branch is followed.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Seed {
    pub(super) itinerary: ContactItinerary,
    /// Its section points, or the first one alone.
    pub(super) states: Vec<Vec<f64>>,
    /// The depth variable of each contact by a map; none by direct simulation.
    pub(super) depth_variables: Vec<f64>,
    pub(super) parameter: f64,
    /// Whether section points are those at contacts alone, as they may be by direct simulation.
    pub(super) at_contacts: bool,
    pub(super) way: Way,
}

/// Where the branch of a seed goes.
#[derive(Clone, Debug, Serialize)]
pub(super) enum Way {
    /// Through it.
    Through,
    /// In this direction of the unknowns, from the branch of half the period.
    Doubled(Vec<f64>),
    /// On in this direction, from the end of a branch in other section points.
    On(Vec<f64>),
}

impl Seed {
    /// An orbit through which a branch is followed.
    pub(super) fn new(
        itinerary: &ContactItinerary,
        states: Vec<Vec<f64>>,
        depth_variables: Vec<f64>,
        parameter: f64,
    ) -> Self {
        let itinerary = itinerary.clone();
        let way = Way::Through;
        Self { itinerary, states, depth_variables, parameter, at_contacts: false, way }
    }

    /// Seed of the same orbit, of its shortest period and begun where its itinerary is the largest;
    /// `circle` is the phase among its coordinates.
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

    /// The same orbit gone through twice, from which a branch goes in a direction of its unknowns.
    pub(super) fn doubled(self, direction: &[f64]) -> Self {
        let returns = self.itinerary.returns().repeat(2);
        Self {
            itinerary: ContactItinerary::new(self.itinerary.passages(), returns),
            states: [self.states.clone(), self.states].concat(),
            depth_variables: self.depth_variables.repeat(2),
            way: Way::Doubled(normalised(direction)),
            ..self
        }
    }
}

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
        let along = any_tangent(&equations.linearised(start)?.jacobian)?;
        let against: Vec<f64> = along.iter().map(|value| -value).collect();
        let on = follow(equations, start, &along, control)?;
        if on.end == CourseEnd::Closed {
            return Some(Self::of(on, false));
        }
        match follow(equations, start, &against, control) {
            Some(back) => Some(Self::joined(back, on)),
            // What was found before the work was done is what there is.
            None if equations.is_spent() => {
                let ends = [CourseEnd::WorkLimit, on.end];
                Some(Self { ends, ..Self::of(on, false) })
            }
            None => None,
        }
    }

    /// The branch from an orbit on, on the side of `along`.
    pub(super) fn onward<C: CurveEquations<f64, Extra = X>>(
        equations: &mut C,
        start: &[f64],
        along: &[f64],
        control: &StepControl,
    ) -> Option<Self> {
        let tangent = tangent_at(&equations.linearised(start)?.jacobian, along)?;
        Some(Self::of(follow(equations, start, &tangent, control)?, true))
    }

    /// One course alone.
    fn of(course: Course<f64, X>, continues: bool) -> Self {
        let Course { points, turns, unresolved, end } = course;
        let unresolved = unresolved.into_iter().map(|(_, ends)| ends).collect();
        Self { points, turns, unresolved, ends: [end; 2], continues }
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
            CourseEnd::WorkLimit => BranchEnd::WorkLimit,
        });
        if self.continues { [BranchEnd::Continued, ends[1]] } else { ends }
    }
}

/// Result of a search from a seed.
#[derive(Serialize, Deserialize)]
#[serde(bound(serialize = "X: Serialize", deserialize = "X: Deserialize<'de>"))]
pub(super) struct Searched<X> {
    pub(super) trace: Option<Trace<X>>,
    /// The work that it took.
    pub(super) work: u64,
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

/// Which branches are followed that others lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::analysis) enum Follow {
    /// Those of every itinerary.
    All,
    /// Those of the itineraries asked for.
    Asked,
}

/// The branches of itineraries.
pub(super) type Traces<X> = Vec<(ContactItinerary, Vec<Trace<X>>)>;

/// What finds the orbits of branches and describes them: a map, or direct simulation.
pub(super) trait Oracle: Sync {
    /// What is known of an orbit beside its equations.
    type Orbit: Clone + Serialize + DeserializeOwned + Send + Sync;
    /// What seeds are taken from, of all itineraries.
    type Sources: Sync;

    /// What is asked for, and who hears how far it is.
    fn asked(&self) -> (&BranchRequest, &dyn Progress);
    fn sources(&self) -> Self::Sources;
    /// Where branches of an itinerary may be found.
    fn seeds(&self, itinerary: &ContactItinerary, sources: &Self::Sources) -> Vec<Seed>;
    /// The branch of an itinerary through a seed, if it is another than those known, with so much
    /// work at most.
    fn trace(
        &self,
        itinerary: &ContactItinerary,
        seed: &Seed,
        known: &[Trace<Self::Orbit>],
        most: u64,
    ) -> Searched<Self::Orbit>;
    /// Most work for the seeds of an itinerary, in all rounds together.
    fn most_work(&self) -> u64 {
        u64::MAX
    }
    /// Takes note of an itinerary of which not all was followed.
    fn cut_short(&self, _: &ContactItinerary) {}
    /// Where the branches begin that a branch leads to: with a contact more or less where an orbit
    /// of it grazes, of the doubled period where it flips.
    fn led_to(&self, itinerary: &ContactItinerary, trace: &Trace<Self::Orbit>) -> Vec<Seed>;
    /// A branch as it is given out, its special points solved for.
    fn branch(&self, itinerary: &ContactItinerary, trace: &Trace<Self::Orbit>) -> Branch;

    /// The branches of an itinerary through these seeds, beside those known, with the work that is
    /// left for it.
    ///
    /// The same seeds come in the same order, so that a seed, the number of branches known and the
    /// work that is left decide what is found.
    fn traces(
        &self,
        itinerary: &ContactItinerary,
        seeds: Vec<Seed>,
        (mut traces, left): (Vec<Trace<Self::Orbit>>, &mut u64),
    ) -> Vec<Trace<Self::Orbit>> {
        let (_, progress) = self.asked();
        let mut looked_at = HashSet::new();
        for seed in seeds {
            // An equal seed finds no other branch.
            if !looked_at.insert(place_of(Piece::Trace as u64, &(traces.len(), &seed))) {
                continue;
            }
            if *left == 0 {
                self.cut_short(itinerary);
                break;
            }
            let place = place_of(Piece::Trace as u64, &(itinerary, traces.len(), &seed, *left));
            let search = || self.trace(itinerary, &seed, &traces, *left);
            let Searched { trace, work } = resumed(progress, &place, search);
            *left = left.saturating_sub(work);
            traces.extend(trace);
        }
        traces
    }

    /// The branches of some of the itineraries asked for, and the work that is left for each.
    fn first(&self, own: &[&ContactItinerary]) -> (Traces<Self::Orbit>, Vec<u64>) {
        let (_, progress) = self.asked();
        progress.expect(own.len() as u64);
        let sources = self.sources();
        let found = parallel::map(own, |&itinerary| {
            let (seeds, mut left) = (self.seeds(itinerary, &sources), self.most_work());
            let traces = self.traces(itinerary, seeds, (Vec::new(), &mut left));
            progress.advance(1);
            ((itinerary.clone(), traces), left)
        });
        found.into_iter().unzip()
    }

    /// All branches, with those that they lead to, and so on.
    fn all(&self, follow: Follow) -> Traces<Self::Orbit> {
        let asked = &self.asked().0.itineraries;
        let (mut found, mut left) = self.first(&asked.iter().collect::<Vec<_>>());
        let mut looked_at = vec![0; found.len()];
        for _ in 0..ROUNDS {
            let mut seeds: Vec<Seed> = Vec::new();
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

    /// The branches as they are given out.
    fn described(&self, found: &Traces<Self::Orbit>) -> Vec<Branch> {
        let traces = found.iter().flat_map(|(of, traces)| traces.iter().map(move |t| (of, t)));
        let (_, progress) = self.asked();
        progress.expect(traces.clone().count() as u64);
        parallel::map(traces, |(itinerary, trace)| {
            let place = place_of(Piece::Branch as u64, &(itinerary, trace));
            let branch = resumed(progress, &place, || self.branch(itinerary, trace));
            progress.advance(1);
            branch
        })
    }

    /// Finds a share of the branches of the itineraries asked for.
    fn find_share(&self, shard: &Shard<'_>) {
        self.described(&self.first(&shard.own_of(&self.asked().0.itineraries)).0);
    }
}

/// The orbit at the parameter of a guess, or the guess where it is one.
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

/// The first orbit of a branch of doubled orbits, in a direction from the orbit that doubles;
/// `is_repeated` tells whether an orbit is one of half the period.
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

/// Whether an orbit lies on one of some lines of points, to a share of their distances and `slack`.
/// It has these first variables, begun at one of its points or another, and a parameter.
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

/// A special point to the rounding of double-double, where it is a zero of this test function.
pub(super) fn refined<X, C: CurveEquations<Dd>>(
    fine: &mut C,
    point: &CurvePoint<f64, X>,
    test: usize,
) -> Option<CurvePoint<Dd, C::Extra>> {
    let (at, tangent) = (converted::<_, Dd>(&point.unknowns), converted::<_, Dd>(&point.tangent));
    let found = zero_near(fine, &at, &tangent, |point| point.tests[test].value)?;
    (apart(&converted(&found.unknowns), &point.unknowns) < FAR).then_some(found)
}

/// What a point is at which these test functions vanish, by its multipliers and how near to those
/// of a special point they are, `near` real ones and `on_circle` complex pairs. Test functions are
/// a turn, a flip, so many grazes, a branch point, and after one more reciprocal multipliers.
pub(super) fn label_of(
    turns: &[usize],
    grazes: usize,
    multipliers: &[Complex<f64>],
    [near, on_circle]: [f64; 2],
) -> impl Iterator<Item = BranchLabel> {
    let is_near =
        |value: f64| multipliers.iter().any(|multiplier| (multiplier - value).norm() < near);
    let is_pair = |value: &Complex<f64>| value.im != 0.0 && (value.norm() - 1.0).abs() < on_circle;
    let [one, minus_one] = [1.0, -1.0].map(is_near);
    let circle = multipliers.iter().any(is_pair);
    turns.iter().filter_map(move |&test| match test {
        0 if one => Some(BranchLabel::SaddleNode),
        1 if minus_one => Some(BranchLabel::PeriodDoubling),
        _ if (2..2 + grazes).contains(&test) => Some(BranchLabel::Graze),
        _ if test == 2 + grazes && one => Some(BranchLabel::BranchPoint),
        _ if test > 3 + grazes && circle => Some(BranchLabel::NeimarkSacker),
        _ => None,
    })
}

/// The first half of an itinerary that repeats after it.
pub(super) fn halved(itinerary: &ContactItinerary) -> ContactItinerary {
    let returns = itinerary.returns()[..itinerary.period() / 2].to_vec();
    ContactItinerary::new(itinerary.passages(), returns)
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

/// An itinerary with the contact of a passage made or left out.
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

/// The unit vector that a nearly singular matrix takes to the least length, by inverse iteration.
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

/// A component of a unit tangent, or 0 where it is rounding: a parameter that changes with the
/// square of a speed does not change with it.
pub(super) fn exact_or_zero(component: f64) -> f64 {
    if component.abs() <= ROUNDING { 0.0 } else { component }
}
