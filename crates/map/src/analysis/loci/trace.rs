//! Tracing of loci from seeds, for the map and direct simulation. Seeds are orbits at which a
//! branch in one parameter turns, flips or grazes.
//!
//! One idea: a seed on a known locus is skipped, and every locus is followed both ways.

use std::f64::consts::PI;

use nalgebra::{Complex, DVector};
use serde::{Deserialize, Serialize};

use super::data::{Locus, LocusEnd, LocusKind, LocusPoint};
use super::equations::{CodimensionTwo, Condition, LocusEquations, OrbitEquations};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{Progress, place_of, resumed};
use crate::continuation::{
    ContinuationEnd, CurveEquations, StepControl, any_tangent, between, corrected, farthest,
    follow, zero_near,
};
use crate::numeric::{Dd, Scalar, converted};

/// Values of the first and of the second parameter at which branches in the other one are searched
/// for seeds, as shares of its range. A locus along which the first parameter is constant crosses
/// branches in that parameter alone.
const SEEDED_AT: [&[f64]; 2] = [&[0.1, 0.3, 0.5, 0.7, 0.9], &[0.4, 0.6]];
/// Largest distance of a seed from a locus that contains it.
pub(super) const SAME: f64 = 1e-6;

/// Step control along a locus.
const STEPS: StepControl = StepControl { first: 0.01, longest: 0.2, ..StepControl::DEFAULT };

/// Line in the plane along which a branch is searched for seeds.
#[derive(Clone, Copy)]
pub(super) struct SeedLine {
    /// Place in the plane of the parameter that is held: 0 or 1.
    pub(super) held: usize,
    /// Its value.
    pub(super) value: f64,
}

impl SeedLine {
    /// Lines of a plane with these ranges of its parameters.
    pub(super) fn of_plane(ranges: [[f64; 2]; 2]) -> Vec<Self> {
        let lines = SEEDED_AT.iter().zip(ranges).enumerate();
        let lines = lines.flat_map(|(held, (shares, [from, to]))| {
            shares.iter().map(move |share| Self { held, value: from + share * (to - from) })
        });
        lines.collect()
    }
}

/// Kinds of kept pieces of loci.
#[derive(Clone, Copy)]
pub(super) enum LocusPiece {
    /// The seeds of an itinerary along a line of the plane.
    Seeds,
    /// Result of the search from a seed.
    Trace,
    /// A locus in its final form, by its number.
    Locus,
    /// Tangencies.
    Tangencies,
}

/// An orbit near a locus.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LocusSeed {
    pub(super) kind: LocusKind,
    /// Itinerary; for a graze its first return has the grazing contact.
    pub(super) itinerary: ContactItinerary,
    /// Unknowns in units, both parameters included; for a pair of multipliers also the angle.
    pub(super) unknowns: Vec<f64>,
}

/// A locus in units, point by point.
#[derive(Serialize, Deserialize)]
pub(super) struct TracedLocus {
    pub(super) kind: LocusKind,
    pub(super) itinerary: ContactItinerary,
    pub(super) points: Vec<TracePoint>,
    pub(super) ends: [LocusEnd; 2],
}

/// A point of a locus in units.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct TracePoint {
    pub(super) unknowns: Vec<f64>,
    pub(super) tangent: Vec<f64>,
    pub(super) label: Option<CodimensionTwo>,
}

/// Equations of closed orbits, with comparisons of orbits.
pub(super) trait ClosedOrbits: OrbitEquations<f64> {
    /// Unknowns of the orbit started at its other returns that have the same contacts to come.
    fn begun_later(&mut self, unknowns: &[f64]) -> Vec<Vec<f64>>;
    /// Whether an orbit has a shorter period, traversed several times.
    fn is_several(&mut self, unknowns: &[f64]) -> bool;
}

/// Locus through a seed, if it is not among those known, and the work it took.
pub(super) type SearchedLocus = (Option<TracedLocus>, u64);

