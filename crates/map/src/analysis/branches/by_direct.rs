//! Branches of the orbits of direct simulation.
//!
//! One idea: if all contacts are those of the section's own passage, a branch may begin at the
//! graze itself, without an orbit of the map. If a later passage makes contact, the graze is no
//! border of the unknowns, and branches begin at orbits of the map. The other seeds are orbits that
//! simulation settles on along the range.

mod grazes;
mod motions;

use std::collections::{BTreeSet, VecDeque};
use std::iter::once;

use nalgebra::{Complex, DVector};
use serde::{Deserialize, Serialize};

use self::grazes::slow_contact;
use super::by_map::MapBranches;
use super::data::{
    AttractorBranch, Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special,
};
use super::normal_form::NormalForm;
use super::trace::{
    BranchPiece, BranchSeed, BranchSource, Extent, Follow, GrazeStart, NEAR, SAME, SearchedBranch,
    SeedKind, TracedBranch, each_once, first_doubled, halved, has_shorter_period, label_of,
    lies_on, null_vector, refined, solved, toggled,
};
use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::periodic::{
    ContactItinerary, DirectOrbit, DirectOrbitEquations, DirectUnits, FoundOrbit, OrbitContact,
    SectionMap, SectionPoints, TestKind, finite_or_one, window_scales,
};
use crate::analysis::progress::{NoProgress, PartProgress, Progress, resumed_if};
use crate::analysis::work::Unfinished;
use crate::continuation::{
    ContinuationEnd, ContinuationPoint, CurveEquations, Linearised, StepControl, TestValue, apart,
    between, corrected, tangent_at, unit_vector,
};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{PassageSet, Period, parallel};
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, converted};
use crate::orbit::GrazingOrbit;

/// Number of parameter values at which orbits are simulated, up and down.
const VALUES: usize = 16;
/// Number of scattered start states at each value, in addition to carried ones.
const SCATTERED: usize = 2;
/// Largest offset at which orbits are simulated, relative to the parameter's grazing value, or to
/// the least offset of a range beyond that.
const FARTHEST: f64 = 4.0;
/// Most returns before section points are recorded.
const TRANSIENT: usize = 300;
/// Returns between tests for settling, and the distance in units within which settled section
/// points repeat.
const SETTLING: usize = 16;
const SETTLED: f64 = 1e-10;
/// Most flights in succession until an orbit settles, and the distance in units within which the
/// section points of an attractor repeat.
const FLIGHTS: usize = 4;
const ATTRACTED: f64 = 1e-6;
/// Fewest returns recorded.
const KEPT: usize = 40;
/// Distance, in units, within which section points nearly repeat.
const NEARLY_REPEATED: f64 = 0.3;
/// Largest variable of a passage, in its unit, that counts as a graze: contacts next to a graze are
/// not resolved, and the polynomial that replaces them errs by as much if the unit is large.
const AT_GRAZE: f64 = 1e-6;
/// Positions of seeds among the map's orbits in its window, as shares of a branch.
const SEEDED_AT: [f64; 3] = [0.25, 0.5, 0.75];
/// Largest distance of a multiplier from its critical value, where a special point was found and
/// where it is refined.
const AT_MULTIPLIER: [f64; 2] = [1e-4; 2];
const REFINED_MULTIPLIER: [f64; 2] = [1e-6; 2];
/// First step of the parameter towards a Hopf point, in units, and most steps.
const HOPF_STEP: f64 = 1e-4;
const HOPF_STEPS: usize = 30;
/// Largest growth rate of a pair of eigenvalues at a Hopf point, relative to its frequency.
const AT_HOPF: f64 = 1e-9;
/// Largest distance of a Hopf point from the end of its branch, in units.
const NEAR_HOPF: f64 = 1e-2;
/// Most work for a flight, in products of series.
const FLIGHT_WORK: u64 = 1_000_000;

/// Step control along a branch: where an orbit loses a section point, derivatives fail before
/// images do.
const STEPS: StepControl = StepControl { unresolved: 8, ..StepControl::DEFAULT };

/// Kinds of section points in the order in which they are tried.
const ALL_POINTS: [SectionPoints; 3] =
    [SectionPoints::Every, SectionPoints::AtContacts, SectionPoints::Plain];

type DirectTrace = TracedBranch<DirectOrbit<f64>>;
type DirectPoint = ContinuationPoint<f64, DirectOrbit<f64>>;

/// Consecutive section points at one value of the parameter.
#[derive(Serialize, Deserialize)]
struct RecordedFlight {
    parameter: f64,
    states: Vec<Vec<f64>>,
    /// Passages that make contact, for each return.
    returns: Vec<PassageSet>,
}

impl RecordedFlight {
    /// Whether a kept flight has one state more than returns, each of so many coordinates, and no
    /// passage beyond the map's.
    fn fits(&self, dimension: usize, passages: usize) -> bool {
        let Self { states, returns, .. } = self;
        let is_known = |made: &PassageSet| made.iter().all(|passage| passage < passages);
        states.len() == if returns.is_empty() { 0 } else { returns.len() + 1 }
            && states.iter().all(|state| state.len() == dimension)
            && returns.iter().all(is_known)
    }
}

/// Part of a range of offsets in which flights are made, for a parameter of a size at the graze.
fn flown_range(range: [f64; 2], size: f64) -> [f64; 2] {
    let [lower, upper] = [range[0].min(range[1]), range[0].max(range[1])];
    let farthest = FARTHEST * size.max(lower).max(-upper);
    if farthest > 0.0 { range.map(|end| end.clamp(-farthest, farthest)) } else { range }
}

/// Data from which seeds are taken.
pub(super) struct DirectSeedData {
    flights: Vec<RecordedFlight>,
    /// Grazes of the orbit without contact.
    grazing: Vec<GrazeStart>,
    /// Orbits of the map with contact at a passage after the section's own.
    by_map: Vec<FoundOrbit>,
}

/// Branches of direct simulation.
pub(super) struct DirectBranches<'a> {
    image: DirectImage<'a, f64>,
    fine: DirectImage<'a, Dd>,
    units: DirectUnits,
    /// Magnitude of the varied parameter at the graze.
    size: f64,
    depths: DepthEvaluation<f64>,
    /// Indices of the surfaces that graze, in the model's order.
    surfaces: BTreeSet<usize>,
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    request: &'a BranchRequest,
    extent: Extent,
    progress: &'a dyn Progress,
    unfinished: Unfinished,
}

impl<'a> DirectBranches<'a> {
    /// Branches of a request within an extent.
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &'a LocalMap,
        (request, extent): (&'a BranchRequest, Extent),
        progress: &'a dyn Progress,
    ) -> Result<Self, AnalysisError> {
        let image = DirectImage::new(system, scene, orbit)?;
        let free = [(request.along, request.range)];
        Ok(Self {
            units: DirectUnits::measured(scene, orbit, image.clone(), &free, &request.at)?,
            image,
            fine: DirectImage::new(system, scene, orbit)?,
            size: orbit.parameters()[scene.expansion.active[request.along]].to_f64().abs(),
            depths: MapEvaluation::depths(map),
            surfaces: orbit.passages.iter().map(|graze| graze.surface).collect(),
            scene,
            orbit,
            map,
            request,
            extent,
            progress,
            unfinished: Unfinished::default(),
        })
    }

