//! Periodic orbits by itinerary, and their folds and flips in two parameters: what is asked, and
//! what was found.
//!
//! One idea: a local map is searched, for with the contacts prescribed it is a polynomial; direct
//! simulation, whose contacts cannot be prescribed, is solved for the orbit next to each one found.
//! Folds and flips are points of branches, and branches of direct simulation lead beyond the map.

use serde::{Deserialize, Serialize};

use super::branches::{self, BranchLabel, BranchRequest, Extent, Follow};
use super::direct_image::DirectImage;
use super::error::AnalysisError;
use super::evaluation::{DepthEvaluation, MapEvaluation};
use super::periodic::{
    ByMap, ContactItinerary, Guess, Held, ItineraryOrbit, ItinerarySearch, PeriodicOrbit,
    PeriodicOutcome, PeriodicProblem, finite_or_one, periodic_orbit, window_scales,
};
use super::progress::{Part, Progress};
use super::section_frame::phase_circle;
use super::work::Unfinished;
use crate::expansion::{LocalMap, MapWindow};
use crate::hybrid::HybridSystem;
use crate::iteration::{PhaseCircle, parallel};
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};
use crate::orbit::GrazingOrbit;

pub use crate::analysis::periodic::{FoundOrbit, OrbitContact};

/// What is asked of [`orbits`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitsRequest {
    /// Itineraries to look for.
    pub itineraries: Vec<ContactItinerary>,
    /// Parameters at which orbits are looked for: offsets of all active ones.
    pub at: Vec<Vec<f64>>,
    /// Whether each orbit of the map is looked for by direct simulation, and that one given.
    pub direct: bool,
    /// Whether direct simulation is searched by itself too, far beyond the map ([`DirectReach`]).
    #[serde(default)]
    pub far: bool,
    /// Folds and flips, where asked for.
    pub loci: Option<LociRequest>,
}

/// Folds and flips that are looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LociRequest {
    /// Which.
    pub kinds: Vec<BifurcationKind>,
    /// The active parameter that is solved for.
    pub free: usize,
    /// The one that is stepped through; `None` at one value of all others.
    pub stepped: Option<SteppedParameter>,
    /// Offsets of all active parameters; of those two no value matters.
    pub at: Vec<f64>,
}

/// A parameter that takes one value after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteppedParameter {
    /// Its number among the active ones.
    pub parameter: usize,
    /// Its offsets, in order.
    pub values: Vec<f64>,
}

/// A change of stability of a periodic orbit that one parameter meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BifurcationKind {
    /// Saddle-node: a multiplier 1, the branch turns back in the parameter.
    Fold,
    /// Period-doubling: a multiplier −1.
    Flip,
}

impl BifurcationKind {
    /// `fold` or `flip`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fold => "fold",
            Self::Flip => "flip",
        }
    }

    /// The multiplier.
    pub fn multiplier(self) -> f64 {
        match self {
            Self::Fold => 1.0,
            Self::Flip => -1.0,
        }
    }
}

/// Orbits of one itinerary at one kind of bifurcation, as a parameter is stepped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locus {
    /// Fold or flip.
    pub kind: BifurcationKind,
    /// The itinerary.
    pub itinerary: ContactItinerary,
    /// The orbits there, in the order of the steps.
    pub points: Vec<FoundOrbit>,
}

/// An orbit of the map for which direct simulation has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostOrbit {
    /// Its itinerary.
    pub itinerary: ContactItinerary,
    /// Its parameters.
    pub parameters: Vec<f64>,
    /// Why.
    pub reason: LostReason,
}

/// Why direct simulation has no orbit next to one of the map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostReason {
    /// The orbit there makes other contacts.
    OtherItinerary(ContactItinerary),
    /// Newton's method led to none.
    NotConverged,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Orbits {
    /// Orbits: by the parameters, then by the itineraries asked for.
    pub orbits: Vec<FoundOrbit>,
    /// Folds and flips; `None` where not asked for.
    pub loci: Option<Vec<Locus>>,
    /// What direct simulation has not.
    pub lost: Vec<LostOrbit>,
    /// How far direct simulation was searched alone; `None` where it was not.
    #[serde(default)]
    pub reach: Option<DirectReach>,
    /// Itineraries of which direct simulation alone did not follow all branches: the work was at
    /// its bound ([`MOST_WORK`](super::MOST_WORK)).
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}

