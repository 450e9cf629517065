//! The whole search, on all cores.

use rayon::prelude::*;

use super::by_map::ByMap;
use super::data::{FoundOrbit, LociRequest, Locus, LostOrbit, Orbits, OrbitsRequest};
use super::direct::Direct;
use crate::analysis::periodic::{
    BifurcationKind, ContactItinerary, ItineraryBifurcation, ItineraryOrbit, ItinerarySearch,
};
use crate::analysis::{AnalysisError, Progress};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::GrazingOrbit;

/// The periodic orbits of the itineraries asked for, and their folds and flips.
///
/// Looked for in the map ([`ItinerarySearch`]), physical and virtual ones. With
/// [`OrbitsRequest::direct`] every physical one is solved for again by direct simulation in
/// double-double from there, and that orbit given; what has none is lost, and said.
/// No result depends on the number of cores.
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
    let finder = Finder {
        search: ItinerarySearch::new(map),
        by_map: ByMap::new(scene, orbit, map)?,
        direct: match request.direct {
            true => Some(Direct::new(&system, scene, orbit, map)?),
            false => None,
        },
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
    let (orbits, mut lost) = parted(cases.collect::<Vec<_>>().concat());
    let loci = request.loci.as_ref().map(|loci| {
        let (found, missing) = finder.loci(itineraries, loci, progress);
        lost.extend(missing);
        found
    });
    Ok(Orbits { orbits, loci, lost })
}

/// An orbit, or what became of it.
type Outcome = Result<FoundOrbit, LostOrbit>;

/// What finds orbits: the map, and direct simulation where that is asked.
struct Finder<'a> {
    search: ItinerarySearch<'a>,
    by_map: ByMap<'a>,
    direct: Option<Direct<'a>>,
}

impl Finder<'_> {
    fn orbits(&self, itinerary: &ContactItinerary, at: &[f64]) -> Vec<Outcome> {
        let found = self.search.orbits(itinerary, at);
        let mut direct = self.direct.clone();
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

    /// Folds and flips of all itineraries, one locus a kind and itinerary.
    fn loci(
        &self,
        itineraries: &[ContactItinerary],
        request: &LociRequest,
        progress: &dyn Progress,
    ) -> (Vec<Locus>, Vec<LostOrbit>) {
        let steps = steps(request);
        progress.expect((steps.len() * itineraries.len()) as u64);
        let (mut loci, mut lost) = (Vec::new(), Vec::new());
        for itinerary in itineraries {
            let at_step = steps.par_iter().map(|at| {
                let found = self.bifurcations(itinerary, request, at);
                progress.advance(1);
                found
            });
            let found = at_step.collect::<Vec<_>>().concat();
            for &kind in &request.kinds {
                let of_kind = found.iter().filter(|(other, _)| *other == kind);
                let outcomes = of_kind.map(|(_, outcome)| outcome.clone()).collect();
                let (points, missing) = parted(outcomes);
                lost.extend(missing);
                if !points.is_empty() {
                    loci.push(Locus {
                        kind,
                        itinerary: itinerary.clone(),
                        points,
                    });
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
        let mut direct = self.direct.clone();
        let outcome = |near: &ItineraryBifurcation| {
            let outcome = match &mut direct {
                Some(direct) => {
                    direct
                        .bifurcation(itinerary, near, free)
                        .map_err(|reason| LostOrbit {
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