/// Locus through a seed, recalled from an earlier run or computed by `follow`. Seeds always come in
/// the same order, so that the number of known loci, the work left and the seed determine it.
pub(super) fn through_seed(
    progress: &dyn Progress,
    (known, left): (usize, u64),
    seed: &impl Serialize,
    follow: impl FnOnce() -> SearchedLocus,
) -> SearchedLocus {
    resumed(progress, &place_of(LocusPiece::Trace as u64, &(known, left, seed)), follow)
}

/// Points of the locus through a seed, with special points solved for in double-double, and its
/// ends; `grazes` is the number of test functions for grazes.
///
/// `None` if the locus is known (also from another return), if its orbits have a shorter period, or
/// if another contact grazes all along it, so that it is a locus of fewer contacts.
pub(super) fn through<O: ClosedOrbits, E: OrbitEquations<Dd>>(
    seed: &LocusSeed,
    known: &[TracedLocus],
    orbits: &mut LocusEquations<O, f64>,
    fine: &mut LocusEquations<E, Dd>,
    grazes: usize,
) -> Option<(Vec<TracePoint>, [ContinuationEnd; 2])> {
    let alike = |trace: &&TracedLocus| trace.kind == seed.kind && trace.itinerary == seed.itinerary;
    let kinds = orbits.kinds(grazes);
    let known = || known.iter().filter(alike);
    let (points, ends) = joined(orbits, &seed.unknowns, known(), &STEPS)?;
    let points = points.into_iter().map(|(point, test)| match test {
        Some(test) => labelled(point, test, &kinds, fine),
        None => point,
    });
    let points = each_once(points.collect());
    let touching = orbits.orbits.depth_variables().into_iter();
    let touching =
        touching.filter(|&place| points.iter().all(|point| point.unknowns[place].abs() < SAME));
    if touching.count() > usize::from(seed.kind == LocusKind::Graze) {
        return None;
    }
    let later = orbits.orbits.begun_later(&points[points.len() / 2].unknowns);
    if later.iter().any(|later| known().any(|trace| trace.holds(orbits, later))) {
        return None;
    }
    let several = points.iter().all(|point| orbits.orbits.is_several(&point.unknowns));
    (!several).then_some((points, ends))
}

/// Condition of a kind of locus; for a graze that of the first contact.
pub(super) fn condition_of(kind: LocusKind) -> Condition {
    match kind {
        LocusKind::Graze => Condition::Graze(0),
        LocusKind::Fold | LocusKind::Crisis => Condition::Multiplier(1.0),
        LocusKind::Flip => Condition::Multiplier(-1.0),
        LocusKind::Torus => Condition::Pair,
    }
}

/// Whether all multipliers but the critical ones of a locus lie inside the unit circle.
pub(super) fn is_stable(kind: LocusKind, multipliers: &[Complex<f64>], angle: Option<f64>) -> bool {
    let mut others = multipliers.to_vec();
    let mut leave_out = |critical: Complex<f64>| {
        let apart = |value: &Complex<f64>| (value - critical).norm();
        let nearest =
            (0..others.len()).min_by(|&a, &b| apart(&others[a]).total_cmp(&apart(&others[b])));
        nearest.map(|place| others.remove(place));
    };
    match kind {
        LocusKind::Graze | LocusKind::Crisis => {}
        LocusKind::Fold => leave_out(Complex::new(1.0, 0.0)),
        LocusKind::Flip => leave_out(Complex::new(-1.0, 0.0)),
        LocusKind::Torus => {
            let (sin, cos) = angle.unwrap_or(0.0).sin_cos();
            leave_out(Complex::new(cos, sin));
            leave_out(Complex::new(cos, -sin));
        }
    }
    !multipliers.is_empty() && others.iter().all(|value| value.norm() < 1.0)
}

/// Largest value of a test function, relative to its size, that counts as zero.
const VANISHES: f64 = 1e-14;

