//! Bifurcation diagrams: attractors of a map as a parameter varies, with the last state carried
//! from value to value; and attractors near the graze.
//!
//! One idea: a sweep uses a map only through [`SweptMap`], so that the local map, direct simulation
//! and a map written by hand are swept, observed and timed by the same code.

mod data;
mod device_sweep;
mod observe;
mod sweep;
mod sweep_run;
mod swept_map;

use serde::Serialize;

use super::error::{AnalysisError, active_place};
use super::progress::{PartProgress, Progress, Shard, SubProgress};
use super::section_frame::{escape_bounds, itinerary};
use super::section_table::TabulatedUse;
use crate::expansion::LocalMap;
use crate::iteration::{MapOrbit, OrbitEnd, OrbitName, Period};
use crate::model::{DiagramRequest, Method, Scene, Spacing, SweepDirection};
use crate::orbit::GrazingOrbit;
use observe::{at_graze, label};
use sweep_run::{sweep, sweep_share};

pub(super) use data::Shares;
pub use data::{Diagram, DiagramPoint, Sweep, SweepHeading, Timing};
pub(super) use device_sweep::DeviceSweep;
pub use observe::Observer;
pub use sweep::SweepRequest;
pub(super) use sweep::{
    Entry, FoundAttractor, agree, kept_contacts, name, nominal_period, settle, states,
};
pub use swept_map::{
    DirectSweep, FrozenSweep, GuardedSweep, Settled, SideBySide, SmoothFixedPoint, Start, SweptMap,
    UnobservedSweep,
};
pub(super) use swept_map::{SweepSubject, exponent};

/// A diagram with its maps and request prepared, ready to run.
pub struct DiagramPlan<'a> {
    /// One map per method.
    pub maps: Vec<Box<dyn SweptMap + 'a>>,
    /// Directions of the sweeps.
    pub direction: SweepDirection,
    /// Request of every sweep.
    pub request: SweepRequest,
}

/// Computes a bifurcation diagram of a scene.
///
/// Every sweep carries its last state from value to value. It starts at the states that the scene
/// names, one sweep for each. Otherwise it starts beside the fixed point of `P_smooth`, a billionth
/// of the window's half-widths to one side, or to the other side if that orbit escapes. If both
/// escape, it starts at eight points each within a tenth and a hundredth of the half-widths about
/// the graze. If the carried state escapes, the start is tried at that value too, and the sweep
/// continues from the last state that stayed. An orbit with repelling multipliers is displaced by a
/// thousandth of the half-widths and followed once more, so that only attractors are shown.
/// Segments of a sweep run in parallel, and their starts are corrected: results do not depend on
/// the number of cores.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if the swept parameter is no variable of the map;
/// [`AnalysisError::NotACoordinate`], [`AnalysisError::NoWidth`] for starts that do not fit the
/// section or the window; [`AnalysisError::Hybrid`] if the simulator refuses the model;
/// [`AnalysisError::Expansion`] if the impact speed is observed and cannot be expanded.
pub fn diagram(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &DiagramRequest,
    progress: &dyn Progress,
) -> Result<Diagram, AnalysisError> {
    let sweeps = planned(scene, orbit, map, request, |plan| run_plan(plan, progress))?;
    Ok(Diagram {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        parameter: scene.model.parameters[request.parameter].name.clone(),
        grazing_value: orbit.parameters()[request.parameter].to_f64(),
        is_logarithmic: request.spacing == Spacing::Logarithmic,
        observable: label(&request.observe).to_owned(),
        observable_at_graze: at_graze(scene, orbit, map, &request.observe),
        surfaces: itinerary(scene, orbit).surfaces,
        transient: request.transient,
        keep: request.keep,
        escape: escape_bounds(scene, orbit),
        speed_ratio: speed_ratio(&sweeps),
        sweeps,
    })
}

