//! A checked scene: a model and the requested results.

mod diagram;
mod document;
mod load;
mod oscillator;
mod period;
mod tables;

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::graph::NodeId;
use super::oscillator::Model;
use crate::numeric::{Dd, FloatFormat, unbounded, unbounded_number};

/// One task: the model, the passage that grazes, the active parameters, the window, and the
/// accuracy.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name of the file as it was given, for messages.
    pub file_name: String,
    /// Identifier for file and module names: the file's stem, checked (`[a-z][a-z0-9_]*`).
    pub identifier: String,
    /// Text of the scene after overrides, from which it can be read again.
    pub text: Arc<str>,
    /// Place in that text, in bytes, at which the tables of a request begin; `None` without a
    /// request.
    pub(in crate::model) request_at: Option<usize>,
    /// Digest of that text, which every output repeats.
    pub digest: Digest,
    /// The oscillator.
    pub model: Model,
    /// The grazing passages, and the parameters adjusted for the graze.
    pub grazing: Grazing,
    /// Section on which the window is stated. The map is taken on it too, unless
    /// [any](SectionRule::Any) section is allowed.
    pub section: Section,
    /// Choice of the section of the map.
    pub section_rule: SectionRule,
    /// Active parameters and orders.
    pub expansion: Expansion,
    /// Window in which the map is used.
    pub window: Window,
    /// Shape and precision of the emitted code.
    pub emit: Emit,
    /// Settings of direct simulation.
    pub direct: Direct,
    /// Requested bifurcation diagrams.
    pub diagrams: Vec<DiagramRequest>,
    /// Requested two-parameter charts.
    pub charts: Vec<ChartRequest>,
    /// Requested basins of attraction.
    pub basins: Vec<BasinPlan>,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// FNV-1a digest (64 bits) of a text or of bytes; written as 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Digest(pub u64);

impl Digest {
    /// Digest of a text.
    pub fn of(text: &str) -> Self {
        Self::of_bytes(text.as_bytes())
    }

    /// Digest of bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let step =
            |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        Self(bytes.iter().fold(0xcbf2_9ce4_8422_2325, step))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:016x}", self.0)
    }
}

impl From<Digest> for String {
    fn from(digest: Digest) -> Self {
        digest.to_string()
    }
}

impl TryFrom<String> for Digest {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let digits = u64::from_str_radix(&text, 16).ok().filter(|_| text.len() == 16);
        digits.map(Self).ok_or_else(|| format!("expected 16 hexadecimal digits, found `{text}`"))
    }
}

/// `[grazing]`.
#[derive(Clone, Debug)]
pub struct Grazing {
    /// Surfaces grazed in one period, in order (indices into [`Model::surfaces`]).
    pub passages: Vec<usize>,
    /// Surfaces that the orbit hits between its grazes.
    pub hits: Hits,
    /// Parameters adjusted so that the orbit grazes, one per independent graze.
    pub solve_for: Vec<usize>,
    /// Forcing periods of the orbit.
    pub periods: usize,
    /// Guess of the first grazing point, per component of the full state; `None`: start from the
    /// steady state.
    pub guess: Option<Vec<f64>>,
    /// Symmetry of the orbit.
    pub symmetry: Symmetry,
}

/// Surfaces that a grazing orbit hits, apart from those that it grazes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hits {
    /// The surfaces, each once, increasing.
    pub surfaces: Vec<usize>,
    /// Grazes and hits of one period in order, from the first graze; `None`: any number of hits.
    pub order: Option<Vec<OrbitContact>>,
}

/// A contact of a grazing orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrbitContact {
    /// The orbit touches the surface with zero normal velocity.
    Graze(usize),
    /// The orbit meets the surface with a normal velocity.
    Hit(usize),
}

impl OrbitContact {
    /// Index of the surface.
    pub fn surface(self) -> usize {
        match self {
            Self::Graze(surface) | Self::Hit(surface) => surface,
        }
    }
}

/// Symmetry of a periodic orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// No symmetry is assumed.
    None,
    /// `(x, theta) -> (-x, theta + period/2)`.
    HalfPeriod,
}

/// `[section]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Section {
    /// `h' = 0` near the grazing point.
    Tangency,
    /// A fixed forcing phase.
    Stroboscopic(StroboscopicPhase),
}

