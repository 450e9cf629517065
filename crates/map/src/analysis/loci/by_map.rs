//! Loci of a map, virtual parts included.

use std::collections::BTreeMap;

use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, Tangency};
use super::equations::{CodimensionTwo, Condition, LocusEquations, begins_smoothly};
use super::tangency::TangencyPoint;
use super::trace::{
    ClosedOrbits, LocusPiece, LocusSeed, SAME, SearchedLocus, SeedLine, TracePoint, TracedLocus,
    beside, condition_of, is_stable, through, through_seed,
};
use crate::analysis::MapEvaluation;
use crate::analysis::periodic::{
    ContactItinerary, ItinerarySearch, MapOrbitEquations, PassagesOfOrbit, TestKind, finite_or_one,
};
use crate::analysis::progress::{Progress, resumed};
use crate::analysis::work::Unfinished;
use crate::continuation::{
    ContinuationPoint, Curve, CurveEquations, StepControl, any_tangent, between, corrected, follow,
    moved, tangent_at, unit_vector,
};
use crate::expansion::LocalMap;
use crate::iteration::PassageSet;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, converted};

/// Most work for the loci of one kind and itinerary, in coefficients evaluated: about 20 s.
const MOST_WORK: u64 = 1_000_000_000;
/// Largest depth variables and states along loci, in their units.
const REACH: f64 = 2.0;
const FARTHEST: f64 = 20.0;
/// Values of the parameter along a line at which orbits with several contacts are looked for, in
/// half-widths.
const LOOKED_AT: [f64; 4] = [-0.5, -0.1, 0.1, 0.5];
/// Distances from a codimension-two point at which a tangency is fitted: the largest, in units, and
/// the shares of it that are used.
const FITTED: f64 = 0.02;
const FITTED_AT: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Loci of a map.
pub(super) struct MapLoci<'a> {
    map: &'a LocalMap,
    rounded: MapEvaluation<f64>,
    exact: MapEvaluation<Dd>,
    search: ItinerarySearch<'a>,
    request: &'a LociRequest,
    progress: &'a dyn Progress,
    /// Factor by which the range exceeds the window.
    wider: f64,
    free: [(usize, [f64; 2]); 2],
    unfinished: Unfinished,
}

/// Loci found, and the work left for each kind and itinerary.
#[derive(Default)]
struct FoundLoci {
    traces: Vec<TracedLocus>,
    left: BTreeMap<String, u64>,
}

impl<'a> MapLoci<'a> {
    pub(super) fn new(
        map: &'a LocalMap,
        request: &'a LociRequest,
        progress: &'a dyn Progress,
    ) -> Self {
        let widths = request.plane.map(|place| map.window.parameter[place]);
        Self {
            map,
            rounded: MapEvaluation::new(map),
            exact: MapEvaluation::new(map),
            search: ItinerarySearch::new(map),
            request,
            progress,
            wider: request.wider(widths[0]),
            free: request.free(widths),
            unfinished: Unfinished::default(),
        }
    }

    /// Itineraries that were not followed completely.
    pub(super) fn unfinished(&self) -> Vec<ContactItinerary> {
        self.unfinished.listed()
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
        let mut equations = match self.map.is_polynomial() {
            true => equations,
            false => equations.with_positive_depths(),
        };
        for (place, parameter) in free.iter().enumerate() {
            if let Some((_, range)) = self.free.iter().find(|(other, _)| other == parameter) {
                equations = equations.with_range(place, *range);
            }
        }
        equations
    }

    fn rounded<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, f64> {
        self.equations(&self.rounded, itinerary, &self.request.plane, &self.request.at)
    }

    fn exact<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, Dd> {
        self.equations(&self.exact, itinerary, &self.request.plane, &self.request.at)
    }