/// Solves for a special point in double-double; the label is left out if that fails.
fn labelled<O: OrbitEquations<Dd>>(
    point: TracePoint,
    test: usize,
    kinds: &[CodimensionTwo],
    fine: &mut LocusEquations<O, Dd>,
) -> TracePoint {
    let (at, along) = (converted::<_, Dd>(&point.unknowns), converted::<_, Dd>(&point.tangent));
    let zero = zero_near(fine, &at, &along, |point| point.tests[test].value);
    let zero = zero.filter(|zero| {
        let found = zero.tests[test];
        // Where all contacts graze, loci of fewer contacts cross and the point is not determined.
        let mut depths = fine.orbits.depth_variables().into_iter();
        let crossing = kinds[test] == CodimensionTwo::DoubleGraze
            && depths.all(|place| zero.unknowns[place].magnitude() < SAME);
        found.value.magnitude() <= VANISHES * found.size && !crossing
    });
    match zero {
        Some(zero) => TracePoint {
            unknowns: converted(&zero.unknowns),
            tangent: point.tangent,
            label: Some(kinds[test]),
        },
        None => point,
    }
}

/// Merges points of codimension two at one place, where several functions vanish together. At a
/// graze multipliers are undefined, so that double ones are dropped.
fn each_once(points: Vec<TracePoint>) -> Vec<TracePoint> {
    let mut kept: Vec<TracePoint> = Vec::with_capacity(points.len());
    for point in points {
        let here = |last: &TracePoint| {
            let apart = farthest(&last.unknowns, &point.unknowns);
            apart < ONE_PLACE && last.label.is_some() && point.label.is_some()
        };
        let first = kept.len().saturating_sub(NEIGHBOURS);
        let at_place: Vec<usize> =
            (first..kept.len()).filter(|&place| here(&kept[place])).collect();
        let double = [CodimensionTwo::R1, CodimensionTwo::R2].map(Some);
        let is_xi = matches!(point.label, Some(CodimensionTwo::Xi(_)));
        let known = at_place.iter().any(|&place| kept[place].label == point.label);
        match at_place.iter().find(|&&place| double.contains(&kept[place].label)) {
            Some(&place) => kept[place].label = point.label,
            None if at_place.is_empty() || is_xi && !known => kept.push(point),
            None => {}
        }
    }
    kept
}

/// Largest distance of points at one place, in units, and how many points back they may lie.
const ONE_PLACE: f64 = 1e-9;
const NEIGHBOURS: usize = 6;

/// Points of a locus in order, each with the test function that vanishes there, and its ends.
type Joined = (Vec<(TracePoint, Option<usize>)>, [ContinuationEnd; 2]);

/// Locus through a point near it, followed both ways; `None` if the point lies on a known locus or
/// no locus is found.
pub(super) fn joined<'t, C: CurveEquations<f64>>(
    equations: &mut C,
    start: &[f64],
    mut known: impl Iterator<Item = &'t TracedLocus>,
    steps: &StepControl,
) -> Option<Joined> {
    // The unknown with the largest tangent component is best to hold.
    let along = any_tangent(&equations.linearised(start)?.jacobian)?;
    let (start, _) = corrected(equations, start, start, &along)?;
    if known.any(|trace| trace.holds(equations, &start)) {
        return None;
    }
    let mut way = |sign: f64| {
        let along: Vec<f64> = along.iter().map(|value| sign * value).collect();
        let curve = follow(equations, &start, &along, steps)?;
        // A zero at the start has no change of sign after it.
        let at_start = curve.points[0].tests.iter();
        let at_start =
            at_start.enumerate().filter(|(_, test)| test.value.abs() <= AT_START * test.size);
        let mut turns: Vec<(usize, usize)> =
            curve.turns.iter().map(|turn| (turn.point, turn.test)).collect();
        for (test, _) in at_start {
            if !turns.contains(&(0, test)) {
                turns.push((0, test));
            }
        }
        let points = curve.points.into_iter().map(|point| TracePoint {
            unknowns: point.unknowns,
            tangent: point.tangent,
            label: None,
        });
        let mut points: Vec<(TracePoint, Option<usize>)> =
            points.map(|point| (point, None)).collect();
        // A point at which several functions vanish is listed once for each.
        turns.sort_by(|a, b| b.cmp(a));
        for (place, test) in turns {
            match points[place].1 {
                None => points[place].1 = Some(test),
                Some(_) => {
                    let again = (points[place].0.clone(), Some(test));
                    points.insert(place, again);
                }
            }
        }
        Some((points, curve.end))
    };
    let ((back, first), on) = (way(-1.0)?, way(1.0));
    let (on, last) = match on {
        Some(on) => on,
        // The bound on work keeps the part found so far.
        None if equations.is_spent() => (vec![back[0].clone()], ContinuationEnd::WorkLimit),
        None => return None,
    };
    // The start belongs to both curves.
    let at_start = back.iter().take_while(|(point, _)| point.unknowns == back[0].0.unknowns);
    let shared = at_start.count();
    let points = back.into_iter().skip(shared).rev().chain(on).collect();
    Some((points, [first, last]))
}

