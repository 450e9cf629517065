//! Two-parameter charts: what the map settles on, cell by cell of a grid of parameters.
//!
//! One idea: every cell starts from states of its own, so that no cell knows of another: as many
//! are iterated in step as the map has lanes, on all cores, and no result depends on either. Only
//! cells along the borders of what is shown are computed, unless all are asked for.

mod data;
mod grid;
mod overlay;

use std::cell::OnceCell;
use std::time::Instant;

use super::diagram::{DeviceSweep, Shares, SweepSubject, SweptMap, Timing, states};
use super::error::AnalysisError;
use super::escape::escape_bounds;
use super::progress::{Part, Progress};
use super::section_frame::itinerary;
use super::share::Shard;
use crate::expansion::LocalMap;
use crate::iteration::{DeviceMap, OrbitRequest};
use crate::model::{ChartRequest, Method, Observable, Scene, even_offsets};
use crate::orbit::GrazingOrbit;
pub use data::{Chart, ChartAttractor, ChartAxis, ChartCell, ChartClass, Overlay};
use grid::Grid;
use overlay::Plane;

/// Bytes that the charts of a scene take in memory.
pub fn chart_bytes(scene: &Scene) -> u64 {
    /// Of a cell, with the names of its orbit, while it is refined and drawn; and of each attractor
    /// besides.
    const CELL: usize = 400;
    const ATTRACTOR: usize = 200;
    let bytes = |request: &ChartRequest| {
        let cells = request.points[0] * request.points[1] * request.count();
        (cells * (CELL + ATTRACTOR * (request.attractors - 1))) as u64
    };
    scene.charts.iter().map(bytes).sum()
}

/// A map and where the cells of one chart of it start.
type Swept<'s> = (&'s dyn SweptMap, &'s [Option<Vec<f64>>]);

/// The charts that a scene asks for: one for each method, and for each start where these are not
/// taken together.
///
/// Every cell starts at one state, or beside the fixed point of `P_smooth` at its parameters, a
/// billionth of the window's half-widths to one side and, where that orbit escapes, to the other
/// and further off, as a sweep does.
/// A chart shows one attractor where there are several, unless several are asked for, to which its
/// starts lead then; a diagram that carries its state shows others. Periods that repel are left by
/// a kick, as in [`diagram`](super::diagram::diagram).
///
/// Cells are computed where their neighbours differ in what is shown
/// ([`BLOCK`](super::basin::BLOCK) says what may be missed), or all of them, as the request says;
/// exponents differ from cell to cell, so that all are computed where they are shown.
///
/// With a `device` its processor makes the orbits of the map, and no bit of the chart changes.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if a parameter is no variable of the map;
/// [`AnalysisError::NotACoordinate`], [`AnalysisError::NoWidth`] for starts that the section or the
/// window does not know; [`AnalysisError::Itinerary`] for loci of an itinerary that cannot be read;
/// [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn chart(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    device: Option<&DeviceMap>,
    request: &ChartRequest,
    progress: &dyn Progress,
) -> Result<Vec<Chart>, AnalysisError> {
    let (axes, places) = axes(scene, orbit, map, request)?;
    let plane = Plane { scene, orbit, map, request, axes: &axes, places };
    let overlays = request.with.iter().map(|&method| Ok((method, plane.overlays(method)?)));
    let overlays = overlays.collect::<Result<Vec<_>, AnalysisError>>()?;
    let overlay = |method: Method| {
        let found = overlays.iter().find(|(other, _)| *other == method);
        found.map_or_else(Vec::new, |(_, found)| found.clone())
    };
    grids((scene, orbit, map), device, request, |number, grid| {
        let clock = Instant::now();
        let (cells, iterates) = grid.cells(&Part::new(progress, number));
        let computed = cells.iter().filter(|cell| cell.computed);
        let shares = |attractor: &ChartAttractor| {
            let ChartAttractor { by_map, outside, .. } = *attractor;
            (Shares { by_map, outside }, 1)
        };
        let followed = computed.clone().flat_map(ChartCell::attractors);
        let Shares { by_map, outside } = Shares::mean(followed.map(shares));
        let (method, starts) = (grid.map.method(), grid.starts);
        let together = request.attractors > 1;
        Chart {
            scene: scene.identifier.clone(),
            digest: scene.digest,
            method,
            axes: axes.clone(),
            surfaces: itinerary(scene, orbit).surfaces,
            observe: request.observe,
            start: starts[0].clone().filter(|_| !together),
            starts: starts.iter().flatten().filter(|_| together).cloned().collect(),
            attractors: request.attractors,
            transient: request.transient,
            longest_period: request.keep,
            escape: escape_bounds(scene, orbit),
            by_map,
            outside,
            computed: computed.count(),
            overlay: overlay(method),
            cells,
            timing: Timing::since(clock, iterates),
        }
    })
}

