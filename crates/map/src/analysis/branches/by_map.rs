//! Branches of the orbits of a local map.

use rayon::prelude::*;
use serde::Serialize;

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
use super::normal_form::NormalForm;
use super::trace::{
    Follow, Of, Trace, Traces, apart, described, each_once, exact_or_zero, null_vector,
    standard_form, through_seed, toggled, twice, unit_vector, with_those_led_to,
};
use crate::analysis::continuation::{
    CurveEquations, CurvePoint, Linearised, StepControl, corrected, searched, tangent_at, zero_near,
};
use crate::analysis::error::AnalysisError;
use crate::analysis::periodic::{
    ByMap, ContactItinerary, FoundOrbit, ItinerarySearch, MapOrbitEquations, OrbitContact,
    PassagesOfOrbit, Settled, window_scales,
};
use crate::analysis::progress::{Progress, Shard};
use crate::expansion::LocalMap;
use crate::iteration::PassageSet;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// Half-widths of the window up to which branches are followed, of coordinates, and depth
/// variables in that of the window's edge.
const REACH: f64 = 10.0;
const DEEPEST: f64 = 2.0;
/// Places in the range at which orbits are looked for, as shares of each side of the graze.
const SHARES: [f64; 4] = [0.02, 0.15, 0.5, 0.95];
/// Orbits are the same where all unknowns agree to this.
const SAME: f64 = 1e-6;
/// A value of a graze within this of zero is at it, in the units of the unknowns.
const AT_GRAZE: f64 = 1e-10;
/// Orbits this near to those of half their period are where a branch doubles.
const NEAR: f64 = 1e-3;
/// How far from a special point its refinement in double-double may lie.
const FAR: f64 = 1e-5;
/// How near a multiplier is to that of a special point.
const AT_MULTIPLIER: f64 = 1e-5;
/// Distances from the orbit that doubles at which the doubled branch begins.
const DOUBLED: [f64; 3] = [1e-2, 1e-3, 1e-4];

type Point = CurvePoint<f64, PassagesOfOrbit<f64>>;

/// An orbit from which a branch is followed: the first point, depth variables, parameter.
#[derive(Clone, Debug, Serialize)]
struct Seed {
    itinerary: ContactItinerary,
    states: Vec<Vec<f64>>,
    depth_variables: Vec<f64>,
    parameter: f64,
    /// The direction of a branch that doubles another, in the unknowns.
    direction: Option<Vec<f64>>,
}

type MapTrace = Trace<PassagesOfOrbit<f64>>;

struct Continuation<'a> {
    search: ItinerarySearch<'a>,
    by_map: ByMap<'a>,
    map: &'a LocalMap,
    request: &'a BranchRequest,
    progress: &'a dyn Progress,
}

/// The branches of a map.
pub(super) fn branches(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    follow: Follow,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let continuation = Continuation::new(scene, orbit, map, request, progress)?;
    let found = with_those_led_to(
        continuation.first(&request.itineraries.iter().collect::<Vec<_>>()),
        Of::itinerary,
        |itinerary, trace| follow.of(request, continuation.led_to(itinerary, trace)),
        |itinerary, seeds, known| continuation.traces(itinerary, seeds, known),
    );
    let branches = continuation.described(&found).into_iter();
    // A branch that is virtual on both sides of a graze touches what is physical there alone.
    let of_stretch = |point: &BranchPoint| {
        point.orbit.physical && point.special.is_none() && !point.orbit.multipliers.is_empty()
    };
    let physical = branches.filter(|branch| branch.points.iter().any(of_stretch));
    Ok(Branches { branches: physical.collect() })
}

/// A share of the branches of the itineraries asked for.
pub(super) fn share(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    shard: &Shard<'_>,
) -> Result<(), AnalysisError> {
    let continuation = Continuation::new(scene, orbit, map, request, shard)?;
    continuation.described(&continuation.first(&shard.own_of(&request.itineraries)));
    Ok(())
}

