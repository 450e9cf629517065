//! Two-parameter charts: what the map settles on, cell by cell of a grid of parameters.
//!
//! One idea: every cell starts from a state of its own, so that no cell knows of another: as many
//! are iterated in step as the map has lanes, on all cores, and no result depends on either.

use std::cell::OnceCell;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::diagram::{
    Entry, Settled, Shares, SweepSubject, SweptMap, Timing, kept_contacts, name, settle, states,
};
use super::error::AnalysisError;
use super::escape::{EscapeBound, escape_bounds};
use super::progress::{Part, Progress, keep, recalled};
use super::section_frame::itinerary;
use crate::expansion::{LocalMap, MapWindow};
use crate::iteration::{OrbitEnd, OrbitName, OrbitRequest, Period};
use crate::model::{ChartRequest, Digest, Method, Observable, Scene, even_offsets};
use crate::orbit::GrazingOrbit;

/// A two-parameter chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// What computed it.
    pub method: Method,
    /// The two parameters, the horizontal one first.
    pub axes: [ChartAxis; 2],
    /// Names of the surfaces that graze, in the model's order: that of the hits in the names of
    /// orbits.
    pub surfaces: Vec<String>,
    /// Where every cell started, in offsets of the section's coordinates; `None` beside the fixed
    /// point of `P_smooth` at the cell's parameters.
    pub start: Option<Vec<f64>>,
    /// Iterates dropped in each cell.
    pub transient: usize,
    /// Longest period looked for; twice as many iterates are kept.
    pub longest_period: usize,
    /// How far the coordinates of the section may go before an orbit has escaped.
    pub escape: Vec<EscapeBound>,
    /// Row by row from the least offset of the second parameter, each from the least of the first.
    pub cells: Vec<ChartCell>,
    /// Share of the kept iterates that the map made, the mean of all cells.
    pub by_map: f64,
    /// Share of the kept iterates outside the window, the mean of all cells.
    pub outside: f64,
    /// How long it took.
    pub timing: Timing,
}

/// One axis of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartAxis {
    /// Name of the parameter.
    pub parameter: String,
    /// Its grazing value, from which the offsets count.
    pub grazing_value: f64,
    /// Offsets of the columns or rows, increasing.
    pub offsets: Vec<f64>,
}

/// What the map settles on at two parameter values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartCell {
    /// Period in iterates.
    pub period: Period,
    /// Name of the orbit, `None` without a period; its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Contacts over all kept iterates.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate, over as many iterates as were kept; `None` for
    /// direct simulation, where a guarded orbit leaves the window, and where the orbit ended early.
    pub lyapunov: Option<f64>,
    /// How the orbit ended.
    pub end: OrbitEnd,
    /// Share of the kept iterates that the map made; the others are direct returns.
    pub by_map: f64,
    /// Share of the kept iterates outside the window in which the map is to be trusted.
    pub outside: f64,
}

impl Chart {
    /// The cells with their offsets, the horizontal parameter's first.
    pub fn located(&self) -> impl Iterator<Item = ([f64; 2], &ChartCell)> {
        let [horizontal, vertical] = &self.axes;
        let grid = vertical
            .offsets
            .iter()
            .flat_map(|&row| horizontal.offsets.iter().map(move |&column| [column, row]));
        grid.zip(&self.cells)
    }

    /// Whether the map alone was used beyond its window in a cell: also where it left every bound.
    pub fn is_outside(&self, cell: &ChartCell) -> bool {
        let left = cell.outside > 0.0 || cell.end != OrbitEnd::Completed;
        self.method == Method::Map && left
    }

    /// Whether the orbit of a cell escaped or has no image.
    pub fn is_escaped(&self, cell: &ChartCell) -> bool {
        !self.is_outside(cell) && cell.end != OrbitEnd::Completed
    }

    /// Cells in which the map alone was used beyond its window.
    pub fn outside(&self) -> usize {
        self.cells.iter().filter(|cell| self.is_outside(cell)).count()
    }

    /// The chart without its times: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        Self { timing: Timing::default(), ..self.clone() }
    }
}

/// Bytes that the charts of a scene take in memory.
pub fn chart_bytes(scene: &Scene) -> u64 {
    /// Of a cell, with the name of its orbit, while blocks of cells are put together.
    const CELL: usize = 300;
    let cells = |request: &ChartRequest| request.points[0] * request.points[1];
    let charts = |request: &ChartRequest| request.starts.count() * request.with.len();
    let bytes = |request: &ChartRequest| (CELL * cells(request) * charts(request)) as u64;
    scene.charts.iter().map(bytes).sum()
}