/// Computes a share of [`diagram`]: some segments of every sweep, and their corrections as far as
/// these segments determine them. The joining run computes the rest.
///
/// # Errors
///
/// As [`diagram`].
pub fn diagram_share(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &DiagramRequest,
    shard: &Shard<'_>,
) -> Result<(), AnalysisError> {
    planned(scene, orbit, map, request, |plan| {
        let values = shard.share.range(plan.request.offsets.len()).len();
        run_sweeps(plan, values, shard, |number, (map, start, heading)| {
            shard.part(number, |shard| sweep_share(map, &plan.request, start, heading, shard));
        })
    })
    .map(drop)
}

/// Prepares the plan of a diagram and passes it to `make`.
fn planned<T>(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &DiagramRequest,
    make: impl FnOnce(&DiagramPlan<'_>) -> T,
) -> Result<T, AnalysisError> {
    let parameter = &scene.model.parameters[request.parameter].name;
    let position = active_place(map, parameter)?;
    let offsets = request.offsets();
    let starts = sweep::states(&request.starts, scene, map)?;
    let ends = [offsets.first(), offsets.last()].map(|end| end.copied().unwrap_or(0.0));
    let tabulated = TabulatedUse {
        varied: vec![(position, ends)],
        starts: starts.clone(),
        carried: true,
        returns: [
            offsets.len(),
            headings(request.direction).len(),
            starts.len().max(1),
            request.transient + request.keep,
        ]
        .map(|count| count as f64)
        .iter()
        .product(),
        ..TabulatedUse::default()
    };
    let new = SweepSubject::new(scene, orbit, map);
    let subject = SweepSubject { observe: &request.observe, tabulated, ..new };
    let swept = request.with.iter().map(|&method| subject.swept(method));
    Ok(make(&DiagramPlan {
        maps: swept.collect::<Result<_, _>>()?,
        direction: request.direction,
        request: SweepRequest {
            parameter: position,
            offsets,
            starts,
            orbit: subject.orbits(request.transient, request.keep),
            window: map.window.clone(),
        },
    }))
}

/// Runs all sweeps of a plan: one per map, start and heading, maps in order, up before down.
pub fn run_plan(plan: &DiagramPlan<'_>, progress: &dyn Progress) -> Vec<Sweep> {
    let run = |number, (map, start, heading): (&dyn SweptMap, Option<&[f64]>, _)| {
        sweep(map, &plan.request, start, heading, &SubProgress::new(progress, number))
    };
    run_sweeps(plan, plan.request.offsets.len(), progress, run)
}

/// Headings of the sweeps of a direction.
fn headings(direction: SweepDirection) -> &'static [SweepHeading] {
    match direction {
        SweepDirection::Up => &[SweepHeading::Up],
        SweepDirection::Down => &[SweepHeading::Down],
        SweepDirection::Both => &[SweepHeading::Up, SweepHeading::Down],
    }
}

/// Runs `run` on each sweep of a plan; a sweep visits `values` values.
fn run_sweeps<T>(
    plan: &DiagramPlan<'_>,
    values: usize,
    progress: &dyn Progress,
    run: impl Fn(usize, (&dyn SweptMap, Option<&[f64]>, SweepHeading)) -> T,
) -> Vec<T> {
    let headings = headings(plan.direction);
    let starts = match &plan.request.starts[..] {
        [] => vec![None],
        states => states.iter().map(|state| Some(&state[..])).collect(),
    };
    let ways = starts.iter().flat_map(|&start| headings.iter().map(move |&way| (start, way)));
    let ways: Vec<_> = ways.collect();
    PartProgress::announce(progress, plan.maps.len() * ways.len() * values);
    let sweeps = plan
        .maps
        .iter()
        .flat_map(|map| ways.iter().map(move |&(start, heading)| (&**map, start, heading)));
    // NOTE: sweeps run one after another, so that each is timed alone; their segments fill the
    // cores.
    sweeps.enumerate().map(|(number, sweep)| run(number, sweep)).collect()
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

/// Offsets measured, as shares of the parameter's half-width.
const SHARES: [f64; 4] = [-0.1, -0.01, 0.01, 0.1];
/// Largest growth of an attractor near the graze at ten times the offset: a square root grows by
/// 3.2, less if the period is shorter there.
const GROWTH: f64 = 5.0;
/// Growth at ten times the offset of an attractor that is born at the graze, in its distance from
/// there: between a root and proportion, beside which there is an attractor away from it.
const BORN: [f64; 2] = [2.0, 15.0];
/// Iterates before an orbit counts as settled, and iterates kept.
const TRANSIENT: usize = 3000;
const KEPT: usize = 256;

/// Attractor of a map at an offset of a parameter from the graze.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSide {
    /// Offset of the parameter.
    pub offset: f64,
    /// Period in nominal returns.
    pub period: Period,
    /// Name of the orbit; `None` without a period.
    pub orbit: Option<OrbitName>,
    /// Whether the orbit makes contact.
    pub contact: bool,
    /// Largest Lyapunov exponent per return; `None` if direct simulation made an iterate.
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an orbit without a period.
    pub lyapunov_error: Option<f64>,
    /// Whether the attractor is near the graze: inside the window of the map; or, at the larger
    /// offset, not much larger than a near one at the smaller offset.
    pub near: bool,
    /// Largest distance of a coordinate from the graze, in half-widths of the window.
    pub size: f64,
    /// End of the orbit.
    pub end: OrbitEnd,
}

