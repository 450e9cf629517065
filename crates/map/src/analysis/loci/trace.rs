//! Loci followed from seeds: orbits at which a branch in one parameter turns, flips or grazes.
//!
//! One idea: a seed on a known locus is not followed again, and every locus is followed both ways.

use nalgebra::{Complex, DVector};
use serde::{Deserialize, Serialize};

use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, Tangency};
use super::equations::{
    CodimensionTwo, Condition, LocusEquations, OrbitEquations, begins_smoothly,
};
use super::tangency::TangencyPoint;
use crate::analysis::MapEvaluation;
use crate::analysis::continuation::{
    Course, CourseEnd, CurveEquations, CurvePoint, StepControl, corrected, follow, tangent_at,
    zero_near,
};
use crate::analysis::periodic::{ContactItinerary, ItinerarySearch, MapOrbitEquations};
use crate::analysis::progress::{Progress, place_of, resumed};
use crate::expansion::LocalMap;
use crate::iteration::PassageSet;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, Scalar};

/// Depth variables, and states, are followed up to this many of their units.
const REACH: f64 = 2.0;
const FARTHEST: f64 = 20.0;
/// Values of the first parameter at which branches are looked through for seeds.
pub(super) const SEEDED_AT: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
/// Offsets of the second at which orbits with several contacts are looked for, in half-widths.
const LOOKED_AT: [f64; 4] = [-0.5, -0.1, 0.1, 0.5];
/// How near a seed lies to a locus that it is a point of.
pub(super) const SAME: f64 = 1e-6;
/// The second parameter is followed over this many times the share of its window that the first is.
pub(super) const WIDER: f64 = 4.0;

/// Steps along a locus.
pub(super) const STEPS: StepControl =
    StepControl { first: 0.01, longest: 0.2, ..StepControl::DEFAULT };

/// Distances from a point of codimension two, in units, to which a tangency is fitted: the largest,
/// and its shares.
const FITTED: f64 = 0.02;
const FITTED_AT: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// The kinds of pieces that are kept of loci.
#[derive(Clone, Copy)]
pub(super) enum Piece {
    /// The seeds of an itinerary at a value of the first parameter.
    Seeds,
    /// What is found through a seed.
    Trace,
    /// A locus as it is given out, by its number.
    Locus,
    /// The tangencies.
    Tangencies,
}

/// The locus through a seed, beside so many that are known, unless an earlier run kept it: the same
/// seeds come in the same order, so that these numbers decide it.
pub(super) fn through_seed(
    progress: &dyn Progress,
    known: usize,
    seed: &impl Serialize,
    follow: impl FnOnce() -> Option<Trace>,
) -> Option<Trace> {
    resumed(progress, &place_of(Piece::Trace as u64, &(known, seed)), follow)
}

/// An orbit near a locus.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Seed {
    pub(super) kind: LocusKind,
    /// Its contacts, the grazing one of a graze first.
    pub(super) itinerary: ContactItinerary,
    /// In units, both parameters included.
    pub(super) unknowns: Vec<f64>,
    /// Angle of a pair of multipliers.
    pub(super) angle: Option<f64>,
}

/// A locus in units, point by point, as it is being put together.
#[derive(Serialize, Deserialize)]
pub(super) struct Trace {
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

/// The loci of a map.
pub(super) struct MapLoci<'a> {
    map: &'a LocalMap,
    rounded: MapEvaluation<f64>,
    exact: MapEvaluation<Dd>,
    search: ItinerarySearch<'a>,
    request: &'a LociRequest,
    progress: &'a dyn Progress,
    /// By how much more than the window is followed.
    wider: f64,
}

impl<'a> MapLoci<'a> {
    pub(super) fn new(
        map: &'a LocalMap,
        request: &'a LociRequest,
        progress: &'a dyn Progress,
    ) -> Self {
        let width = map.window.parameter[request.plane[0]];
        let asked = request.range.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let wider = if width.is_finite() { (asked / width).max(1.0) } else { 1.0 };
        Self {
            map,
            rounded: MapEvaluation::new(map),
            exact: MapEvaluation::new(map),
            search: ItinerarySearch::new(map),
            request,
            progress,
            wider,
        }
    }

