//! A two-parameter chart as plain data.

use serde::{Deserialize, Serialize};

use crate::analysis::basin::BlockProbes;
use crate::analysis::diagram::Timing;
use crate::analysis::loci::PlaneCurve;
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::section_frame::EscapeBound;
use crate::iteration::{OrbitEnd, OrbitName, Period};
use crate::model::{ChartObservable, ChartOverlay, Digest, Method};

/// A two-parameter chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Method that computed the chart.
    pub method: Method,
    /// The two parameters, the horizontal one first.
    pub axes: [ChartAxis; 2],
    /// Names of the surfaces that graze, in the model's order, which is the order of the hits in
    /// names of orbits.
    pub surfaces: Vec<String>,
    /// Quantity shown.
    pub observe: ChartObservable,
    /// Start of every cell, as offsets of the section's coordinates; `None` for a start beside the
    /// fixed point of `P_smooth` at the cell's parameters, and if several starts are taken
    /// together.
    pub start: Option<Vec<f64>>,
    /// Starts that are taken together.
    pub starts: Vec<Vec<f64>>,
    /// Largest number of attractors of a cell.
    pub attractors: usize,
    /// Iterates dropped in each cell.
    pub transient: usize,
    /// Longest period looked for; twice as many iterates are kept.
    pub longest_period: usize,
    /// Escape bounds of the section's coordinates.
    pub escape: Vec<EscapeBound>,
    /// Cells: rows by increasing offset of the second parameter, in a row by increasing offset of
    /// the first.
    pub cells: Vec<ChartCell>,
    /// Number of cells computed.
    pub computed: usize,
    /// Probes of the blocks of cells that were filled.
    #[serde(default)]
    pub probes: BlockProbes,
    /// Curves laid over the cells.
    pub overlay: Vec<Overlay>,
    /// Fraction of the kept iterates made by the map, as the mean over all computed attractors.
    pub by_map: f64,
    /// Fraction of the kept iterates outside the window, as the mean over all computed attractors.
    pub outside: f64,
    /// Computing time.
    pub timing: Timing,
}

/// One axis of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartAxis {
    /// Name of the parameter.
    pub parameter: String,
    /// Grazing value of the parameter, to which offsets are relative.
    pub grazing_value: f64,
    /// Offsets of the columns or rows, increasing.
    pub offsets: Vec<f64>,
}

/// Attractors of the map at two parameter values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartCell {
    /// Attractor of the first start whose orbit stays; if none stays, the last orbit.
    #[serde(flatten)]
    pub attractor: ChartAttractor,
    /// Other attractors, reached from other starts.
    pub others: Vec<ChartAttractor>,
    /// Whether orbits of this cell were computed. Otherwise the cell lies among computed cells of
    /// one class and copies one of them.
    pub computed: bool,
}

/// Curves of one kind laid over a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlay {
    /// Kind of the curves.
    pub what: ChartOverlay,
    /// Curves, in offsets of the chart's parameters; empty if none was found.
    pub curves: Vec<PlaneCurve>,
}

/// Attractor that an orbit settles on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartAttractor {
    /// Period in nominal returns (those of the grazing orbit): forcing periods of the orbit over
    /// those of the grazing orbit.
    pub period: Period,
    /// Whether the orbit has no period yet but still converges to one.
    #[serde(default)]
    pub converging: bool,
    /// Contacts of the passages, return by return; `None` without a period, or if the chart does
    /// not show itineraries.
    pub itinerary: Option<ContactItinerary>,
    /// Name of the orbit; `None` without a period. Its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Number of passages with contact over all iterates after the transient.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate: from the multipliers for a periodic orbit, otherwise
    /// over as many iterates as were kept. `None` after an early end, in a cell that was not
    /// computed, and if direct simulation made an iterate (unless exponents are shown).
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an orbit without a period.
    #[serde(default)]
    pub lyapunov_error: Option<f64>,
    /// End of the orbit.
    pub end: OrbitEnd,
    /// Fraction of the kept iterates made by the map; the others are direct returns.
    pub by_map: f64,
    /// Fraction of the kept iterates outside the window in which the map is trusted.
    pub outside: f64,
}

/// Classes of attractors in a chart of periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChartClass {
    /// Period one without contact at a surface that grazes.
    WithoutContact,
    /// Period in nominal returns, with contacts.
    Period(usize),
    /// Orbit that still converges to a period.
    Converging,
    /// No period up to the longest looked for.
    NoPeriod,
    /// The map, used alone, left its window or every bound.
    Outside,
    /// The orbit escaped or has no image.
    Escaped,
}

impl ChartClass {
    pub(super) fn of(method: Method, attractor: &ChartAttractor) -> Self {
        let completed = attractor.end == OrbitEnd::Completed;
        if method == Method::Map && (attractor.outside > 0.0 || !completed) {
            return Self::Outside;
        }
        let hits = attractor.orbit.iter().flat_map(|name| &name.hits).sum::<u32>();
        match attractor.period {
            _ if !completed => Self::Escaped,
            Period::NotFound if attractor.converging => Self::Converging,
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
    /// Cells with their offsets, the horizontal parameter's first.
    pub fn located(&self) -> impl Iterator<Item = ([f64; 2], &ChartCell)> {
        let [horizontal, vertical] = &self.axes;
        let grid = vertical
            .offsets
            .iter()
            .flat_map(|&row| horizontal.offsets.iter().map(move |&column| [column, row]));
        grid.zip(&self.cells)
    }

    /// Class of an attractor of the chart.
    pub fn class(&self, attractor: &ChartAttractor) -> ChartClass {
        ChartClass::of(self.method, attractor)
    }

    /// Number of cells whose first attractor has the given class.
    pub fn count(&self, class: ChartClass) -> usize {
        self.cells.iter().filter(|cell| self.class(&cell.attractor) == class).count()
    }

    /// The chart with its times reset: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        Self { timing: Timing::default(), ..self.clone() }
    }
}