impl<'a> Continuation<'a> {
    fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
        request: &'a BranchRequest,
        progress: &'a dyn Progress,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            search: ItinerarySearch::new(map),
            by_map: ByMap::new(scene, orbit, map)?,
            map,
            request,
            progress,
        })
    }

    /// The branches of some of the itineraries asked for.
    fn first(&self, own: &[&ContactItinerary]) -> Traces<PassagesOfOrbit<f64>> {
        self.progress.expect(own.len() as u64);
        let settled = self.settled();
        let grazing = self.grazing_orbits();
        let first = own.par_iter().map(|&itinerary| {
            let seeds = self.seeds(itinerary, &settled, &grazing);
            let traces = self.traces(itinerary, seeds, Vec::new());
            self.progress.advance(1);
            (itinerary.clone(), traces)
        });
        first.collect()
    }

    /// The branches as they are given out.
    fn described(&self, found: &Traces<PassagesOfOrbit<f64>>) -> Vec<Branch> {
        described(self.progress, found, |itinerary, trace| self.branch(itinerary, trace))
    }

    fn equations<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, f64> {
        self.equations_of(&self.search.map, itinerary)
    }

    fn equations_of<'e, S: Real>(
        &'e self,
        map: &'e crate::analysis::evaluation::MapEvaluation<S>,
        itinerary: &'e ContactItinerary,
    ) -> MapOrbitEquations<'e, S> {
        let BranchRequest { along, at, .. } = self.request;
        let range = self.request.ordered_range();
        let reach = [REACH, DEEPEST];
        let equations =
            MapOrbitEquations::new(map, itinerary, &self.map.window, &[*along], at, reach);
        let equations = equations.in_units_of(0, range);
        if self.search.positive { equations.with_positive_depths() } else { equations }
    }

    /// The values at which orbits are looked for.
    fn values(&self) -> Vec<f64> {
        let [a, b] = self.request.range;
        let zero = 0.0_f64.clamp(a.min(b), a.max(b));
        let sides = [a, b].into_iter().filter(|&end| end != zero);
        sides.flat_map(|end| SHARES.map(|share| zero + share * (end - zero))).collect()
    }

    /// What the map settles on at these values.
    fn settled(&self) -> Vec<(f64, Vec<Settled>)> {
        let values = self.values();
        let longest = self.request.itineraries.iter().map(ContactItinerary::period).max();
        let settled = values.into_par_iter().map(|value| {
            let settled =
                self.search.settled(&self.request.parameters(value), longest.unwrap_or(1));
            (value, settled)
        });
        settled.collect()
    }

    /// Where the orbit without contact grazes: its point, the parameter, and the passages.
    fn grazing_orbits(&self) -> Vec<(Vec<f64>, f64, PassageSet)> {
        let passages = self.map.passages();
        let none = ContactItinerary::new(passages, vec![PassageSet::default()]);
        let value = self.values().first().copied().unwrap_or_default();
        let seed = Seed {
            itinerary: none.clone(),
            states: vec![self.search.smooth.at(&self.request.parameters(value))],
            depth_variables: Vec::new(),
            parameter: value,
            direction: None,
        };
        let traces = self.traces(&none, vec![seed], Vec::new());
        let turns = traces.iter().flat_map(|trace| {
            let grazes = trace.turns.iter().filter(|turn| turn.test >= 2);
            grazes.filter_map(|turn| {
                let point = &trace.points[turn.point];
                let free = &point.linearised.extra.free;
                free.get(turn.test - 2)?;
                let made = free.iter().filter(|(_, _, depth)| depth.abs() <= AT_GRAZE);
                let state = point.linearised.extra.states[0].clone();
                let (_, _, parameters) = self.equations(&none).offsets(&point.unknowns);
                let value = parameters[self.request.along];
                Some((state, value, made.map(|(_, passage, _)| *passage).collect()))
            })
        });
        turns.collect()
    }

    /// Where branches of an itinerary may be found.
    fn seeds(
        &self,
        itinerary: &ContactItinerary,
        settled: &[(f64, Vec<Settled>)],
        grazing: &[(Vec<f64>, f64, PassageSet)],
    ) -> Vec<Seed> {
        let contacts = itinerary.contacts();
        let seed = |state: Vec<f64>, depth_variables: Vec<f64>, parameter: f64| Seed {
            itinerary: itinerary.clone(),
            states: vec![state],
            depth_variables,
            parameter,
            direction: None,
        };
        let mut seeds = Vec::new();
        for (state, parameter, passages) in grazing {
            let all = itinerary.returns().iter().flat_map(|made| made.iter());
            if all.into_iter().all(|passage| passages.contains(passage)) {
                seeds.push(seed(state.clone(), vec![0.0; contacts], *parameter));
            }
        }
        for (value, settled) in settled {
            for start in settled.iter().filter_map(|settled| settled.begun_as(itinerary)) {
                seeds.push(seed(start.state, start.depth_variables, *value));
            }
            for start in self.search.starts_about(itinerary, &self.request.parameters(*value)) {
                seeds.push(seed(start.state, start.depth_variables, *value));
            }
        }
        seeds
    }

    /// The branches of an itinerary through these seeds, beside those known.
    fn traces(
        &self,
        itinerary: &ContactItinerary,
        seeds: Vec<Seed>,
        mut traces: Vec<MapTrace>,
    ) -> Vec<MapTrace> {
        let mut equations = self.equations(itinerary);
        for seed in seeds {
            let trace = through_seed(self.progress, itinerary, traces.len(), &seed, || {
                self.trace(&mut equations, &seed, &traces)
            });
            traces.extend(trace);
        }
        traces
    }

    /// The branch through a seed, if it is another.
    fn trace(
        &self,
        equations: &mut MapOrbitEquations<'_, f64>,
        seed: &Seed,
        known: &[MapTrace],
    ) -> Option<MapTrace> {
        let parameters = self.request.parameters(seed.parameter);
        let guess = equations.unknowns(&seed.states[0], &seed.depth_variables, &parameters);
        if let Some(direction) = &seed.direction {
            return self.doubled(equations, &guess, direction, known);
        }
        let start = solved(equations, &guess)?;
        let is_new =
            !equations.is_repeated(&start.2.extra, SAME) && !is_known(equations, &start, known);
        is_new.then(|| Trace::through(equations, &start.0, &StepControl::DEFAULT))?
    }

    /// The branch of the doubled orbits that begins at one that doubles.
    fn doubled(
        &self,
        equations: &mut MapOrbitEquations<'_, f64>,
        origin: &[f64],
        direction: &[f64],
        known: &[MapTrace],
    ) -> Option<MapTrace> {
        let first = DOUBLED.iter().find_map(|distance| {
            let pairs = origin.iter().zip(direction);
            let start: Vec<f64> = pairs.map(|(u, d)| u + distance * d).collect();
            let (unknowns, linearised) = corrected(equations, &start, &start, direction)?;
            let same = equations.is_repeated(&linearised.extra, 0.1 * distance);
            (!same).then_some((unknowns, start, linearised))
        })?;
        if is_known(equations, &(first.0.clone(), first.0.len() - 1, first.2.clone()), known) {
            return None;
        }
        Trace::through(equations, &first.0, &StepControl::DEFAULT)
    }

    /// The branches that a branch leads to: with a contact more or less where an orbit of it
    /// grazes, of the doubled period where it flips.
    fn led_to(&self, itinerary: &ContactItinerary, trace: &MapTrace) -> Vec<Seed> {
        let equations = self.equations(itinerary);
        let contacts = itinerary.contacts();
        let mut seeds = Vec::new();
        for turn in &trace.turns {
            let point = &trace.points[turn.point];
            let extra = &point.linearised.extra;
            if !is_physical(&equations, point, &[turn.test]) {
                continue;
            }
            let (_, depth_variables, parameters) = equations.offsets(&point.unknowns);
            let seed = Seed {
                itinerary: itinerary.clone(),
                states: extra.states.clone(),
                depth_variables,
                parameter: parameters[self.request.along],
                direction: None,
            };
            match turn.test {
                1 if 2 * itinerary.period() <= self.request.longest => {
                    seeds.extend(doubling(&equations, point, seed));
                }
                test if (2..2 + contacts).contains(&test) => {
                    let (number, passage, _) = extra.arrivals[test - 2];
                    seeds.push(seed.with(number, passage, Some(test - 2)));
                }
                test if (2 + contacts..2 + contacts + extra.free.len()).contains(&test) => {
                    let (number, passage, _) = extra.free[test - 2 - contacts];
                    seeds.push(seed.with(number, passage, None));
                }
                _ => {}
            }
        }
        seeds.into_iter().map(|seed| seed.in_standard_form()).collect()
    }

    /// A branch as it is given out.
    fn branch(&self, itinerary: &ContactItinerary, trace: &MapTrace) -> Branch {
        let equations = self.equations(itinerary);
        let points = trace.orbits().into_iter().map(|(place, turns)| {
            let point = &trace.points[place];
            let physical = is_physical(&equations, point, &turns);
            let mut orbit = self.found(&equations, point, physical);
            let mut special = None;
            if let Some(&first) = turns.first() {
                special = self.special(&equations, point, &turns).filter(|_| physical);
                let doubles = equations.is_repeated(&point.linearised.extra, NEAR);
                let exact = match doubles {
                    true => self.refined_doubling(itinerary, point),
                    false => self.refined(itinerary, point, first),
                };
                orbit.parameters = exact.unwrap_or(orbit.parameters);
            }
            BranchPoint { orbit, special }
        });
        let points = each_once(points.collect());
        let value = |place: usize| {
            let (_, _, parameters) = equations.offsets(&trace.points[place].unknowns);
            parameters[self.request.along]
        };
        // Where several contacts graze at once, determinants have zeros of higher order.
        let several = |ends: &&[usize; 2]| {
            let places = ends[0]..=ends[1];
            let mut grazing = places.map(|place| &trace.points[place]);
            !grazing.any(|point| depths_at_graze(&equations, point) > 1)
        };
        let unresolved = trace.unresolved.iter().filter(several);
        let unresolved = unresolved.map(|ends| ends.map(value)).collect();
        let first = equations.first_parameter();
        let ends = trace.ends(|unknown| match unknown == first {
            true => BranchEnd::Range,
            false => BranchEnd::Reach,
        });
        Branch { itinerary: itinerary.clone(), points, ends, unresolved }
    }

    /// What is special about a point at which these test functions vanish.
    fn special(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &Point,
        turns: &[usize],
    ) -> Option<Special> {
        let contacts = equations.itinerary().contacts();
        let passages = contacts + point.linearised.extra.free.len();
        let jacobian = equations.jacobian(&point.linearised);
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        // Nearer to a graze than rounding nothing is told from it.
        let at_graze = depths_at_graze(equations, point) > 0;
        let near = |value: f64| {
            let mut apart = multipliers.iter().map(|multiplier| (multiplier - value).norm());
            !at_graze && apart.any(|apart| apart < AT_MULTIPLIER)
        };
        let circle = multipliers
            .iter()
            .any(|multiplier| multiplier.im != 0.0 && (multiplier.norm() - 1.0).abs() < 1e-6);
        let doubles = equations.is_repeated(&point.linearised.extra, NEAR);
        let doubles = doubles.then_some(BranchLabel::BranchPoint);
        let label = doubles.or_else(|| {
            turns.iter().find_map(|&test| match test {
                // On a branch of doubled orbits the parameter turns where it begins, too.
                0 if near(1.0) && !equations.is_repeated(&point.linearised.extra, NEAR) => {
                    Some(BranchLabel::SaddleNode)
                }
                1 if near(-1.0) => Some(BranchLabel::PeriodDoubling),
                test if (2..2 + passages).contains(&test) => Some(BranchLabel::Graze),
                test if test == 2 + passages && near(1.0) => Some(BranchLabel::BranchPoint),
                test if test > 3 + passages && circle => Some(BranchLabel::NeimarkSacker),
                _ => None,
            })
        })?;
        let grazing = turns.iter().filter_map(|&test| grazing_passage(equations, point, test));
        let grazing = grazing.filter(|_| label == BranchLabel::Graze).collect();
        let coefficient = match label {
            BranchLabel::Graze => self.slope(equations, point, turns),
            _ => self.normal_form(equations, point, label),
        };
        Some(Special { label, grazing, coefficient })
    }

    /// The change of the parameter with the speed of the one contact that begins at a graze.
    fn slope(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &Point,
        turns: &[usize],
    ) -> Option<f64> {
        let contacts = turns.iter().filter_map(|test| test.checked_sub(2));
        let contacts = contacts.filter(|&place| place < equations.itinerary().contacts());
        let [place] = contacts.collect::<Vec<_>>()[..] else { return None };
        let (unknown, parameter) =
            (equations.first_depth_variable() + place, equations.first_parameter());
        let units = equations.units();
        let (_, passage, arrival) = &point.linearised.extra.arrivals[place];
        let small = 1e-9 * units[unknown];
        let by_depth = self.by_map.speed(*passage, small, arrival) / small;
        let along = |unknown: usize| exact_or_zero(point.tangent[unknown]) * units[unknown];
        let slope = along(parameter) / along(unknown) / by_depth;
        slope.is_finite().then_some(slope)
    }

    /// The coefficient of the normal form.
    fn normal_form(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &Point,
        label: BranchLabel,
    ) -> Option<f64> {
        let mut map = self.search.fine.clone();
        let exact = |values: Vec<f64>| values.into_iter().map(Dd::from).collect();
        let (state, depths, parameters) = equations.offsets(&point.unknowns);
        let first = equations.first_depth_variable();
        let units = &window_scales(&self.map.window)[..first];
        // Units of the equations are half-widths, or smaller by one factor.
        let smaller = (equations.units()[0] / units[0]).powi(2);
        let depths = depths.iter().zip(&equations.units()[first..]);
        let depths = depths.map(|(y, unit)| smaller * (y / unit).powi(2));
        let free = point.linearised.extra.free.iter();
        let free = free.map(|(_, _, depth)| smaller * depth.abs());
        let jacobian = equations.jacobian(&point.linearised)?;
        let mut form = NormalForm {
            map: &mut map,
            state: exact(state),
            parameters: exact(parameters),
            returns: equations.itinerary().period(),
            units: units.to_vec(),
            length: depths.chain(free).fold(1.0, f64::min),
            jacobian,
        };
        form.of(label)
    }

    /// The parameters of a special point to the rounding of double-double, where it is a zero of
    /// this test function.
    fn refined(
        &self,
        itinerary: &ContactItinerary,
        point: &Point,
        test: usize,
    ) -> Option<Vec<f64>> {
        let mut fine = self.equations_of(&self.search.fine, itinerary);
        let exact =
            |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect::<Vec<_>>();
        let (at, tangent) = (exact(&point.unknowns), exact(&point.tangent));
        let found = zero_near(&mut fine, &at, &tangent, |point| point.tests[test].value)?;
        let rounded: Vec<f64> = found.unknowns.iter().map(|value| value.to_f64()).collect();
        let (_, _, parameters) = fine.offsets(&found.unknowns);
        let parameters = parameters.iter().map(|value| value.to_f64()).collect();
        (apart(&rounded, &point.unknowns) < FAR).then_some(parameters)
    }

    /// The same of a branch point at which orbits have half their period: there those double.
    fn refined_doubling(&self, itinerary: &ContactItinerary, point: &Point) -> Option<Vec<f64>> {
        let half = itinerary.period() / 2;
        let returns = itinerary.returns()[..half].to_vec();
        let half = ContactItinerary::new(itinerary.passages(), returns);
        let (state, depths, parameters) = self.equations(itinerary).offsets(&point.unknowns);
        let equations = self.equations(&half);
        let unknowns = equations.unknowns(&state, &depths[..half.contacts()], &parameters);
        let linearised = equations.at(&unknowns)?;
        let along = unit_vector(unknowns.len(), unknowns.len() - 1);
        let tangent = tangent_at(&linearised.jacobian, &along)?;
        let point = Point { unknowns, tangent, linearised, tests: Vec::new() };
        self.refined(&half, &point, 1)
    }

    /// The orbit at a point.
    fn found(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &Point,
        physical: bool,
    ) -> FoundOrbit {
        let (_, depth_variables, parameters) = equations.offsets(&point.unknowns);
        let extra = &point.linearised.extra;
        let at_graze = depths_at_graze(equations, point) > 0;
        let jacobian = equations.jacobian(&point.linearised).filter(|_| !at_graze);
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers: Vec<[f64; 2]> =
            multipliers.iter().flatten().map(|value| [value.re, value.im]).collect();
        let inside = extra.states.iter();
        let depths: Vec<f64> = depth_variables.iter().map(|y| y * y).collect();
        let window = &self.map.window;
        let contacts = extra.arrivals.iter().zip(&depth_variables);
        let contacts = contacts.map(|((number, passage, point), &y)| OrbitContact {
            number: *number,
            passage: *passage,
            speed: self.by_map.speed(*passage, y, point),
        });
        FoundOrbit {
            itinerary: equations.itinerary().clone(),
            states: extra.states.clone(),
            stable: !multipliers.is_empty()
                && multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0),
            multipliers,
            contacts: contacts.collect(),
            physical,
            inside: { inside }.all(|state| window.holds(state, &parameters, &depths)),
            extra_contacts: 0,
            hits: None,
            residual: point.linearised.residual.iter().fold(0.0, |most, r| most.max(r.abs())),
            parameters,
        }
    }
}

