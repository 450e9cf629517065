//! Loci in two parameters: saddle-nodes, flips, Neimark–Sacker points and grazes of periodic orbits
//! of any itinerary, with their points of codimension two; and crises.
//!
//! One idea: the orbits of an itinerary with one additional condition form a curve. The curve is
//! regular where it meets a graze, because the depth variables are among its unknowns. See
//! docs/mathematics/loci.md.

mod by_map;
mod connection;
mod crisis;
mod data;
mod direct;
mod direct_crisis;
mod equations;
mod tangency;
mod trace;

pub use data::{
    Loci, LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, PlaneCurve, PlanePoint, Tangency,
};
pub use equations::CodimensionTwo;

use crate::analysis::error::{AnalysisError, check_contacts};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::{Progress, SubProgress};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;
use by_map::MapLoci;
use crisis::MapCrises;
use direct::DirectLoci;
use direct_crisis::DirectCrises;

/// Range in half-widths of the window in which loci of the map are computed as starts for those of
/// direct simulation.
const NEAR: f64 = 2.0;

/// Computes the loci of a request.
///
/// With the map, all parts of every locus are followed, virtual ones too. With direct simulation,
/// in double-double, the physical parts are followed as far as the orbits make their contacts.
/// Their seeds are branches of direct simulation at some values of the first parameter, and the
/// map's loci if its contacts are [expanded](LocalMap::has_contacts). Grazes by direct simulation
/// are those of the tangency section's own passage. Tangencies are always the map's. Crises by
/// direct simulation are solved for at some points of the map's crises.
///
/// # Errors
///
/// [`AnalysisError::Hybrid`] if the simulator refuses the parameters, [`AnalysisError::NotPlanar`]
/// for crises on a section without exactly two coordinates, [`AnalysisError::NoContacts`] for
/// crises if the map's contacts are not expanded.
pub fn loci(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &LociRequest,
    progress: &dyn Progress,
) -> Result<Loci, AnalysisError> {
    let itineraries = ContactItinerary::listed(&request.itineraries);
    let request = &LociRequest { itineraries, ..request.clone() };
    let mut near = request.clone();
    if request.direct {
        // The map only provides starts for simulation, so it need not reach as far.
        let most = NEAR * map.window.parameter[request.plane[0]];
        near.range = request.range.map(|end| end.clamp(-most, most));
    }
    let mut found = Loci::default();
    if request.kinds.iter().any(|&kind| kind != LocusKind::Crisis) {
        let part = SubProgress::new(progress, 0);
        if map.has_contacts() {
            let by_map = MapLoci::new(map, &near, &part);
            let traces = by_map.all();
            found.loci = by_map.all_described(&traces);
            found.tangencies = by_map.tangencies(&traces);
            found.without_kick = by_map.without_kick(&traces);
            found.unfinished = by_map.unfinished();
        }
        if request.direct {
            let system = HybridSystem::new(&scene.model);
            let part = SubProgress::new(progress, 1);
            let direct = DirectLoci::new(&system, scene, orbit, map, (request, &part))?;
            let unfinished = std::mem::take(&mut found.unfinished);
            (found.loci, found.unfinished) = direct.all(&found.loci)?;
            found.unfinished.extend(unfinished);
            found.unfinished = ContactItinerary::listed(&found.unfinished);
        } else if !request.kinds.contains(&LocusKind::Graze) {
            found.loci.retain(|locus| locus.kind != LocusKind::Graze);
        }
    }
    if request.kinds.contains(&LocusKind::Crisis) {
        if map.dimension() != 2 {
            return Err(AnalysisError::NotPlanar { dimension: map.dimension() });
        }
        check_contacts(map)?;
        let crises = MapCrises::new(map, &near).all(&SubProgress::new(progress, 2));
        if request.direct {
            let system = HybridSystem::new(&scene.model);
            let direct = DirectCrises::new(&system, scene, orbit, map, request)?;
            found.loci.extend(direct.all(&crises, &SubProgress::new(progress, 3)));
        } else {
            found.loci.extend(crises.into_iter().map(|crisis| crisis.locus));
        }
    }
    Ok(found)
}