/// Choice of the section on which a map is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SectionRule {
    /// The section that the scene names.
    #[default]
    Named,
    /// The section on which the map for the tolerance costs least; the scene is on its tangency
    /// section until that section is known.
    Any,
}

/// The phase of a stroboscopic section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StroboscopicPhase {
    /// The phase of the (first) grazing point.
    Grazing,
    /// A given phase.
    At(Dd),
}

/// `[expansion]`.
#[derive(Clone, Debug)]
pub struct Expansion {
    /// Parameters kept as variables (indices into [`Model::parameters`]).
    pub active: Vec<usize>,
    /// Truncation orders, or the tolerance for which they are chosen.
    pub orders: Orders,
    /// Weights that differ from the default (the deviation of a state or parameter has weight 2),
    /// by name.
    pub weights: Vec<(String, u32)>,
}

/// Truncation orders in a scene: given, or chosen for a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orders {
    /// Given orders.
    Fixed(MapOrders),
    /// The cheapest orders whose error on the window is at most this tolerance.
    Tolerance(f64),
}

/// Truncation orders `(N, W)` of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapOrders {
    /// Truncation order `N` of `P_smooth`: the highest degree of its monomials.
    pub smooth_order: u32,
    /// Truncation order `W` of `D`: the highest weight of its monomials.
    pub contact_weight: u32,
}

impl MapOrders {
    /// The orders `(smooth_order, contact_weight)`.
    pub const fn new(smooth_order: u32, contact_weight: u32) -> Self {
        Self { smooth_order, contact_weight }
    }

    /// Componentwise maximum.
    pub fn max(self, other: Self) -> Self {
        self.zip(other, u32::max)
    }

    /// Componentwise minimum.
    pub fn min(self, other: Self) -> Self {
        self.zip(other, u32::min)
    }

    /// Componentwise sum.
    pub fn plus(self, other: Self) -> Self {
        self.zip(other, u32::saturating_add)
    }

    /// Whether neither order is below the other pair's order.
    pub fn reaches(self, other: Self) -> bool {
        self.max(other) == self
    }

    /// All pairs of orders from `(1, 1)` up to this one.
    pub fn pairs(self) -> impl Iterator<Item = Self> {
        (1..=self.smooth_order)
            .flat_map(move |n| (1..=self.contact_weight).map(move |w| Self::new(n, w)))
    }

    fn zip(self, other: Self, pick: impl Fn(u32, u32) -> u32) -> Self {
        Self::new(
            pick(self.smooth_order, other.smooth_order),
            pick(self.contact_weight, other.contact_weight),
        )
    }
}

impl fmt::Display for MapOrders {
    /// Writes `(N, W)`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "({}, {})", self.smooth_order, self.contact_weight)
    }
}

/// `[window]`: half-widths about the grazing point, in offsets.
///
/// Bounds that the scene does not name are infinite: such a bound is open, and is measured when
/// there is a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Largest `y²` (infinite if the scene does not name it).
    #[serde(with = "unbounded_number")]
    pub depth: f64,
    /// Half-width per component of the full state (infinite if the scene does not name it).
    #[serde(with = "unbounded")]
    pub state: Vec<f64>,
    /// Half-width per parameter (infinite if the scene does not name it).
    #[serde(with = "unbounded")]
    pub parameter: Vec<f64>,
}

impl Window {
    /// Largest `y²`, or 1e-3 if the scene does not name it: the depth for which orders are chosen
    /// and flights are planned before the window of a map is measured.
    pub fn assumed_depth(&self) -> f64 {
        if self.depth.is_finite() { self.depth } else { 1e-3 }
    }
}

/// `[direct]`: settings of direct simulation, alone or outside the window of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direct {
    /// An orbit has escaped if a coordinate of the section is farther from the section point than
    /// this many times the extent of the grazing orbit in that coordinate. The default is 100.
    pub escape: f64,
}

/// `[emit]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emit {
    /// Shape of the step.
    pub shape: Shape,
    /// Precision of the step.
    pub precision: EmitPrecision,
    /// Points per call of the lane kernel, if the scene names them.
    pub lanes: Option<usize>,
    /// Largest error of an image, absolute and per coordinate, for measuring and judging the
    /// window, if the scene names both orders and this tolerance.
    pub tolerance: Option<f64>,
}

