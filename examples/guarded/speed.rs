//! The time of an iterate, for shares outside the window from none to all.
//!
//! The window is shrunk until it leaves the share asked for outside: of the iterates that the map
//! makes in the sweep, that quantile of how far they reach in it. All sweeps of a scene are of one
//! run, so that their times can be compared.

use std::error::Error;

use grazemap::Map;
use grazemap::analysis::diagram::{
    DiagramPlan, DirectSweep, FrozenSweep, GuardedSweep, Observer, SmoothFixedPoint, Start, Sweep,
    SweepRequest, SweptMap, run_plan,
};
use grazemap::analysis::{DirectMap, NoProgress, itinerary};
use grazemap::expansion::MapWindow;
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{HornerMap, OrbitRequest};
use grazemap::model::{Observable, SweepDirection, even_offsets};
use grazemap::prelude::*;
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::of_catalogue;

/// Scenes of the catalogue: one rigid stop with an affine and with another flow, in and out of
/// lanes of direct simulation; a compliant stop; two stops.
const SCENES: [&str; 5] = ["linear", "mems", "cantilever_3_5_soft", "soft_b", "two_stops_t1_rigid"];
/// Shares of the iterates outside the window.
const SHARES: [f64; 4] = [0.0, 0.01, 0.1, 1.0];
/// Values of a sweep, iterates dropped and kept at each.
const VALUES: usize = 512;
const ITERATES: [usize; 2] = [400, 100];
/// Runs of a sweep that is timed, of which the fastest counts.
const RUNS: usize = 5;

/// One row a scene and share.
pub(crate) fn table() -> Result<Table, Box<dyn Error>> {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::number("by map").with_unit("%"),
        Column::number("map").with_unit("ns"),
        Column::number("guarded").with_unit("ns"),
        Column::number("direct").with_unit("ns"),
        Column::number("guarded over map"),
        Column::number("direct over guarded"),
    ]);
    for name in SCENES {
        rows(&of_catalogue(name)?.graze()?.map()?, &mut table)?;
    }
    Ok(table)
}

fn rows(map: &Map, table: &mut Table) -> Result<(), Box<dyn Error>> {
    let settled = map.settled();
    let (scene, orbit, local) = (settled.scene(), settled.orbit(), map.local());
    let system = HybridSystem::new(&scene.model);
    let direct = || DirectMap::new(&system, scene, orbit);
    let observer = || Observer::new(scene, orbit, local, &Observable::EventFunction);
    let frozen = || -> Result<FrozenSweep, grazemap::analysis::AnalysisError> {
        Ok(FrozenSweep {
            map: HornerMap::new(local),
            start: SmoothFixedPoint::new(local),
            observer: observer()?,
            itinerary: itinerary(scene, orbit),
        })
    };
    let parameter = &scene.model.parameters[scene.diagrams[0].parameter].name;
    let mut active = local.parameters.iter();
    let place = active.position(|active| active.name == *parameter).unwrap_or(0);
    let request = |range: [f64; 2]| SweepRequest {
        parameter: place,
        offsets: even_offsets(range, VALUES),
        starts: Vec::new(),
        orbit: OrbitRequest::new(ITERATES[0], ITERATES[1], &local.window.state),
        window: local.window.clone(),
    };
    // The side of the graze on which more orbits of the map stay, as far as the parameter's
    // half-width: an orbit that escapes ends the map's sweep alone.
    let width = local.window.parameter[place];
    let map = frozen()?;
    let side = |range: [f64; 2]| {
        let request = request(range);
        let reaches = reaches(&map, &request);
        (request, reaches)
    };
    let (below, above) = (side([-width, 0.0]), side([0.0, width]));
    let (request, reaches) = if below.1.len() >= above.1.len() { below } else { above };
    let run = |swept: Box<dyn SweptMap + '_>, request: &SweepRequest, runs: usize| {
        let (maps, direction) = (vec![swept], SweepDirection::Up);
        let plan = DiagramPlan { maps, direction, request: request.clone() };
        let sweeps = (0..runs).map(|_| run_plan(&plan, &NoProgress).remove(0));
        let time = |sweep: &Sweep| sweep.timing.nanoseconds_per_iterate();
        sweeps.min_by(|a, b| time(a).total_cmp(&time(b)))
    };
    for share in SHARES {
        let window = narrowed(&local.window, &reaches, share);
        let guarded = GuardedSweep { map: frozen()?, window, direct: direct()? };
        let simulated = DirectSweep {
            map: direct()?,
            start: SmoothFixedPoint::new(local),
            observer: observer()?,
            itinerary: itinerary(scene, orbit),
        };
        let runs = if share > 0.0 { 1 } else { RUNS };
        let swept: [Box<dyn SweptMap + '_>; 3] =
            [Box::new(frozen()?), Box::new(guarded), Box::new(simulated)];
        let [map, guarded, direct] = swept;
        let sweeps =
            [run(map, &request, RUNS), run(guarded, &request, runs), run(direct, &request, 1)];
        let [Some(map), Some(guarded), Some(direct)] = sweeps else { continue };
        push(table, &scene.identifier, [&map, &guarded, &direct])?;
    }
    Ok(())
}

fn push(table: &mut Table, scene: &str, sweeps: [&Sweep; 3]) -> Result<(), ReportError> {
    let [map, guarded, direct] = sweeps.map(|sweep| sweep.timing.nanoseconds_per_iterate());
    table.push(vec![
        Cell::text(scene),
        Cell::number(100.0 * sweeps[1].by_map, 4),
        Cell::number(map, 3),
        Cell::number(guarded, 3),
        Cell::number(direct, 3),
        Cell::number(guarded / map, 4),
        Cell::number(direct / guarded, 3),
    ])
}

/// How far the iterates of the map reach in its window, of every value, increasing.
fn reaches(map: &FrozenSweep, request: &SweepRequest) -> Vec<f64> {
    let start = |&offset: &f64| {
        let mut parameters = vec![0.0; map.parameters()];
        parameters[request.parameter] = offset;
        Start { state: map.start(&parameters), parameters }
    };
    let starts: Vec<Start> = request.offsets.iter().map(start).collect();
    let settled = starts.chunks(map.lanes()).flat_map(|block| map.settle(block, &request.orbit));
    let reach = |orbit: &grazemap::iteration::MapOrbit| {
        let steps = orbit.origins().zip(&orbit.steps);
        let reach = steps.map(|(state, step)| {
            let states = state.iter().zip(&request.window.state);
            let states = states.map(|(value, width)| value.abs() / width);
            states.fold(step.depth / request.window.depth, f64::max)
        });
        reach.collect::<Vec<f64>>()
    };
    let mut reaches: Vec<f64> = settled.flat_map(|settled| reach(&settled.orbit)).collect();
    reaches.sort_by(f64::total_cmp);
    reaches
}

/// The window shrunk, or widened, to leave a share of the iterates outside.
fn narrowed(window: &MapWindow, reaches: &[f64], share: f64) -> MapWindow {
    let last = reaches.len() - 1;
    let inside = ((1.0 - share) * last as f64) as usize;
    let reach = if share > 0.0 { reaches[inside] } else { 2.0 * reaches[last] };
    // Of all iterates, those at the graze too.
    let reach = if share < 1.0 { reach } else { 0.0 };
    let parameter = if share < 1.0 { 1.0 } else { 0.0 };
    MapWindow {
        depth: reach * window.depth,
        state: window.state.iter().map(|width| reach * width).collect(),
        parameter: window.parameter.iter().map(|width| parameter * width).collect(),
    }
}