/// Attractors by guarded iteration at a tenth and a hundredth of a parameter's half-width of the
/// window on both sides of the graze; orbits start beside the orbit without contact.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if the parameter is no variable of the map;
/// [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn measure_graze(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    parameter: &str,
) -> Result<Vec<MeasuredSide>, AnalysisError> {
    let place = active_place(map, parameter)?;
    let subject = SweepSubject::new(scene, orbit, map);
    let swept = subject.swept(Method::Guarded)?;
    let request = subject.orbits(TRANSIENT, KEPT);
    let entry = |share: f64| {
        let mut parameters = vec![0.0; map.parameters.len()];
        parameters[place] = share * map.window.parameter[place];
        Entry { parameters, carried: None }
    };
    let entries: Vec<Entry> = SHARES.into_iter().map(entry).collect();
    let found = settle(&*swept, entries.clone(), None, &request, &|| ());
    let side = |(found, entry): (FoundAttractor, Entry)| {
        let (settled, parameters) = (found.settled, entry.parameters);
        let near = settled.orbit.end == OrbitEnd::Completed
            && settled.orbit.states().all(|state| map.window.holds(state, &parameters, &[]));
        let widths = map.window.state.iter();
        let reached = settled.orbit.extent().into_iter().zip(widths);
        let reached = reached.map(|([low, high], width)| low.abs().max(high.abs()) / width);
        MeasuredSide {
            offset: parameters[place],
            period: nominal_period(&*swept, &settled.orbit),
            orbit: name(&*swept, &settled.orbit, &parameters),
            contact: makes_contact(&*swept, &settled.orbit, &parameters),
            lyapunov: settled.lyapunov.map(|exponent| exponent.value),
            lyapunov_error: settled.lyapunov.and_then(|exponent| exponent.error),
            near,
            size: reached.fold(0.0, f64::max),
            end: settled.orbit.end,
        }
    };
    let mut sides: Vec<MeasuredSide> = found.into_iter().zip(entries).map(side).collect();
    for (far, close) in [(0, 1), (3, 2)] {
        let both = [close, far].map(|side| sides[side].end == OrbitEnd::Completed) == [true; 2];
        let growth = sides[far].size / sides[close].size;
        let is_born = both && (BORN[0]..=BORN[1]).contains(&growth);
        sides[close].near |= is_born;
        sides[far].near |= is_born || (both && sides[close].near && growth <= GROWTH);
    }
    Ok(sides)
}

/// Whether an orbit meets a grazing surface in a kept return more often than the nominal orbit
/// does, at a passage or elsewhere.
fn makes_contact(map: &dyn SweptMap, orbit: &MapOrbit, parameters: &[f64]) -> bool {
    let mut returns = 0..orbit.steps.len().saturating_sub(1);
    let nominal = &map.itinerary().nominal_hits;
    let hits_more = |number: usize| {
        map.hits(orbit, number, parameters).iter().zip(nominal).any(|(hits, own)| hits > own)
    };
    kept_contacts(orbit) > 0 || returns.any(hits_more)
}
