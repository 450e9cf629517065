//! Branches of periodic orbits in one parameter, through folds, flips and grazes.
//!
//! One idea: the orbits of an itinerary are solved for, so a branch needs no stable orbit to start
//! from. With depth variables as unknowns, the graze of an orbit is a regular point of its branch.
//! Beyond it the orbit is virtual; the physical continuation is the branch of the itinerary with
//! one contact more or less. Both branches pass through the graze.

mod by_direct;
mod by_map;
mod data;
mod graze_guess;
mod normal_form;
mod observables;
mod trace;

pub use data::{
    AttractorBranch, Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special,
};
pub use graze_guess::{BranchGraze, BriefHit, GrazeGuess, graze_guess};
pub use observables::{BranchDiagram, BranchObservable, branch_diagram, observed};
pub(super) use trace::{Extent, Follow};

use by_direct::DirectBranches;
use by_map::MapBranches;
use trace::BranchSource;

use crate::analysis::error::AnalysisError;
use crate::analysis::periodic::{ContactItinerary, FoundOrbit};
use crate::analysis::progress::{Progress, Shard};
use crate::analysis::work::MOST_WORK;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// Most work for the branch through an attractor, in products of series.
const ATTRACTOR_WORK: u64 = MOST_WORK / 8;

/// Computes the branches of the itineraries asked for, and of the itineraries that these change to
/// at grazes and period-doublings.
///
/// Special points are solved for in double-double. Branches are returned if a part of them is
/// physical, with their virtual parts. Results do not depend on the number of cores.
///
/// # Errors
///
/// [`AnalysisError::Expansion`] if an impact speed cannot be expanded.
pub fn branches(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    followed(scene, orbit, map, request, Extent::to(Follow::All), progress)
}

/// Computes a share of [`branches`]: the branches of some of the itineraries asked for. Every share
/// computes the seeds; the branches that others lead to are left to the joining run.
///
/// # Errors
///
/// As [`branches`].
pub fn branches_share(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    shard: &Shard<'_>,
) -> Result<(), AnalysisError> {
    let request = request.listed();
    match request.direct {
        true => {
            let system = HybridSystem::new(&scene.model);
            let asked = (&request, Extent::to(Follow::All));
            DirectBranches::new(&system, scene, orbit, map, asked, shard)?.find_share(shard);
        }
        false => MapBranches::new(scene, orbit, map, &request, shard)?.find_share(shard),
    }
    Ok(())
}

/// Branch through the orbit of direct simulation on which a flight from a section point settles at
/// the offsets `request.at`, that of the varied parameter included; itineraries and starts of the
/// request are not used.
///
/// `None` if the flight settles on no orbit of up to `request.longest` returns, or if that orbit is
/// not solved for. A branch that takes more than an eighth of [`MOST_WORK`] is cut short. Progress
/// is told of the flights, of the work along the branch, and of the points that are described.
///
/// # Errors
///
/// [`AnalysisError::Length`] for a wrong number of offsets.
pub fn attractor_branch(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    start: &[f64],
    progress: &dyn Progress,
) -> Result<Option<AttractorBranch>, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let extent = Extent { most_work: ATTRACTOR_WORK, ..Extent::to(Follow::Asked) };
    let asked = (request, extent);
    let of = DirectBranches::new(&system, scene, orbit, map, asked, progress)?;
    Ok(of.through_attractor(start))
}

/// Branches of the itineraries asked for, within an extent.
pub(super) fn followed(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    extent: Extent,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let request = &request.listed();
    if !request.direct {
        let of = MapBranches::new(scene, orbit, map, request, progress)?;
        return Ok(of.physical(extent.follow));
    }
    let system = HybridSystem::new(&scene.model);
    let of = DirectBranches::new(&system, scene, orbit, map, (request, extent), progress)?;
    Ok(of.given_out())
}

/// Orbits of direct simulation at a value of the varied parameter, on branches of the itineraries
/// asked for, solved for in double-double; and the itineraries that were not followed completely.
pub(super) fn direct_orbits(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    (request, extent): (&BranchRequest, Extent),
    value: f64,
    progress: &dyn Progress,
) -> Result<(Vec<FoundOrbit>, Vec<ContactItinerary>), AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let of = DirectBranches::new(&system, scene, orbit, map, (request, extent), progress)?;
    Ok(of.orbits(value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::direct_image::DirectImage;
    use crate::analysis::progress::NoProgress;
    use crate::expansion::{Expander, MapOrders};
    use crate::orbit::locate;

    #[test]
    fn a_search_whose_work_is_done_ends_with_what_it_has_and_names_what_is_unfinished() {
        let scene = Scene::of_catalogue("linear").expect("a valid scene");
        let orbit = locate(&scene).expect("a search").into_result().expect("a graze");
        let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
        let map = Expander::new(&scene, &orbit).expect("series").expand(orders).expect("a map");
        let request = BranchRequest {
            itineraries: vec![ContactItinerary::parse("1", 1).expect("digits")],
            longest: 1,
            along: 0,
            range: [-0.1, 0.1],
            at: vec![0.0, 0.0],
            direct: true,
            starts: Vec::new(),
        };
        let found = |most_work: u64| {
            let extent = Extent { most_work, ..Extent::to(Follow::Asked) };
            followed(&scene, &orbit, &map, &request, extent, &NoProgress).expect("branches")
        };
        let cut = |branch: &Branch| branch.ends.contains(&BranchEnd::WorkLimit);
        let all = found(MOST_WORK);
        assert!(all.unfinished.is_empty() && !all.branches.iter().any(cut), "{:?}", all.branches);
        // The smallest power of two that gives a branch.
        let mut some = (10..26).map(|power| found(1 << power));
        let some = some.find(|some| !some.branches.is_empty()).expect("a branch");
        assert_eq!(some.unfinished, request.itineraries);
        assert!(some.branches.iter().any(cut), "{:?}", some.branches);
        let points = |found: &Branches| {
            let points = found.branches.iter().map(|branch| branch.points.len());
            points.sum::<usize>()
        };
        assert!(points(&some) < points(&all));
        // The results are orbits: fixed points of the simulated return.
        let system = HybridSystem::new(&scene.model);
        let mut image = DirectImage::<f64>::new(&system, &scene, &orbit).expect("parameters");
        for FoundOrbit { states, parameters, .. } in
            some.branches.iter().flat_map(|branch| &branch.points).map(|point| &point.orbit)
        {
            let back = image.image(&states[0], parameters).expect("offsets").offsets;
            let apart = back.iter().zip(&states[0]).map(|(a, b)| (a - b).abs());
            // At a graze the image is accurate to the root of rounding.
            assert!(apart.fold(0.0, f64::max) < 1e-7, "{states:?} {back:?}");
        }
    }
}