    fn equations<'e, S: Real>(
        &'e self,
        evaluation: &'e MapEvaluation<S>,
        itinerary: &'e ContactItinerary,
        free: &[usize],
        at: &[f64],
    ) -> MapOrbitEquations<'e, S> {
        let reach = [FARTHEST, REACH].map(|reach| reach * self.wider);
        let window = &self.map.window;
        let equations = MapOrbitEquations::new(evaluation, itinerary, window, free, at, reach);
        let [from, to] = self.request.range;
        let mut equations = match self.map.is_flown() {
            true => equations.with_positive_depths(),
            false => equations,
        };
        for (place, &parameter) in free.iter().enumerate() {
            let width = window.parameter[parameter];
            let range = match parameter == self.request.plane[0] {
                true => [from.min(to), from.max(to)],
                false => [-width * WIDER * self.wider, width * WIDER * self.wider],
            };
            equations = equations.with_range(place, range);
        }
        equations
    }

    fn rounded<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, f64> {
        self.equations(&self.rounded, itinerary, &self.request.plane, &self.request.at)
    }

    fn exact<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, Dd> {
        self.equations(&self.exact, itinerary, &self.request.plane, &self.request.at)
    }

    /// Number of passages of an itinerary, with contact and without.
    fn passages(itinerary: &ContactItinerary) -> usize {
        itinerary.period() * itinerary.passages()
    }

    /// All loci asked for.
    pub(super) fn all(&self) -> Vec<Trace> {
        let mut traces: Vec<Trace> = Vec::new();
        for passage in 0..self.map.passages() {
            let made: PassageSet = [passage].into_iter().collect();
            let itinerary = ContactItinerary::new(self.map.passages(), vec![made]);
            let size = self.map.dimension() + 3;
            let kind = LocusKind::Graze;
            self.add(&mut traces, Seed { kind, itinerary, unknowns: vec![0.0; size], angle: None });
        }
        let simple = traces.len();
        let mut seeds: Vec<Seed> = Vec::new();
        for (number, itinerary) in self.request.itineraries.iter().enumerate() {
            if itinerary.contacts() == 1 {
                seeds.extend(self.seeds_at_conditions(&traces[..simple], itinerary));
            }
            for (at, share) in SEEDED_AT.into_iter().enumerate() {
                let [from, to] = self.request.range;
                let value = from + share * (to - from);
                let place = [Piece::Seeds as u64, number as u64, at as u64];
                let found = || self.seeds_at(&traces[..simple], itinerary, value);
                seeds.extend(resumed(self.progress, &place, found));
            }
        }
        for seed in seeds {
            if self.request.kinds.contains(&seed.kind) {
                self.add(&mut traces, seed);
            }
        }
        traces
    }

    /// Folds and flips of a one-impact orbit begin where `ξ_n = 0` on the graze of the orbit
    /// without contact.
    fn seeds_at_conditions(&self, grazes: &[Trace], itinerary: &ContactItinerary) -> Vec<Seed> {
        let first = itinerary.returns()[0];
        let of_passage = grazes.iter().filter(|graze| graze.itinerary.returns()[0] == first);
        let points = of_passage.flat_map(|graze| &graze.points);
        let there =
            points.filter(|point| point.label == Some(CodimensionTwo::Xi(itinerary.period())));
        let seeds = there.flat_map(|point| {
            [LocusKind::Fold, LocusKind::Flip].map(|kind| Seed {
                kind,
                itinerary: itinerary.clone(),
                unknowns: point.unknowns.clone(),
                angle: None,
            })
        });
        seeds.collect()
    }

    /// Orbits at a value of the first parameter from which the branches of an itinerary are
    /// followed in the second, in units.
    fn starts(
        &self,
        grazes: &[Trace],
        itinerary: &ContactItinerary,
        equations: &MapOrbitEquations<'_, f64>,
        value: f64,
    ) -> Vec<Vec<f64>> {
        let [first, second] = self.request.plane;
        let d = self.map.dimension();
        if itinerary.contacts() == 1 {
            let made = itinerary.returns()[0];
            let unit = self.rounded(itinerary).units()[d + 1];
            let crossing = |pair: &[TracePoint]| {
                let [a, b] = [&pair[0], &pair[1]].map(|point| point.unknowns[d + 1] * unit - value);
                (a * b <= 0.0 && a != b).then(|| {
                    let share = a / (a - b);
                    let pairs = pair[0].unknowns.iter().zip(&pair[1].unknowns);
                    let at: Vec<f64> = pairs.map(|(a, b)| a + share * (b - a)).collect();
                    let mut start = at[..d + 1].to_vec();
                    start.push(at[d + 2]);
                    start
                })
            };
            let of_passage = grazes.iter().filter(|graze| graze.itinerary.returns()[0] == made);
            return of_passage
                .flat_map(|graze| graze.points.windows(2).filter_map(crossing))
                .collect();
        }
        let width = self.map.window.parameter[second];
        let mut starts = Vec::new();
        for share in LOOKED_AT {
            let mut parameters = self.request.at.clone();
            parameters[first] = value;
            parameters[second] = share * width;
            for orbit in self.search.orbits(itinerary, &parameters) {
                let round = |values: &[Dd]| -> Vec<f64> {
                    values.iter().map(|value| value.to_f64()).collect()
                };
                let (state, depths) =
                    (round(&orbit.orbit.states[0]), round(&orbit.depth_variables));
                starts.push(equations.unknowns(&state, &depths, &parameters));
            }
        }
        starts
    }

    /// The seeds along the branches of an itinerary at a value of the first parameter.
    fn seeds_at(&self, grazes: &[Trace], itinerary: &ContactItinerary, value: f64) -> Vec<Seed> {
        let [first, second] = self.request.plane;
        let mut at = self.request.at.clone();
        at[first] = value;
        let mut equations = self.equations(&self.rounded, itinerary, &[second], &at);
        let starts = self.starts(grazes, itinerary, &equations, value);
        let mut seeds = Vec::new();
        let mut courses: Vec<Vec<Vec<f64>>> = Vec::new();
        for start in starts {
            if courses.iter().any(|course| is_near(course, &start)) {
                continue;
            }
            for sign in [1.0, -1.0] {
                let Some(course) = followed(&mut equations, &start, sign) else { continue };
                let points = course.points.iter().map(|point| point.unknowns.clone());
                courses.push(points.collect());
                for turn in &course.turns {
                    let point = &course.points[turn.point];
                    let mut unknowns = point.unknowns.clone();
                    let unit = self.map.window.parameter[first];
                    let unit = if unit.is_finite() { unit } else { 1.0 };
                    unknowns.insert(equations.first_parameter(), value / unit);
                    seeds.extend(self.seed(itinerary, &equations, point, turn.test, unknowns));
                }
            }
        }
        seeds
    }

    /// What a special point of a branch is a seed of.
    fn seed(
        &self,
        itinerary: &ContactItinerary,
        equations: &MapOrbitEquations<'_, f64>,
        point: &CurvePoint<f64, crate::analysis::periodic::PassagesOfOrbit<f64>>,
        test: usize,
        unknowns: Vec<f64>,
    ) -> Option<Seed> {
        let plain = |kind, angle| Seed {
            kind,
            itinerary: itinerary.clone(),
            unknowns: unknowns.clone(),
            angle,
        };
        let (contacts, d) = (itinerary.contacts(), equations.first_depth_variable());
        let free = Self::passages(itinerary) - contacts;
        match test {
            0 => Some(plain(LocusKind::Fold, None)),
            1 => Some(plain(LocusKind::Flip, None)),
            _ if test < 2 + contacts => {
                let contact = test - 2;
                let (number, passage, _) = point.linearised.extra.arrivals[contact];
                (contacts > 1).then(|| {
                    self.grazing(
                        itinerary,
                        &point.linearised.extra.states,
                        &unknowns,
                        number,
                        passage,
                    )
                })
            }
            _ if test < 2 + contacts + free => {
                let (number, passage, _) = point.linearised.extra.free[test - 2 - contacts];
                let (mut returns, mut unknowns) = (itinerary.returns().to_vec(), unknowns);
                let before = |&(other, at): &(usize, usize)| (other, at) < (number, passage);
                let made = point.linearised.extra.arrivals.iter().map(|&(n, p, _)| (n, p));
                unknowns.insert(d + made.filter(before).count(), 0.0);
                returns[number].insert(passage);
                let with = ContactItinerary::new(itinerary.passages(), returns);
                let states = &point.linearised.extra.states;
                (with.contacts() > 1)
                    .then(|| self.grazing(&with, states, &unknowns, number, passage))
            }
            _ => {
                let jacobian = equations.jacobian(&point.linearised)?;
                let pairs = eigenvalues(&jacobian).ok()?;
                let on_circle = pairs
                    .iter()
                    .find(|value| value.im > 1e-6 && (value.norm() - 1.0).abs() < 1e-6)?;
                Some(plain(LocusKind::Torus, Some(on_circle.arg())))
            }
        }
    }

    /// The seed of a graze, the itinerary begun with the grazing return and, in it, the passage
    /// known by its depth variable.
    fn grazing(
        &self,
        itinerary: &ContactItinerary,
        states: &[Vec<f64>],
        unknowns: &[f64],
        number: usize,
        passage: usize,
    ) -> Seed {
        let d = self.map.dimension();
        let returns = itinerary.returns();
        let before: usize = returns[..number].iter().map(|made| made.len()).sum();
        let mut rotated = returns.to_vec();
        rotated.rotate_left(number);
        let mut depths = unknowns[d..d + itinerary.contacts()].to_vec();
        depths.rotate_left(before);
        let grazing = rotated[0].iter().position(|other| other == passage).unwrap_or(0);
        depths[grazing] = 0.0;
        let units = self.rounded(itinerary).units().to_vec();
        let state = states[number].iter().zip(&units).map(|(value, unit)| value / unit);
        let parameters = &unknowns[d + itinerary.contacts()..];
        Seed {
            kind: LocusKind::Graze,
            itinerary: ContactItinerary::new(itinerary.passages(), rotated),
            unknowns: state.chain(depths).chain(parameters.iter().copied()).collect(),
            angle: None,
        }
    }

    /// Adds the locus through a seed.
    fn add(&self, traces: &mut Vec<Trace>, seed: Seed) {
        let known = &traces[..];
        let found = through_seed(self.progress, known.len(), &seed, || self.trace(known, &seed));
        traces.extend(found);
    }

    /// Follows a seed unless it lies on a locus that is known.
    fn trace(&self, traces: &[Trace], seed: &Seed) -> Option<Trace> {
        let condition = condition(seed);
        let conditions = match seed.kind {
            LocusKind::Graze if seed.itinerary.contacts() == 1 => {
                let periods = self.request.itineraries.iter().map(ContactItinerary::period);
                periods.max().unwrap_or(1)
            }
            _ => 0,
        };
        let mut start = seed.unknowns.clone();
        start.extend(seed.angle);
        let known = traces
            .iter()
            .filter(|trace| trace.kind == seed.kind && trace.itinerary == seed.itinerary);
        let mut equations =
            LocusEquations::new(self.rounded(&seed.itinerary), condition, conditions);
        let kinds = equations.kinds(Self::passages(&seed.itinerary));
        let (points, ends) = joined(&mut equations, &start, known, &STEPS)?;
        let mut exact = LocusEquations::new(self.exact(&seed.itinerary), condition, conditions);
        let points: Vec<TracePoint> = points
            .into_iter()
            .map(|(point, test)| match test {
                Some(test) => labelled(point, test, &kinds, &mut exact),
                None => point,
            })
            .collect();
        let points = each_once(points);
        let (kind, itinerary) = (seed.kind, &seed.itinerary);
        // Where another contact grazes all along, the orbit is one of fewer contacts.
        let d = self.map.dimension();
        let grazing = (d..d + itinerary.contacts())
            .filter(|&place| points.iter().all(|point| point.unknowns[place].abs() < SAME));
        let shorter = points.iter().all(|point| self.repeats(itinerary, &point.unknowns));
        let middle = &points[points.len() / 2].unknowns;
        let again = self.begun_later(itinerary, middle).iter().any(|later| {
            let alike = |trace: &&Trace| trace.kind == kind && trace.itinerary == *itinerary;
            traces.iter().filter(alike).any(|trace| trace.holds(&mut equations, later))
        });
        if again || shorter || grazing.count() > usize::from(kind == LocusKind::Graze) {
            return None;
        }
        let itinerary = itinerary.clone();
        Some(Trace { kind, itinerary, points, ends: ends.map(LocusEnd::of) })
    }

    /// The same orbit begun at its other returns with the same contacts to come.
    fn begun_later(&self, itinerary: &ContactItinerary, unknowns: &[f64]) -> Vec<Vec<f64>> {
        let equations = self.rounded(itinerary);
        let (d, units) = (equations.first_depth_variable(), equations.units());
        let Some(there) = equations.at(&unknowns[..units.len()]) else { return Vec::new() };
        let later = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        let begun = later.map(|later| {
            let before: usize = itinerary.returns()[..later].iter().map(|made| made.len()).sum();
            let mut rotated = unknowns.to_vec();
            let state = there.extra.states[later].iter().zip(units);
            rotated.splice(..d, state.map(|(value, unit)| value / unit));
            rotated[d..d + itinerary.contacts()].rotate_left(before);
            rotated
        });
        begun.collect()
    }

    /// Whether an orbit is one of a shorter period, gone through several times.
    fn repeats(&self, itinerary: &ContactItinerary, unknowns: &[f64]) -> bool {
        let equations = self.rounded(itinerary);
        let units = equations.units();
        let Some(there) = equations.at(&unknowns[..units.len()]) else { return false };
        let states = there.extra.states;
        let mut shorter = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        shorter.any(|later| {
            let mut pairs = states[0].iter().zip(&states[later]).zip(units);
            pairs.all(|((a, b), unit)| (a - b).abs() <= SAME * unit)
        })
    }

    /// The passages whose contact begins without a kick.
    pub(super) fn without_kick(&self, traces: &[Trace]) -> Vec<usize> {
        let place = self.map.dimension();
        let simple = traces.iter().filter(|trace| trace.itinerary.contacts() == 1);
        let grazes = simple.filter(|trace| trace.kind == LocusKind::Graze);
        let smooth = grazes.filter_map(|trace| {
            let point = trace.points.first()?;
            let there = self.rounded(&trace.itinerary).at(&point.unknowns)?;
            let passage = trace.itinerary.returns()[0].iter().next()?;
            begins_smoothly(&there.jacobian, place, 1.0).then_some(passage)
        });
        smooth.collect()
    }

    /// How folds and flips leave the grazes at their points of codimension two.
    pub(super) fn tangencies(&self, traces: &[Trace]) -> Vec<Tangency> {
        resumed(self.progress, &[Piece::Tangencies as u64], || self.tangencies_of(traces))
    }

    fn tangencies_of(&self, traces: &[Trace]) -> Vec<Tangency> {
        let grazes = traces.iter().filter(|trace| trace.kind == LocusKind::Graze);
        let mut found = Vec::new();
        for (graze, point) in grazes.flat_map(|graze| graze.points.iter().map(move |p| (graze, p)))
        {
            let Some(label) = point.label else { continue };
            let itineraries: Vec<ContactItinerary> = match label {
                CodimensionTwo::Xi(n) => {
                    let made = graze.itinerary.returns()[0];
                    let asked = self.request.itineraries.iter();
                    let of_period = asked.filter(|asked| {
                        asked.period() == n && asked.contacts() == 1 && asked.returns()[0] == made
                    });
                    of_period.cloned().collect()
                }
                CodimensionTwo::FoldGraze | CodimensionTwo::FlipGraze => {
                    vec![graze.itinerary.clone()]
                }
                _ => Vec::new(),
            };
            for itinerary in &itineraries {
                for kind in [LocusKind::Fold, LocusKind::Flip] {
                    if self.request.kinds.contains(&kind) {
                        found.extend(self.tangency(graze, point, label, itinerary, kind));
                    }
                }
            }
        }
        found
    }

    fn tangency(
        &self,
        graze: &Trace,
        point: &TracePoint,
        label: CodimensionTwo,
        itinerary: &ContactItinerary,
        kind: LocusKind,
    ) -> Option<Tangency> {
        let multiplier = if kind == LocusKind::Fold { 1.0 } else { -1.0 };
        let equations = self.exact(itinerary);
        let unknowns: Vec<Dd> = point.unknowns.iter().map(|&value| Dd::from(value)).collect();
        let (state, depth_variables, parameters) = equations.offsets(&unknowns);
        let grazing = self.grazing_contact(graze);
        let rounded = parameters.iter().map(|value| value.to_f64()).collect();
        let units = equations.units().to_vec();
        let plane = self.request.plane;
        let at = TangencyPoint { itinerary, state, depth_variables, grazing, parameters, plane };
        let leaving = at.leaving(&self.exact, &units, multiplier)?;
        let (d, contacts) = (self.map.dimension(), itinerary.contacts());
        let [depth, first, second] = [d + grazing, d + contacts, d + contacts + 1];
        let slope = leaving.slope.to_f64();
        let largest = FITTED / (1.0 + (slope * units[first] / units[depth]).abs());
        let mut of_locus =
            LocusEquations::new(self.exact(itinerary), Condition::Multiplier(multiplier), 0);
        let mut of_graze = LocusEquations::new(self.exact(itinerary), Condition::Graze(grazing), 0);
        let mut fit = |share: f64| {
            let t = Dd::from(largest * share * slope.signum());
            let locus = beyond(&mut of_locus, &unknowns, first, t)?;
            let graze = beyond(&mut of_graze, &unknowns, first, t)?;
            let apart = (locus[second] - graze[second]) / (t * t);
            Some((t, apart * Dd::from(units[second] / (units[first] * units[first]))))
        };
        let values: Option<Vec<_>> = FITTED_AT.iter().map(|&share| fit(share)).collect();
        Some(Tangency {
            kind,
            itinerary: itinerary.clone(),
            label,
            parameters: rounded,
            coefficient: leaving.coefficient.to_f64(),
            fitted: values.map(|values| at_zero(&values).to_f64()),
            slope,
        })
    }

    /// Loci in offsets.
    pub(super) fn all_described(&self, traces: &[Trace]) -> Vec<Locus> {
        let traces = traces.iter().enumerate();
        let described = traces.map(|(number, trace)| {
            let place = [Piece::Locus as u64, number as u64];
            resumed(self.progress, &place, || self.described(trace))
        });
        described.collect()
    }

    /// A locus in offsets.
    fn described(&self, trace: &Trace) -> Locus {
        let mut points: Vec<LocusPoint> =
            trace.points.iter().filter_map(|point| self.point(trace, point)).collect();
        // Where multipliers are not determined, at a graze, they are those next to it.
        for place in 0..points.len() {
            if points[place].multipliers.is_empty() {
                let near = if place > 0 { place - 1 } else { (place + 1).min(points.len() - 1) };
                points[place].stable = points[near].stable;
            }
        }
        let (itinerary, grazing) = match trace.kind {
            LocusKind::Graze => {
                let (without, passage) =
                    without_grazing(&trace.itinerary, self.grazing_contact(trace));
                (without, Some([0, passage]))
            }
            _ => (trace.itinerary.clone(), None),
        };
        let (kind, ends) = (trace.kind, trace.ends);
        Locus { kind, itinerary, grazing, excursion: None, points, ends }
    }

    /// The place among the contacts of the one that grazes along a locus of grazes.
    fn grazing_contact(&self, trace: &Trace) -> usize {
        let d = self.map.dimension();
        let zero =
            |place: &usize| trace.points.iter().all(|point| point.unknowns[d + place].abs() < 1e-9);
        (0..trace.itinerary.contacts()).find(zero).unwrap_or(0)
    }

    fn point(&self, trace: &Trace, point: &TracePoint) -> Option<LocusPoint> {
        let equations = self.rounded(&trace.itinerary);
        let size = equations.units().len();
        let there = equations.at(&point.unknowns[..size])?;
        let (_, depth_variables, parameters) = equations.offsets(&point.unknowns[..size]);
        let grazing = match trace.kind {
            LocusKind::Graze => Some(self.grazing_contact(trace)),
            _ => None,
        };
        let jacobian = match grazing {
            None => equations.jacobian(&there),
            Some(contact) => {
                let (without, _) = without_grazing(&trace.itinerary, contact);
                let mut unknowns = point.unknowns.clone();
                unknowns.remove(self.map.dimension() + contact);
                let equations = self.rounded(&without);
                let there = equations.at(&unknowns)?;
                equations.jacobian(&there)
            }
        };
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        let others = depth_variables.iter().enumerate();
        let contacts = others
            .filter(|(place, _)| Some(*place) != grazing)
            .all(|(_, &y)| y > 0.0 || point.label.is_some() && y > -1e-9 * self.search_unit());
        let free = there
            .extra
            .free
            .iter()
            .all(|&(_, _, depth)| depth <= if point.label.is_some() { 1e-9 } else { 0.0 });
        let depths: Vec<f64> = depth_variables.iter().map(|y| y * y).collect();
        let mut states = there.extra.states.iter();
        let inside = states.all(|state| self.map.window.holds(state, &parameters, &depths));
        Some(LocusPoint {
            parameters,
            states: there.extra.states,
            depth_variables,
            stable: is_stable(trace.kind, &multipliers, point.unknowns.last().copied()),
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            physical: contacts && free,
            inside,
            label: point.label,
        })
    }

    fn search_unit(&self) -> f64 {
        self.map.window.depth.sqrt()
    }
}

