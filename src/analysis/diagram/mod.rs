//! Bifurcation diagrams: what a map settles on, parameter by parameter, the last state carried
//! along.
//!
//! One idea: a sweep knows a map only as a [`SweptMap`], so that the local map, direct simulation
//! and a map written by hand are swept, observed and timed by the same code.

mod course;
mod data;
mod observe;
mod sweep;
mod swept_map;

pub use data::{Diagram, DiagramPoint, Sweep, SweepHeading, Timing};
pub use observe::Observer;
pub use sweep::SweepRequest;
pub(super) use sweep::{kept_contacts, made, name, offsets, outside};
pub use swept_map::{
    DirectSweep, FrozenSweep, Settled, SmoothFixedPoint, Start, SweptMap, UnobservedSweep,
};

use std::cell::OnceCell;

use rayon::prelude::*;

use crate::analysis::direct_map::DirectMap;
use crate::analysis::error::AnalysisError;
use crate::analysis::progress::Progress;
use crate::analysis::section_frame::itinerary;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{HornerMap, OrbitRequest};
use crate::model::{DiagramRequest, Method, Scene, SweepDirection};
use crate::orbit::GrazingOrbit;
use course::sweep;
use observe::label;

/// A diagram with its maps and requests worked out, ready to run.
pub struct DiagramPlan<'a> {
    /// One map per method.
    pub maps: Vec<Box<dyn SweptMap + 'a>>,
    /// Directions of the sweeps.
    pub direction: SweepDirection,
    /// What every sweep does.
    pub request: SweepRequest,
}

/// The bifurcation diagram that a scene asks for.
///
/// Every sweep starts at the fixed point of `P_smooth` at its first parameter value and carries its
/// last state from value to value; after an escape it starts again at the fixed point. Sweeps (one
/// per method and heading) run side by side, and so do segments of each, whose starts are
/// corrected: no result depends on the number of cores.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if the swept parameter is no variable of the map;
/// [`AnalysisError::Hybrid`] if the simulator refuses the model; [`AnalysisError::Expansion`] if
/// the impact speed is drawn and cannot be expanded.
pub fn diagram(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &DiagramRequest,
    progress: &dyn Progress,
) -> Result<Diagram, AnalysisError> {
    let parameter = &scene.model.parameters[request.parameter].name;
    let position = map.parameters.iter().position(|active| active.name == *parameter);
    let position =
        position.ok_or_else(|| AnalysisError::NotActive { parameter: parameter.clone() })?;
    let system = OnceCell::new();
    let itinerary = itinerary(scene, orbit);
    let observer = || Observer::new(scene, orbit, map, &request.observe);
    let swept = |method: &Method| -> Result<Box<dyn SweptMap + '_>, AnalysisError> {
        let start = || SmoothFixedPoint::new(map);
        Ok(match method {
            Method::Map => {
                let others = || (start(), observer());
                let (map, (start, observer)) = rayon::join(|| HornerMap::new(map), others);
                Box::new(FrozenSweep {
                    map,
                    start,
                    observer: observer?,
                    itinerary: itinerary.clone(),
                })
            }
            Method::Direct => Box::new(DirectSweep {
                map: DirectMap::new(
                    system.get_or_init(|| HybridSystem::new(&scene.model)),
                    scene,
                    orbit,
                )?,
                start: start(),
                observer: observer()?,
                itinerary: itinerary.clone(),
            }),
        })
    };
    let plan = DiagramPlan {
        maps: request.with.iter().map(swept).collect::<Result<_, _>>()?,
        direction: request.direction,
        request: SweepRequest {
            parameter: position,
            range: request.range,
            points: request.points,
            orbit: OrbitRequest::new(request.transient, request.keep, &map.window.state),
            window: map.window.clone(),
        },
    };
    let sweeps = run_plan(&plan, progress);
    Ok(Diagram {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        parameter: parameter.clone(),
        grazing_value: orbit.parameters()[request.parameter].to_f64(),
        observable: label(&request.observe).to_owned(),
        surfaces: itinerary.surfaces.clone(),
        transient: request.transient,
        keep: request.keep,
        speed_ratio: speed_ratio(&sweeps),
        sweeps,
    })
}

/// Runs all sweeps of a plan: one per map and heading, maps in order, up before down.
pub fn run_plan(plan: &DiagramPlan<'_>, progress: &dyn Progress) -> Vec<Sweep> {
    let headings: &[SweepHeading] = match plan.direction {
        SweepDirection::Up => &[SweepHeading::Up],
        SweepDirection::Down => &[SweepHeading::Down],
        SweepDirection::Both => &[SweepHeading::Up, SweepHeading::Down],
    };
    let tasks: Vec<_> = plan
        .maps
        .iter()
        .flat_map(|map| headings.iter().map(move |&heading| (map, heading)))
        .collect();
    progress.expect((tasks.len() * plan.request.points) as u64);
    tasks
        .into_par_iter()
        .map(|(map, heading)| sweep(&**map, &plan.request, heading, progress))
        .collect()
}

/// Time of an iterate by direct simulation over that by the map.
fn speed_ratio(sweeps: &[Sweep]) -> Option<f64> {
    let mean = |method: Method| {
        let times: Vec<_> = sweeps
            .iter()
            .filter(|sweep| sweep.method == method && sweep.timing.iterates > 0)
            .map(|sweep| sweep.timing)
            .collect();
        let iterates: u64 = times.iter().map(|timing| timing.iterates).sum();
        let seconds: f64 = times.iter().map(|timing| timing.seconds).sum();
        (iterates > 0).then(|| seconds / iterates as f64)
    };
    Some(mean(Method::Direct)? / mean(Method::Map)?)
}