    /// Branches in their final form, and the itineraries that were not followed completely.
    pub(super) fn given_out(&self) -> Branches {
        let mut found = self.all(self.extent.follow);
        self.one_of_each_motion(&mut found);
        let mut branches = self.described(&found);
        self.end_at_grazes(&mut branches);
        let cut = branches.iter().filter(|branch| branch.ends.contains(&BranchEnd::WorkLimit));
        self.unfinished.extend(cut.map(|branch| &branch.itinerary));
        Branches { branches, unfinished: self.unfinished.listed() }
    }

    /// Orbits of the itineraries asked for at a value of the varied parameter, taken from branches
    /// that pass it; and the itineraries that were not followed completely.
    pub(super) fn orbits(&self, value: f64) -> (Vec<FoundOrbit>, Vec<ContactItinerary>) {
        let found = self.all(self.extent.follow);
        let is_cut = |trace: &DirectTrace| trace.ends.contains(&ContinuationEnd::WorkLimit);
        let cut = found.iter().filter(|(_, traces)| traces.iter().any(is_cut));
        self.unfinished.extend(cut.map(|(itinerary, _)| itinerary));
        let asked = found.iter().filter(|(known, _)| self.request.itineraries.contains(known));
        let orbits = parallel::map(asked, |(itinerary, traces)| {
            let orbits = traces.iter().flat_map(|trace| self.passing(itinerary, trace, value));
            orbits.collect::<Vec<_>>()
        });
        (orbits.concat(), self.unfinished.listed())
    }

    /// Branch through the orbit on which a flight from a section point settles.
    pub(super) fn through_attractor(&self, start: &[f64]) -> Option<AttractorBranch> {
        let value = self.request.at[self.request.along];
        let (mut image, mut state) = (self.image.clone(), start.to_vec());
        PartProgress::announce(self.progress, 3);
        let flights = PartProgress::new(self.progress, 1);
        flights.expect(FLIGHTS as u64);
        let settled = (0..FLIGHTS).find_map(|_| {
            let flight = self.fly(&mut image, &state, value);
            flights.advance(1);
            state.clone_from(flight.states.last()?);
            Some((self.settled_itinerary(&flight)?, flight))
        });
        let (itinerary, flight) = settled?;
        drop(flights);
        let seed = self.nearest_period(&flight, &itinerary)?;
        let traced = PartProgress::new(self.progress, 1);
        let most = self.extent.most_work;
        traced.expect(most);
        let trace = self.reported_trace(&itinerary, &seed, &[], most, &traced).trace?;
        drop(traced);
        let described = PartProgress::new(self.progress, 1);
        let branch = self.reported_branch(&itinerary, &trace, &described);
        let distance = |point: &BranchPoint| {
            let FoundOrbit { parameters, states, .. } = &point.orbit;
            let away = (parameters[self.request.along] - value).abs() / self.units.parameters[0];
            away + self.image.circle().apart(&states[0], &seed.states[0], &self.units.state)
        };
        let places = branch.points.iter().map(distance).enumerate();
        let (place, _) = places.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(AttractorBranch { branch, place })
    }

    /// Itinerary of a flight that repeats, in standard form. A flight that still turns about the
    /// point that it approaches has the period of that point.
    fn settled_itinerary(&self, flight: &RecordedFlight) -> Option<ContactItinerary> {
        let (circle, units) = (self.image.circle(), &self.units.state);
        let states = flight.states.concat();
        let found = Period::of(&states, units, circle, ATTRACTED);
        let Period::Periodic(period) = found else { return None };
        if period > self.request.longest {
            return None;
        }
        let returns = flight.returns[..period].to_vec();
        Some(ContactItinerary::new(self.map.passages(), returns).largest_rotation().0)
    }

