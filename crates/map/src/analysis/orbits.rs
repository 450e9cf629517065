//! Periodic orbits by itinerary, and their folds and flips in two parameters: request, search and
//! results.
//!
//! One idea: with prescribed contacts a local map is a polynomial, so orbits are searched in the
//! map. The contacts of direct simulation cannot be prescribed: it is solved for the orbit next to
//! each one found. Folds and flips are points of branches; branches of direct simulation extend
//! beyond the map.

use serde::{Deserialize, Serialize};

use super::branches::{self, BranchLabel, BranchRequest, Extent, Follow};
use super::direct_image::DirectImage;
use super::error::AnalysisError;
use super::evaluation::{DepthEvaluation, MapEvaluation};
use super::periodic::{
    ByMap, ContactItinerary, Guess, Held, ItineraryOrbit, ItinerarySearch, PeriodicOrbit,
    PeriodicOutcome, PeriodicProblem, finite_or_one, periodic_orbit, window_scales,
};
use super::progress::{Progress, SubProgress};
use super::section_frame::phase_circle;
use super::work::Unfinished;
use crate::expansion::{LocalMap, MapWindow};
use crate::hybrid::HybridSystem;
use crate::iteration::{PhaseCircle, parallel};
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};
use crate::orbit::GrazingOrbit;

pub use crate::analysis::periodic::{FoundOrbit, OrbitContact};

/// Request of [`orbits`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitsRequest {
    /// Itineraries to look for.
    pub itineraries: Vec<ContactItinerary>,
    /// Parameters at which orbits are looked for: each an offset per active parameter.
    pub at: Vec<Vec<f64>>,
    /// Whether each orbit of the map is replaced by the orbit of direct simulation next to it.
    pub direct: bool,
    /// Whether direct simulation is also searched by itself, far beyond the map ([`DirectReach`]).
    #[serde(default)]
    pub far: bool,
    /// Folds and flips, where asked for.
    pub loci: Option<BifurcationRequest>,
}

/// Request for folds and flips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BifurcationRequest {
    /// Kinds to look for.
    pub kinds: Vec<BifurcationKind>,
    /// Index of the active parameter that is solved for.
    pub free: usize,
    /// Parameter that is stepped through; `None` for a single value of all others.
    pub stepped: Option<SteppedParameter>,
    /// Offsets of all active parameters; those of the free and the stepped parameter are ignored.
    pub at: Vec<f64>,
}

/// A parameter that takes one value after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteppedParameter {
    /// Index among the active parameters.
    pub parameter: usize,
    /// Offsets of the parameter, in order.
    pub values: Vec<f64>,
}

/// Change of stability of a periodic orbit, of codimension one.
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

    /// Value of the critical multiplier.
    pub fn multiplier(self) -> f64 {
        match self {
            Self::Fold => 1.0,
            Self::Flip => -1.0,
        }
    }
}

/// Orbits of one itinerary at one kind of bifurcation, for successive values of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BifurcationLocus {
    /// Kind: fold or flip.
    pub kind: BifurcationKind,
    /// The itinerary.
    pub itinerary: ContactItinerary,
    /// Orbits at the bifurcation, in the order of the steps.
    pub points: Vec<FoundOrbit>,
}

/// An orbit of the map without a counterpart in direct simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostOrbit {
    /// Itinerary of the orbit.
    pub itinerary: ContactItinerary,
    /// Parameter offsets.
    pub parameters: Vec<f64>,
    /// Reason.
    pub reason: LostReason,
}

/// Reason why direct simulation has no orbit next to one of the map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostReason {
    /// The orbit found there makes other contacts.
    OtherItinerary(ContactItinerary),
    /// Newton's method did not converge.
    NotConverged,
}

/// Result of [`orbits`].
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Orbits {
    /// Orbits, ordered by parameters, then by the itineraries asked for.
    pub orbits: Vec<FoundOrbit>,
    /// Folds and flips; `None` if not asked for.
    pub loci: Option<Vec<BifurcationLocus>>,
    /// Orbits of the map without a counterpart in direct simulation.
    pub lost: Vec<LostOrbit>,
    /// Range of the search by direct simulation alone; `None` if there was none.
    #[serde(default)]
    pub reach: Option<DirectReach>,
    /// Itineraries whose branches direct simulation did not all follow within its bound on work
    /// ([`MOST_WORK`](super::MOST_WORK)).
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}

/// Range searched by direct simulation alone: along the branches, in one parameter, that begin at
/// the graze or at states that simulation settles on or nearly repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectReach {
    /// Index of the parameter among the active ones.
    pub parameter: usize,
    /// Offsets up to which branches are followed.
    pub range: [f64; 2],
}

/// Half-widths of the window up to which branches of the map are followed.
const WINDOWS: f64 = 10.0;
/// Offsets up to which branches of direct simulation are followed, relative to the parameter's
/// value (absolute if that is 0).
const SIZES: [f64; 2] = [-0.99, 100.0];

