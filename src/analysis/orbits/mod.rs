//! Periodic orbits by itinerary, and their folds and flips in two parameters: what is asked, and
//! what was found.
//!
//! One idea: a local map is searched, for with the contacts prescribed it is a polynomial; direct
//! simulation, whose contacts cannot be prescribed, is solved for the orbit next to each one found,
//! and searched by itself from what it settles on.

mod data;
mod direct_search;

pub use data::{
    DirectReach, FoundOrbit, LociRequest, Locus, LostOrbit, LostReason, OrbitContact, Orbits,
    OrbitsRequest, SteppedParameter,
};

use direct_search::{DirectSearch, Reach};
use rayon::prelude::*;

use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::periodic::{
    BifurcationKind, ContactItinerary, Guess, Held, ItineraryBifurcation, ItineraryOrbit,
    ItinerarySearch, PeriodicOrbit, PeriodicOutcome, PeriodicProblem, bifurcation, periodic_orbit,
    window_scales,
};
use crate::analysis::progress::Progress;
use crate::expansion::{Expander, ImpactSpeed, LocalMap, MapWindow};
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// The periodic orbits of the itineraries asked for, and their folds and flips.
///
/// Looked for in the map ([`ItinerarySearch`]), physical and virtual ones. With
/// [`OrbitsRequest::direct`] every physical one is solved for again by direct simulation in
/// double-double from there, and that orbit is returned; those without one are listed as lost.
/// With [`OrbitsRequest::far`] direct simulation is searched by itself as well. No result depends
/// on the number of cores.
///
/// # Errors
///
/// [`AnalysisError::Expansion`] if an impact speed cannot be expanded, [`AnalysisError::Hybrid`] if
/// the simulator refuses the parameters.
///
/// # Panics
///
/// If offsets are not as many as the map's parameters, or there are none.
pub fn orbits(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &OrbitsRequest,
    progress: &dyn Progress,
) -> Result<Orbits, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let far = match &request.loci {
        Some(loci) => Some(loci.free),
        None => first_adjusted(scene),
    };
    let finder = Finder {
        search: ItinerarySearch::new(map),
        by_map: ByMap::new(scene, orbit, map)?,
        direct: match request.direct || request.far {
            true => Some(Direct::new(&system, scene, orbit, map)?),
            false => None,
        },
        guided: request.direct,
        reach: far.filter(|_| request.far).map(|free| Reach::of(scene, orbit, free)),
    };
    let itineraries = &request.itineraries;
    progress.expect((request.at.len() * itineraries.len()) as u64);
    let cases: Vec<_> = request
        .at
        .iter()
        .flat_map(|at| itineraries.iter().map(move |itinerary| (at, itinerary)))
        .collect();
    let cases = cases.into_par_iter().map(|(at, itinerary)| {
        let found = finder.orbits(itinerary, at);
        progress.advance(1);
        found
    });
    let mut cases: Vec<_> = cases.collect();
    if request.loci.is_none() {
        let wide = request.at.par_iter().flat_map(|at| finder.wide_orbits(itineraries, at));
        for (known, found) in cases.iter_mut().zip(wide.collect::<Vec<_>>()) {
            add_new(known, found);
        }
    }
    let (orbits, mut lost) = parted(cases.concat());
    let loci = request.loci.as_ref().map(|loci| {
        let (found, missing) = finder.loci(itineraries, loci, progress);
        lost.extend(missing);
        found
    });
    let reach = finder.reach.map(Reach::words);
    Ok(Orbits { orbits, loci, lost, reach })
}

/// The first active parameter that is adjusted so that the orbit grazes; the first of all where
/// none is.
fn first_adjusted(scene: &Scene) -> Option<usize> {
    let active = &scene.expansion.active;
    let adjusted = active.iter().position(|place| scene.grazing.solve_for.contains(place));
    adjusted.or((!active.is_empty()).then_some(0))
}