    fn equations(&self, itinerary: &ContactItinerary) -> DirectOrbitEquations<'a, f64> {
        self.equations_of(&self.image, itinerary)
    }

    /// Equations in the section points that an orbit has.
    fn equations_with(
        &self,
        itinerary: &ContactItinerary,
        orbit: &DirectOrbit<f64>,
    ) -> DirectOrbitEquations<'a, f64> {
        in_points_of(self.equations(itinerary), orbit)
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

    /// Flights of direct simulation along the range: up and down, each started at the end of the
    /// last one, and from scattered states and the start states of the request.
    fn flights(&self) -> Vec<RecordedFlight> {
        let [from, to] = flown_range(self.request.range, self.size);
        let value = |number: usize| from + (to - from) * (number as f64 + 0.5) / VALUES as f64;
        let up: Vec<f64> = (0..VALUES).map(value).collect();
        let down: Vec<f64> = up.iter().rev().copied().collect();
        let piece = |number: usize| [BranchPiece::Flights as u64, number as u64];
        let fits = |flights: &Vec<RecordedFlight>| {
            flights.iter().all(|flight| flight.fits(self.image.dimension(), self.map.passages()))
        };
        self.progress.expect(VALUES as u64 + 2);
        let scattered_at = |number: usize, value: f64| {
            let mut image = self.image.clone();
            let scattered = (0..SCATTERED).map(|more| {
                let units = self.units.state.iter().enumerate();
                let start =
                    units.map(|(place, unit)| unit * scattered(SCATTERED * number + more, place));
                start.collect::<Vec<_>>()
            });
            let starts = scattered.chain(self.request.starts.iter().cloned());
            starts.map(|start| self.fly(&mut image, &start, value)).collect::<Vec<_>>()
        };
        let about = parallel::map(up.iter().enumerate(), |(number, &value)| {
            let compute = || scattered_at(number, value);
            let found = resumed_if(self.progress, &piece(number), fits, compute);
            self.progress.advance(1);
            found
        });
        let carried = |values: &[f64]| {
            let mut image = self.image.clone();
            let mut state = vec![0.0; image.dimension()];
            let mut flights = Vec::new();
            for &value in values {
                let flight = self.fly(&mut image, &state, value);
                state = match flight.states.last() {
                    Some(last) => last.clone(),
                    None => vec![0.0; state.len()],
                };
                flights.push(flight);
            }
            flights
        };
        let flights = parallel::map([&up, &down].into_iter().enumerate(), |(way, values)| {
            let piece = piece(VALUES + way);
            let found = resumed_if(self.progress, &piece, fits, || carried(values));
            self.progress.advance(1);
            found
        });
        flights.into_iter().chain(about).flatten().collect()
    }

    /// Returns from a state after a transient, as many as there are.
    fn fly(
        &self,
        image: &mut DirectImage<'a, f64>,
        start: &[f64],
        parameter: f64,
    ) -> RecordedFlight {
        let parameters = self.request.parameters(parameter);
        let kept = KEPT.max(2 * self.request.longest);
        let mut state = start.to_vec();
        let mut flight = RecordedFlight { parameter, states: Vec::new(), returns: Vec::new() };
        // The latest section points, enough to detect the longest period.
        let mut latest: VecDeque<Vec<f64>> = VecDeque::new();
        let (mut dropped, mut left) = (TRANSIENT, FLIGHT_WORK);
        for number in 0.. {
            if number == dropped + kept || left == 0 {
                break;
            }
            let Some(step) = SectionMap::image(image, &state, &parameters) else {
                break;
            };
            left = left.saturating_sub(image.work());
            // Half of the work is reserved for recorded returns.
            if number < dropped && 2 * left < FLIGHT_WORK {
                dropped = number + 1;
            }
            let mut next = step.offsets;
            image.circle().reduce(&mut next);
            if number >= dropped {
                flight.states.push(state);
                flight.returns.push(step.contacts);
            } else {
                if latest.len() > self.request.longest {
                    latest.pop_back();
                }
                if number % SETTLING == 0 && self.repeats(&next, &latest) {
                    dropped = number + 1;
                }
                latest.push_front(next.clone());
            }
            state = next;
        }
        if !flight.states.is_empty() {
            flight.states.push(state);
        }
        flight
    }

    /// Whether a section point equals one of the latest.
    fn repeats(&self, state: &[f64], latest: &VecDeque<Vec<f64>>) -> bool {
        let (circle, units) = (self.image.circle(), &self.units.state);
        latest.iter().any(|other| circle.apart(state, other, units) <= SETTLED)
    }

    /// Seed at the recorded returns that are nearest to a period of an itinerary.
    fn nearest_period(
        &self,
        flight: &RecordedFlight,
        itinerary: &ContactItinerary,
    ) -> Option<BranchSeed> {
        let (period, asked) = (itinerary.period(), itinerary.returns());
        let made = |start: &usize| flight.returns[*start..*start + period] == *asked;
        let apart = |start: usize| {
            let [a, b] = [start, start + period].map(|number| &flight.states[number]);
            self.image.circle().apart(a, b, &self.units.state)
        };
        let last = (flight.returns.len() + 1).checked_sub(period)?;
        let nearest = (0..last).filter(made).min_by(|&a, &b| apart(a).total_cmp(&apart(b)))?;
        let states = &flight.states[nearest..nearest + period];
        (apart(nearest) <= NEARLY_REPEATED)
            .then(|| BranchSeed::new(itinerary, states.to_vec(), Vec::new(), flight.parameter))
    }

    /// Grazes of the orbit without contact. The orbit is followed from the parameters of the graze
    /// or from where simulation settles on it.
    fn grazing_orbits(&self, flights: &[RecordedFlight]) -> Vec<GrazeStart> {
        let origin = vec![0.0; self.image.dimension()];
        let mut others = self.request.at.iter().enumerate();
        if others.all(|(place, &offset)| place == self.request.along || offset == 0.0) {
            return vec![(origin, 0.0)];
        }
        let none = ContactItinerary::new(self.map.passages(), vec![PassageSet::default()]);
        let at_graze = BranchSeed::new(&none, vec![origin], Vec::new(), 0.0);
        let free = flights.iter().filter_map(|flight| self.nearest_period(flight, &none));
        let seeds = once(at_graze).chain(free).collect();
        let equations = self.equations(&none);
        let traces = self.traces(&none, seeds, (Vec::new(), &mut self.most_work()));
        let ends = traces.iter().flat_map(|trace| [trace.points.first(), trace.points.last()]);
        let grazing = ends.flatten().filter(|point| !self.grazing(&equations, point).is_empty());
        let grazing = grazing.map(|point| {
            let parameters = equations.parameters(&point.unknowns);
            (point.linearised.extra.states[0].clone(), parameters[self.request.along])
        });
        grazing.collect()
    }

    /// Some orbits of each branch of the map inside its window, for itineraries with contact at a
    /// passage after the section's own.
    fn orbits_of_map(&self) -> Vec<FoundOrbit> {
        let later = |itinerary: &&ContactItinerary| {
            itinerary.returns().iter().any(|made| made.iter().any(|passage| passage > 0))
        };
        let itineraries = self.request.itineraries.iter().filter(later).cloned();
        let itineraries: Vec<ContactItinerary> = itineraries.collect();
        let width = finite_or_one(self.map.window.parameter[self.request.along]);
        let range = self.request.range.map(|end| end.clamp(-width, width));
        if itineraries.is_empty() || range[0] == range[1] {
            return Vec::new();
        }
        let request = BranchRequest { itineraries, range, direct: false, ..self.request.clone() };
        let map = MapBranches::new(self.scene, self.orbit, self.map, &request, &NoProgress);
        let found = map.map(|map| map.physical(Follow::Asked)).unwrap_or_default();
        let orbits = found.branches.iter().flat_map(|branch| {
            let is_seed = |point: &&BranchPoint| {
                point.orbit.physical && point.orbit.inside && point.special.is_none()
            };
            let points: Vec<&BranchPoint> = branch.points.iter().filter(is_seed).collect();
            let count = points.len();
            let places = SEEDED_AT.map(|share| (share * count as f64) as usize);
            places.into_iter().filter_map(move |place| Some(points.get(place)?.orbit.clone()))
        });
        orbits.collect()
    }

    /// Section points in which the branch of a seed may be followed, in the order in which they are
    /// tried: an orbit may lack a section point, or the gap of a passage.
    fn choices(seed: &BranchSeed) -> &'static [SectionPoints] {
        match seed.points {
            SectionPoints::Every => &ALL_POINTS,
            SectionPoints::AtContacts => &[SectionPoints::AtContacts],
            SectionPoints::Plain => &[SectionPoints::Plain],
        }
    }

    /// Equations in section points, and the unknowns of a seed; `None` if it lacks one.
    fn equations_at(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        points: SectionPoints,
    ) -> Option<(DirectOrbitEquations<'a, f64>, Vec<f64>)> {
        let mut equations = self.equations(itinerary).in_points(points)?;
        let guess = equations.unknowns(&seed.states, &self.request.parameters(seed.parameter))?;
        Some((equations, guess))
    }

    /// Whether an orbit lies on a known branch, from any of its starting points. Branches in the
    /// section points that `counts` accepts are looked at.
    fn is_known(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        (unknowns, orbit): (&[f64], &DirectOrbit<f64>),
        traces: &[DirectTrace],
        counts: impl Fn(SectionPoints) -> bool,
    ) -> bool {
        let itinerary = equations.itinerary().clone();
        ALL_POINTS.into_iter().any(|points| {
            let same = points == orbit.points;
            let in_points =
                |trace: &&DirectTrace| trace.points[0].linearised.extra.points == points;
            let mut others = traces.iter().filter(in_points).peekable();
            if !counts(points) || others.peek().is_none() {
                return false;
            }
            if same {
                let lines = others.map(|trace| {
                    trace.points.iter().map(|point| point.unknowns.clone()).collect::<Vec<_>>()
                });
                return lies_on_one(equations, unknowns, &lines.collect::<Vec<_>>());
            }
            // Both are compared in the points of the one that comes later among all.
            let shared = ALL_POINTS.into_iter().rfind(|own| [points, orbit.points].contains(own));
            let shared = shared.and_then(|own| self.equations(&itinerary).in_points(own));
            let Some(mut shared) = shared else { return false };
            let Some(start) = self.in_unknowns_of(&mut shared, unknowns, orbit) else {
                return false;
            };
            let lines = others.map(|trace| {
                let points = trace.points.iter();
                let points = points.filter_map(|DirectPoint { unknowns, linearised, .. }| {
                    self.in_unknowns_of(&mut shared, unknowns, &linearised.extra)
                });
                points.collect::<Vec<_>>()
            });
            let lines: Vec<_> = lines.collect();
            lies_on_one(&mut shared, &start, &lines)
        })
    }

    /// Unknowns of an orbit in the section points of equations that have fewer of them, or that
    /// leave out the variables of passages; `None` if the orbit lacks one.
    fn in_unknowns_of(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        unknowns: &[f64],
        orbit: &DirectOrbit<f64>,
    ) -> Option<Vec<f64>> {
        if equations.points() != SectionPoints::Plain {
            let all = unknowns.len() == equations.variables() + 1;
            return Some(if all { unknowns.to_vec() } else { equations.own(unknowns) });
        }
        let parameter = unknowns[unknowns.len() - 1] * self.units.parameters[0];
        equations.unknowns(&orbit.states, &self.request.parameters(parameter))
    }

    /// Seed that continues a branch in other section points: without those of returns without
    /// contact, which may have lost theirs, without the variables of passages, which may have no
    /// gap, or with both again.
    fn other_points(&self, seed: BranchSeed, point: &DirectPoint) -> Option<BranchSeed> {
        // The tangent at the end points in the direction in which the branch was followed.
        let outward = &point.tangent;
        let own = self.equations(&seed.itinerary);
        let fewer = || own.clone().in_points(SectionPoints::AtContacts);
        if seed.points == SectionPoints::Every
            && let Some(fewer) = fewer()
        {
            let way = SeedKind::On(fewer.own(outward));
            return Some(BranchSeed { points: SectionPoints::AtContacts, way, ..seed });
        }
        let points = match seed.points {
            SectionPoints::Every => SectionPoints::Plain,
            SectionPoints::AtContacts | SectionPoints::Plain => SectionPoints::Every,
        };
        let mut other = own.in_points(points)?;
        let parameters = self.request.parameters(seed.parameter);
        let states = other.every_point(&point.linearised.extra, &parameters)?;
        let unknowns = other.unknowns(&states, &parameters)?;
        let there = other.linearised(&unknowns)?;
        let mut along = unit_vector(unknowns.len(), unknowns.len() - 1);
        let ahead = outward[outward.len() - 1];
        along.iter_mut().for_each(|value| *value *= ahead.signum());
        let way = SeedKind::On(tangent_at(&there.jacobian, &along)?);
        Some(BranchSeed { points, states, way, ..seed })
    }

    /// Seeds that continue a branch with one more return without contact, in the section points of
    /// returns with contact. On a tangency section an orbit may acquire another local minimum of
    /// the gap, which splits one of its returns; the right one to split is found by solving.
    fn with_another_return(&self, seed: &BranchSeed, point: &DirectPoint) -> Vec<BranchSeed> {
        let (itinerary, orbit) = (&seed.itinerary, &point.linearised.extra);
        let returns = itinerary.returns();
        let begins = |number: usize| returns[number].contains(0);
        if !self.image.is_on_tangency() || returns.len() >= self.request.longest || !begins(0) {
            return Vec::new();
        }
        let size = self.units.state.len();
        let contacts = (0..orbit.returns.len()).filter(|&place| begins(orbit.returns[place]));
        let own: Vec<(&Vec<f64>, &[f64])> = contacts
            .map(|place| (&orbit.states[place], &point.tangent[place * size..][..size]))
            .collect();
        let parted = |number: usize| {
            let mut longer = returns.to_vec();
            longer.insert(number + 1, PassageSet::default());
            let longer = ContactItinerary::new(itinerary.passages(), longer);
            let (itinerary, by) = longer.largest_rotation();
            let later = longer.returns()[..by].iter().filter(|made| made.contains(0)).count();
            let mut rotated = own.clone();
            rotated.rotate_left(later);
            let ahead = point.tangent[orbit.returns.len() * size..].iter();
            let way = rotated.iter().flat_map(|(_, way)| way.iter()).chain(ahead).copied();
            BranchSeed {
                itinerary,
                states: rotated.iter().map(|(state, _)| (*state).clone()).collect(),
                points: SectionPoints::AtContacts,
                way: SeedKind::On(way.collect()),
                ..seed.clone()
            }
        };
        (0..returns.len()).map(parted).collect()
    }

    /// Orbits of a branch at a value of the varied parameter, in double-double.
    fn passing(
        &self,
        itinerary: &ContactItinerary,
        trace: &DirectTrace,
        value: f64,
    ) -> Vec<FoundOrbit> {
        let first = &trace.points[0].linearised.extra;
        let equations = self.equations_with(itinerary, first);
        let mut fine = in_points_of(self.equations_of(&self.fine, itinerary), first);
        let last = trace.points[0].unknowns.len() - 1;
        let normal: Vec<Dd> = unit_vector(last + 1, last);
        let guesses = guesses_at(trace, value / self.units.parameters[0]).map(|guess| {
            let mut guess: Vec<Dd> = converted(&guess);
            guess[last] = Dd::from(value) / Dd::from(self.units.parameters[0]);
            guess
        });
        let orbits = guesses.filter_map(|guess| {
            let (unknowns, linearised) = corrected(&mut fine, &guess, &guess, &normal)?;
            let tangent = vec![Dd::ZERO; unknowns.len()];
            let point = ContinuationPoint { unknowns, tangent, linearised, tests: Vec::new() };
            let mut orbit = self.found(&fine, &point, false);
            orbit.parameters[self.request.along] = value;
            let is_own = point
                .unknowns
                .iter()
                .enumerate()
                .all(|(unknown, at)| equations.passage_of(unknown).is_none() || *at > Dd::ZERO);
            (is_own && orbit.extra_contacts == 0).then_some(orbit)
        });
        orbits.collect()
    }

    /// Data of the special point at which the given test functions vanish.
    fn special(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &DirectPoint,
        turns: &[usize],
        grazing: Vec<usize>,
    ) -> Option<Special> {
        let orbit = &point.linearised.extra;
        if !grazing.is_empty() {
            let grazing = grazing.into_iter().map(|number| [number, 0]).collect();
            return Some(Special { grazing, ..Special::new(BranchLabel::Graze) });
        }
        if turns.is_empty() {
            return None;
        }
        let multipliers =
            equations.jacobian(orbit).and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        let vanishing = || turns.iter().map(|&test| test_of(test));
        let is_turn = vanishing().any(|test| test == TestKind::Turn);
        let label = match equations.is_repeated(orbit, NEAR) {
            true => BranchLabel::BranchPoint,
            // Where the parameter turns, the multiplier 1 belongs to the turn.
            false => label_of(vanishing(), &multipliers, AT_MULTIPLIER)
                .find(|label| *label != BranchLabel::BranchPoint || !is_turn)?,
        };
        let coefficient = self.coefficient(equations, point, label);
        Some(Special { coefficient, ..Special::new(label) })
    }

    /// Hopf point near an orbit of an autonomous system: the equilibrium at which a pair of
    /// eigenvalues crosses the imaginary axis, by secant steps in the parameter.
    fn hopf(&self, itinerary: &ContactItinerary, near: &FoundOrbit) -> Option<BranchPoint> {
        self.units.acceleration?;
        let mut image = self.image.clone();
        let along = self.request.along;
        let mut at = |parameter: f64| {
            let parameters = self.request.parameters(parameter);
            let there = image.equilibrium(&near.states[0], &parameters)?;
            let pairs = there.eigenvalues.iter().filter(|value| value.im > 0.0);
            let share = |value: &Complex<f64>| value.re.abs() / value.im;
            let pair = *pairs.min_by(|a, b| share(a).total_cmp(&share(b)))?;
            Some((parameter, pair, there))
        };
        let start = near.parameters[along];
        let step = HOPF_STEP * self.units.parameters[0];
        let (mut before, mut here) = (at(start)?, at(start + step)?);
        if before.1.re.abs() < here.1.re.abs() {
            std::mem::swap(&mut before, &mut here);
        }
        for _ in 0..HOPF_STEPS {
            let step = here.1.re * (here.0 - before.0) / (here.1.re - before.1.re);
            if here.1.re == 0.0 || !step.is_finite() {
                break;
            }
            let next = at(here.0 - step)?;
            if next.1.re.abs() >= here.1.re.abs() {
                break;
            }
            before = std::mem::replace(&mut here, next);
        }
        let (parameter, pair, there) = here;
        let units = &self.units.state;
        let apart = there.offsets.iter().zip(&near.states[0]).zip(units);
        let apart = apart.fold(0.0_f64, |most, ((a, b), unit)| most.max((a - b).abs() / unit));
        if pair.re.abs() > AT_HOPF * pair.im
            || apart > NEAR_HOPF
            || (parameter - start).abs() > NEAR_HOPF * self.units.parameters[0]
        {
            return None;
        }
        let period = std::f64::consts::TAU / pair.im;
        // The pair's own plane leaves one direction for the return, with multiplier 1.
        let others = there.eigenvalues.iter().filter(|value| **value != pair);
        let others = others.filter(|value| **value != pair.conj());
        let all = others.map(|value| (value * period).exp()).chain([Complex::new(1.0, 0.0)]);
        let mut multipliers: Vec<Complex<f64>> = all.collect();
        multipliers.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        let parameters = self.request.parameters(parameter);
        let depths = self.depths.at(&there.offsets, &parameters);
        let orbit = FoundOrbit {
            itinerary: itinerary.clone(),
            inside: self.map.window.holds(&there.offsets, &parameters, &depths),
            parameters,
            states: vec![there.offsets; near.states.len()],
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            stable: false,
            contacts: Vec::new(),
            physical: true,
            extra_contacts: 0,
            turns: 0,
            hits: Some(vec![0; self.surfaces.len()]),
            residual: 0.0,
        };
        let special = Special { coefficient: Some(pair.im), ..Special::new(BranchLabel::Hopf) };
        Some(BranchPoint { orbit, special: Some(special) })
    }

    /// Coefficient of the normal form.
    fn coefficient(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &DirectPoint,
        label: BranchLabel,
    ) -> Option<f64> {
        let orbit = &point.linearised.extra;
        let own = point.unknowns.iter().enumerate();
        let own = own.filter(|(unknown, _)| equations.passage_of(*unknown).is_some());
        let gaps = own.map(|(unknown, value)| match equations.begins_with_contact_at(unknown) {
            true => value * value,
            false => value.abs(),
        });
        let units = &window_scales(&self.map.window)[..self.units.state.len()];
        // Distance of the replaced coordinate from its value at a graze, in half-widths.
        let share = self.units.gap.map_or(1.0, |(place, _)| self.units.state[place] / units[place]);
        let mut image = self.fine.clone();
        NormalForm {
            map: &mut image,
            state: converted(&orbit.states[0]),
            parameters: converted(&equations.parameters(&point.unknowns)),
            returns: equations.itinerary().period(),
            units: units.to_vec(),
            length: gaps.fold(1.0, |least, gap| least.min(share * gap)),
            jacobian: equations.jacobian(orbit)?,
        }
        .of(label)
    }

    /// Refines a special point, a zero of test function `test`, to the rounding of double-double.
    fn refined(
        &self,
        itinerary: &ContactItinerary,
        point: &DirectPoint,
        test: usize,
    ) -> Option<FoundOrbit> {
        let fine = self.equations_of(&self.fine, itinerary);
        let mut fine = in_points_of(fine, &point.linearised.extra);
        let found = refined(&mut fine, point, test)?;
        Some(self.found(&fine, &found, false))
    }

    /// Orbit of half the period at a branch point, refined as its period-doubling point.
    fn refined_doubling(
        &self,
        itinerary: &ContactItinerary,
        point: &DirectPoint,
    ) -> Option<FoundOrbit> {
        let half = halved(itinerary);
        let orbit = &point.linearised.extra;
        let mut equations = self.equations(&half).in_points(orbit.points)?;
        let variables = orbit.returns.len() / 2 * self.units.state.len();
        let mut unknowns = point.unknowns[..variables].to_vec();
        unknowns.push(*point.unknowns.last()?);
        let along = unit_vector(unknowns.len(), variables);
        let (unknowns, linearised) = corrected(&mut equations, &unknowns, &unknowns, &along)?;
        let tangent = tangent_at(&linearised.jacobian, &along)?;
        let point = DirectPoint { unknowns, tangent, linearised, tests: Vec::new() };
        self.refined(&half, &point, 1)
    }

    /// Branch through a seed, if it is not among those known; it ends where it meets one of them
    /// that has the variables of passages and this one has not, or the reverse. Rejects branches
    /// that consist of one point.
    fn through(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        guess: &[f64],
        seed: &BranchSeed,
        known: &[DirectTrace],
    ) -> Result<DirectTrace, NoBranch> {
        equations.reach_beyond(guess);
        let is_repeated = DirectOrbitEquations::is_repeated;
        let start = match &seed.way {
            SeedKind::Doubled(direction) => {
                let first = first_doubled(equations, guess, direction, is_repeated);
                first.ok_or(NoBranch::NoOrbit)?.0
            }
            SeedKind::Through | SeedKind::On(_) => {
                let start = solved(equations, guess).ok_or(NoBranch::NoOrbit)?;
                let several = equations.rotations().nth(1).is_some();
                if several && has_shorter_period(equations, &start, is_repeated) {
                    return Err(NoBranch::OfAnother);
                }
                start.0
            }
        };
        let bounded = start.iter().enumerate().map(|(unknown, value)| {
            let [lower, upper] = equations.range(unknown);
            let bounded = value.clamp(lower, upper);
            ((bounded - value).abs() <= AT_GRAZE).then_some(bounded)
        });
        let start: Vec<f64> = bounded.collect::<Option<_>>().ok_or(NoBranch::NoOrbit)?;
        let there = equations.linearised(&start).ok_or(NoBranch::NoOrbit)?;
        let parameters = equations.parameters(&start);
        if equations.is_at_rest(&there.extra, &parameters) {
            return Err(NoBranch::OfAnother);
        }
        let (own, goes_on) = (equations.points(), matches!(seed.way, SeedKind::On(_)));
        let alike = |points: SectionPoints| !goes_on || points == own;
        if self.is_known(equations, (&start, &there.extra), known, alike) {
            return Err(NoBranch::OfAnother);
        }
        let others = |points: SectionPoints| {
            (points == SectionPoints::Plain) != (own == SectionPoints::Plain)
        };
        let has_others = known.iter().any(|trace| others(trace.points[0].linearised.extra.points));
        let meets = |equations: &DirectOrbitEquations<'a, f64>, point: &DirectPoint| {
            let orbit = (&point.unknowns[..], &point.linearised.extra);
            has_others && self.is_known(&mut equations.clone(), orbit, known, others)
        };
        let mut followed = UntilKnown { equations, meets: &meets };
        let trace = match &seed.way {
            SeedKind::On(direction) => {
                TracedBranch::onward(&mut followed, &start, direction, &STEPS)
            }
            _ => TracedBranch::through(&mut followed, &start, &STEPS),
        };
        let trace = trace.ok_or(NoBranch::NoOrbit)?;
        // A branch without orbits beside the graze is physical on neither side.
        let beside = |point: &DirectPoint| apart(&point.unknowns, &start) > SAME;
        trace.points.iter().any(beside).then_some(trace).ok_or(NoBranch::OfAnother)
    }

    /// Orbit at a point of a branch.
    fn found<S: Real>(
        &self,
        equations: &DirectOrbitEquations<'a, S>,
        point: &ContinuationPoint<S, DirectOrbit<S>>,
        at_graze: bool,
    ) -> FoundOrbit {
        let orbit = &point.linearised.extra;
        let known = !at_graze || self.units.smooth;
        let jacobian = equations.jacobian(orbit).filter(|_| known);
        let parameters = equations.parameters(&point.unknowns);
        let found = FoundOrbit::on_branch(
            equations.itinerary(),
            (&orbit.states, &parameters),
            jacobian,
            &point.linearised.residual,
        );
        let holds = |state: &Vec<f64>| {
            let depths = self.depths.at(state, &found.parameters);
            self.map.window.holds(state, &found.parameters, &depths)
        };
        let contact = |&(number, passage, speed): &(usize, usize, S)| OrbitContact {
            number,
            passage,
            speed: speed.to_f64(),
        };
        FoundOrbit {
            inside: found.states.iter().all(holds),
            contacts: orbit.speeds.iter().map(contact).collect(),
            extra_contacts: orbit.extra_contacts,
            turns: orbit.turns,
            hits: Some(self.surfaces.iter().map(|&surface| orbit.hits[surface] as u32).collect()),
            ..found
        }
    }
}

