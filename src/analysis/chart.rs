//! Two-parameter charts: what the map settles on, cell by cell of a grid of parameters.
//!
//! One idea: every cell starts from the fixed point of `P_smooth` at its own parameters, so that no
//! cell knows of another: as many are iterated in step as the map has lanes, on all cores, and no
//! result depends on either.

use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::diagram::{
    FrozenSweep, Observer, Settled, SmoothFixedPoint, Start, SweptMap, Timing, kept_contacts, made,
    name, offsets, outside,
};
use super::error::AnalysisError;
use super::progress::Progress;
use super::section_frame::itinerary;
use crate::expansion::{LocalMap, MapWindow};
use crate::iteration::{HornerMap, OrbitEnd, OrbitName, OrbitRequest, Period};
use crate::model::{ChartRequest, Digest, Observable, Scene};
use crate::orbit::GrazingOrbit;

/// A two-parameter chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// The two parameters, the horizontal one first.
    pub axes: [ChartAxis; 2],
    /// Names of the surfaces that graze, in the model's order: that of the hits in the names of
    /// orbits.
    pub surfaces: Vec<String>,
    /// Iterates dropped in each cell.
    pub transient: usize,
    /// Longest period looked for; twice as many iterates are kept.
    pub longest_period: usize,
    /// Row by row from the least offset of the second parameter, each from the least of the first.
    pub cells: Vec<ChartCell>,
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
    /// Largest Lyapunov exponent per iterate, over as many iterates as were kept; `None` where the
    /// orbit ended early.
    pub lyapunov: Option<f64>,
    /// How the orbit ended.
    pub end: OrbitEnd,
    /// Kept iterates outside the window in which the map is to be trusted.
    pub outside: usize,
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

    /// The chart without its times: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        Self { timing: Timing::default(), ..self.clone() }
    }
}

/// The chart that a scene asks for, by the map.
///
/// Every cell starts at the fixed point of `P_smooth` at its parameters, so that a chart shows one
/// attractor where there are several; a diagram that carries its state shows the others.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if a parameter is no variable of the map.
pub fn chart(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ChartRequest,
    progress: &dyn Progress,
) -> Result<Chart, AnalysisError> {
    let axis = |number: usize| {
        let parameter = request.parameters[number];
        ChartAxis {
            parameter: scene.model.parameters[parameter].name.clone(),
            grazing_value: orbit.parameters()[parameter].to_f64(),
            offsets: offsets(request.ranges[number], request.points[number]),
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
    let itinerary = itinerary(scene, orbit);
    let surfaces = itinerary.surfaces.clone();
    let swept = FrozenSweep {
        map: HornerMap::new(map),
        start: SmoothFixedPoint::new(map),
        observer: Observer::new(scene, orbit, map, &Observable::EventFunction)?,
        itinerary,
    };
    let grid = Grid {
        map: &swept,
        axes: &axes,
        places,
        orbit: OrbitRequest::new(request.transient, 2 * request.keep, &map.window.state),
        window: &map.window,
    };
    let clock = Instant::now();
    let cells = grid.cells(progress);
    let seconds = clock.elapsed().as_secs_f64();
    let timing = Timing {
        iterates: cells.iter().map(|cell| made(cell.end, &grid.orbit)).sum(),
        seconds,
        total_seconds: seconds,
    };
    Ok(Chart {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        axes,
        surfaces,
        transient: request.transient,
        longest_period: request.keep,
        cells,
        timing,
    })
}

/// The cells to be computed.
struct Grid<'a> {
    map: &'a FrozenSweep,
    axes: &'a [ChartAxis; 2],
    /// Positions of the axes' parameters among the map's; the others stay at 0.
    places: [usize; 2],
    orbit: OrbitRequest,
    window: &'a MapWindow,
}

impl Grid<'_> {
    /// All cells, as many at a time as the map has lanes, on all cores.
    fn cells(&self, progress: &dyn Progress) -> Vec<ChartCell> {
        let [columns, rows] = [&self.axes[0].offsets, &self.axes[1].offsets].map(Vec::len);
        let count = columns * rows;
        let lanes = self.map.lanes();
        progress.expect(count as u64);
        let block = |number: usize| {
            let cells = number * lanes..count.min((number + 1) * lanes);
            let starts: Vec<Start> = cells.map(|cell| self.start(cell)).collect();
            let settled = self.map.settle(&starts, &self.orbit);
            progress.advance(starts.len() as u64);
            let settled = settled.iter().zip(&starts);
            settled.map(|(settled, start)| self.cell(settled, start)).collect::<Vec<_>>()
        };
        let blocks = (0..count.div_ceil(lanes)).into_par_iter();
        blocks.map(block).collect::<Vec<_>>().concat()
    }

    /// Where a cell starts.
    fn start(&self, cell: usize) -> Start {
        let [horizontal, vertical] = self.axes;
        let (row, column) = (cell / horizontal.offsets.len(), cell % horizontal.offsets.len());
        let mut parameters = vec![0.0; self.map.parameters()];
        parameters[self.places[0]] = horizontal.offsets[column];
        parameters[self.places[1]] = vertical.offsets[row];
        Start { state: self.map.start(&parameters), parameters }
    }

    fn cell(&self, settled: &Settled, start: &Start) -> ChartCell {
        let (orbit, parameters) = (&settled.orbit, &start.parameters);
        ChartCell {
            period: orbit.period,
            orbit: name(self.map, orbit, parameters),
            kept_contacts: kept_contacts(orbit),
            lyapunov: settled.lyapunov,
            end: orbit.end,
            outside: outside(orbit, parameters, self.window),
        }
    }
}