/// The point of a curve where an unknown is this far beyond a point of it.
fn beyond<C: CurveEquations<Dd>>(
    equations: &mut C,
    from: &[Dd],
    unknown: usize,
    by: Dd,
) -> Option<Vec<Dd>> {
    let mut normal = vec![Dd::ZERO; from.len()];
    normal[unknown] = Dd::ONE;
    let there = equations.linearised(from)?;
    let tangent = tangent_at(&there.jacobian, &normal)?;
    let length = by / tangent[unknown];
    let pairs = from.iter().zip(&tangent);
    let origin: Vec<Dd> = pairs.map(|(&value, &along)| value + length * along).collect();
    Some(corrected(equations, &origin, &origin, &normal)?.0)
}

/// The value at 0 of the polynomial through points.
fn at_zero(points: &[(Dd, Dd)]) -> Dd {
    let weight = |t: Dd| {
        let others = points.iter().filter(|(other, _)| *other != t);
        others.fold(Dd::ONE, |product, &(other, _)| product * other / (other - t))
    };
    points.iter().fold(Dd::ZERO, |sum, &(t, value)| sum + weight(t) * value)
}

/// The condition of a seed.
fn condition(seed: &Seed) -> Condition {
    match seed.kind {
        LocusKind::Graze => {
            let contacts = seed.itinerary.contacts();
            let first = seed.unknowns.len() - 2 - contacts;
            let zero = |place: &usize| seed.unknowns[first + place] == 0.0;
            Condition::Graze((0..contacts).find(zero).unwrap_or(0))
        }
        kind => condition_of(kind),
    }
}