impl BranchSource for DirectBranches<'_> {
    type Orbit = DirectOrbit<f64>;
    type SeedData = DirectSeedData;

    fn asked(&self) -> (&BranchRequest, &dyn Progress) {
        (self.request, self.progress)
    }

    fn seed_data(&self) -> DirectSeedData {
        let flights = self.flights();
        let grazing = match &self.extent.graze {
            Some(graze) => vec![graze.clone()],
            None => self.grazing_orbits(&flights),
        };
        DirectSeedData { flights, grazing, by_map: self.orbits_of_map() }
    }

    /// NOTE: a contact just before a section at a phase is none of its passage, where the passage
    /// itself is nearer in time. An orbit of two periods may so have returns without contact alone.
    fn repeated(&self, data: &DirectSeedData) -> Vec<ContactItinerary> {
        if self.image.is_on_tangency() {
            return Vec::new();
        }
        let asked = &self.request.itineraries;
        let settled = data.flights.iter().filter_map(|flight| self.settled_itinerary(flight));
        let root = |itinerary: &ContactItinerary| {
            let period = itinerary.period();
            let root = (1..period)
                .find(|&root| period.is_multiple_of(root) && itinerary.repeats_after(root))?;
            let returns = itinerary.returns()[..root].to_vec();
            Some(ContactItinerary::new(itinerary.passages(), returns))
        };
        let is_repeated = |of: &ContactItinerary| root(of).is_some_and(|at| asked.contains(&at));
        let mut repeated = Vec::new();
        for itinerary in settled.filter(is_repeated) {
            if !asked.contains(&itinerary) && !repeated.contains(&itinerary) {
                repeated.push(itinerary);
            }
        }
        repeated
    }

    /// Seeds at the graze, at orbits of the map, and at nearly periodic flights.
    fn seeds(
        &self,
        itinerary: &ContactItinerary,
        DirectSeedData { flights, grazing, by_map }: &DirectSeedData,
    ) -> Vec<BranchSeed> {
        let mine = flights.iter().filter_map(|flight| self.nearest_period(flight, itinerary));
        let grazing = grazing.iter().map(|(state, parameter)| {
            let states = vec![state.clone(); itinerary.period()];
            BranchSeed::new(itinerary, states, Vec::new(), *parameter)
        });
        let by_map = by_map.iter().filter(|orbit| orbit.itinerary == *itinerary);
        let by_map = by_map.map(|orbit| {
            let parameter = orbit.parameters[self.request.along];
            BranchSeed::new(itinerary, orbit.states.clone(), Vec::new(), parameter)
        });
        grazing.chain(by_map).chain(mine).collect()
    }

    fn trace(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        known: &[DirectTrace],
        most: u64,
    ) -> SearchedBranch<DirectOrbit<f64>> {
        self.reported_trace(itinerary, seed, known, most, &NoProgress)
    }

    fn fits(&self, itinerary: &ContactItinerary, trace: &DirectTrace) -> bool {
        let Some(first) = trace.points.first() else { return false };
        let mut equations = in_points_of(self.equations(itinerary), &first.linearised.extra);
        let count = equations.variables() + 1;
        trace.fits(itinerary, &mut equations, count)
    }

    fn most_work(&self) -> u64 {
        self.extent.most_work
    }

    fn cut_short(&self, itinerary: &ContactItinerary) {
        self.unfinished.extend([itinerary]);
    }

    fn led_to(&self, itinerary: &ContactItinerary, trace: &DirectTrace) -> Vec<BranchSeed> {
        let mut equations = self.equations_with(itinerary, &trace.points[0].linearised.extra);
        let seed = |equations: &DirectOrbitEquations<'_, f64>, point: &DirectPoint| {
            let orbit = &point.linearised.extra;
            let parameter = equations.parameters(&point.unknowns)[self.request.along];
            BranchSeed {
                points: orbit.points,
                ..BranchSeed::new(itinerary, orbit.states.clone(), Vec::new(), parameter)
            }
        };
        let mut seeds = Vec::new();
        let ends = trace.ends.iter().zip([trace.points.first(), trace.points.last()]);
        for (end, point) in ends.skip(usize::from(trace.continues)) {
            let Some(point) = point else { continue };
            let is_border = match end {
                ContinuationEnd::Border { .. } => true,
                // The last step to a graze may fail by rounding.
                ContinuationEnd::StepTooSmall => self.refined_graze(itinerary, point).is_some(),
                _ => false,
            };
            match end {
                _ if is_border => {
                    let [number] = self.grazing(&equations, point)[..] else { continue };
                    let mut seed = seed(&equations, point);
                    if seed.points == SectionPoints::AtContacts {
                        let parameters = self.request.parameters(seed.parameter);
                        let orbit = &point.linearised.extra;
                        let Some(all) = equations.every_point(orbit, &parameters) else { continue };
                        (seed.states, seed.points) = (all, SectionPoints::Every);
                    }
                    seed.itinerary = toggled(itinerary, number, 0);
                    seeds.push(seed.in_standard_form(self.image.circle()));
                }
                ContinuationEnd::StepTooSmall
                | ContinuationEnd::StepLimit
                | ContinuationEnd::WorkLimit => {
                    let end = seed(&equations, point);
                    seeds.extend(self.with_another_return(&end, point));
                    seeds.extend(self.other_points(end, point));
                }
                _ => {}
            }
        }
        if 2 * itinerary.period() > self.request.longest {
            return seeds;
        }
        let flips = trace.turns.iter().filter(|turn| test_of(turn.test) == TestKind::Flip);
        for turn in flips {
            let point = &trace.points[turn.point];
            let orbit = &point.linearised.extra;
            let Some(vector) = equations.doubling_direction(orbit, null_vector) else { continue };
            let against = vector.iter().map(|value| -value);
            let direction: Vec<f64> = vector.iter().copied().chain(against).chain([0.0]).collect();
            seeds.push(seed(&equations, point).doubled(&direction));
        }
        seeds
    }

    fn branch(&self, itinerary: &ContactItinerary, trace: &DirectTrace) -> Branch {
        self.reported_branch(itinerary, trace, &NoProgress)
    }
}