/// Periodic orbits of the itineraries asked for, and their folds and flips.
///
/// Physical and virtual orbits of the map are searched ([`ItinerarySearch`]) if its contacts are
/// [expanded](LocalMap::has_contacts). With [`OrbitsRequest::direct`] every physical one is a start
/// of Newton's method in direct simulation in double-double; the orbit found there is returned, and
/// orbits without one are listed as lost. With [`OrbitsRequest::far`] branches of direct simulation
/// are followed in one parameter, and their orbits at its given value are added. Folds and flips
/// are special points of branches, of the map or of direct simulation alone. Results do not depend
/// on the number of cores.
///
/// # Errors
///
/// [`AnalysisError::Expansion`] if an impact speed cannot be expanded, [`AnalysisError::Hybrid`] if
/// the simulator refuses the parameters.
///
/// # Panics
///
/// If the number of offsets is not that of the map's parameters, or there are none.
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
    if let Some(free) = far {
        let part = SubProgress::new(progress, SearchPart::Wide as usize);
        let wide = parallel::try_map(request.at.iter().enumerate(), |(number, at)| {
            finder.wide_orbits(itineraries, (free, at), &SubProgress::new(&part, number))
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

/// Parts of a search whose pieces are kept.
#[derive(Clone, Copy)]
enum SearchPart {
    /// Orbits found by direct simulation alone, by the values asked for.
    Wide,
    /// Folds and flips near the graze, by the steps.
    Near,
    /// Folds and flips far from the graze, by the steps.
    Far,
}

/// First active parameter that is adjusted to make the orbit graze; the first active one if none
/// is; `None` without active parameters.
fn first_adjusted(scene: &Scene) -> Option<usize> {
    let active = &scene.expansion.active;
    let adjusted = active.iter().position(|place| scene.grazing.solve_for.contains(place));
    adjusted.or((!active.is_empty()).then_some(0))
}

/// Adds orbits that are not known yet.
fn add_new(known: &mut Vec<Outcome>, found: Vec<FoundOrbit>, circle: PhaseCircle) {
    for orbit in found {
        if !known.iter().flatten().any(|other| other.is_same_as(&orbit, circle)) {
            known.push(Ok(orbit));
        }
    }
}

/// Adds folds and flips that are not known yet: where a branch changes its section points, both
/// parts have the same one.
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

/// An orbit, or the reason why direct simulation has none.
type Outcome = Result<FoundOrbit, LostOrbit>;

/// Searches orbits in the map, and by direct simulation if that is asked for.
struct Finder<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    /// Search in the map; `None` if its contacts are not expanded.
    by_map: Option<(ItinerarySearch<'a>, ByMap<'a>)>,
    /// Solver for the orbits of direct simulation; `None` if not asked for.
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

    /// Offsets of a parameter up to which branches are followed, near the graze or far from it.
    fn range(&self, parameter: usize, far: bool) -> [f64; 2] {
        if !far {
            let width = finite_or_one(self.map.window.parameter[parameter]);
            return [-WINDOWS, WINDOWS].map(|share| share * width);
        }
        let active = self.scene.expansion.active[parameter];
        let value = self.orbit.parameters()[active].to_f64();
        SIZES.map(|share| if value == 0.0 { share } else { share * value })
    }

    /// Request for the branches of itineraries in one parameter, the others fixed.
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

    /// Orbits that direct simulation alone finds at these parameters, for each itinerary.
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

    /// Folds and flips on branches in one parameter.
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

    /// Folds and flips of all itineraries, one locus for each kind and itinerary.
    fn loci(
        &self,
        itineraries: &[ContactItinerary],
        request: &BifurcationRequest,
        [direct, far]: [bool; 2],
        progress: &dyn Progress,
    ) -> Result<Vec<BifurcationLocus>, AnalysisError> {
        let steps = steps(request);
        progress.expect(steps.len() as u64);
        let [near, beyond] = [SearchPart::Near, SearchPart::Far]
            .map(|piece| SubProgress::new(progress, piece as usize));
        let at_step = parallel::try_map(steps.iter().enumerate(), |(number, at)| {
            let place = (request.free, &at[..]);
            let part = SubProgress::new(&near, number);
            let mut special = self.bifurcations(itineraries, place, [direct, false], &part)?;
            if direct && far {
                let part = SubProgress::new(&beyond, number);
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
                    loci.push(BifurcationLocus { kind, itinerary: itinerary.clone(), points });
                }
            }
        }
        Ok(loci)
    }
}

/// Parameters of every step.
fn steps(request: &BifurcationRequest) -> Vec<Vec<f64>> {
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

/// Separates the orbits found from the lost ones.
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

/// Direct simulation in double-double, with the window of a map.
#[derive(Clone, Debug)]
pub(super) struct Direct<'a> {
    image: DirectImage<'a, Dd>,
    window: &'a MapWindow,
    depths: DepthEvaluation<f64>,
    scales: Vec<f64>,
}

impl<'a> Direct<'a> {
    /// Direct simulation of a scene about its grazing orbit.
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

    /// Orbit of direct simulation next to one of the map, at its parameters.
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

    /// The orbit with its impact speeds, from one more flight.
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