/// Adds orbits that are not among those known.
fn add_new(known: &mut Vec<Outcome>, found: Vec<FoundOrbit>) {
    for orbit in found {
        if !known.iter().flatten().any(|other| other.is_same_as(&orbit)) {
            known.push(Ok(orbit));
        }
    }
}

/// An orbit, or what became of it.
type Outcome = Result<FoundOrbit, LostOrbit>;

/// What finds orbits: the map, and direct simulation where that is asked.
struct Finder<'a> {
    search: ItinerarySearch<'a>,
    by_map: ByMap<'a>,
    direct: Option<Direct<'a>>,
    /// Whether the map's orbits are looked for by direct simulation.
    guided: bool,
    /// The parameter in which direct simulation is searched alone.
    reach: Option<Reach>,
}

impl Finder<'_> {
    fn orbits(&self, itinerary: &ContactItinerary, at: &[f64]) -> Vec<Outcome> {
        let found = self.search.orbits(itinerary, at);
        let mut direct = self.direct.clone().filter(|_| self.guided);
        let outcome = |orbit: &ItineraryOrbit<Dd>| match &mut direct {
            Some(_) if !orbit.is_physical() => None,
            Some(direct) => Some(direct.orbit(itinerary, orbit).map_err(|reason| LostOrbit {
                itinerary: itinerary.clone(),
                parameters: at.to_vec(),
                reason,
            })),
            None => self.by_map.found(itinerary, orbit).map(Ok),
        };
        found.iter().filter_map(outcome).collect()
    }

    /// The orbits of each itinerary that direct simulation has by itself at these parameters.
    fn wide_orbits(&self, itineraries: &[ContactItinerary], at: &[f64]) -> Vec<Vec<FoundOrbit>> {
        let (Some(direct), Some(reach)) = (&self.direct, self.reach) else {
            return vec![Vec::new(); itineraries.len()];
        };
        let (mut direct, mut rounded) = (direct.clone(), direct.rounded.clone());
        let mut search = DirectSearch::new(&mut rounded, reach, &direct.scales, at);
        let branches: Vec<_> =
            itineraries.iter().map(|itinerary| search.branches(itinerary)).collect();
        let guesses: Vec<_> =
            branches.iter().map(|branches| search.passing(at[reach.free], branches)).collect();
        let each = itineraries.iter().zip(guesses);
        each.map(|(itinerary, guesses)| {
            let found = guesses.iter().filter_map(|guess| direct.alone(itinerary, guess));
            found.collect()
        })
        .collect()
    }

    /// The folds and flips of each itinerary that direct simulation has by itself.
    fn wide_bifurcations(
        &self,
        itineraries: &[ContactItinerary],
        request: &LociRequest,
        at: &[f64],
    ) -> Vec<Vec<(BifurcationKind, FoundOrbit)>> {
        let (Some(direct), Some(reach)) = (&self.direct, self.reach) else {
            return vec![Vec::new(); itineraries.len()];
        };
        let (mut direct, mut rounded) = (direct.clone(), direct.rounded.clone());
        let scales = direct.scales.clone();
        let mut search = DirectSearch::new(&mut rounded, reach, &scales, at);
        let mut of_itinerary = |itinerary: &ContactItinerary| {
            let branches = search.branches(itinerary);
            let mut found = Vec::new();
            for &kind in &request.kinds {
                for (ends, coordinate) in search.changes(kind, &branches) {
                    let point = direct.change(itinerary, kind, ends, coordinate, request.free);
                    found.extend(point.map(|point| (kind, point)));
                }
            }
            found
        };
        itineraries.iter().map(&mut of_itinerary).collect()
    }

    /// Folds and flips of all itineraries, one locus a kind and itinerary.
    fn loci(
        &self,
        itineraries: &[ContactItinerary],
        request: &LociRequest,
        progress: &dyn Progress,
    ) -> (Vec<Locus>, Vec<LostOrbit>) {
        let steps = steps(request);
        progress.expect((steps.len() * itineraries.len()) as u64);
        let at_step = steps.par_iter().map(|at| {
            let guided = itineraries.iter().map(|itinerary| {
                let found = self.bifurcations(itinerary, request, at);
                progress.advance(1);
                found
            });
            let guided: Vec<_> = guided.collect();
            (guided, self.wide_bifurcations(itineraries, request, at))
        });
        let at_step: Vec<_> = at_step.collect();
        let (mut loci, mut lost) = (Vec::new(), Vec::new());
        for (number, itinerary) in itineraries.iter().enumerate() {
            for &kind in &request.kinds {
                let mut outcomes = Vec::new();
                for (guided, wide) in &at_step {
                    let of_kind = guided[number].iter().filter(|(other, _)| *other == kind);
                    let mut known: Vec<_> = of_kind.map(|(_, outcome)| outcome.clone()).collect();
                    let wide = wide[number].iter().filter(|(other, _)| *other == kind);
                    add_new(&mut known, wide.map(|(_, orbit)| orbit.clone()).collect());
                    outcomes.extend(known);
                }
                let (points, missing) = parted(outcomes);
                lost.extend(missing);
                if !points.is_empty() {
                    loci.push(Locus { kind, itinerary: itinerary.clone(), points });
                }
            }
        }
        (loci, lost)
    }

    fn bifurcations(
        &self,
        itinerary: &ContactItinerary,
        request: &LociRequest,
        at: &[f64],
    ) -> Vec<(BifurcationKind, Outcome)> {
        let (kinds, free) = (&request.kinds, request.free);
        let found = self.search.bifurcations(itinerary, kinds, free, at);
        let mut direct = self.direct.clone().filter(|_| self.guided);
        let outcome = |near: &ItineraryBifurcation| {
            let outcome = match &mut direct {
                Some(direct) => {
                    direct.bifurcation(itinerary, near, free).map_err(|reason| LostOrbit {
                        itinerary: itinerary.clone(),
                        parameters: near.orbit.orbit.parameters.clone(),
                        reason,
                    })
                }
                None => Ok(self.by_map.found(itinerary, &near.orbit)?),
            };
            Some((near.kind, outcome))
        };
        found.iter().filter_map(outcome).collect()
    }
}

