//! Two-parameter charts: what the map settles on, cell by cell of a grid of parameters.
//!
//! One idea: every cell starts from states of its own, so that no cell knows of another: as many
//! are iterated in step as the map has lanes, on all cores, and no result depends on either. Only
//! cells along the borders of what is shown are computed, unless all are asked for.

mod grid;
mod overlay;

use std::cell::OnceCell;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::diagram::{Shares, SweepSubject, SweptMap, Timing, states};
use super::error::AnalysisError;
use super::escape::{EscapeBound, escape_bounds};
use super::periodic::ContactItinerary;
use super::progress::{Part, Progress};
use super::section_frame::itinerary;
use crate::expansion::LocalMap;
use crate::iteration::{OrbitEnd, OrbitName, OrbitRequest, Period};
use crate::model::{
    ChartObservable, ChartRequest, Digest, Method, Observable, Scene, even_offsets,
};
use crate::orbit::GrazingOrbit;
use grid::Grid;
pub use overlay::Overlay;
use overlay::Plane;

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
    /// What is shown.
    pub observe: ChartObservable,
    /// Where every cell started, in offsets of the section's coordinates; `None` beside the fixed
    /// point of `P_smooth` at the cell's parameters, and where several starts were taken together.
    pub start: Option<Vec<f64>>,
    /// The starts that were taken together.
    pub starts: Vec<Vec<f64>>,
    /// Most attractors of a cell.
    pub attractors: usize,
    /// Iterates dropped in each cell.
    pub transient: usize,
    /// Longest period looked for; twice as many iterates are kept.
    pub longest_period: usize,
    /// How far the coordinates of the section may go before an orbit has escaped.
    pub escape: Vec<EscapeBound>,
    /// Row by row from the least offset of the second parameter, each from the least of the first.
    pub cells: Vec<ChartCell>,
    /// How many of them were computed.
    pub computed: usize,
    /// Curves laid over them.
    pub overlay: Vec<Overlay>,
    /// Share of the kept iterates that the map made, the mean of all attractors that were computed.
    pub by_map: f64,
    /// Share of the kept iterates outside the window, the mean of the same.
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
    /// That of the first start from which the orbit stays; of the last if from none.
    #[serde(flatten)]
    pub attractor: ChartAttractor,
    /// Other attractors, to which other starts lead.
    pub others: Vec<ChartAttractor>,
    /// Whether orbits of this very cell were followed. Otherwise it stands among computed cells
    /// that are alike, and has what one of them has.
    pub computed: bool,
}

/// What an orbit settles on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartAttractor {
    /// Period in iterates.
    pub period: Period,
    /// Which passages make contact, return by return; `None` without a period, and where nothing
    /// but itineraries is shown.
    pub itinerary: Option<ContactItinerary>,
    /// Name of the orbit, `None` without a period; its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Contacts over all kept iterates.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate, over as many iterates as were kept; `None` where the
    /// orbit ended early, in a cell that was not computed and, unless exponents are shown, where
    /// direct simulation made an iterate.
    pub lyapunov: Option<f64>,
    /// How the orbit ended.
    pub end: OrbitEnd,
    /// Share of the kept iterates that the map made; the others are direct returns.
    pub by_map: f64,
    /// Share of the kept iterates outside the window in which the map is to be trusted.
    pub outside: f64,
}

/// What a chart of periods tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChartClass {
    /// One return, without contact at a surface that grazes.
    WithoutContact,
    /// A period in returns, with contacts.
    Period(usize),
    /// No period up to the longest looked for.
    NoPeriod,
    /// The map alone, beyond its window: also where it left every bound.
    Outside,
    /// The orbit escaped or has no image.
    Escaped,
}

impl ChartClass {
    fn of(method: Method, attractor: &ChartAttractor) -> Self {
        let completed = attractor.end == OrbitEnd::Completed;
        if method == Method::Map && (attractor.outside > 0.0 || !completed) {
            return Self::Outside;
        }
        let hits = attractor.orbit.iter().flat_map(|name| &name.hits).sum::<u32>();
        match attractor.period {
            _ if !completed => Self::Escaped,
            Period::NotFound => Self::NoPeriod,
            Period::Periodic(1) if attractor.kept_contacts == 0 && hits == 0 => {
                Self::WithoutContact
            }
            Period::Periodic(period) => Self::Period(period),
        }
    }
}

impl ChartCell {
    /// All attractors found.
    pub fn attractors(&self) -> impl Iterator<Item = &ChartAttractor> {
        std::iter::once(&self.attractor).chain(&self.others)
    }
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

    /// What an attractor of the chart counts as.
    pub fn class(&self, attractor: &ChartAttractor) -> ChartClass {
        ChartClass::of(self.method, attractor)
    }

    /// Cells whose first attractor counts as this.
    pub fn count(&self, class: ChartClass) -> usize {
        self.cells.iter().filter(|cell| self.class(&cell.attractor) == class).count()
    }

    /// The chart without its times: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        Self { timing: Timing::default(), ..self.clone() }
    }
}

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
    request: &ChartRequest,
    progress: &dyn Progress,
) -> Result<Vec<Chart>, AnalysisError> {
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
    let swept = request.with.iter().map(|&method| subject.swept(method));
    let swept = swept.collect::<Result<Vec<_>, _>>()?;
    let plane = Plane { scene, orbit, map, request, axes: &axes, places };
    let overlays = request.with.iter().map(|&method| Ok((method, plane.overlays(method)?)));
    let overlays = overlays.collect::<Result<Vec<_>, AnalysisError>>()?;
    let overlay = |method: Method| {
        let found = overlays.iter().find(|(other, _)| *other == method);
        found.map_or_else(Vec::new, |(_, found)| found.clone())
    };
    let asked =
        swept.iter().flat_map(|map| starts.chunks(together).map(move |starts| (&**map, starts)));
    let chart = |(number, (swept, starts)): (usize, Swept<'_>)| {
        let clock = Instant::now();
        let grid = Grid {
            map: swept,
            axes: &axes,
            places,
            orbit: own.clone(),
            window: &map.window,
            starts,
            request,
        };
        let (cells, iterates) = grid.cells(&Part::new(progress, number));
        let computed = cells.iter().filter(|cell| cell.computed);
        let shares = |attractor: &ChartAttractor| {
            let ChartAttractor { by_map, outside, .. } = *attractor;
            (Shares { by_map, outside }, 1)
        };
        let followed = computed.clone().flat_map(ChartCell::attractors);
        let Shares { by_map, outside } = Shares::mean(followed.map(shares));
        let together = request.attractors > 1;
        Chart {
            scene: scene.identifier.clone(),
            digest: scene.digest,
            method: swept.method(),
            axes: axes.clone(),
            surfaces: itinerary(scene, orbit).surfaces,
            observe: request.observe,
            start: starts[0].clone().filter(|_| !together),
            starts: starts.iter().flatten().filter(|_| together).cloned().collect(),
            attractors: request.attractors,
            transient: request.transient,
            longest_period: request.keep,
            escape: escape.clone(),
            by_map,
            outside,
            computed: computed.count(),
            overlay: overlay(swept.method()),
            cells,
            timing: Timing::since(clock, iterates),
        }
    };
    Ok(asked.enumerate().map(chart).collect())
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
