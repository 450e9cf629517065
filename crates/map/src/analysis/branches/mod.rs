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

pub(super) use by_direct::branches_from;
pub use data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
pub use observables::{BranchDiagram, BranchObservable, branch_diagram, observed};
pub(super) use trace::Follow;

use crate::analysis::error::AnalysisError;
use crate::analysis::periodic::FoundOrbit;
use crate::analysis::progress::Progress;
use crate::analysis::progress::Shard;
use crate::expansion::LocalMap;
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
        true => by_direct::share(scene, orbit, map, &request, shard),
        false => by_map::share(scene, orbit, map, &request, shard),
    }
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
    match request.direct {
        true => by_direct::branches(scene, orbit, map, &request, follow, progress),
        false => by_map::branches(scene, orbit, map, &request, follow, progress),
    }
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
    by_direct::orbits(scene, orbit, map, request, value)
}
