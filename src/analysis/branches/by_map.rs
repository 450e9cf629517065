//! Branches of the orbits of a local map.

use rayon::prelude::*;

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
use super::normal_form::NormalForm;
use crate::analysis::continuation::{
    Course, CourseEnd, CurveEquations, CurvePoint, Linearised, StepControl, Turn, corrected,
    follow, searched, tangent_at, zero_near,
};
use crate::analysis::error::AnalysisError;
use crate::analysis::orbits::{ByMap, FoundOrbit, OrbitContact};
use crate::analysis::periodic::{
    ContactItinerary, ItinerarySearch, MapOrbitEquations, PassagesOfOrbit, Settled,
};
use crate::analysis::progress::Progress;
use crate::expansion::LocalMap;
use crate::iteration::PassageSet;
use crate::model::Scene;
use crate::numeric::linear::{eigenvalues, solve};
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
/// How near a multiplier is to that of a special point.
const AT_MULTIPLIER: f64 = 1e-5;
/// Distances from the orbit that doubles at which the doubled branch begins.
const DOUBLED: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Rounds in which branches lead to others.
const ROUNDS: usize = 8;

type Point = CurvePoint<f64, PassagesOfOrbit<f64>>;

/// An orbit from which a branch is followed: the first point, depth variables, parameter.
#[derive(Clone, Debug)]
struct Seed {
    itinerary: ContactItinerary,
    states: Vec<Vec<f64>>,
    depth_variables: Vec<f64>,
    parameter: f64,
    /// The direction of a branch that doubles another, in the unknowns.
    direction: Option<Vec<f64>>,
}

/// A branch as it is followed, from its one end to the other.
struct Trace {
    points: Vec<Point>,
    turns: Vec<Turn>,
    unresolved: Vec<[usize; 2]>,
    ends: [BranchEnd; 2],
}

struct Continuation<'a> {
    search: ItinerarySearch<'a>,
    by_map: ByMap<'a>,
    map: &'a LocalMap,
    request: &'a BranchRequest,
}

/// The branches of a map.
pub(super) fn branches(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let continuation = Continuation {
        search: ItinerarySearch::new(map),
        by_map: ByMap::new(scene, orbit, map)?,
        map,
        request,
    };
    progress.expect(request.itineraries.len() as u64);
    let settled = continuation.settled();
    let grazing = continuation.grazing_orbits();
    let mut found: Vec<(ContactItinerary, Vec<Trace>)> = request
        .itineraries
        .par_iter()
        .map(|itinerary| {
            let seeds = continuation.seeds(itinerary, &settled, &grazing);
            let traces = continuation.traces(itinerary, seeds, Vec::new());
            progress.advance(1);
            (itinerary.clone(), traces)
        })
        .collect();
    let mut looked_at = vec![0; found.len()];
    for _ in 0..ROUNDS {
        let mut seeds: Vec<Seed> = Vec::new();
        for ((itinerary, traces), looked_at) in found.iter().zip(&mut looked_at) {
            for trace in &traces[*looked_at..] {
                seeds.extend(continuation.led_to(itinerary, trace));
            }
            *looked_at = traces.len();
        }
        if seeds.is_empty() {
            break;
        }
        for seed in &seeds {
            if !found.iter().any(|(itinerary, _)| *itinerary == seed.itinerary) {
                found.push((seed.itinerary.clone(), Vec::new()));
                looked_at.push(0);
            }
        }
        found.par_iter_mut().for_each(|(itinerary, traces)| {
            let mine = seeds.iter().filter(|seed| seed.itinerary == *itinerary).cloned();
            *traces = continuation.traces(itinerary, mine.collect(), std::mem::take(traces));
        });
    }
    found.sort_by_key(|(itinerary, _)| itinerary.period());
    let branches = found.iter().flat_map(|(itinerary, traces)| {
        traces.iter().map(|trace| continuation.branch(itinerary, trace))
    });
    // A branch that is virtual on both sides of a graze touches what is physical there alone.
    let of_stretch = |point: &BranchPoint| point.orbit.physical && point.special.is_none();
    let physical = branches.filter(|branch| branch.points.iter().any(of_stretch));
    Ok(Branches { branches: physical.collect() })
}