    /// All loci asked for.
    pub(super) fn all(&self) -> Vec<TracedLocus> {
        let mut found = FoundLoci::default();
        for passage in 0..self.map.passages() {
            let made: PassageSet = [passage].into_iter().collect();
            let itinerary = ContactItinerary::new(self.map.passages(), vec![made]);
            let unknowns = vec![0.0; self.map.dimension() + 3];
            self.add(&mut found, LocusSeed { kind: LocusKind::Graze, itinerary, unknowns });
        }
        let simple = found.traces.len();
        let mut seeds: Vec<LocusSeed> = Vec::new();
        // NOTE: the first range in the order in which it is asked for.
        let lines = SeedLine::of_plane([self.request.range, self.free[1].1]);
        self.progress.expect((self.request.itineraries.len() * lines.len()) as u64);
        for (number, itinerary) in self.request.itineraries.iter().enumerate() {
            if itinerary.contacts() == 1 {
                seeds.extend(self.seeds_at_conditions(&found.traces[..simple], itinerary));
            }
            for (at, &line) in lines.iter().enumerate() {
                let place = [LocusPiece::Seeds as u64, number as u64, at as u64];
                let look = || self.seeds_along(&found.traces[..simple], itinerary, line);
                seeds.extend(resumed(self.progress, &place, look));
                self.progress.advance(1);
            }
        }
        for seed in seeds {
            if self.request.kinds.contains(&seed.kind) {
                self.add(&mut found, seed);
            }
        }
        if self.request.kinds.contains(&LocusKind::Torus) {
            let seeds = found.traces.iter().flat_map(TracedLocus::double_multipliers);
            let seeds: Vec<LocusSeed> = seeds.collect();
            seeds.into_iter().for_each(|seed| self.add(&mut found, seed));
        }
        found.traces
    }

    /// Seeds of folds and flips of orbits with one contact, at the points `ξ_n = 0` on the graze of
    /// the orbit without contact.
    fn seeds_at_conditions(
        &self,
        grazes: &[TracedLocus],
        itinerary: &ContactItinerary,
    ) -> Vec<LocusSeed> {
        let first = itinerary.returns()[0];
        let of_passage = grazes.iter().filter(|graze| graze.itinerary.returns()[0] == first);
        let at_condition = Some(CodimensionTwo::Xi(itinerary.period()));
        let points = of_passage.flat_map(|graze| &graze.points);
        let seeds = points.filter(|point| point.label == at_condition).flat_map(|point| {
            [LocusKind::Fold, LocusKind::Flip].map(|kind| LocusSeed {
                kind,
                itinerary: itinerary.clone(),
                unknowns: point.unknowns.clone(),
            })
        });
        seeds.collect()
    }

    /// Orbits on a line of the plane, in units, from which the branches of an itinerary along it
    /// are followed.
    fn starts(
        &self,
        grazes: &[TracedLocus],
        itinerary: &ContactItinerary,
        equations: &MapOrbitEquations<'_, f64>,
        SeedLine { held, value }: SeedLine,
    ) -> Vec<Vec<f64>> {
        let [held_parameter, moved_parameter] =
            [held, 1 - held].map(|place| self.request.plane[place]);
        let d = self.map.dimension();
        if itinerary.contacts() == 1 {
            let made = itinerary.returns()[0];
            let place = d + 1 + held;
            let unit = self.rounded(itinerary).units()[place];
            let crossing = |pair: &[TracePoint]| {
                let [a, b] = [&pair[0], &pair[1]].map(|point| point.unknowns[place] * unit - value);
                (a * b <= 0.0 && a != b).then(|| {
                    let at = between(&pair[0].unknowns, &pair[1].unknowns, a / (a - b));
                    let mut start = at[..d + 1].to_vec();
                    start.push(at[d + 2 - held]);
                    start
                })
            };
            let of_passage = grazes.iter().filter(|graze| graze.itinerary.returns()[0] == made);
            return of_passage
                .flat_map(|graze| graze.points.windows(2).filter_map(crossing))
                .collect();
        }
        let width = self.map.window.parameter[moved_parameter];
        let mut starts = Vec::new();
        for share in LOOKED_AT {
            let mut parameters = self.request.at.clone();
            parameters[held_parameter] = value;
            parameters[moved_parameter] = share * width;
            for orbit in self.search.orbits(itinerary, &parameters) {
                let state = converted(&orbit.orbit.states[0]);
                let depths = converted(&orbit.depth_variables);
                starts.push(equations.unknowns(&state, &depths, &parameters));
            }
        }
        starts
    }

