//! A two-parameter chart as plain data.

use serde::{Deserialize, Serialize};

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

/// Curves of one kind laid over a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlay {
    /// What they are.
    pub what: ChartOverlay,
    /// The curves, in offsets of the chart's parameters; none where none was found.
    pub curves: Vec<PlaneCurve>,
}

/// What an orbit settles on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartAttractor {
    /// Period in nominal returns, those of the grazing orbit: forcing periods over theirs.
    pub period: Period,
    /// Whether the orbit has no period yet and still comes nearer to one.
    #[serde(default)]
    pub converging: bool,
    /// Which passages make contact, return by return; `None` without a period, and where nothing
    /// but itineraries is shown.
    pub itinerary: Option<ContactItinerary>,
    /// Name of the orbit, `None` without a period; its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Contacts over all kept iterates.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate, of a periodic orbit by its multipliers, else over as
    /// many iterates as were kept; `None` where the orbit ended early, in a cell that was not
    /// computed and, unless exponents are shown, where direct simulation made an iterate.
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an orbit without a period.
    #[serde(default)]
    pub lyapunov_error: Option<f64>,
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
    /// A period in nominal returns, with contacts.
    Period(usize),
    /// Not settled yet: the orbit still comes nearer to a period.
    Converging,
    /// No period up to the longest looked for.
    NoPeriod,
    /// The map alone, beyond its window: also where it left every bound.
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