impl DirectBranches<'_> {
    /// Result of [`BranchSource::trace`]; reports the work, of which `most` is expected.
    fn reported_trace(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        known: &[DirectTrace],
        most: u64,
        progress: &dyn Progress,
    ) -> SearchedBranch<DirectOrbit<f64>> {
        let (mut work, mut is_tried) = (0, false);
        for &points in Self::choices(seed) {
            // Where the equations with variables of passages fail, plain ones are tried.
            if is_tried && points != SectionPoints::Plain {
                continue;
            }
            let Some((mut equations, guess)) = self.equations_at(itinerary, seed, points) else {
                continue;
            };
            is_tried = true;
            equations.limit_work(most - work);
            equations.report_work(progress);
            let found = self.through(&mut equations, &guess, seed, known);
            work = most.min(work + equations.work());
            match found {
                Err(NoBranch::NoOrbit) => {}
                found => return SearchedBranch { trace: found.ok(), work },
            }
        }
        SearchedBranch { trace: None, work }
    }

    /// Result of [`BranchSource::branch`]; reports its points.
    fn reported_branch(
        &self,
        itinerary: &ContactItinerary,
        trace: &DirectTrace,
        progress: &dyn Progress,
    ) -> Branch {
        let equations = self.equations_with(itinerary, &trace.points[0].linearised.extra);
        let orbits = trace.orbits();
        progress.expect(orbits.len() as u64);
        let before = once(None).chain(orbits.iter().map(|(place, _)| Some(*place)));
        let points = orbits.iter().zip(before).flat_map(|((place, turns), before)| {
            let (place, point) = (*place, &trace.points[*place]);
            let passed = before
                .and_then(|before| self.graze_between(itinerary, [&trace.points[before], point]));
            let grazing = match place == 0 || place + 1 == trace.points.len() {
                true => self.grazing(&equations, point),
                false => Vec::new(),
            };
            let grazes = !grazing.is_empty();
            let mut special = self.special(&equations, point, turns, grazing);
            let doubles = equations.is_repeated(&point.linearised.extra, NEAR);
            let exact = match (&mut special, turns.first()) {
                (Some(special), _) if grazes => {
                    let graze = self.refined_graze(itinerary, point);
                    graze.map(|(orbit, slope)| {
                        special.coefficient = slope;
                        orbit
                    })
                }
                (Some(_), Some(&test)) if !doubles => self.refined(itinerary, point, test),
                _ => None,
            };
            let mut orbit = exact.unwrap_or_else(|| self.found(&equations, point, grazes));
            special = special.filter(|special| {
                doubles || has_multiplier(&orbit, special.label, REFINED_MULTIPLIER)
            });
            if special.is_some()
                && !grazes
                && doubles
                && let Some(half) = self.refined_doubling(itinerary, point)
            {
                orbit.parameters = half.parameters;
                orbit.states = [&half.states[..], &half.states].concat();
            }
            progress.advance(1);
            passed.into_iter().chain([BranchPoint { orbit, special }])
        });
        let mut points = each_once(points.collect());
        let value =
            |place: usize| equations.parameters(&trace.points[place].unknowns)[self.request.along];
        let unresolved = trace.unresolved.iter().map(|ends| ends.map(value)).collect();
        let along = trace.points[0].unknowns.len() - 1;
        let mut ends = trace.ends(|unknown| match equations.passage_of(unknown) {
            _ if unknown == along => BranchEnd::Range,
            Some(_) => BranchEnd::Graze,
            None => BranchEnd::Reach,
        });
        for (side, end) in ends.iter_mut().enumerate() {
            let place = if side == 0 { 0 } else { points.len() - 1 };
            if *end == BranchEnd::StepLimit && self.loses_section_point(&points[place].orbit) {
                *end = BranchEnd::SectionPoint;
            }
            if !matches!(end, BranchEnd::Doubling | BranchEnd::StepTooSmall) {
                continue;
            }
            let last = if side == 0 { 0 } else { trace.points.len() - 1 };
            if *end == BranchEnd::StepTooSmall
                && self.refined_graze(itinerary, &trace.points[last]).is_some()
            {
                *end = BranchEnd::Graze;
                continue;
            }
            if *end == BranchEnd::Doubling && self.meets_known(&equations, &trace.points[last]) {
                *end = BranchEnd::Continued;
                continue;
            }
            if *end == BranchEnd::StepTooSmall
                && let Some(contact) = slow_contact(&equations, &points, place)
            {
                *end = BranchEnd::Graze;
                if let Some(orbit) = self.extrapolated_graze(itinerary, (trace, last), contact) {
                    let grazing = vec![contact];
                    let special = Special { grazing, ..Special::new(BranchLabel::Graze) };
                    points[place] = BranchPoint { orbit, special: Some(special) };
                }
                continue;
            }
            if *end == BranchEnd::StepTooSmall
                && let Some(graze) = self.graze_ahead(itinerary, &trace.points[last])
            {
                *end = BranchEnd::Graze;
                points.insert(if side == 0 { 0 } else { points.len() }, graze);
                continue;
            }
            let Some(hopf) = self.hopf(itinerary, &points[place].orbit) else { continue };
            *end = BranchEnd::Hopf;
            points.insert(if side == 0 { 0 } else { points.len() }, hopf);
        }
        Branch { itinerary: itinerary.clone(), points, ends, unresolved }
    }

    /// Whether the last point of a curve ends it because it lies on a known branch, and not because
    /// its period is shorter or it is an equilibrium.
    fn meets_known(&self, equations: &DirectOrbitEquations<'_, f64>, last: &DirectPoint) -> bool {
        !self.image.is_on_tangency() && !equations.is_repeated(&last.linearised.extra, NEAR)
    }

    /// Whether `h''` nearly vanishes at a point of an orbit on the tangency section: the point is
    /// about to meet a local maximum of the gap and to vanish with it.
    fn loses_section_point(&self, orbit: &FoundOrbit) -> bool {
        /// Share of the graze's own `h''` that counts as nearly zero.
        const VANISHING: f64 = 1e-2;
        let nominal = self.orbit.grazing_point().normal_acceleration.to_f64();
        let mut image = self.image.clone();
        image.is_on_tangency()
            && orbit.states.iter().any(|state| {
                let here = image.normal_acceleration(state, &orbit.parameters);
                here.is_ok_and(|here| here.abs() <= VANISHING * nominal)
            })
    }
}