/// Unknowns of an orbit, which of them was held, and its equations.
type Solved = (Vec<f64>, usize, Linearised<f64, PassagesOfOrbit<f64>>);

/// The orbit at the parameter of a guess, in range.
fn solved(equations: &mut MapOrbitEquations<'_, f64>, guess: &[f64]) -> Option<Solved> {
    let held = guess.len() - 1;
    // An orbit that is known to be one, as the grazing orbit is.
    let exact = equations.linearised(guess)?;
    let (unknowns, linearised) = if exact.residual.iter().all(|value| value.abs() <= 1e-11) {
        (guess.to_vec(), exact)
    } else {
        searched(equations, guess, held)?
    };
    let in_range = unknowns.iter().enumerate().all(|(unknown, value)| {
        let [lower, upper] = equations.range(unknown);
        lower <= *value && *value <= upper
    });
    in_range.then_some((unknowns, held, linearised))
}

/// Whether an orbit lies on a branch that is known, begun at any of its points.
fn is_known(
    equations: &mut MapOrbitEquations<'_, f64>,
    (unknowns, held, linearised): &Solved,
    traces: &[MapTrace],
) -> bool {
    let itinerary = equations.itinerary().clone();
    let dimension = equations.first_depth_variable();
    let later: Vec<usize> =
        (0..itinerary.period()).filter(|&later| itinerary.repeats_after(later)).collect();
    let starts: Vec<Vec<f64>> = later
        .iter()
        .map(|&later| {
            let state = &linearised.extra.states[later];
            state.iter().zip(equations.units()).map(|(value, unit)| value / unit).collect()
        })
        .collect();
    let value = unknowns[*held];
    let normal = unit_vector(unknowns.len(), *held);
    let near = |at: &[f64], within: f64| {
        starts.iter().any(|start| apart(&at[..dimension], start) <= within)
    };
    let mut points = traces.iter().flat_map(|trace| &trace.points);
    if points.any(|point| near(&point.unknowns, SAME)) {
        return true;
    }
    for pair in traces.iter().flat_map(|trace| trace.points.windows(2)) {
        let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
        let (from, to) = (a[*held], b[*held]);
        if (from - value) * (to - value) > 0.0 {
            continue;
        }
        let length = apart(a, b);
        if !near(a, 3.0 * length + SAME) {
            continue;
        }
        let share = if from == to { 0.0 } else { (value - from) / (to - from) };
        let guess: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect();
        let there = corrected(equations, &guess, &guess, &normal);
        if there.is_some_and(|(there, _)| near(&there, SAME)) {
            return true;
        }
    }
    false
}

