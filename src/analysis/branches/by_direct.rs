//! Branches of the orbits of direct simulation.
//!
//! One idea: at the graze itself every branch may begin, without the map being asked for an orbit;
//! what simulation settles on along the range gives the other seeds.

use rayon::prelude::*;

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
use super::normal_form::NormalForm;
use super::trace::{
    Trace, apart, null_vector, standard_form, toggled, twice, unit_vector, with_those_led_to,
};
use crate::analysis::continuation::{
    CourseEnd, CurveEquations, CurvePoint, corrected, searched, tangent_at, zero_near,
};
use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::orbits::{FoundOrbit, OrbitContact};
use crate::analysis::periodic::{
    ContactItinerary, DirectOrbit, DirectOrbitEquations, DirectUnits, SectionMap, window_scales,
};
use crate::analysis::progress::Progress;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::PassageSet;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// Values of the parameter at which orbits are flown, up and down.
const VALUES: usize = 16;
/// Returns flown before any are looked at.
const TRANSIENT: usize = 300;
/// Orbits are the same where all variables agree to this.
const SAME: f64 = 1e-6;
/// A variable of a passage up to this is that of a graze, in its unit.
const AT_GRAZE: f64 = 1e-8;
/// How near a multiplier is to that of a special point.
const AT_MULTIPLIER: f64 = 1e-4;
/// Orbits this near to those of half their period are where a branch doubles.
const NEAR: f64 = 1e-3;
/// Distances from the orbit that doubles at which the doubled branch begins.
const DOUBLED: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// How far from a special point its refinement in double-double may lie.
const FAR: f64 = 1e-5;
/// The same where a contact is too weak for double precision.
const FAR_AT_GRAZE: f64 = 1e-2;

type DirectTrace = Trace<DirectOrbit<f64>>;
type Point = CurvePoint<f64, DirectOrbit<f64>>;

/// An orbit from which a branch is followed.
#[derive(Clone, Debug)]
struct Seed {
    itinerary: ContactItinerary,
    states: Vec<Vec<f64>>,
    parameter: f64,
    /// The direction of a branch that doubles another, in the unknowns.
    direction: Option<Vec<f64>>,
}

struct Continuation<'a> {
    image: DirectImage<'a, f64>,
    fine: DirectImage<'a, Dd>,
    units: DirectUnits,
    depths: DepthEvaluation<f64>,
    map: &'a LocalMap,
    request: &'a BranchRequest,
    graze: Option<GrazeStart>,
}

/// Where the orbit without contact grazes: its section point and the value of the parameter that
/// varies, in offsets.
pub(in crate::analysis) type GrazeStart = (Vec<f64>, f64);

/// The branches of direct simulation.
pub(super) fn branches(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let mut others = request.at.iter().enumerate().filter(|(place, _)| *place != request.along);
    let graze = others.all(|(_, &offset)| offset == 0.0);
    let graze = graze.then(|| (vec![0.0; map.dimension()], 0.0));
    branches_from(scene, orbit, map, request, graze, progress)
}

/// The same with the graze given, at which branches may begin.
pub(in crate::analysis) fn branches_from(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    graze: Option<GrazeStart>,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let image = DirectImage::new(&system, scene, orbit)?;
    let free = [(request.along, request.range)];
    let continuation = Continuation {
        units: DirectUnits::measured(scene, orbit, image.clone(), &free, &request.at)?,
        image,
        fine: DirectImage::new(&system, scene, orbit)?,
        depths: MapEvaluation::depths(map),
        map,
        request,
        graze,
    };
    progress.expect(request.itineraries.len() as u64);
    let settled = continuation.settled();
    let first = request.itineraries.par_iter().map(|itinerary| {
        let seeds = continuation.seeds(itinerary, &settled);
        let traces = continuation.traces(itinerary, seeds, Vec::new());
        progress.advance(1);
        (itinerary.clone(), traces)
    });
    let found = with_those_led_to(
        first.collect(),
        |seed: &Seed| &seed.itinerary,
        |itinerary, trace| continuation.led_to(itinerary, trace),
        |itinerary, seeds, known| continuation.traces(itinerary, seeds, known),
    );
    let branches = found.par_iter().flat_map_iter(|(itinerary, traces)| {
        traces.iter().map(|trace| continuation.branch(itinerary, trace))
    });
    Ok(Branches { branches: branches.collect() })
}