/// Unknowns between the points of a branch at a value of the varied parameter, in units.
fn guesses_at(trace: &DirectTrace, at: f64) -> impl Iterator<Item = Vec<f64>> {
    trace.points.windows(2).filter_map(move |pair| {
        let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
        let last = a.len() - 1;
        let share = (at - a[last]) / (b[last] - a[last]);
        // A value at a point belongs to one of its two intervals.
        (0.0..1.0).contains(&share).then(|| {
            let mut guess = between(a, b, share);
            guess[last] = at;
            guess
        })
    })
}

/// Number from −1 to 1 for each pair of indices, by a Kronecker sequence.
fn scattered(number: usize, component: usize) -> f64 {
    let golden = 0.618_033_988_749_894_9;
    2.0 * ((number + 1) as f64 * (golden / (component + 1) as f64).sqrt()).fract() - 1.0
}

/// Test function of an index: direct simulation has none of single passages.
fn test_of(index: usize) -> TestKind {
    TestKind::of(index, [0, 0])
}

/// Whether an orbit has the critical multiplier of its label, within `near`.
fn has_multiplier(orbit: &FoundOrbit, label: BranchLabel, near: [f64; 2]) -> bool {
    let test = match label {
        BranchLabel::SaddleNode => TestKind::Turn,
        BranchLabel::PeriodDoubling => TestKind::Flip,
        BranchLabel::NeimarkSacker => TestKind::Reciprocal,
        BranchLabel::Graze | BranchLabel::BranchPoint | BranchLabel::Hopf => return true,
    };
    let multipliers = orbit.multipliers.iter().map(|[re, im]| Complex::new(*re, *im));
    label_of(once(test), &multipliers.collect::<Vec<_>>(), near).next().is_some()
}