    /// Seeds on the branches of an itinerary along a line of the plane.
    fn seeds_along(
        &self,
        grazes: &[TracedLocus],
        itinerary: &ContactItinerary,
        line: SeedLine,
    ) -> Vec<LocusSeed> {
        let SeedLine { held, value } = line;
        let [held_parameter, moved_parameter] =
            [held, 1 - held].map(|place| self.request.plane[place]);
        let mut at = self.request.at.clone();
        at[held_parameter] = value;
        let mut equations = self.equations(&self.rounded, itinerary, &[moved_parameter], &at);
        let starts = self.starts(grazes, itinerary, &equations, line);
        let mut seeds = Vec::new();
        let mut curves: Vec<Vec<Vec<f64>>> = Vec::new();
        for start in starts {
            if curves.iter().any(|curve| is_near(curve, &start)) {
                continue;
            }
            for sign in [1.0, -1.0] {
                let Some(curve) = followed(&mut equations, &start, sign) else { continue };
                let points = curve.points.iter().map(|point| point.unknowns.clone());
                curves.push(points.collect());
                for turn in &curve.turns {
                    let point = &curve.points[turn.point];
                    let mut unknowns = point.unknowns.clone();
                    let unit = finite_or_one(self.map.window.parameter[held_parameter]);
                    unknowns.insert(equations.first_parameter() + held, value / unit);
                    seeds.extend(self.seed(itinerary, &equations, point, turn.test, unknowns));
                }
            }
        }
        seeds
    }

    /// Seed at a special point of a branch.
    fn seed(
        &self,
        itinerary: &ContactItinerary,
        equations: &MapOrbitEquations<'_, f64>,
        point: &ContinuationPoint<f64, PassagesOfOrbit<f64>>,
        test: usize,
        unknowns: Vec<f64>,
    ) -> Option<LocusSeed> {
        let extra = &point.linearised.extra;
        let d = equations.first_depth_variable();
        let plain =
            |kind, unknowns| Some(LocusSeed { kind, itinerary: itinerary.clone(), unknowns });
        match equations.test(point, test) {
            TestKind::Turn => plain(LocusKind::Fold, unknowns),
            TestKind::Flip => plain(LocusKind::Flip, unknowns),
            TestKind::Contact(place) => {
                let (number, passage, _) = extra.arrivals[place];
                (itinerary.contacts() > 1)
                    .then(|| self.grazing(itinerary, &extra.states, &unknowns, number, passage))
            }
            TestKind::Passage(place) => {
                let (number, passage, _) = extra.free[place];
                let before =
                    |(other, at, _): &&(usize, usize, Vec<f64>)| (*other, *at) < (number, passage);
                let mut unknowns = unknowns;
                unknowns.insert(d + extra.arrivals.iter().filter(before).count(), 0.0);
                let with = itinerary.with_contact(number, passage);
                (with.contacts() > 1)
                    .then(|| self.grazing(&with, &extra.states, &unknowns, number, passage))
            }
            TestKind::Crossing | TestKind::Halves | TestKind::Reciprocal => {
                let pairs = eigenvalues(&equations.jacobian(&point.linearised)?).ok()?;
                let on_circle = pairs
                    .iter()
                    .find(|value| value.im > 1e-6 && (value.norm() - 1.0).abs() < 1e-6)?;
                plain(LocusKind::Torus, [unknowns, vec![on_circle.arg()]].concat())
            }
        }
    }