/// The condition of a kind; of a graze, that of the first contact.
pub(super) fn condition_of(kind: LocusKind) -> Condition {
    match kind {
        LocusKind::Graze => Condition::Graze(0),
        LocusKind::Fold | LocusKind::Crisis => Condition::Multiplier(1.0),
        LocusKind::Flip => Condition::Multiplier(-1.0),
        LocusKind::Torus => Condition::Pair,
    }
}

/// An itinerary without its contact of a number, which is of the first return; the passage.
fn without_grazing(itinerary: &ContactItinerary, contact: usize) -> (ContactItinerary, usize) {
    let mut returns = itinerary.returns().to_vec();
    let passage = returns[0].iter().nth(contact).unwrap_or(0);
    returns[0] = returns[0].iter().filter(|&other| other != passage).collect();
    (ContactItinerary::new(itinerary.passages(), returns), passage)
}

/// Whether all multipliers but those that a locus is about lie inside the unit circle.
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

/// A tangent at a point near a locus, on the side where the first parameter grows, or the second.
fn first_tangent<C: CurveEquations<f64>>(equations: &mut C, start: &[f64]) -> Option<Vec<f64>> {
    let there = equations.linearised(start)?;
    let size = start.len();
    let sides = (0..size).rev().map(|place| {
        let mut along = vec![0.0; size];
        along[place] = 1.0;
        tangent_at(&there.jacobian, &along)
    });
    // The side along which most of the tangent lies is the surest.
    sides.flatten().next()
}