/// Equations in the section points of an orbit, which are first sought next to it.
fn in_points_of<'a, S: Real>(
    equations: DirectOrbitEquations<'a, S>,
    orbit: &DirectOrbit<f64>,
) -> DirectOrbitEquations<'a, S> {
    let every = equations.clone();
    let mut equations = equations.in_points(orbit.points).unwrap_or(every);
    equations.seek_near(orbit);
    equations
}

/// Reason why a seed has no branch of its own.
enum NoBranch {
    /// No orbit was found in the section points that were tried.
    NoOrbit,
    /// The orbit lies on a known branch, has a shorter period, or is an equilibrium.
    OfAnother,
}

/// Test of an orbit on a curve.
type OrbitTest<'e, 'a> = &'e dyn Fn(&DirectOrbitEquations<'a, f64>, &DirectPoint) -> bool;

/// Equations whose curve also ends where it meets a known one.
struct UntilKnown<'e, 'a> {
    equations: &'e mut DirectOrbitEquations<'a, f64>,
    meets: OrbitTest<'e, 'a>,
}

impl CurveEquations<f64> for UntilKnown<'_, '_> {
    type Extra = DirectOrbit<f64>;

    fn linearised(&mut self, unknowns: &[f64]) -> Option<Linearised<f64, Self::Extra>> {
        self.equations.linearised(unknowns)
    }