/// How far direct simulation was searched for orbits by itself: along the branches, in one
/// parameter, that begin at the graze or at what simulation settles on or nearly repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectReach {
    /// The parameter, its number among the active ones.
    pub parameter: usize,
    /// The offsets up to which branches are followed.
    pub range: [f64; 2],
}

/// Half-widths of the window up to which branches of the map are followed.
const WINDOWS: f64 = 10.0;
/// Offsets up to which branches of direct simulation are followed, in sizes of the parameter.
const SIZES: [f64; 2] = [-0.99, 100.0];

/// The periodic orbits of the itineraries asked for, and their folds and flips.
///
/// Looked for in the map ([`ItinerarySearch`]), physical and virtual ones, where its contacts are
/// [expanded](LocalMap::has_contacts). With
/// [`OrbitsRequest::direct`] every physical one is solved for again by direct simulation in
/// double-double from there, and that orbit is returned; those without one are listed as lost.
/// With [`OrbitsRequest::far`] branches of direct simulation are followed in one parameter, and
/// the orbits where they pass its value added. Folds and flips are special points of branches, of
/// the map or of direct simulation alone. No result depends on the number of cores.
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
        scene,
        orbit,
        map,
        by_map: match map.has_contacts() {
            true => Some((ItinerarySearch::new(map), ByMap::new(scene, orbit, map)?)),
            false => None,
        },
        direct: match request.direct {
            true => Some(Direct::new(&system, scene, orbit, map)?),
            false => None,
        },
        unfinished: Unfinished::default(),
    };
    let itineraries = &request.itineraries;
    progress.expect((request.at.len() * itineraries.len()) as u64);
    let cases: Vec<_> = request
        .at
        .iter()
        .flat_map(|at| itineraries.iter().map(move |itinerary| (at, itinerary)))
        .collect();
    let mut cases = parallel::map(cases, |(at, itinerary)| {
        let found = finder.orbits(itinerary, at);
        progress.advance(1);
        found
    });
    let far = far.filter(|_| request.far);
    if let (Some(free), None) = (far, &request.loci) {
        let part = Part::new(progress, Piece::Wide as usize);
        let wide = parallel::try_map(request.at.iter().enumerate(), |(number, at)| {
            finder.wide_orbits(itineraries, (free, at), &Part::new(&part, number))
        })?;
        for (known, found) in cases.iter_mut().zip(wide.concat()) {
            add_new(known, found, phase_circle(scene, orbit));
        }
    }
    let (orbits, lost) = parted(cases.concat());
    let loci = request.loci.as_ref();
    let loci =
        loci.map(|loci| finder.loci(itineraries, loci, [request.direct, request.far], progress));
    let loci = loci.transpose()?;
    let reach = far.map(|free| DirectReach { parameter: free, range: finder.range(free, true) });
    Ok(Orbits { orbits, loci, lost, reach, unfinished: finder.unfinished.listed() })
}

/// The parts of a search whose pieces are kept.
#[derive(Clone, Copy)]
enum Piece {
    /// Orbits that direct simulation has by itself, by the values asked for.
    Wide,
    /// Folds and flips next to the graze, by the steps.
    Near,
    /// The same far from it.
    Far,
}

/// The first active parameter that is adjusted so that the orbit grazes; the first of all where
/// none is.
fn first_adjusted(scene: &Scene) -> Option<usize> {
    let active = &scene.expansion.active;
    let adjusted = active.iter().position(|place| scene.grazing.solve_for.contains(place));
    adjusted.or((!active.is_empty()).then_some(0))
}

/// Adds orbits that are not among those known.
fn add_new(known: &mut Vec<Outcome>, found: Vec<FoundOrbit>, circle: PhaseCircle) {
    for orbit in found {
        if !known.iter().flatten().any(|other| other.is_same_as(&orbit, circle)) {
            known.push(Ok(orbit));
        }
    }
}

/// The same for folds and flips: where a branch goes on in other section points, both have one.
fn add_special(
    known: &mut Vec<(BifurcationKind, FoundOrbit)>,
    found: impl Iterator<Item = (BifurcationKind, FoundOrbit)>,
    circle: PhaseCircle,
) {
    for (kind, orbit) in found {
        let same = |(other, known): &(BifurcationKind, FoundOrbit)| {
            (*other, &known.itinerary) == (kind, &orbit.itinerary)
                && known.is_same_as(&orbit, circle)
        };
        if !known.iter().any(same) {
            known.push((kind, orbit));
        }
    }
}