impl Emit {
    /// Points per call of the lane kernel. The default is 64 bytes of numbers: 8 doubles or 16
    /// singles.
    pub fn lanes(&self, precision: FloatFormat) -> usize {
        self.lanes.unwrap_or(match precision {
            FloatFormat::F32 => 16,
            FloatFormat::F64 => 8,
        })
    }
}

/// Precision in which an emitted map is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitPrecision {
    /// A given precision.
    Given(FloatFormat),
    /// Single precision if it meets the scene's tolerance, double precision otherwise.
    Any,
}

impl EmitPrecision {
    /// Precision that is tried first.
    pub fn first(self) -> FloatFormat {
        match self {
            Self::Given(format) => format,
            Self::Any => FloatFormat::F32,
        }
    }
}

/// Shape of an emitted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// Chosen by the number of coefficients.
    Auto,
    /// `P_smooth ∘ D`, stage by stage.
    Factored,
    /// One polynomial pass.
    Composed,
    /// Stage by stage, with every compliant contact flown exactly.
    Flown,
}

/// `[[diagram]]`.
#[derive(Clone, Debug)]
pub struct DiagramRequest {
    /// Swept parameter (index into [`Model::parameters`]).
    pub parameter: usize,
    /// First and last offset from the grazing value.
    pub range: [f64; 2],
    /// Number of parameter values.
    pub points: usize,
    /// Distribution of the values over the range.
    pub spacing: Spacing,
    /// Starts of the sweeps.
    pub starts: Starts,
    /// Number of iterates dropped at each value.
    pub transient: usize,
    /// Number of iterates kept at each value.
    pub keep: usize,
    /// Observable on the vertical axis.
    pub observe: Observable,
    /// Direction of the sweep.
    pub direction: SweepDirection,
    /// Methods; the diagram is computed with each.
    pub with: Vec<Method>,
}

impl DiagramRequest {
    /// All offsets of the swept parameter, in increasing order; both ends of the range are exact.
    pub fn offsets(&self) -> Vec<f64> {
        let [first, last] = self.range;
        match &self.spacing {
            Spacing::Even => even_offsets(self.range, self.points),
            Spacing::Listed(values) => values.clone(),
            Spacing::Logarithmic => {
                let places = even_offsets([0.0, logarithm(last, first)], self.points);
                // Twice the square root: the power alone may overflow.
                let inner = |&place: &f64| match place.exp() {
                    power if power.is_finite() => first * power,
                    _ => first * (0.5 * place).exp() * (0.5 * place).exp(),
                };
                let mut offsets: Vec<f64> = places.iter().map(inner).collect();
                if let [_, .., end] = &mut offsets[..] {
                    *end = last;
                }
                offsets
            }
        }
    }
}

/// Logarithm of the quotient of two numbers of one sign, also if the quotient overflows.
fn logarithm(over: f64, under: f64) -> f64 {
    let quotient = over / under;
    let is_normal = quotient.is_finite() && quotient > 0.0;
    if is_normal { quotient.ln() } else { over.abs().ln() - under.abs().ln() }
}

/// Evenly spaced offsets, in increasing order; both ends are exact.
pub fn even_offsets([first, last]: [f64; 2], points: usize) -> Vec<f64> {
    let offset = |index: usize| {
        if index + 1 == points && points > 1 {
            return last;
        }
        let share = index as f64 / (points.max(2) - 1) as f64;
        let width = last - first;
        if width.is_finite() { first + share * width } else { (1.0 - share) * first + share * last }
    };
    (0..points).map(offset).collect()
}

/// Distribution of the values of a diagram over its range.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Spacing {
    /// Equal differences.
    #[default]
    Even,
    /// Equal ratios; both ends have one sign.
    Logarithmic,
    /// Given offsets, in increasing order.
    Listed(Vec<f64>),
}

/// Starts of the orbits of a diagram or chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Starts {
    /// Starts near the fixed point of `P_smooth`.
    #[default]
    Smooth,
    /// Offsets by component of the full state, `None` if the scene names none. Several starts give
    /// several sweeps or charts.
    Given(Vec<Vec<Option<f64>>>),
    /// Number of starts, spread evenly over the window.
    Spread(usize),
}

impl Starts {
    /// Number of starts.
    pub fn count(&self) -> usize {
        match self {
            Self::Smooth => 1,
            Self::Given(states) => states.len(),
            Self::Spread(count) => *count,
        }
    }
}