/// A share of the cells of [`chart`]: those of some tiles. What borders between tiles ask for is
/// left to what joins the shares, as are the loci.
///
/// # Errors
///
/// As [`chart`].
pub fn chart_share(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    device: Option<&DeviceMap>,
    request: &ChartRequest,
    shard: &Shard<'_>,
) -> Result<(), AnalysisError> {
    grids((scene, orbit, map), device, request, |number, grid| {
        shard.part(number, |shard| grid.share(shard));
    })
    .map(drop)
}

/// What is made of the grid of each chart.
fn grids<T>(
    (scene, orbit, map): (&Scene, &GrazingOrbit, &LocalMap),
    device: Option<&DeviceMap>,
    request: &ChartRequest,
    make: impl Fn(usize, Grid<'_>) -> T,
) -> Result<Vec<T>, AnalysisError> {
    let (axes, places) = axes(scene, orbit, map, request)?;
    let subject = SweepSubject {
        scene,
        orbit,
        map,
        observe: &Observable::EventFunction,
        system: OnceCell::new(),
    };
    let escape = escape_bounds(scene, orbit);
    let bounds: Vec<f64> = escape.iter().map(|bound| bound.offset).collect();
    let own = OrbitRequest::new(request.transient, 2 * request.keep, &map.window.state);
    let own = own.escaping_at(&bounds).approaching();
    let starts = match states(&request.starts, scene, map)? {
        states if states.is_empty() => vec![None],
        states => states.into_iter().map(Some).collect(),
    };
    let together = if request.attractors > 1 { starts.len() } else { 1 };
    let swept = request.with.iter().map(|&method| {
        let swept = subject.swept(method)?;
        Ok::<_, AnalysisError>(match device {
            None => swept,
            Some(device) => DeviceSweep::of(swept, device, &map.window, own.keep),
        })
    });
    let swept = swept.collect::<Result<Vec<_>, _>>()?;
    let asked =
        swept.iter().flat_map(|map| starts.chunks(together).map(move |starts| (&**map, starts)));
    let made = |(number, (swept, starts)): (usize, Swept<'_>)| {
        let grid = Grid {
            map: swept,
            axes: &axes,
            places,
            orbit: own.clone(),
            window: &map.window,
            starts,
            request,
        };
        make(number, grid)
    };
    Ok(asked.enumerate().map(made).collect())
}

/// The axes of a chart, and the positions of their parameters among the map's.
fn axes(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ChartRequest,
) -> Result<([ChartAxis; 2], [usize; 2]), AnalysisError> {
    let axis = |number: usize| {
        let parameter = request.parameters[number];
        ChartAxis {
            parameter: scene.model.parameters[parameter].name.clone(),
            grazing_value: orbit.parameters()[parameter].to_f64(),
            offsets: even_offsets(request.ranges[number], request.points[number]),
        }
    };
    let axes = [axis(0), axis(1)];
    let mut places = [0; 2];
    for (place, axis) in places.iter_mut().zip(&axes) {
        let mut active = map.parameters.iter();
        let found = active.position(|active| active.name == axis.parameter);
        *place =
            found.ok_or_else(|| AnalysisError::NotActive { parameter: axis.parameter.clone() })?;
    }
    Ok((axes, places))
}