/// An orbit, or what became of it.
type Outcome = Result<FoundOrbit, LostOrbit>;

/// What finds orbits: the map, and direct simulation where that is asked.
struct Finder<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    /// The search in the map; `None` where its contacts are not expanded.
    by_map: Option<(ItinerarySearch<'a>, ByMap<'a>)>,
    /// Where the map's orbits are looked for by direct simulation.
    direct: Option<Direct<'a>>,
    unfinished: Unfinished,
}

impl Finder<'_> {
    fn orbits(&self, itinerary: &ContactItinerary, at: &[f64]) -> Vec<Outcome> {
        let Some((search, by_map)) = &self.by_map else {
            return Vec::new();
        };
        let found = search.orbits(itinerary, at);
        let mut direct = self.direct.clone();
        let outcome = |orbit: &ItineraryOrbit<Dd>| match &mut direct {
            Some(_) if !orbit.is_physical() => None,
            Some(direct) => Some(direct.orbit(itinerary, orbit).map_err(|reason| LostOrbit {
                itinerary: itinerary.clone(),
                parameters: at.to_vec(),
                reason,
            })),
            None => by_map.found(itinerary, orbit).map(Ok),
        };
        found.iter().filter_map(outcome).collect()
    }

    /// The offsets of a parameter up to which branches are followed, near the graze or far from it.
    fn range(&self, parameter: usize, far: bool) -> [f64; 2] {
        if !far {
            let width = finite_or_one(self.map.window.parameter[parameter]);
            return [-WINDOWS, WINDOWS].map(|share| share * width);
        }
        let active = self.scene.expansion.active[parameter];
        let value = self.orbit.parameters()[active].to_f64();
        SIZES.map(|share| if value == 0.0 { share } else { share * value })
    }

    /// The branches of itineraries in one parameter, the others held.
    fn branches(
        &self,
        itineraries: &[ContactItinerary],
        (along, at): (usize, &[f64]),
        [direct, far]: [bool; 2],
    ) -> BranchRequest {
        let periods = itineraries.iter().map(ContactItinerary::period);
        BranchRequest {
            itineraries: itineraries.to_vec(),
            longest: periods.max().unwrap_or(1),
            along,
            range: self.range(along, far),
            at: at.to_vec(),
            direct,
            starts: Vec::new(),
        }
    }

    /// The orbits of each itinerary that direct simulation has by itself at these parameters.
    fn wide_orbits(
        &self,
        itineraries: &[ContactItinerary],
        (free, at): (usize, &[f64]),
        progress: &dyn Progress,
    ) -> Result<Vec<Vec<FoundOrbit>>, AnalysisError> {
        let request = self.branches(itineraries, (free, at), [true; 2]);
        let asked = (&request, Extent::to(Follow::Asked));
        let (scene, orbit, map) = (self.scene, self.orbit, self.map);
        let (found, unfinished) =
            branches::direct_orbits(scene, orbit, map, asked, at[free], progress)?;
        self.unfinished.extend(&unfinished);
        let of = |itinerary: &ContactItinerary| {
            let found = found.iter().filter(|orbit| orbit.itinerary == *itinerary);
            found.cloned().collect()
        };
        Ok(itineraries.iter().map(of).collect())
    }

    /// The folds and flips on branches in one parameter.
    fn bifurcations(
        &self,
        itineraries: &[ContactItinerary],
        place: (usize, &[f64]),
        direct_and_far: [bool; 2],
        progress: &dyn Progress,
    ) -> Result<Vec<(BifurcationKind, FoundOrbit)>, AnalysisError> {
        let asked = self.branches(itineraries, place, direct_and_far);
        let (scene, orbit, map) = (self.scene, self.orbit, self.map);
        let extent = Extent::to(Follow::Asked);
        let found = branches::followed(scene, orbit, map, &asked, extent, progress)?;
        self.unfinished.extend(&found.unfinished);
        let points = found.branches.into_iter().flat_map(|branch| branch.points);
        let special = points.filter_map(|point| {
            let kind = match point.special?.label {
                BranchLabel::SaddleNode => BifurcationKind::Fold,
                BranchLabel::PeriodDoubling => BifurcationKind::Flip,
                _ => return None,
            };
            let physical = point.orbit.physical && point.orbit.extra_contacts == 0;
            physical.then_some((kind, point.orbit))
        });
        let mut found: Vec<(BifurcationKind, FoundOrbit)> = Vec::new();
        add_special(&mut found, special, phase_circle(scene, orbit));
        Ok(found)
    }

    /// Folds and flips of all itineraries, one locus a kind and itinerary.
    fn loci(
        &self,
        itineraries: &[ContactItinerary],
        request: &LociRequest,
        [direct, far]: [bool; 2],
        progress: &dyn Progress,
    ) -> Result<Vec<Locus>, AnalysisError> {
        let steps = steps(request);
        progress.expect(steps.len() as u64);
        let [near, beyond] =
            [Piece::Near, Piece::Far].map(|piece| Part::new(progress, piece as usize));
        let at_step = parallel::try_map(steps.iter().enumerate(), |(number, at)| {
            let place = (request.free, &at[..]);
            let part = Part::new(&near, number);
            let mut special = self.bifurcations(itineraries, place, [direct, false], &part)?;
            if direct && far {
                let part = Part::new(&beyond, number);
                let more = self.bifurcations(itineraries, place, [true; 2], &part)?;
                let circle = phase_circle(self.scene, self.orbit);
                add_special(&mut special, more.into_iter(), circle);
            }
            progress.advance(1);
            Ok::<_, AnalysisError>(special)
        })?;
        let mut loci = Vec::new();
        for itinerary in itineraries {
            for &kind in &request.kinds {
                let mut points = Vec::new();
                for special in &at_step {
                    let mine = special
                        .iter()
                        .filter(|(other, orbit)| *other == kind && orbit.itinerary == *itinerary);
                    let mut mine: Vec<_> = mine.map(|(_, orbit)| orbit.clone()).collect();
                    let speed = |orbit: &FoundOrbit| orbit.contacts.first().map(|c| c.speed);
                    let compare = |a: &FoundOrbit, b: &FoundOrbit| speed(a).partial_cmp(&speed(b));
                    mine.sort_by(|a, b| compare(a, b).unwrap_or(std::cmp::Ordering::Equal));
                    points.extend(mine);
                }
                if !points.is_empty() {
                    loci.push(Locus { kind, itinerary: itinerary.clone(), points });
                }
            }
        }
        Ok(loci)
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

/// Direct simulation in double-double, with what places its orbits in the window of a map.
#[derive(Clone, Debug)]
pub(super) struct Direct<'a> {
    image: DirectImage<'a, Dd>,
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
        let problem = PeriodicProblem {
            returns: itinerary.period(),
            free: 0,
            itinerary: Some(itinerary.returns().to_vec()),
            scales: self.scales.clone(),
        };
        let guess = near.orbit.guess();
        let guess =
            Guess { state: converted(&guess.state), parameters: converted(&guess.parameters) };
        match periodic_orbit(&mut self.image, &problem, Held::Parameter, &guess) {
            PeriodicOutcome::Found(orbit) => self.found(itinerary, &orbit),
            PeriodicOutcome::OtherItinerary(orbit) => {
                let passages = itinerary.passages();
                let other = ContactItinerary::new(passages, orbit.itinerary);
                Err(LostReason::OtherItinerary(other))
            }
            _ => Err(LostReason::NotConverged),
        }
    }

    /// The orbit with its speeds, flown once more.
    fn found(
        &mut self,
        itinerary: &ContactItinerary,
        orbit: &PeriodicOrbit<Dd>,
    ) -> Result<FoundOrbit, LostReason> {
        let (mut contacts, mut inside) = (Vec::new(), true);
        let parameters: Vec<f64> = converted(&orbit.parameters);
        for (number, state) in orbit.states.iter().enumerate() {
            let image = self.image.image(state, &orbit.parameters);
            let image = image.map_err(|_| LostReason::NotConverged)?;
            let speeds = image.passages.iter().enumerate();
            contacts.extend(speeds.filter_map(|(passage, speed)| {
                Some(OrbitContact { number, passage, speed: (*speed)?.to_f64() })
            }));
            let state: Vec<f64> = converted(state);
            let depths = self.depths.at(&state, &parameters);
            inside &= self.window.holds(&state, &parameters, &depths);
        }
        let kind = (orbit.extra_contacts == 0, inside);
        FoundOrbit::of(itinerary, orbit, contacts, kind).ok_or(LostReason::NotConverged)
    }
}
