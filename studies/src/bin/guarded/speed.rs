//! Times of an iterate, for shares outside the window from none to all.
//!
//! A sweep goes from the graze to the half-width of the parameter, on the side on which the orbits
//! of the map reach farther. The window is scaled so that the share asked for lies outside: its
//! size is that quantile of the reaches of the map's iterates. Map, guarded map and direct
//! simulation take turns, so that their times can be compared.

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
use grazemap::report::{Cell, Column, Table};

/// Scenes of the catalogue whose orbits stay on one side of the graze: one rigid stop with an
/// affine flow, with another flow, and between two bodies; one and two compliant stops.
const SCENES: [&str; 6] =
    ["linear", "mems_codim2", "cantilever_3_5_soft", "impact_pair", "soft_b", "two_stops_t1"];
/// Shares of the iterates outside the window.
const SHARES: [f64; 4] = [0.0, 0.01, 0.1, 1.0];
/// Number of values of a sweep; numbers of iterates dropped and kept at each.
const VALUES: usize = 512;
const ITERATES: [usize; 2] = [400, 100];
/// Numbers of timed runs of a sweep, of which the fastest counts: by the map alone, and by the
/// other methods.
const RUNS: [usize; 2] = [40, 3];

/// Table with one row per scene and share.
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
        rows(&Scene::of_catalogue(name)?.graze()?.map()?, &mut table)?;
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
    // NOTE: an orbit that escapes ends the map's sweep. The side is that on which more orbits stay
    // and, if equal, that on which they reach farther.
    let width = local.window.parameter[place];
    let map = frozen()?;
    let side = |range: [f64; 2]| {
        let request = request(range);
        let reaches = reaches(&map, &request);
        (request, reaches)
    };
    let (below, above) = (side([-width, 0.0]), side([0.0, width]));
    let stay = |side: &(SweepRequest, Vec<f64>)| (side.1.len(), side.1.last().map(|y| y.to_bits()));
    let (request, reaches) = if stay(&below) >= stay(&above) { below } else { above };
    for share in SHARES {
        let window = narrowed(&local.window, &reaches, share);
        let maps: [Box<dyn SweptMap + '_>; 3] = [
            Box::new(frozen()?),
            Box::new(GuardedSweep { map: frozen()?, window, direct: direct()? }),
            Box::new(DirectSweep {
                map: direct()?,
                start: SmoothFixedPoint::new(local),
                observer: observer()?,
                itinerary: itinerary(scene, orbit),
            }),
        ];
        let plans = maps.map(|swept| DiagramPlan {
            maps: vec![swept],
            direction: SweepDirection::Up,
            request: request.clone(),
        });
        let [alone, others] = RUNS;
        let runs = [alone, if share > 0.0 { others } else { alone }, others];
        push(table, &scene.identifier, fastest(&plans, runs));
    }
    Ok(())
}

/// Fastest run of every plan. Each plan has one sweep, and the plans take turns.
fn fastest<const N: usize>(plans: &[DiagramPlan<'_>; N], runs: [usize; N]) -> [Sweep; N] {
    let run = |plan: &DiagramPlan<'_>| run_plan(plan, &NoProgress).remove(0);
    let time = |sweep: &Sweep| sweep.timing.nanoseconds_per_iterate();
    let mut fastest = plans.each_ref().map(run);
    for turn in 1..runs.iter().copied().max().unwrap_or(0) {
        for ((plan, fastest), _) in
            plans.iter().zip(&mut fastest).zip(runs).filter(|(_, runs)| turn < *runs)
        {
            let sweep = run(plan);
            if time(&sweep) < time(fastest) {
                *fastest = sweep;
            }
        }
    }
    fastest
}

fn push(table: &mut Table, scene: &str, sweeps: [Sweep; 3]) {
    let [map, guarded, direct] =
        sweeps.each_ref().map(|sweep| sweep.timing.nanoseconds_per_iterate());
    table.push(vec![
        Cell::text(scene),
        Cell::number(100.0 * sweeps[1].by_map, 4),
        Cell::number(map, 3),
        Cell::number(guarded, 3),
        Cell::number(direct, 3),
        Cell::number(guarded / map, 4),
        Cell::number(direct / guarded, 3),
    ]);
}

/// Reaches of the map's iterates in its window at every value, ascending.
fn reaches(map: &FrozenSweep, request: &SweepRequest) -> Vec<f64> {
    let start = |&offset: &f64| {
        let mut parameters = vec![0.0; map.parameters()];
        parameters[request.parameter] = offset;
        Start { state: map.start(&parameters), parameters }
    };
    let starts: Vec<Start> = request.offsets.iter().map(start).collect();
    let settled =
        starts.chunks(map.lanes()).flat_map(|block| map.settle(block, &request.orbit, &|| ()));
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

/// Window scaled so that a share of the iterates lies outside.
fn narrowed(window: &MapWindow, reaches: &[f64], share: f64) -> MapWindow {
    let last = reaches.len() - 1;
    let inside = ((1.0 - share) * last as f64) as usize;
    let reach = if share > 0.0 { reaches[inside] } else { 2.0 * reaches[last] };
    // NOTE: for a share of 1, iterates at the graze are outside too.
    let reach = if share < 1.0 { reach } else { 0.0 };
    let parameter = if share < 1.0 { 1.0 } else { 0.0 };
    MapWindow {
        depth: reach * window.depth,
        state: window.state.iter().map(|width| reach * width).collect(),
        parameter: window.parameter.iter().map(|width| parameter * width).collect(),
    }
}