/// Whether the map makes the contacts prescribed, where these test functions vanish.
fn is_physical(equations: &MapOrbitEquations<'_, f64>, point: &Point, vanishing: &[usize]) -> bool {
    let contacts = equations.itinerary().contacts();
    let first = equations.first_depth_variable();
    let depths = &point.unknowns[first..first + contacts];
    let grazes = |test: usize, value: f64| vanishing.contains(&test) || value.abs() <= AT_GRAZE;
    let made = depths.iter().enumerate();
    let mut made =
        made.map(|(place, &y)| y > 0.0 || (grazes(2 + place, y) && !vanishing.is_empty()));
    let free = point.linearised.extra.free.iter().enumerate();
    let mut free = free.map(|(place, &(_, _, depth))| {
        depth <= 0.0 || (grazes(2 + contacts + place, depth) && !vanishing.is_empty())
    });
    made.all(|made| made) && free.all(|free| free)
}

/// The return and passage that graze where a test function vanishes.
fn grazing_passage(
    equations: &MapOrbitEquations<'_, f64>,
    point: &Point,
    test: usize,
) -> Option<[usize; 2]> {
    let contacts = equations.itinerary().contacts();
    let extra = &point.linearised.extra;
    let place = test.checked_sub(2)?;
    let (number, passage) = match place.checked_sub(contacts) {
        None => (extra.arrivals[place].0, extra.arrivals[place].1),
        Some(free) => extra.free.get(free).map(|&(number, passage, _)| (number, passage))?,
    };
    Some([number, passage])
}

