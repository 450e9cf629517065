//! Two-parameter charts: attractors of the map in each cell of a grid of parameters.
//!
//! One idea: every cell has its own starts and depends on no other cell: cells are iterated in
//! step, as many as the map has lanes, on all cores, and results do not depend on either. Only
//! cells at the borders between classes are computed, unless all are asked for. Curves are laid
//! over the cells: the graze of the scene's orbit, and loci of periodic orbits.

mod data;
mod grid;

use std::time::Instant;

use super::diagram::{DeviceSweep, Shares, SweepSubject, SweptMap, Timing, states};
use super::error::{AnalysisError, active_place};
use super::loci::{LociRequest, Locus, LocusKind, PlaneCurve, PlanePoint, loci};
use super::periodic::ContactItinerary;
use super::progress::{NoProgress, Progress, Shard, SubProgress};
use super::refinement::COMPUTED;
use super::section_frame::{escape_bounds, itinerary};
use super::section_table::TabulatedUse;
use crate::expansion::LocalMap;
use crate::iteration::{DeviceMap, PassageSet};
use crate::model::{ChartOverlay, ChartRequest, Method, Scene, even_offsets};
use crate::orbit::{self, CurveEnd, CurveOptions, CurveOutcome, CurvePoint, GrazingOrbit};
use grid::ChartGrid;

pub use data::{Chart, ChartAttractor, ChartAxis, ChartCell, ChartClass, Overlay};

/// A map and the starts of the cells of one chart.
type Swept<'s> = (&'s dyn SweptMap, &'s [Option<Vec<f64>>]);

/// Computes the charts of a request: one for each method, and one for each start unless the starts
/// are taken together.
///
/// Every cell starts at one state, or beside the fixed point of `P_smooth` at its parameters, a
/// billionth of the window's half-widths to one side, or to the other side if that orbit escapes;
/// if both escape, farther away, as a sweep does. A cell shows one attractor even if there are
/// several, unless several are asked for, which are those that its starts lead to; a diagram, which
/// carries its state, may show others. Repelling periods are left by a displacement, as in
/// [`diagram`](super::diagram::diagram).
///
/// Cells are computed where the quantity shown differs between neighbours, and at probes of the
/// blocks between ([`BlockProbes`](super::basin::BlockProbes) bound the share missed), or all of
/// them on request; charts of exponents always compute all cells, because exponents vary from cell
/// to cell.
///
/// With a `device` its processor computes the orbits of the map; the chart is the same to the last
/// bit.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if a parameter is no variable of the map;
/// [`AnalysisError::NotACoordinate`], [`AnalysisError::NoWidth`] for starts that do not fit the
/// section or the window; [`AnalysisError::Itinerary`] for loci of an itinerary that cannot be
/// read; [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn chart(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    device: Option<&DeviceMap>,
    request: &ChartRequest,
    progress: &dyn Progress,
) -> Result<Vec<Chart>, AnalysisError> {
    let (axes, places) = axes(scene, orbit, map, request)?;
    let plane = ChartPlane { scene, orbit, map, request, axes: &axes, places };
    let overlays = request.with.iter().map(|&method| Ok((method, plane.overlays(method)?)));
    let overlays = overlays.collect::<Result<Vec<_>, AnalysisError>>()?;
    let overlay = |method: Method| {
        let found = overlays.iter().find(|(other, _)| *other == method);
        found.map_or_else(Vec::new, |(_, found)| found.clone())
    };
    grids((scene, orbit, map), device, request, |number, grid| {
        let clock = Instant::now();
        let (cells, probes, iterates) = grid.cells(&SubProgress::new(progress, number));
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
            probes,
            overlay: overlay(method),
            cells,
            timing: Timing::since(clock, iterates),
        }
    })
}

/// Computes a share of the cells of [`chart`]: those of some tiles. Cells needed by borders between
/// tiles, and loci, are left to the joining run.
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