/// The parameters of every step.
fn steps(request: &LociRequest) -> Vec<Vec<f64>> {
    let Some(stepped) = &request.stepped else {
        return vec![request.at.clone()];
    };
    let at = |&value: &f64| {
        let mut at = request.at.clone();
        at[stepped.parameter] = value;
        at
    };
    stepped.values.iter().map(at).collect()
}

/// Orbits, and those that are lost.
fn parted(outcomes: Vec<Outcome>) -> (Vec<FoundOrbit>, Vec<LostOrbit>) {
    let (mut orbits, mut lost) = (Vec::new(), Vec::new());
    for outcome in outcomes {
        match outcome {
            Ok(orbit) => orbits.push(orbit),
            Err(orbit) => lost.push(orbit),
        }
    }
    (orbits, lost)
}

/// Impact speeds of a map's contacts.
#[derive(Debug)]
pub(in crate::analysis) struct ByMap<'a> {
    speeds: Vec<ImpactSpeed>,
    window: &'a MapWindow,
}

impl<'a> ByMap<'a> {
    /// The expansions of all passages, to the weight of the map's contacts.
    pub(in crate::analysis) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
    ) -> Result<Self, AnalysisError> {
        let expander = Expander::new(scene, orbit)?;
        let speed = |passage| expander.impact_speed(passage, map.orders.contact_weight);
        let speeds = (0..expander.passages()).map(speed);
        Ok(Self { speeds: speeds.collect::<Result<_, _>>()?, window: &map.window })
    }

    /// The speed of a contact of a passage of depth variable `y`, reached at a point (coordinates;
    /// parameters).
    pub(in crate::analysis) fn speed(&self, passage: usize, y: f64, point: &[f64]) -> f64 {
        self.speeds[passage].at(y, point)
    }

    /// An orbit of the map as it is given out.
    pub(super) fn found<S: Real>(
        &self,
        itinerary: &ContactItinerary,
        orbit: &ItineraryOrbit<S>,
    ) -> Option<FoundOrbit> {
        let contacts = orbit.arrivals.iter().zip(&orbit.depth_variables);
        let contact = |((number, passage, point), y): (&(usize, usize, Vec<S>), &S)| {
            let point: Vec<f64> = point.iter().map(|value| value.to_f64()).collect();
            OrbitContact {
                number: *number,
                passage: *passage,
                speed: self.speed(*passage, y.to_f64(), &point),
            }
        };
        let contacts = contacts.map(contact).collect();
        let kind = (orbit.is_physical(), orbit.is_within(self.window));
        FoundOrbit::of(itinerary, &orbit.orbit, contacts, kind)
    }
}