/// Contacts without depth.
fn depths_at_graze(equations: &MapOrbitEquations<'_, f64>, point: &Point) -> usize {
    let depths = equations.first_depth_variable()..equations.first_parameter();
    point.unknowns[depths].iter().filter(|y| y.abs() <= AT_GRAZE).count()
}

/// The doubled branch at an orbit with a multiplier −1: the vector of that multiplier, with the
/// depth variables of the second half the other way.
fn doubling(equations: &MapOrbitEquations<'_, f64>, point: &Point, seed: Seed) -> Option<Seed> {
    let matrix = equations.shifted(&point.linearised.jacobian, -1.0);
    let vector = null_vector(&matrix)?;
    let (state, depths) = vector.split_at(equations.first_depth_variable());
    let direction = state.iter().chain(depths).copied();
    let direction = direction.chain(depths.iter().map(|value| -value)).chain([0.0]);
    let direction: Vec<f64> = direction.collect();
    let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
    Some(Seed {
        itinerary: twice(&seed.itinerary),
        states: [seed.states.clone(), seed.states].concat(),
        depth_variables: [seed.depth_variables.clone(), seed.depth_variables].concat(),
        parameter: seed.parameter,
        direction: Some(direction.iter().map(|value| value / length).collect()),
    })
}

impl Of for Seed {
    fn itinerary(&self) -> &ContactItinerary {
        &self.itinerary
    }
}

impl Seed {
    /// The same orbit with a passage made a contact, of depth zero, or one made none.
    fn with(mut self, number: usize, passage: usize, contact: Option<usize>) -> Self {
        match contact {
            Some(place) => drop(self.depth_variables.remove(place)),
            None => {
                let returns = self.itinerary.returns();
                let before = returns[..number].iter().map(|made| made.len()).sum::<usize>()
                    + returns[number].iter().filter(|&other| other < passage).count();
                self.depth_variables.insert(before, 0.0);
            }
        }
        self.itinerary = toggled(&self.itinerary, number, passage);
        self
    }

    /// The same orbit, of its shortest period and begun where its itinerary is the largest.
    fn in_standard_form(mut self) -> Self {
        if self.direction.is_some() {
            return self;
        }
        let (standard, period, by) = standard_form(&self.itinerary, &self.states);
        let returns = self.itinerary.returns();
        let skipped = returns[..by].iter().map(|made| made.len()).sum();
        self.depth_variables.truncate(standard.contacts());
        self.depth_variables.rotate_left(skipped);
        self.states.truncate(period);
        self.states.rotate_left(by);
        self.itinerary = standard;
        self
    }
}