    /// Seed of a graze: the itinerary starts with the grazing return, and the depth variable of the
    /// grazing passage is 0.
    fn grazing(
        &self,
        itinerary: &ContactItinerary,
        states: &[Vec<f64>],
        unknowns: &[f64],
        number: usize,
        passage: usize,
    ) -> LocusSeed {
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
        LocusSeed {
            kind: LocusKind::Graze,
            itinerary: ContactItinerary::new(itinerary.passages(), rotated),
            unknowns: state.chain(depths).chain(parameters.iter().copied()).collect(),
        }
    }

    /// Adds the locus through a seed.
    fn add(&self, found: &mut FoundLoci, seed: LocusSeed) {
        self.progress.expect(1);
        let of = format!("{} {}", seed.kind.word(), seed.itinerary);
        let left = found.left.entry(of).or_insert(MOST_WORK);
        if *left > 0 {
            let known = &found.traces[..];
            let follow = || self.searched(known, &seed, *left);
            let (trace, work) = through_seed(self.progress, (known.len(), *left), &seed, follow);
            *left = left.saturating_sub(work);
            found.traces.extend(trace);
        }
        if *left == 0 {
            self.unfinished.extend([&seed.itinerary]);
        }
        self.progress.advance(1);
    }

    /// Locus through a seed, unless it is known, with at most `most` work.
    fn searched(&self, known: &[TracedLocus], seed: &LocusSeed, most: u64) -> SearchedLocus {
        let condition = condition(seed);
        let conditions = self.request.conditions(seed.kind, &seed.itinerary);
        let orbits = self.rounded(&seed.itinerary).within_work(most);
        let mut orbits = LocusEquations::new(orbits, condition, conditions);
        let mut fine = LocusEquations::new(self.exact(&seed.itinerary), condition, conditions);
        let grazes = seed.itinerary.period() * seed.itinerary.passages();
        let found = through(seed, known, &mut orbits, &mut fine, grazes);
        let trace = found.map(|(points, ends)| {
            let (kind, itinerary) = (seed.kind, seed.itinerary.clone());
            TracedLocus { kind, itinerary, points, ends: ends.map(LocusEnd::of) }
        });
        (trace, orbits.orbits.work())
    }

    /// Indices of the passages whose contact begins without a kick.
    pub(super) fn without_kick(&self, traces: &[TracedLocus]) -> Vec<usize> {
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

    /// Tangencies of folds and flips with the grazing curves at their points of codimension two.
    pub(super) fn tangencies(&self, traces: &[TracedLocus]) -> Vec<Tangency> {
        resumed(self.progress, &[LocusPiece::Tangencies as u64], || self.tangencies_of(traces))
    }

    fn tangencies_of(&self, traces: &[TracedLocus]) -> Vec<Tangency> {
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
        graze: &TracedLocus,
        point: &TracePoint,
        label: CodimensionTwo,
        itinerary: &ContactItinerary,
        kind: LocusKind,
    ) -> Option<Tangency> {
        let multiplier = if kind == LocusKind::Fold { 1.0 } else { -1.0 };
        let equations = self.exact(itinerary);
        let unknowns: Vec<Dd> = converted(&point.unknowns);
        let (state, depth_variables, parameters) = equations.offsets(&unknowns);
        let grazing = self.grazing_contact(graze);
        let offsets = converted(&parameters);
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
            parameters: offsets,
            coefficient: leaving.coefficient.to_f64(),
            fitted: values.map(|values| at_zero(&values).to_f64()),
            slope,
        })
    }

    /// All loci in offsets.
    pub(super) fn all_described(&self, traces: &[TracedLocus]) -> Vec<Locus> {
        let traces = traces.iter().enumerate();
        let described = traces.map(|(number, trace)| {
            let place = [LocusPiece::Locus as u64, number as u64];
            resumed(self.progress, &place, || self.described(trace))
        });
        described.collect()
    }

    /// A locus in offsets.
    fn described(&self, trace: &TracedLocus) -> Locus {
        let mut points: Vec<LocusPoint> =
            trace.points.iter().filter_map(|point| self.point(trace, point)).collect();
        // Where multipliers are undefined, at a graze, the stability of the next point is used.
        for place in 0..points.len() {
            if points[place].multipliers.is_empty() {
                let near = if place > 0 { place - 1 } else { (place + 1).min(points.len() - 1) };
                points[place].stable = points[near].stable;
            }
        }
        trace.described(points, self.grazing_passage(trace))
    }

    /// Passage that grazes along a locus of grazes.
    fn grazing_passage(&self, trace: &TracedLocus) -> usize {
        trace.itinerary.returns()[0].iter().nth(self.grazing_contact(trace)).unwrap_or(0)
    }

    /// Index of the grazing contact among the contacts of a locus of grazes.
    fn grazing_contact(&self, trace: &TracedLocus) -> usize {
        let d = self.map.dimension();
        let zero =
            |place: &usize| trace.points.iter().all(|point| point.unknowns[d + place].abs() < 1e-9);
        (0..trace.itinerary.contacts()).find(zero).unwrap_or(0)
    }

    fn point(&self, trace: &TracedLocus, point: &TracePoint) -> Option<LocusPoint> {
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
                let passage = self.grazing_passage(trace);
                let without = trace.itinerary.without_contact(0, passage);
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
        let contacts = others.filter(|(place, _)| Some(*place) != grazing).all(|(_, &y)| {
            y > 0.0 || point.label.is_some() && y > -1e-9 * self.map.window.depth.sqrt()
        });
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
}

