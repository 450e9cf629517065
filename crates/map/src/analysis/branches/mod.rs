//! Branches of periodic orbits in one parameter, through folds, flips and grazes.
//!
//! One idea: an itinerary's orbits are solved for, so a branch needs no stable orbit to begin with.
//! With the depth variables as unknowns the graze of an orbit is a regular point of its branch;
//! beyond it the orbit is virtual, and the physical continuation is the branch of the itinerary
//! with that contact more or less. Both pass through the same point.

mod by_direct;
mod by_map;
mod data;
mod normal_form;
mod observables;
mod trace;

pub use data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
pub use observables::{BranchDiagram, BranchObservable, branch_diagram, observed};
pub(super) use trace::Follow;

use by_direct::{DirectBranches, GrazeStart};
use by_map::MapBranches;
use trace::Oracle;

use crate::analysis::error::AnalysisError;
use crate::analysis::periodic::FoundOrbit;
use crate::analysis::progress::{NoProgress, Progress, Shard};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// The branches of the itineraries asked for, and of those that they change to where their orbits
/// graze or double.
///
/// Special points are solved for in double-double. A branch is given out if a part of it is
/// physical; virtual stretches are parts of it. No result depends on the number of cores.
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
    followed(scene, orbit, map, request, Follow::All, progress)
}

/// A share of the pieces of [`branches`]: the branches of some of the itineraries asked for. Those
/// that they lead to are left to what joins the shares; what seeds them is found by every share.
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
            let of = DirectBranches::new(&system, scene, orbit, map, (&request, None), shard)?;
            of.find_share(shard);
        }
        false => MapBranches::new(scene, orbit, map, &request, shard)?.find_share(shard),
    }
    Ok(())
}

/// The branches of the itineraries asked for, and others that they lead to if so.
pub(super) fn followed(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    follow: Follow,
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let request = request.listed();
    if request.direct {
        return branches_from(scene, orbit, map, &request, (follow, None), progress);
    }
    Ok(MapBranches::new(scene, orbit, map, &request, progress)?.physical(follow))
}

/// The branches of direct simulation, the graze given at which they may begin.
pub(super) fn branches_from(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    (follow, graze): (Follow, Option<GrazeStart>),
    progress: &dyn Progress,
) -> Result<Branches, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let of = DirectBranches::new(&system, scene, orbit, map, (request, graze), progress)?;
    Ok(of.given_out(follow))
}

/// The orbits of direct simulation where the branches of the itineraries asked for pass a value of
/// the parameter that varies, solved for in double-double.
pub(super) fn direct_orbits(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    value: f64,
) -> Result<Vec<FoundOrbit>, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let of = DirectBranches::new(&system, scene, orbit, map, (request, None), &NoProgress)?;
    Ok(of.orbits(value))
}