impl<'a> Continuation<'a> {
    fn equations<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, f64> {
        self.equations_of(&self.search.map, itinerary)
    }

    fn equations_of<'e, S: Real>(
        &'e self,
        map: &'e crate::analysis::evaluation::MapEvaluation<S>,
        itinerary: &'e ContactItinerary,
    ) -> MapOrbitEquations<'e, S> {
        let BranchRequest { along, range: [a, b], at, .. } = self.request;
        let range = [a.min(*b), a.max(*b)];
        let reach = [REACH, DEEPEST];
        let equations =
            MapOrbitEquations::new(map, itinerary, &self.map.window, &[*along], at, reach);
        let equations = equations.with_range(0, range);
        if self.search.positive { equations.with_positive_depths() } else { equations }
    }

    /// All active parameters at a value of the one that varies.
    fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.request.at.clone();
        parameters[self.request.along] = value;
        parameters
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
            let settled = self.search.settled(&self.parameters(value), longest.unwrap_or(1));
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
            states: vec![self.search.smooth.at(&self.parameters(value))],
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
            for start in self.search.starts_about(itinerary, &self.parameters(*value)) {
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
        mut traces: Vec<Trace>,
    ) -> Vec<Trace> {
        let mut equations = self.equations(itinerary);
        for seed in seeds {
            let parameters = self.parameters(seed.parameter);
            let guess = equations.unknowns(&seed.states[0], &seed.depth_variables, &parameters);
            let trace = match &seed.direction {
                Some(direction) => self.doubled(&mut equations, &guess, direction, &traces),
                None => {
                    let Some(start) = solved(&mut equations, &guess) else { continue };
                    let is_new = !equations.is_repeated(&start.2.extra, SAME)
                        && !is_known(&mut equations, &start, &traces);
                    if is_new { traced(&mut equations, &start.0, &start.2) } else { None }
                }
            };
            traces.extend(trace);
        }
        traces
    }

    /// The branch of the doubled orbits that begins at one that doubles.
    fn doubled(
        &self,
        equations: &mut MapOrbitEquations<'_, f64>,
        origin: &[f64],
        direction: &[f64],
        known: &[Trace],
    ) -> Option<Trace> {
        let first = DOUBLED.iter().find_map(|distance| {
            let pairs = origin.iter().zip(direction);
            let start: Vec<f64> = pairs.map(|(u, d)| u + distance * d).collect();
            let (unknowns, linearised) = corrected(equations, &start, &start, direction)?;
            let same = equations.is_repeated(&linearised.extra, 0.1 * distance);
            (!same).then_some((unknowns, start, linearised))
        })?;
        if is_known(equations, &(first.0.clone(), 0, first.2.clone()), known) {
            return None;
        }
        let along: Vec<f64> = direction.to_vec();
        let course = follow(equations, &first.0, &along, &StepControl::default())?;
        Some(Trace::of(course, BranchEnd::Doubling))
    }

    /// The branches that a branch leads to: with a contact more or less where an orbit of it
    /// grazes, of the doubled period where it flips.
    fn led_to(&self, itinerary: &ContactItinerary, trace: &Trace) -> Vec<Seed> {
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
    fn branch(&self, itinerary: &ContactItinerary, trace: &Trace) -> Branch {
        let equations = self.equations(itinerary);
        let points = trace.orbits().into_iter().map(|(place, turns)| {
            let point = &trace.points[place];
            let physical = is_physical(&equations, point, &turns);
            let mut orbit = self.found(&equations, point, physical);
            let mut special = None;
            if let Some(&first) = turns.first() {
                let mut fine = self.equations_of(&self.search.fine, itinerary);
                let exact = refined(&mut fine, point, first);
                if let Some(exact) = &exact {
                    let (_, _, parameters) = fine.offsets(&exact.unknowns);
                    orbit.parameters = parameters.iter().map(|value| value.to_f64()).collect();
                }
                if physical {
                    special = self.special(&equations, point, &turns);
                }
            }
            BranchPoint { orbit, special }
        });
        let points = points.collect();
        let value = |place: usize| {
            let (_, _, parameters) = equations.offsets(&trace.points[place].unknowns);
            parameters[self.request.along]
        };
        let unresolved = trace.unresolved.iter().map(|ends| ends.map(value)).collect();
        Branch { itinerary: itinerary.clone(), points, ends: trace.ends, unresolved }
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
        let at_graze = self.is_at_graze(equations, point);
        let near = |value: f64| {
            let mut apart = multipliers.iter().map(|multiplier| (multiplier - value).norm());
            !at_graze && apart.any(|apart| apart < AT_MULTIPLIER)
        };
        let circle = multipliers
            .iter()
            .any(|multiplier| multiplier.im != 0.0 && (multiplier.norm() - 1.0).abs() < 1e-6);
        let label = turns.iter().find_map(|&test| match test {
            0 if equations.is_repeated(&point.linearised.extra, SAME) => {
                Some(BranchLabel::BranchPoint)
            }
            0 if near(1.0) => Some(BranchLabel::SaddleNode),
            1 if near(-1.0) => Some(BranchLabel::PeriodDoubling),
            test if (2..2 + passages).contains(&test) => Some(BranchLabel::Graze),
            test if test == 2 + passages && near(1.0) => Some(BranchLabel::BranchPoint),
            test if test > 2 + passages && circle => Some(BranchLabel::NeimarkSacker),
            _ => None,
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
        let [test] = turns else { return None };
        let place =
            test.checked_sub(2).filter(|&place| place < equations.itinerary().contacts())?;
        let (unknown, parameter) =
            (equations.first_depth_variable() + place, equations.first_parameter());
        let units = equations.units();
        let (_, passage, arrival) = &point.linearised.extra.arrivals[place];
        let small = 1e-9 * units[unknown];
        let by_depth = self.by_map.speed(*passage, small, arrival) / small;
        let along = |unknown: usize| point.tangent[unknown] * units[unknown];
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
        let units = equations.units();
        let first = equations.first_depth_variable();
        let depths = depths.iter().zip(&units[first..]);
        let depths = depths.map(|(y, unit)| (y / unit).powi(2));
        let free = point.linearised.extra.free.iter().map(|(_, _, depth)| depth.abs());
        let jacobian = equations.jacobian(&point.linearised)?;
        let mut form = NormalForm {
            map: &mut map,
            state: exact(state),
            parameters: exact(parameters),
            returns: equations.itinerary().period(),
            units: units[..first].to_vec(),
            length: depths.chain(free).fold(1.0, f64::min),
            jacobian,
        };
        match label {
            BranchLabel::SaddleNode => form.fold(),
            BranchLabel::PeriodDoubling => form.flip(),
            BranchLabel::NeimarkSacker => {
                let multipliers = eigenvalues(&form.jacobian).ok()?;
                form.torus(multipliers.into_iter().find(|value| value.im > 0.0)?)
            }
            BranchLabel::Graze | BranchLabel::BranchPoint => None,
        }
    }

    /// Whether a contact has no depth.
    fn is_at_graze(&self, equations: &MapOrbitEquations<'_, f64>, point: &Point) -> bool {
        let depths = equations.first_depth_variable()..equations.first_parameter();
        point.unknowns[depths].iter().any(|y| y.abs() <= AT_GRAZE)
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
        let at_graze = self.is_at_graze(equations, point);
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
            residual: point.linearised.residual.iter().fold(0.0, |most, r| most.max(r.abs())),
            parameters,
        }
    }
}

impl Trace {
    /// A course from a seed on, of which the other end is known.
    fn of(course: Course<f64, PassagesOfOrbit<f64>>, begin: BranchEnd) -> Self {
        let unresolved = course.unresolved.iter().map(|(_, ends)| *ends).collect();
        let end = end_of(&course);
        Self { points: course.points, turns: course.turns, unresolved, ends: [begin, end] }
    }

    /// Two courses from one seed, the first backwards.
    fn of_both(
        back: Course<f64, PassagesOfOrbit<f64>>,
        on: Course<f64, PassagesOfOrbit<f64>>,
    ) -> Self {
        let last = back.points.len() - 1;
        let ends = [end_of(&back), end_of(&on)];
        let turned = back.turns.iter().rev().map(|turn| Turn { point: last - turn.point, ..*turn });
        // Those of the first point are among both.
        let later = on.turns.iter().filter(|turn| turn.point > 0);
        let moved = later.map(|turn| Turn { point: last + turn.point, ..*turn });
        let turns = turned.chain(moved).collect();
        let unresolved = back.unresolved.iter().map(|(_, [a, b])| [last - b, last - a]);
        let later = on.unresolved.iter().map(|(_, [a, b])| [last + a, last + b]);
        let unresolved = unresolved.chain(later).collect();
        let points = back.points.into_iter().rev().chain(on.points.into_iter().skip(1)).collect();
        Self { points, turns, unresolved, ends }
    }
}

impl Trace {
    /// The places of the points that are given out, with the test functions that vanish at each:
    /// special points that agree to rounding are one.
    fn orbits(&self) -> Vec<(usize, Vec<usize>)> {
        let mut orbits: Vec<(usize, Vec<usize>)> = Vec::with_capacity(self.points.len());
        for place in 0..self.points.len() {
            let mine = self.turns.iter().filter(|turn| turn.point == place);
            let mine: Vec<usize> = mine.map(|turn| turn.test).collect();
            match orbits.last_mut() {
                Some((before, turns))
                    if !turns.is_empty()
                        && !mine.is_empty()
                        && apart(&self.points[*before].unknowns, &self.points[place].unknowns)
                            < AT_GRAZE =>
                {
                    turns.extend(
                        mine.into_iter().filter(|test| !turns.contains(test)).collect::<Vec<_>>(),
                    );
                }
                _ => orbits.push((place, mine)),
            }
        }
        orbits
    }
}

fn end_of(course: &Course<f64, PassagesOfOrbit<f64>>) -> BranchEnd {
    let unknowns = course.points[0].unknowns.len();
    match course.end {
        CourseEnd::Border { unknown } if unknown + 1 == unknowns => BranchEnd::Range,
        CourseEnd::Border { .. } => BranchEnd::Reach,
        CourseEnd::Closed => BranchEnd::Closed,
        CourseEnd::Last => BranchEnd::Doubling,
        CourseEnd::StepTooSmall => BranchEnd::StepTooSmall,
        CourseEnd::StepLimit => BranchEnd::StepLimit,
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

/// The branch through an orbit, both ways.
fn traced(
    equations: &mut MapOrbitEquations<'_, f64>,
    start: &[f64],
    linearised: &Linearised<f64, PassagesOfOrbit<f64>>,
) -> Option<Trace> {
    let units = (0..start.len()).rev().map(|place| {
        let mut unit = vec![0.0; start.len()];
        unit[place] = 1.0;
        unit
    });
    let mut tangents = units.filter_map(|unit| tangent_at(&linearised.jacobian, &unit));
    let along = tangents.next()?;
    let against: Vec<f64> = along.iter().map(|value| -value).collect();
    let control = StepControl::default();
    let on = follow(equations, start, &along, &control)?;
    if on.end == CourseEnd::Closed {
        return Some(Trace::of(on, BranchEnd::Closed));
    }
    let back = follow(equations, start, &against, &control)?;
    Some(Trace::of_both(back, on))
}

/// Whether an orbit lies on a branch that is known, begun at any of its points.
fn is_known(
    equations: &mut MapOrbitEquations<'_, f64>,
    (unknowns, held, linearised): &Solved,
    traces: &[Trace],
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
    let mut normal = vec![0.0; unknowns.len()];
    normal[*held] = 1.0;
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

/// A special point to the rounding of double-double, where it is a zero of this test function.
fn refined(
    fine: &mut MapOrbitEquations<'_, Dd>,
    point: &Point,
    test: usize,
) -> Option<CurvePoint<Dd, PassagesOfOrbit<Dd>>> {
    let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect::<Vec<_>>();
    let (at, tangent) = (exact(&point.unknowns), exact(&point.tangent));
    let found = zero_near(fine, &at, &tangent, |point| point.tests[test].value)?;
    let rounded: Vec<f64> = found.unknowns.iter().map(|value| value.to_f64()).collect();
    (apart(&rounded, &point.unknowns) < 1e-6).then_some(found)
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
    let twice = |returns: &[PassageSet]| [returns, returns].concat();
    Some(Seed {
        itinerary: ContactItinerary::new(
            seed.itinerary.passages(),
            twice(seed.itinerary.returns()),
        ),
        states: [seed.states.clone(), seed.states].concat(),
        depth_variables: [seed.depth_variables.clone(), seed.depth_variables].concat(),
        parameter: seed.parameter,
        direction: Some(direction.iter().map(|value| value / length).collect()),
    })
}

/// The unit vector that a nearly singular matrix takes to the least length, by inverse iteration.
fn null_vector(matrix: &nalgebra::DMatrix<f64>) -> Option<Vec<f64>> {
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

impl Seed {
    /// The same orbit with a passage made a contact, of depth zero, or one made none.
    fn with(mut self, number: usize, passage: usize, contact: Option<usize>) -> Self {
        let mut returns = self.itinerary.returns().to_vec();
        match contact {
            Some(place) => {
                let made = returns[number].iter().filter(|&other| other != passage);
                returns[number] = made.collect();
                self.depth_variables.remove(place);
            }
            None => {
                let before = returns[..number].iter().map(|made| made.len()).sum::<usize>()
                    + returns[number].iter().filter(|&other| other < passage).count();
                returns[number].insert(passage);
                self.depth_variables.insert(before, 0.0);
            }
        }
        self.itinerary = ContactItinerary::new(self.itinerary.passages(), returns);
        self
    }

    /// The same orbit, of its shortest period and begun where its itinerary is the largest.
    fn in_standard_form(mut self) -> Self {
        if self.direction.is_some() {
            return self;
        }
        let period = self.itinerary.period();
        let divides = |shorter: &usize| period % shorter == 0;
        let shortest = (1..period).filter(divides).find(|&shorter| {
            let near = |a: &Vec<f64>, b: &Vec<f64>| {
                a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()))
            };
            self.itinerary.repeats_after(shorter)
                && (0..period).all(|n| near(&self.states[n], &self.states[(n + shorter) % period]))
        });
        let passages = self.itinerary.passages();
        if let Some(shorter) = shortest {
            let returns = self.itinerary.returns()[..shorter].to_vec();
            self.itinerary = ContactItinerary::new(passages, returns);
            self.depth_variables.truncate(self.itinerary.contacts());
            self.states.truncate(shorter);
        }
        let standard = self.itinerary.largest_rotation().0;
        if let Some(by) = self.itinerary.rotation_to(&standard) {
            let skipped: usize = self.itinerary.returns()[..by].iter().map(|made| made.len()).sum();
            self.states.rotate_left(by);
            self.depth_variables.rotate_left(skipped);
        }
        self.itinerary = standard;
        self
    }
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