/// Observable of a diagram.
#[derive(Clone, Debug, PartialEq)]
pub enum Observable {
    /// The event function of the first passage's surface at the section.
    EventFunction,
    /// Speed at contact (0 without contact).
    ImpactSpeed,
    /// An expression of states and parameters.
    Expression {
        /// Expression as written: the label of the axis.
        text: String,
        /// Node of the expression in the model's graph.
        node: NodeId,
    },
}

/// Direction of a sweep; each value starts from the last state of the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepDirection {
    /// Increasing parameter.
    Up,
    /// Decreasing parameter.
    Down,
    /// Up, then down.
    Both,
}

/// Method by which an image is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The local map.
    Map,
    /// The local map inside its window, direct simulation outside.
    Guarded,
    /// Direct simulation.
    Direct,
    /// Polynomials of the return on boxes all over the region that orbits visit, direct simulation
    /// where there are none.
    Atlas,
}

impl Method {
    /// Whether the method needs no local map, but direct returns alone.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Direct | Self::Atlas)
    }
}

/// `[[chart]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartRequest {
    /// The two parameters, horizontal first.
    pub parameters: [usize; 2],
    /// First and last offset of each parameter.
    pub ranges: [[f64; 2]; 2],
    /// Number of points along each axis.
    pub points: [usize; 2],
    /// Whether every cell is computed, or only those along borders.
    pub every_cell: bool,
    /// Starts of the orbits of the cells.
    pub starts: Starts,
    /// Largest number of attractors in a cell. With 1, every start has a chart of its own. With
    /// more, the starts are combined, and a cell lists the attractors that they reach.
    pub attractors: usize,
    /// Number of iterates dropped.
    pub transient: usize,
    /// Longest period that is detected.
    pub keep: usize,
    /// Observable of the cells.
    pub observe: ChartObservable,
    /// Methods, with one chart for each.
    pub with: Vec<Method>,
    /// Curves drawn over the chart.
    pub overlay: Vec<ChartOverlay>,
    /// Itineraries, in digits, of the orbits whose loci are drawn; empty for all of the shortest
    /// ones.
    pub itineraries: Vec<String>,
}

impl ChartRequest {
    /// A chart with the defaults of a scene that names only parameters and ranges: 200 points along
    /// each axis, cells computed along borders, 1000 iterates dropped, periods up to 32, guarded
    /// iteration.
    pub fn new(parameters: [usize; 2], ranges: [[f64; 2]; 2]) -> Self {
        Self {
            parameters,
            ranges,
            points: [200; 2],
            every_cell: false,
            starts: Starts::Smooth,
            attractors: 1,
            transient: 1000,
            keep: 32,
            observe: ChartObservable::Period,
            with: vec![Method::Guarded],
            overlay: Vec::new(),
            itineraries: Vec::new(),
        }
    }

    /// Number of charts: one for each method, and for each start unless the starts are combined.
    pub fn count(&self) -> usize {
        let starts = if self.attractors > 1 { 1 } else { self.starts.count() };
        self.with.len() * starts
    }
}

/// Observable of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChartObservable {
    /// The period.
    Period,
    /// The itinerary: the passages with contact, return by return.
    Itinerary,
    /// The largest Lyapunov exponent.
    Lyapunov,
    /// The number of attractors.
    Attractors,
}

/// Curves drawn over a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChartOverlay {
    /// Grazing curve of the scene's orbit.
    Graze,
    /// Loci at which periodic orbits graze, fold, flip or lose stability to a torus.
    Loci,
}

/// `[[basin]]`: the settings in the scene; the others follow from the map.
#[derive(Clone, Debug, PartialEq)]
pub struct BasinPlan {
    /// Names of the two coordinates of the section that span the plane, the horizontal one first.
    pub axes: Option<[String; 2]>,
    /// First and last offset along each axis.
    pub ranges: Option<[[f64; 2]; 2]>,
    /// Cells along each axis.
    pub points: Option<[usize; 2]>,
    /// Whether the state of every cell is followed.
    pub every_cell: bool,
    /// Offsets of parameters by number in the model; others are 0.
    pub at: Vec<(usize, f64)>,
    /// Offsets of the coordinates that are not axes, by name; others are 0.
    pub start: Vec<(String, f64)>,
    /// Longest period of the saddles whose manifolds are drawn; `None` for no manifolds.
    pub manifolds: Option<usize>,
    /// Methods, with one basin for each.
    pub with: Vec<Method>,
}