impl ClosedOrbits for MapOrbitEquations<'_, f64> {
    fn begun_later(&mut self, unknowns: &[f64]) -> Vec<Vec<f64>> {
        let (d, units, itinerary) = (self.first_depth_variable(), self.units(), self.itinerary());
        let Some(there) = self.at(&unknowns[..units.len()]) else { return Vec::new() };
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

    fn is_several(&mut self, unknowns: &[f64]) -> bool {
        let (units, itinerary) = (self.units(), self.itinerary());
        let Some(there) = self.at(&unknowns[..units.len()]) else { return false };
        let states = there.extra.states;
        let mut shorter = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        shorter.any(|later| {
            let mut pairs = states[0].iter().zip(&states[later]).zip(units);
            pairs.all(|((a, b), unit)| (a - b).abs() <= SAME * unit)
        })
    }
}

/// Point of a curve at which an unknown differs by `by` from that of another point.
fn beyond<C: CurveEquations<Dd>>(
    equations: &mut C,
    from: &[Dd],
    unknown: usize,
    by: Dd,
) -> Option<Vec<Dd>> {
    let normal = unit_vector(from.len(), unknown);
    let tangent = tangent_at(&equations.linearised(from)?.jacobian, &normal)?;
    let origin = moved(from, &tangent, by / tangent[unknown]);
    Some(corrected(equations, &origin, &origin, &normal)?.0)
}

/// Value at 0 of the interpolation polynomial through points.
fn at_zero(points: &[(Dd, Dd)]) -> Dd {
    let weight = |t: Dd| {
        let others = points.iter().filter(|(other, _)| *other != t);
        others.fold(Dd::ONE, |product, &(other, _)| product * other / (other - t))
    };
    points.iter().fold(Dd::ZERO, |sum, &(t, value)| sum + weight(t) * value)
}

/// The condition of a seed.
fn condition(seed: &LocusSeed) -> Condition {
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

/// Branch in one parameter from a start, on one side.
fn followed(
    equations: &mut MapOrbitEquations<'_, f64>,
    start: &[f64],
    sign: f64,
) -> Option<Curve<f64, PassagesOfOrbit<f64>>> {
    let tangent = any_tangent(&equations.linearised(start)?.jacobian)?;
    let along: Vec<f64> = tangent.iter().map(|value| sign * value).collect();
    follow(equations, start, &along, &StepControl::DEFAULT)
}

/// Whether a point lies near a polyline.
fn is_near(line: &[Vec<f64>], point: &[f64]) -> bool {
    line.windows(2).any(|pair| {
        let (share, apart, _) = beside(&pair[0], &pair[1], point);
        (0.0..=1.0).contains(&share) && apart < 1e-3
    })
}