    fn residual(&mut self, unknowns: &[f64]) -> Option<DVector<f64>> {
        self.equations.residual(unknowns)
    }

    fn tests(&self, point: &DirectPoint) -> Vec<TestValue<f64>> {
        self.equations.tests(point)
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        self.equations.range(unknown)
    }

    fn bring_near(&self, unknowns: &mut [f64], other: &[f64]) {
        self.equations.bring_near(unknowns, other);
    }

    fn is_spent(&self) -> bool {
        self.equations.is_spent()
    }

    fn is_last(&mut self, [before, point]: [&DirectPoint; 2]) -> bool {
        self.equations.is_last([before, point]) || (self.meets)(self.equations, point)
    }
}

/// Whether an orbit lies on one of the lines, from any of its starting points.
fn lies_on_one(
    equations: &mut DirectOrbitEquations<'_, f64>,
    unknowns: &[f64],
    lines: &[Vec<Vec<f64>>],
) -> bool {
    let last = unknowns.len() - 1;
    let size = equations.dimension();
    let rotated = equations.rotations().map(|later| {
        let mut variables = unknowns[..last].to_vec();
        variables.rotate_left(later * size);
        variables
    });
    let starts: Vec<Vec<f64>> = rotated.collect();
    lies_on(equations, (&starts, unknowns[last]), lines, 0.0)
}