/// The charts that a scene asks for: one for each method and start.
///
/// Every cell starts at one state, or beside the fixed point of `P_smooth` at its parameters, a
/// billionth of the window's half-widths to one side and, where that orbit escapes, to the other
/// and further off, as a sweep does.
/// A chart shows one attractor where there are several; other starts, or a diagram that carries
/// its state, show the others. Periods that repel are left by a kick, as in
/// [`diagram`](super::diagram::diagram).
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if a parameter is no variable of the map;
/// [`AnalysisError::NotACoordinate`], [`AnalysisError::NoWidth`] for starts that the section or the
/// window does not know; [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn chart(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ChartRequest,
    progress: &dyn Progress,
) -> Result<Vec<Chart>, AnalysisError> {
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
    let own = own.escaping_at(&bounds);
    let starts = match states(&request.starts, scene, map)? {
        states if states.is_empty() => vec![None],
        states => states.into_iter().map(Some).collect(),
    };
    let swept = request.with.iter().map(|&method| subject.swept(method));
    let swept = swept.collect::<Result<Vec<_>, _>>()?;
    let asked = swept.iter().flat_map(|map| starts.iter().map(move |start| (&**map, start)));
    let chart = |(number, (swept, start)): (usize, (&dyn SweptMap, &Option<Vec<f64>>))| {
        let clock = Instant::now();
        let (orbit_request, window) = (own.clone(), &map.window);
        let grid = Grid { map: swept, axes: &axes, places, orbit: orbit_request, window };
        let (cells, iterates) = grid.cells(start.as_deref(), &Part::new(progress, number));
        let shares = |cell: &ChartCell| {
            let ChartCell { by_map, outside, .. } = *cell;
            (Shares { by_map, outside }, 1)
        };
        let Shares { by_map, outside } = Shares::mean(cells.iter().map(shares));
        Chart {
            scene: scene.identifier.clone(),
            digest: scene.digest,
            method: swept.method(),
            axes: axes.clone(),
            surfaces: itinerary(scene, orbit).surfaces,
            start: start.clone(),
            transient: request.transient,
            longest_period: request.keep,
            escape: escape.clone(),
            by_map,
            outside,
            cells,
            timing: Timing::since(clock, iterates),
        }
    };
    Ok(asked.enumerate().map(chart).collect())
}

/// The cells to be computed.
struct Grid<'a> {
    map: &'a dyn SweptMap,
    axes: &'a [ChartAxis; 2],
    /// Positions of the axes' parameters among the map's; the others stay at 0.
    places: [usize; 2],
    orbit: OrbitRequest,
    window: &'a MapWindow,
}

impl Grid<'_> {
    /// All cells, as many at a time as the map has lanes, on all cores, and the iterates that they
    /// took.
    fn cells(&self, start: Option<&[f64]>, progress: &dyn Progress) -> (Vec<ChartCell>, u64) {
        let [columns, rows] = [&self.axes[0].offsets, &self.axes[1].offsets].map(Vec::len);
        let count = columns * rows;
        let lanes = self.map.lanes();
        progress.expect(count as u64);
        let block = |number: usize| {
            let cells = number * lanes..count.min((number + 1) * lanes);
            let (units, place) = (cells.len() as u64, [number as u64]);
            if let Some(kept) = recalled(progress, &place) {
                progress.advance(units);
                return kept;
            }
            let entries: Vec<Entry> = cells.map(|cell| self.entry(cell)).collect();
            let found = settle(self.map, entries.clone(), start, &self.orbit);
            progress.advance(units);
            let iterates = found.iter().map(|found| found.iterates).sum::<u64>();
            let cells = found.iter().zip(&entries);
            let cells = cells.map(|(found, entry)| self.cell(&found.settled, &entry.parameters));
            let block: (Vec<ChartCell>, u64) = (cells.collect(), iterates);
            keep(progress, &place, &block);
            block
        };
        let blocks = (0..count.div_ceil(lanes)).into_par_iter().map(block);
        let (cells, iterates): (Vec<_>, Vec<_>) = blocks.unzip();
        (cells.into_iter().flatten().collect(), iterates.into_iter().sum())
    }

    /// Where a cell starts.
    fn entry(&self, cell: usize) -> Entry {
        let [horizontal, vertical] = self.axes;
        let (row, column) = (cell / horizontal.offsets.len(), cell % horizontal.offsets.len());
        let mut parameters = vec![0.0; self.map.parameters()];
        parameters[self.places[0]] = horizontal.offsets[column];
        parameters[self.places[1]] = vertical.offsets[row];
        Entry { parameters, carried: None }
    }

    fn cell(&self, settled: &Settled, parameters: &[f64]) -> ChartCell {
        let orbit = &settled.orbit;
        let Shares { by_map, outside } =
            Shares::of(self.map.method(), orbit, parameters, self.window);
        ChartCell {
            period: orbit.period,
            orbit: name(self.map, orbit, parameters),
            kept_contacts: kept_contacts(orbit),
            lyapunov: settled.lyapunov,
            end: orbit.end,
            by_map,
            outside,
        }
    }
}