/// Largest value of a test function, relative to its size, that counts as zero at the start.
const AT_START: f64 = 1e-9;

/// Position of a point relative to a segment: share along it, distance from it, and the length of
/// the segment.
pub(super) fn beside(a: &[f64], b: &[f64], point: &[f64]) -> (f64, f64, f64) {
    let [a, b, point] = [a, b, point].map(DVector::from_column_slice);
    let (chord, offset) = (&b - &a, point - &a);
    let length = chord.norm();
    let share = if length > 0.0 { chord.dot(&offset) / (length * length) } else { 0.0 };
    (share, (offset - share * chord).norm(), length)
}

/// Distance from 0 or π of the angle at which a locus of pairs is started at a double multiplier.
const FROM_DOUBLE: f64 = 0.05;

impl TracedLocus {
    /// Seeds of loci of pairs on this locus: at a double multiplier 1 of a fold or −1 of a flip. An
    /// orbit whose pair has a small angle is within about the square of that angle.
    pub(super) fn double_multipliers(&self) -> Vec<LocusSeed> {
        let (label, angle) = match self.kind {
            LocusKind::Fold => (CodimensionTwo::R1, FROM_DOUBLE),
            LocusKind::Flip => (CodimensionTwo::R2, PI - FROM_DOUBLE),
            _ => return Vec::new(),
        };
        let points = self.points.iter().filter(|point| point.label == Some(label));
        let seed = |point: &TracePoint| LocusSeed {
            kind: LocusKind::Torus,
            itinerary: self.itinerary.clone(),
            unknowns: [&point.unknowns[..], &[angle]].concat(),
        };
        points.map(seed).collect()
    }

    /// Whether a point of these equations lies on the locus.
    pub(super) fn holds(&self, equations: &mut impl CurveEquations<f64>, point: &[f64]) -> bool {
        self.points.windows(2).any(|pair| {
            let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
            let mut point = point.to_vec();
            equations.bring_near(&mut point, a);
            let (share, apart, length) = beside(a, b, &point);
            if !(-1e-9..=1.0 + 1e-9).contains(&share) || apart > 0.5 * length.max(1e-3) {
                return false;
            }
            let chord: Vec<f64> = a.iter().zip(b).map(|(a, b)| (b - a) / length).collect();
            let found = corrected(equations, &between(a, b, share), &point, &chord);
            found.is_some_and(|(found, _)| farthest(&found, &point) < SAME)
        })
    }

    /// The locus with these points; for a locus of grazes the contact of `passage` in the first
    /// return is the grazing one.
    pub(super) fn described(&self, points: Vec<LocusPoint>, passage: usize) -> Locus {
        let (itinerary, grazing) = match self.kind {
            LocusKind::Graze => (self.itinerary.without_contact(0, passage), Some([0, passage])),
            _ => (self.itinerary.clone(), None),
        };
        let (kind, ends) = (self.kind, self.ends);
        Locus { kind, itinerary, grazing, excursion: None, points, ends }
    }
}