/// A branch in one parameter from a start, on one side.
fn followed<'e>(
    equations: &mut MapOrbitEquations<'e, f64>,
    start: &[f64],
    sign: f64,
) -> Option<Course<f64, <MapOrbitEquations<'e, f64> as CurveEquations<f64>>::Extra>> {
    let tangent = first_tangent(equations, start)?;
    let along: Vec<f64> = tangent.iter().map(|value| sign * value).collect();
    follow(equations, start, &along, &StepControl::DEFAULT)
}

/// Largest rest of a test function at a point where it vanishes.
const VANISHES: f64 = 1e-14;

/// A special point solved for in double-double; without its label where that does not converge.
pub(super) fn labelled<O: OrbitEquations<Dd>>(
    point: TracePoint,
    test: usize,
    kinds: &[CodimensionTwo],
    exact: &mut LocusEquations<O, Dd>,
) -> TracePoint {
    let fine = |values: &[f64]| -> Vec<Dd> { values.iter().map(|&v| Dd::from(v)).collect() };
    let (at, along) = (fine(&point.unknowns), fine(&point.tangent));
    let zero = zero_near(exact, &at, &along, |point| point.tests[test].value);
    let zero = zero.filter(|zero| {
        let found = zero.tests[test];
        // Where all contacts graze, loci of fewer contacts cross: the place is not determined.
        let mut depths = exact.orbits.depth_variables().into_iter();
        let crossing = kinds[test] == CodimensionTwo::DoubleGraze
            && depths.all(|place| zero.unknowns[place].magnitude() < SAME);
        found.value.magnitude() <= VANISHES * found.size && !crossing
    });
    match zero {
        Some(zero) => TracePoint {
            unknowns: zero.unknowns.iter().map(|value| value.to_f64()).collect(),
            tangent: point.tangent,
            label: Some(kinds[test]),
        },
        None => point,
    }
}