/// Direct simulation in double-double, with what places its orbits in the window of a map.
#[derive(Clone, Debug)]
pub(super) struct Direct<'a> {
    image: DirectImage<'a, Dd>,
    rounded: DirectImage<'a, f64>,
    window: &'a MapWindow,
    depths: DepthEvaluation<f64>,
    scales: Vec<f64>,
}

impl<'a> Direct<'a> {
    /// Of a scene about its grazing orbit.
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            image: DirectImage::new(system, scene, orbit)?,
            rounded: DirectImage::new(system, scene, orbit)?,
            window: &map.window,
            depths: MapEvaluation::depths(map),
            scales: window_scales(&map.window),
        })
    }

    /// The orbit next to one of the map, at its parameters.
    pub(super) fn orbit<S: Real>(
        &mut self,
        itinerary: &ContactItinerary,
        near: &ItineraryOrbit<S>,
    ) -> Result<FoundOrbit, LostReason> {
        let problem = self.problem(itinerary, 0);
        let orbit = self.solved(itinerary, &problem, Held::Parameter, &exact(near))?;
        self.found(itinerary, &orbit)
    }

    /// The bifurcation between the neighbours that the map has of one.
    pub(super) fn bifurcation(
        &mut self,
        itinerary: &ContactItinerary,
        near: &ItineraryBifurcation,
        free: usize,
    ) -> Result<FoundOrbit, LostReason> {
        let problem = self.problem(itinerary, free);
        let [before, after] = &near.neighbours;
        let coordinate = self.steepest(before, after);
        let held = Held::Coordinate(coordinate);
        let before = self.solved(itinerary, &problem, held, &exact(before))?;
        let after = self.solved(itinerary, &problem, held, &exact(after))?;
        let kind: BifurcationKind = near.kind;
        let ends = [&before, &after];
        let found = bifurcation(&mut self.image, &problem, kind, coordinate, ends);
        self.found(itinerary, &found.ok_or(LostReason::NotBracketed)?.orbit)
    }

    /// The orbit at the parameters of a guess, where nothing but the itinerary's contacts is made.
    fn alone(&mut self, itinerary: &ContactItinerary, guess: &Guess<f64>) -> Option<FoundOrbit> {
        let problem = self.problem(itinerary, 0);
        let orbit = self.solved(itinerary, &problem, Held::Parameter, &converted(guess)).ok()?;
        self.found(itinerary, &orbit).ok().filter(|orbit| orbit.physical)
    }

    /// The bifurcation between two orbits of a branch in double precision.
    fn change(
        &mut self,
        itinerary: &ContactItinerary,
        kind: BifurcationKind,
        [before, after]: [&PeriodicOrbit<f64>; 2],
        coordinate: usize,
        free: usize,
    ) -> Option<FoundOrbit> {
        let problem = self.problem(itinerary, free);
        let held = Held::Coordinate(coordinate);
        let before = self.solved(itinerary, &problem, held, &converted(&before.guess())).ok()?;
        let after = self.solved(itinerary, &problem, held, &converted(&after.guess())).ok()?;
        let ends = [&before, &after];
        let found = bifurcation(&mut self.image, &problem, kind, coordinate, ends)?.orbit;
        let multipliers = found.multipliers().ok()?;
        let mut apart = multipliers.iter().map(|value| (value - kind.multiplier()).norm());
        // The determinant passes through infinity too: at a graze.
        let is_there = apart.any(|apart| apart < AT_MULTIPLIER);
        let found = self.found(itinerary, &found).ok()?;
        (is_there && found.physical).then_some(found)
    }

    fn problem(&self, itinerary: &ContactItinerary, free: usize) -> PeriodicProblem {
        PeriodicProblem {
            returns: itinerary.period(),
            free,
            itinerary: Some(itinerary.returns().to_vec()),
            scales: self.scales.clone(),
        }
    }

    fn solved(
        &mut self,
        itinerary: &ContactItinerary,
        problem: &PeriodicProblem,
        held: Held,
        guess: &Guess<Dd>,
    ) -> Result<PeriodicOrbit<Dd>, LostReason> {
        match periodic_orbit(&mut self.image, problem, held, guess) {
            PeriodicOutcome::Found(orbit) => Ok(orbit),
            PeriodicOutcome::OtherItinerary(orbit) => {
                let passages = itinerary.passages();
                let other = ContactItinerary::new(passages, orbit.itinerary);
                Err(LostReason::OtherItinerary(other))
            }
            _ => Err(LostReason::NotConverged),
        }
    }

    /// The coordinate of the first point that differs most between two orbits.
    fn steepest(&self, before: &ItineraryOrbit<f64>, after: &ItineraryOrbit<f64>) -> usize {
        let pairs = before.orbit.states[0].iter().zip(&after.orbit.states[0]);
        let changes = pairs.zip(&self.scales);
        let changes = changes.map(|((a, b), scale)| ((a - b) / scale).abs());
        let largest = changes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        largest.map_or(0, |(coordinate, _)| coordinate)
    }

    /// The orbit with its speeds, flown once more.
    fn found(
        &mut self,
        itinerary: &ContactItinerary,
        orbit: &PeriodicOrbit<Dd>,
    ) -> Result<FoundOrbit, LostReason> {
        let (mut contacts, mut inside) = (Vec::new(), true);
        let parameters: Vec<f64> = orbit.parameters.iter().map(|value| value.to_f64()).collect();
        for (number, state) in orbit.states.iter().enumerate() {
            let image = self.image.image(state, &orbit.parameters);
            let image = image.map_err(|_| LostReason::NotConverged)?;
            let speeds = image.passages.iter().enumerate();
            contacts.extend(speeds.filter_map(|(passage, speed)| {
                Some(OrbitContact { number, passage, speed: (*speed)?.to_f64() })
            }));
            let state: Vec<f64> = state.iter().map(|value| value.to_f64()).collect();
            let depths = self.depths.at(&state, &parameters);
            inside &= self.window.holds(&state, &parameters, &depths);
        }
        let kind = (orbit.extra_contacts == 0, inside);
        FoundOrbit::of(itinerary, orbit, contacts, kind).ok_or(LostReason::NotConverged)
    }
}

/// How near to its own a multiplier of a bifurcation is, and that of no pole.
const AT_MULTIPLIER: f64 = 1e-6;

/// The first point of an orbit, as a guess.
fn exact<S: Real>(orbit: &ItineraryOrbit<S>) -> Guess<Dd> {
    converted(&orbit.orbit.guess())
}

fn converted<S: Real>(guess: &Guess<S>) -> Guess<Dd> {
    let convert = |values: &[S]| values.iter().map(|value| value.to_dd()).collect();
    Guess { state: convert(&guess.state), parameters: convert(&guess.parameters) }
}