/// Calls `make` with the grid of each chart.
fn grids<T>(
    (scene, orbit, map): (&Scene, &GrazingOrbit, &LocalMap),
    device: Option<&DeviceMap>,
    request: &ChartRequest,
    make: impl Fn(usize, ChartGrid<'_>) -> T,
) -> Result<Vec<T>, AnalysisError> {
    let (axes, places) = axes(scene, orbit, map, request)?;
    let mut subject = SweepSubject::new(scene, orbit, map);
    let own = subject.orbits(request.transient, 2 * request.keep).approaching();
    let starts = match states(&request.starts, scene, map)? {
        states if states.is_empty() => vec![None],
        states => states.into_iter().map(Some).collect(),
    };
    let varied = places.into_iter().zip(&axes).map(|(place, axis)| {
        let ends = [axis.offsets.first(), axis.offsets.last()];
        (place, ends.map(|end| end.copied().unwrap_or(0.0)))
    });
    subject.tabulated = TabulatedUse {
        varied: varied.collect(),
        starts: starts.iter().flatten().cloned().collect(),
        returns: axes.iter().map(|axis| axis.offsets.len() as f64).product::<f64>()
            * if request.every_cell { 1.0 } else { COMPUTED }
            * (starts.len() * (own.transient + own.keep)) as f64,
        ..TabulatedUse::default()
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
        let grid = ChartGrid {
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

/// Axes of a chart, and indices of their parameters among the map's.
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
    let place = |number: usize| active_place(map, &axes[number].parameter);
    let places = [place(0)?, place(1)?];
    Ok((axes, places))
}

/// Number of passages in the longest itineraries whose loci are computed by default.
const DEFAULT_PASSAGES: usize = 2;

/// Scene, axes and parameters for the curves of a chart.
pub(super) struct ChartPlane<'a> {
    pub(super) scene: &'a Scene,
    pub(super) orbit: &'a GrazingOrbit,
    pub(super) map: &'a LocalMap,
    pub(super) request: &'a ChartRequest,
    pub(super) axes: &'a [ChartAxis; 2],
    /// Indices of the axes' parameters among the map's.
    pub(super) places: [usize; 2],
}

impl ChartPlane<'_> {
    /// Curves that are asked for: by direct simulation over a chart of direct simulation, otherwise
    /// by the map inside its window.
    fn overlays(&self, method: Method) -> Result<Vec<Overlay>, AnalysisError> {
        let overlay = |&what: &ChartOverlay| {
            let curves = match what {
                ChartOverlay::Graze => self.grazing_curve().into_iter().collect(),
                ChartOverlay::Loci => self.loci(method.is_direct())?,
            };
            Ok(Overlay { what, curves })
        };
        self.request.overlay.iter().map(overlay).collect()
    }

    /// Grazing curve through the scene's orbit, as far as it can be followed over the chart; `None`
    /// if there is none in the chart's plane.
    fn grazing_curve(&self) -> Option<PlaneCurve> {
        let mut scene = self.scene.clone();
        for (parameter, &value) in scene.model.parameters.iter_mut().zip(self.orbit.parameters()) {
            parameter.value = value;
        }
        let [horizontal, vertical] = self.request.parameters;
        let turned = scene.grazing.solve_for == [horizontal];
        let (with, adjusted) = if turned { (1, horizontal) } else { (0, vertical) };
        if scene.grazing.solve_for.len() > 1 {
            return None;
        }
        scene.grazing.solve_for = vec![adjusted];
        let ends = self.request.ranges[with];
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let center = self.axes[with].grazing_value;
        let parameter = self.request.parameters[with];
        let follow = |end: f64| {
            let options = CurveOptions { xi_count: 0, ..CurveOptions::default() };
            let curve = orbit::curve(&scene, parameter, center, center + end, &options);
            match curve.ok()? {
                CurveOutcome::Traced(curve) | CurveOutcome::StartNotReached(curve) => {
                    let is_whole = matches!(curve.end, CurveEnd::Reached | CurveEnd::Closed);
                    Some((curve.points.iter().map(|p| self.point(p)).collect(), is_whole))
                }
                CurveOutcome::NotLocated(_) => None,
            }
        };
        let before = if ends[0] < 0.0 { follow(ends[0])? } else { (Vec::new(), true) };
        let after = if ends[1] > 0.0 { follow(ends[1])? } else { (Vec::new(), true) };
        let (mut points, rest): (Vec<PlanePoint>, Vec<PlanePoint>) = (before.0, after.0);
        points.reverse();
        points.extend(rest);
        let passages = self.map.passages();
        Some(PlaneCurve {
            kind: LocusKind::Graze,
            itinerary: ContactItinerary::new(passages, vec![PassageSet::NONE]).to_string(),
            points,
            whole: before.1 && after.1,
        })
    }

    fn point(&self, point: &CurvePoint) -> PlanePoint {
        let offset = |axis: usize| {
            point.parameters[self.request.parameters[axis]] - self.axes[axis].grazing_value
        };
        PlanePoint {
            at: [offset(0), offset(1)],
            stable: point.multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0),
            physical: point.is_physical(),
            label: None,
        }
    }

    /// Physical parts of loci; those of the map only inside its window.
    fn loci(&self, direct: bool) -> Result<Vec<PlaneCurve>, AnalysisError> {
        let passages = self.map.passages();
        let named = &self.request.itineraries;
        let itineraries = match named.is_empty() {
            true => ContactItinerary::all(passages, (DEFAULT_PASSAGES / passages.max(1)).max(1)),
            false => named.iter().map(|one| ContactItinerary::parse(one, passages)).collect(),
        };
        let mut itineraries = itineraries?;
        itineraries.retain(|itinerary| itinerary.contacts() > 0);
        let request = LociRequest {
            plane: self.places,
            range: self.request.ranges[0],
            at: vec![0.0; self.map.parameters.len()],
            kinds: LocusKind::LOCAL.to_vec(),
            itineraries,
            direct,
        };
        let found = loci(self.scene, self.orbit, self.map, &request, &NoProgress)?.loci;
        let own = self.request.overlay.contains(&ChartOverlay::Graze);
        let is_own =
            |locus: &Locus| locus.kind == LocusKind::Graze && locus.itinerary.contacts() == 0;
        let others = found.iter().filter(|locus| !(own && is_own(locus)));
        Ok(others.flat_map(|locus| self.stretches(locus, direct)).collect())
    }

    /// Parts of a locus that are drawn.
    fn stretches(&self, locus: &Locus, direct: bool) -> Vec<PlaneCurve> {
        let mut stretches = Vec::new();
        let drawn = |point: &&[_]| point.len() > 1;
        let parts = locus.points.split(|point| !(point.physical && (direct || point.inside)));
        for part in parts.filter(drawn) {
            let points = part.iter().map(|point| PlanePoint {
                at: self.places.map(|place| point.parameters[place]),
                stable: point.stable,
                physical: point.physical,
                label: point.label.map(|label| label.label()),
            });
            stretches.push(PlaneCurve {
                kind: locus.kind,
                itinerary: locus.itinerary.to_string(),
                points: points.collect(),
                whole: !locus.ends.iter().any(|end| end.is_early()),
            });
        }
        stretches
    }
}