impl<'a> Continuation<'a> {
    fn equations(&self, itinerary: &ContactItinerary) -> DirectOrbitEquations<'a, f64> {
        self.equations_of(&self.image, itinerary)
    }

    fn equations_of<S: Real>(
        &self,
        image: &DirectImage<'a, S>,
        itinerary: &ContactItinerary,
    ) -> DirectOrbitEquations<'a, S> {
        let BranchRequest { along, at, .. } = self.request;
        let range = self.request.ordered_range();
        let image = image.clone();
        DirectOrbitEquations::new(image, itinerary, &self.units, &[(*along, range)], at)
    }

    /// The periodic orbits that simulation settles on along the range, up and down, every flight
    /// begun where the last one ended.
    fn settled(&self) -> Vec<Seed> {
        let [from, to] = self.request.range;
        let value = |number: usize| from + (to - from) * (number as f64 + 0.5) / VALUES as f64;
        let up: Vec<f64> = (0..VALUES).map(value).collect();
        let down: Vec<f64> = up.iter().rev().copied().collect();
        let seeds = [up, down].into_par_iter().flat_map_iter(|values| {
            let mut image = self.image.clone();
            let mut state = vec![0.0; image.dimension()];
            let mut seeds = Vec::new();
            for value in values {
                match self.settles(&mut image, &mut state, value) {
                    Some(seed) => seeds.push(seed),
                    None if state.iter().all(|value| value.is_finite()) => {}
                    None => state.fill(0.0),
                }
            }
            seeds
        });
        seeds.collect()
    }

    /// The periodic orbit that is settled on from a state, which moves on.
    fn settles(
        &self,
        image: &mut DirectImage<'a, f64>,
        state: &mut Vec<f64>,
        value: f64,
    ) -> Option<Seed> {
        let parameters = self.request.parameters(value);
        let longest = self.request.longest;
        let (mut states, mut returns) = (Vec::new(), Vec::new());
        for number in 0..TRANSIENT + 2 * longest {
            let step = SectionMap::image(image, state, &parameters);
            let Some(step) = step else {
                state.fill(f64::NAN);
                return None;
            };
            if number >= TRANSIENT {
                states.push(state.clone());
                returns.push((step.contacts, step.extra_contacts));
            }
            *state = step.offsets;
        }
        let near = |a: &[f64], b: &[f64]| {
            let mut pairs = a.iter().zip(b).zip(&self.units.state);
            pairs.all(|((a, b), unit)| (a - b).abs() <= SAME * unit)
        };
        let period = (1..=longest).find(|&period| {
            let mut pairs = (0..longest).map(|n| (&states[n], &states[n + period]));
            pairs.all(|(a, b)| near(a, b))
        })?;
        let made: Vec<PassageSet> = returns[..period].iter().map(|(made, _)| *made).collect();
        let itinerary = ContactItinerary::new(self.map.passages(), made);
        let states = states[..period].to_vec();
        let seed = Seed { itinerary, states, parameter: value, direction: None };
        Some(seed.in_standard_form())
    }

    /// Where branches of an itinerary begin: at the graze, and at what was settled on.
    fn seeds(&self, itinerary: &ContactItinerary, settled: &[Seed]) -> Vec<Seed> {
        let mine = settled.iter().filter(|seed| seed.itinerary == *itinerary).cloned();
        let graze = self.graze.as_ref().map(|(state, parameter)| Seed {
            itinerary: itinerary.clone(),
            states: vec![state.clone(); itinerary.period()],
            parameter: *parameter,
            direction: None,
        });
        graze.into_iter().chain(mine).collect()
    }

    /// The branches of an itinerary through these seeds, beside those known.
    fn traces(
        &self,
        itinerary: &ContactItinerary,
        seeds: Vec<Seed>,
        mut traces: Vec<DirectTrace>,
    ) -> Vec<DirectTrace> {
        let mut equations = self.equations(itinerary);
        for seed in seeds {
            traces.extend(self.trace(&mut equations, &seed, &traces));
        }
        traces
    }

    /// The branch through a seed, if it is another and not a point alone.
    fn trace(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        seed: &Seed,
        known: &[DirectTrace],
    ) -> Option<DirectTrace> {
        let guess = equations.unknowns(&seed.states, &self.request.parameters(seed.parameter))?;
        let start = match &seed.direction {
            Some(direction) => DOUBLED.iter().find_map(|distance| {
                let pairs = guess.iter().zip(direction);
                let start: Vec<f64> = pairs.map(|(u, d)| u + distance * d).collect();
                let (unknowns, there) = corrected(equations, &start, &start, direction)?;
                let same = equations.is_repeated(&there.extra, 0.1 * distance);
                (!same).then_some(unknowns)
            })?,
            None => {
                let (unknowns, there) = match equations.linearised(&guess) {
                    Some(there) if there.residual.amax() <= 1e-11 => (guess, there),
                    _ => searched(equations, &guess, guess.len() - 1)?,
                };
                let is_new = !equations.is_repeated(&there.extra, SAME);
                is_new.then_some(unknowns)?
            }
        };
        let in_range = start.iter().enumerate().all(|(unknown, value)| {
            let [lower, upper] = equations.range(unknown);
            lower - AT_GRAZE <= *value && *value <= upper + AT_GRAZE
        });
        if !in_range || self.is_known(equations, &start, known) {
            return None;
        }
        let trace = Trace::through(equations, &start)?;
        // One without orbits beside the graze is not physical on any side of it.
        let beside = |point: &Point| apart(&point.unknowns, &start) > SAME;
        trace.points.iter().any(beside).then_some(trace)
    }

    /// Whether an orbit lies on a branch that is known, begun at any of its points.
    fn is_known(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        unknowns: &[f64],
        traces: &[DirectTrace],
    ) -> bool {
        let (last, size) = (unknowns.len() - 1, self.units.state.len());
        let itinerary = equations.itinerary().clone();
        let later = (0..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        let rotated = later.map(|later| {
            let mut variables = unknowns[..last].to_vec();
            variables.rotate_left(later * size);
            variables
        });
        let starts: Vec<Vec<f64>> = rotated.collect();
        let near = |at: &[f64], within: f64| {
            starts.iter().any(|start| apart(&at[..last], start) <= within)
        };
        let normal = unit_vector(unknowns.len(), last);
        let mut pairs = traces.iter().flat_map(|trace| trace.points.windows(2));
        pairs.any(|pair| {
            let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
            let length = apart(a, b);
            if near(a, SAME) || near(b, SAME) {
                return true;
            }
            let between = (a[last] - unknowns[last]) * (b[last] - unknowns[last]) <= 0.0;
            if !between || !near(a, 3.0 * length) {
                return false;
            }
            let run = b[last] - a[last];
            let share = if run == 0.0 { 0.0 } else { (unknowns[last] - a[last]) / run };
            let guess: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect();
            let there = corrected(equations, &guess, &guess, &normal);
            there.is_some_and(|(there, _)| near(&there, SAME))
        })
    }

    /// The passages without speed or gap where a branch ends.
    fn grazing(&self, equations: &DirectOrbitEquations<'a, f64>, point: &Point) -> Vec<usize> {
        let unknowns = point.unknowns.iter().enumerate();
        let touching = unknowns.filter(|(_, value)| value.abs() <= AT_GRAZE);
        touching.filter_map(|(unknown, _)| equations.passage_of(unknown)).collect()
    }

    /// The branches that a branch leads to: with a contact more or less where it ends at a graze,
    /// of the doubled period where it flips.
    fn led_to(&self, itinerary: &ContactItinerary, trace: &DirectTrace) -> Vec<Seed> {
        let equations = self.equations(itinerary);
        let seed = |point: &Point| Seed {
            itinerary: itinerary.clone(),
            states: point.linearised.extra.states.clone(),
            parameter: equations.parameters(&point.unknowns)[self.request.along],
            direction: None,
        };
        let mut seeds = Vec::new();
        for (end, point) in trace.ends.iter().zip([trace.points.first(), trace.points.last()]) {
            if let (CourseEnd::Border { .. }, Some(point)) = (end, point)
                && let [number] = self.grazing(&equations, point)[..]
            {
                let mut seed = seed(point);
                seed.itinerary = toggled(itinerary, number, 0);
                seeds.push(seed.in_standard_form());
            }
        }
        if 2 * itinerary.period() > self.request.longest {
            return seeds;
        }
        for turn in trace.turns.iter().filter(|turn| turn.test == 1) {
            let point = &trace.points[turn.point];
            let matrix = equations.doubling(&point.linearised, &point.linearised.extra);
            let Some(vector) = null_vector(&matrix) else { continue };
            let seed = seed(point);
            let against = vector.iter().map(|value| -value);
            let direction: Vec<f64> = vector.iter().copied().chain(against).chain([0.0]).collect();
            let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
            seeds.push(Seed {
                itinerary: twice(itinerary),
                states: [seed.states.clone(), seed.states].concat(),
                direction: Some(direction.iter().map(|value| value / length).collect()),
                ..seed
            });
        }
        seeds
    }

    /// A branch as it is given out.
    fn branch(&self, itinerary: &ContactItinerary, trace: &DirectTrace) -> Branch {
        let equations = self.equations(itinerary);
        let points = trace.orbits().into_iter().map(|(place, turns)| {
            let point = &trace.points[place];
            let grazing = match place == 0 || place + 1 == trace.points.len() {
                true => self.grazing(&equations, point),
                false => Vec::new(),
            };
            let mut orbit = self.found(&equations, point, !grazing.is_empty());
            if !grazing.is_empty() {
                let exact = self.refined_graze(itinerary, point);
                orbit.parameters = exact.unwrap_or(orbit.parameters);
            }
            let special = self.special(&equations, point, &turns, grazing);
            let labelled = special.as_ref().is_some_and(|s| s.label != BranchLabel::Graze);
            if let (Some(&test), true) = (turns.first(), labelled) {
                let exact = match equations.is_repeated(&point.linearised.extra, NEAR) {
                    true => self.refined_doubling(itinerary, point),
                    false => self.refined(itinerary, point, test),
                };
                orbit.parameters = exact.unwrap_or(orbit.parameters);
            }
            BranchPoint { orbit, special }
        });
        let points = points.collect();
        let value =
            |place: usize| equations.parameters(&trace.points[place].unknowns)[self.request.along];
        let unresolved = trace.unresolved.iter().map(|ends| ends.map(value)).collect();
        let last = trace.points[0].unknowns.len() - 1;
        let ends = trace.ends(|unknown| match equations.passage_of(unknown) {
            _ if unknown == last => BranchEnd::Range,
            Some(_) => BranchEnd::Graze,
            None => BranchEnd::Reach,
        });
        Branch { itinerary: itinerary.clone(), points, ends, unresolved }
    }

    /// What is special about a point at which these test functions vanish.
    fn special(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &Point,
        turns: &[usize],
        grazing: Vec<usize>,
    ) -> Option<Special> {
        let orbit = &point.linearised.extra;
        if !grazing.is_empty() {
            let grazing = grazing.into_iter().map(|number| [number, 0]).collect();
            return Some(Special { label: BranchLabel::Graze, grazing, coefficient: None });
        }
        if turns.is_empty() {
            return None;
        }
        let multipliers =
            equations.jacobian(orbit).and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        let near = |value: f64| {
            multipliers.iter().any(|multiplier| (multiplier - value).norm() < AT_MULTIPLIER)
        };
        let circle = multipliers
            .iter()
            .any(|value| value.im != 0.0 && (value.norm() - 1.0).abs() < AT_MULTIPLIER);
        let doubles = equations.is_repeated(orbit, NEAR);
        let label = doubles.then_some(BranchLabel::BranchPoint);
        let label = label.or_else(|| {
            turns.iter().find_map(|&test| match test {
                0 if near(1.0) => Some(BranchLabel::SaddleNode),
                1 if near(-1.0) => Some(BranchLabel::PeriodDoubling),
                2 if near(1.0) && !turns.contains(&0) => Some(BranchLabel::BranchPoint),
                4 if circle => Some(BranchLabel::NeimarkSacker),
                _ => None,
            })
        })?;
        let coefficient = self.coefficient(equations, point, label);
        Some(Special { label, grazing: Vec::new(), coefficient })
    }

    /// The coefficient of the normal form.
    fn coefficient(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &Point,
        label: BranchLabel,
    ) -> Option<f64> {
        let orbit = &point.linearised.extra;
        let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect();
        let own = point.unknowns.iter().enumerate();
        let own = own.filter(|(unknown, _)| equations.passage_of(*unknown).is_some());
        let mut image = self.fine.clone();
        let mut form = NormalForm {
            map: &mut image,
            state: exact(&orbit.states[0]),
            parameters: exact(&equations.parameters(&point.unknowns)),
            returns: equations.itinerary().period(),
            units: window_scales(&self.map.window)[..self.units.state.len()].to_vec(),
            length: own.fold(1.0, |least, (_, value)| least.min(value * value)),
            jacobian: equations.jacobian(orbit)?,
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
        let mut fine = self.equations_of(&self.fine, itinerary);
        let exact =
            |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect::<Vec<_>>();
        let (at, tangent) = (exact(&point.unknowns), exact(&point.tangent));
        let found = zero_near(&mut fine, &at, &tangent, |point| point.tests[test].value)?;
        let rounded: Vec<f64> = found.unknowns.iter().map(|value| value.to_f64()).collect();
        let parameters = fine.parameters(&found.unknowns);
        let parameters = parameters.iter().map(|value| value.to_f64()).collect();
        (apart(&rounded, &point.unknowns) < FAR).then_some(parameters)
    }

    /// The parameters of an orbit that grazes, its passages without speed or gap held there, to the
    /// rounding of double-double.
    fn refined_graze(&self, itinerary: &ContactItinerary, point: &Point) -> Option<Vec<f64>> {
        let mut fine = self.equations_of(&self.fine, itinerary);
        let own = |unknown: usize| fine.passage_of(unknown).is_some();
        let at = point.unknowns.iter().enumerate().map(|(unknown, &value)| {
            let grazes = own(unknown) && value.abs() <= AT_GRAZE;
            if grazes { Dd::ZERO } else { Dd::from(value) }
        });
        let at: Vec<Dd> = at.collect();
        let held = (0..at.len()).find(|&unknown| own(unknown) && at[unknown] == Dd::ZERO)?;
        let normal: Vec<Dd> = unit_vector(at.len(), held).into_iter().map(Dd::from).collect();
        let (found, _) = corrected(&mut fine, &at, &at, &normal)?;
        let rounded: Vec<f64> = found.iter().map(|value| value.to_f64()).collect();
        let parameters = fine.parameters(&found);
        let parameters = parameters.iter().map(|value| value.to_f64()).collect();
        (apart(&rounded, &point.unknowns) < FAR_AT_GRAZE).then_some(parameters)
    }

    /// The same of a branch point at which orbits have half their period: there those double.
    fn refined_doubling(&self, itinerary: &ContactItinerary, point: &Point) -> Option<Vec<f64>> {
        let half = itinerary.period() / 2;
        let returns = itinerary.returns()[..half].to_vec();
        let half = ContactItinerary::new(itinerary.passages(), returns);
        let mut equations = self.equations(&half);
        let variables = half.period() * self.units.state.len();
        let mut unknowns = point.unknowns[..variables].to_vec();
        unknowns.push(*point.unknowns.last()?);
        let along = unit_vector(unknowns.len(), variables);
        let (unknowns, linearised) = corrected(&mut equations, &unknowns, &unknowns, &along)?;
        let tangent = tangent_at(&linearised.jacobian, &along)?;
        let point = Point { unknowns, tangent, linearised, tests: Vec::new() };
        self.refined(&half, &point, 1)
    }

    /// The orbit at a point.
    fn found(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &Point,
        at_graze: bool,
    ) -> FoundOrbit {
        let orbit = &point.linearised.extra;
        let jacobian = equations.jacobian(orbit).filter(|_| !at_graze);
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers: Vec<[f64; 2]> =
            multipliers.iter().flatten().map(|value| [value.re, value.im]).collect();
        let parameters = equations.parameters(&point.unknowns);
        let window = &self.map.window;
        let inside = orbit
            .states
            .iter()
            .all(|state| window.holds(state, &parameters, &self.depths.at(state, &parameters)));
        let contact = |&(number, passage, speed): &(usize, usize, f64)| OrbitContact {
            number,
            passage,
            speed,
        };
        FoundOrbit {
            itinerary: equations.itinerary().clone(),
            states: orbit.states.clone(),
            stable: !multipliers.is_empty()
                && multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0),
            multipliers,
            contacts: orbit.speeds.iter().map(contact).collect(),
            physical: orbit.extra_contacts == 0,
            inside,
            extra_contacts: orbit.extra_contacts,
            residual: point.linearised.residual.amax(),
            parameters,
        }
    }
}

impl Seed {
    /// The same orbit, of its shortest period and begun where its itinerary is the largest.
    fn in_standard_form(mut self) -> Self {
        let (standard, period, by) = standard_form(&self.itinerary, &self.states);
        self.states.truncate(period);
        self.states.rotate_left(by);
        self.itinerary = standard;
        self
    }
}