/// The points of a locus with those of codimension two that lie at one place made one: functions
/// vanish together there. Where it is a graze, multipliers are not determined, and a double one is
/// none.
pub(super) fn each_once(points: Vec<TracePoint>) -> Vec<TracePoint> {
    let mut kept: Vec<TracePoint> = Vec::with_capacity(points.len());
    for point in points {
        let here = |last: &TracePoint| {
            let pairs = last.unknowns.iter().zip(&point.unknowns);
            let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
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

/// Points at one place, in units, and how many places back they may lie.
const ONE_PLACE: f64 = 1e-9;
const NEIGHBOURS: usize = 6;

/// The points of a locus in order, each with the test function that vanishes there, and its ends.
type Joined = (Vec<(TracePoint, Option<usize>)>, [CourseEnd; 2]);

/// A locus through a point near it, followed both ways; `None` where the point lies on a locus that
/// is known, or no locus is found.
pub(super) fn joined<'t, C: CurveEquations<f64>>(
    equations: &mut C,
    start: &[f64],
    mut known: impl Iterator<Item = &'t Trace>,
    steps: &StepControl,
) -> Option<Joined> {
    let along = first_tangent(equations, start)?;
    let (start, _) = corrected(equations, start, start, &along)?;
    if known.any(|trace| trace.holds(equations, &start)) {
        return None;
    }
    let mut way = |sign: f64| {
        let along: Vec<f64> = along.iter().map(|value| sign * value).collect();
        let course = follow(equations, &start, &along, steps)?;
        // A zero at the start has no change of sign after it.
        let at_start = course.points[0].tests.iter();
        let at_start =
            at_start.enumerate().filter(|(_, test)| test.value.abs() <= AT_START * test.size);
        let mut turns: Vec<(usize, usize)> =
            course.turns.iter().map(|turn| (turn.point, turn.test)).collect();
        for (test, _) in at_start {
            if !turns.contains(&(0, test)) {
                turns.push((0, test));
            }
        }
        let points = course.points.into_iter().map(|point| TracePoint {
            unknowns: point.unknowns,
            tangent: point.tangent,
            label: None,
        });
        let mut points: Vec<(TracePoint, Option<usize>)> =
            points.map(|point| (point, None)).collect();
        // Functions that vanish at one point make as many points of it.
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
        Some((points, course.end))
    };
    let ((back, first), (on, last)) = (way(-1.0)?, way(1.0)?);
    // The start is in both.
    let at_start = back.iter().take_while(|(point, _)| point.unknowns == back[0].0.unknowns);
    let shared = at_start.count();
    let points = back.into_iter().skip(shared).rev().chain(on).collect();
    Some((points, [first, last]))
}

/// Rounding of a test function at the start of a locus.
const AT_START: f64 = 1e-9;

/// Whether a point lies nearly on a line through others.
fn is_near(line: &[Vec<f64>], point: &[f64]) -> bool {
    line.windows(2).any(|pair| {
        let (share, apart, _) = beside(&pair[0], &pair[1], point);
        (0.0..=1.0).contains(&share) && apart < 1e-3
    })
}

/// The share of a segment beside which a point lies, its distance from it and the segment's
/// length.
fn beside(a: &[f64], b: &[f64], point: &[f64]) -> (f64, f64, f64) {
    let [a, b, point] = [a, b, point].map(DVector::from_column_slice);
    let (chord, offset) = (&b - &a, point - &a);
    let length = chord.norm();
    let share = if length > 0.0 { chord.dot(&offset) / (length * length) } else { 0.0 };
    (share, (offset - share * chord).norm(), length)
}

impl Trace {
    /// Whether a point of these equations lies on the locus.
    pub(super) fn holds(&self, equations: &mut impl CurveEquations<f64>, point: &[f64]) -> bool {
        self.points.windows(2).any(|pair| {
            let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
            let (share, apart, length) = beside(a, b, point);
            if !(-1e-9..=1.0 + 1e-9).contains(&share) || apart > 0.5 * length.max(1e-3) {
                return false;
            }
            let chord: Vec<f64> = a.iter().zip(b).map(|(a, b)| (b - a) / length).collect();
            let origin: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect();
            let found = corrected(equations, &origin, point, &chord);
            found.is_some_and(|(found, _)| {
                let pairs = found.iter().zip(point);
                pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) < SAME
            })
        })
    }
}
