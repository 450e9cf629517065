//! A checked scene: a model and what is asked of it.

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

/// One task: the model, which passage grazes, which parameters are active, where and how
/// accurately.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name of the file as it was given, for messages.
    pub file_name: String,
    /// Identifier for file and module names: the file's stem, checked (`[a-z][a-z0-9_]*`).
    pub identifier: String,
    /// The scene's text after overrides: what the scene is read from again.
    pub text: Arc<str>,
    /// Digest of that text, as it stands in every output.
    pub digest: Digest,
    /// The oscillator.
    pub model: Model,
    /// Which orbit grazes and what is adjusted so that it does.
    pub grazing: Grazing,
    /// The section that the window is stated on, and that the map is taken on unless
    /// [any](SectionRule::Any) will do.
    pub section: Section,
    /// Which sections the map may be taken on.
    pub section_rule: SectionRule,
    /// Active parameters and orders.
    pub expansion: Expansion,
    /// Where the map is to be trusted.
    pub window: Window,
    /// The shape of the emitted code.
    pub emit: Emit,
    /// What orbits are given up by.
    pub direct: Direct,
    /// Bifurcation diagrams asked for.
    pub diagrams: Vec<DiagramRequest>,
    /// Two-parameter charts asked for.
    pub charts: Vec<ChartRequest>,
    /// Basins of attraction asked for.
    pub basins: Vec<BasinPlan>,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// FNV-1a digest (64 bits) of a text or of bytes; as text it is 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Digest(pub u64);

impl Digest {
    /// Of a text.
    pub fn of(text: &str) -> Self {
        Self::of_bytes(text.as_bytes())
    }

    /// Of bytes.
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
    /// Parameters adjusted so that the orbit grazes, one per independent graze.
    pub solve_for: Vec<usize>,
    /// Forcing periods of the orbit.
    pub periods: usize,
    /// Guess of the first grazing point, per full-state component; `None`: found from the steady
    /// state.
    pub guess: Option<Vec<f64>>,
    /// Symmetry of the orbit.
    pub symmetry: Symmetry,
}

/// Symmetry of a periodic orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// None assumed.
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

/// Which sections a map may be taken on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SectionRule {
    /// The one that the scene names.
    #[default]
    Named,
    /// The one whose map for the tolerance costs least; until that is known, the scene is on its
    /// tangency section.
    Any,
}

/// The phase of a stroboscopic section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StroboscopicPhase {
    /// The phase of the (first) grazing point.
    Grazing,
    /// This phase.
    At(Dd),
}

/// `[expansion]`.
#[derive(Clone, Debug)]
pub struct Expansion {
    /// Parameters kept as variables (indices into [`Model::parameters`]).
    pub active: Vec<usize>,
    /// Truncation orders, or the tolerance they are chosen for.
    pub orders: Orders,
    /// Weights that differ from the default (a state or parameter deviation has weight 2), by
    /// name.
    pub weights: Vec<(String, u32)>,
}

/// How a scene names the truncation orders of its map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orders {
    /// Given orders.
    Fixed(MapOrders),
    /// The cheapest orders whose error on the window is at most this.
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

    /// The larger of each order.
    pub fn max(self, other: Self) -> Self {
        self.zip(other, u32::max)
    }

    /// The smaller of each order.
    pub fn min(self, other: Self) -> Self {
        self.zip(other, u32::min)
    }

    /// The sum of each order.
    pub fn plus(self, other: Self) -> Self {
        self.zip(other, u32::saturating_add)
    }

    /// Whether neither order is below the other's.
    pub fn reaches(self, other: Self) -> bool {
        self.max(other) == self
    }

    /// Every pair of orders from `(1, 1)` up to this one.
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
    /// `(N, W)`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "({}, {})", self.smooth_order, self.contact_weight)
    }
}

/// `[window]`: half-widths about the grazing point, in offsets.
///
/// What the scene does not name is infinite: such a bound is open, and measured once there is a
/// map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Largest `y²` (infinite where the scene names none).
    #[serde(with = "unbounded_number")]
    pub depth: f64,
    /// Half-width per full-state component (infinite where the scene names none).
    #[serde(with = "unbounded")]
    pub state: Vec<f64>,
    /// Half-width per parameter (infinite where the scene names none).
    #[serde(with = "unbounded")]
    pub parameter: Vec<f64>,
}

impl Window {
    /// Largest `y²`, taken to be 1e-3 where the scene names none: the depth for which orders are
    /// chosen and flights are planned before the window of a map is measured.
    pub fn assumed_depth(&self) -> f64 {
        if self.depth.is_finite() { self.depth } else { 1e-3 }
    }
}

/// `[direct]`: what holds for orbits that are simulated, alone or where a map does not reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direct {
    /// An orbit has escaped where a coordinate of the section is farther from the section point
    /// than this many times the extent of the grazing orbit in that coordinate; 100 where the scene
    /// names no number.
    pub escape: f64,
}

/// `[emit]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emit {
    /// Shape of the step.
    pub shape: Shape,
    /// Numbers that it is run in.
    pub precision: EmitPrecision,
    /// Points per call of the lane kernel, where the scene names them.
    pub lanes: Option<usize>,
    /// Error of an image that the window is measured and judged by, absolute and per coordinate,
    /// where the scene names orders and this.
    pub tolerance: Option<f64>,
}

impl Emit {
    /// Points per call of the lane kernel: 64 bytes of numbers where the scene names none, 8
    /// doubles or 16 singles.
    pub fn lanes(&self, precision: FloatFormat) -> usize {
        self.lanes.unwrap_or(match precision {
            FloatFormat::F32 => 16,
            FloatFormat::F64 => 8,
        })
    }
}

/// Numbers that an emitted map is run in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitPrecision {
    /// These numbers.
    Given(FloatFormat),
    /// Single precision where it holds the scene's tolerance, double precision elsewhere.
    Any,
}

impl EmitPrecision {
    /// The numbers that are tried first.
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
    /// Decided by the number of coefficients.
    Auto,
    /// `P_smooth ∘ D`, stage by stage.
    Factored,
    /// One polynomial pass.
    Composed,
    /// Stage by stage, every compliant contact flown exactly.
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
    /// How the values are spread over the range.
    pub spacing: Spacing,
    /// Where sweeps start.
    pub starts: Starts,
    /// Iterates dropped at each value.
    pub transient: usize,
    /// Iterates kept at each value.
    pub keep: usize,
    /// Observable that is drawn.
    pub observe: Observable,
    /// Direction of the sweep.
    pub direction: SweepDirection,
    /// Computed by each of these.
    pub with: Vec<Method>,
}

impl DiagramRequest {
    /// Every offset of the swept parameter, increasing; both ends of the range are met exactly.
    pub fn offsets(&self) -> Vec<f64> {
        let [first, last] = self.range;
        match &self.spacing {
            Spacing::Even => even_offsets(self.range, self.points),
            Spacing::Listed(values) => values.clone(),
            Spacing::Logarithmic => {
                let places = even_offsets([0.0, logarithm(last, first)], self.points);
                // Twice the root: a power alone may be larger than any number.
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

/// Logarithm of a quotient of two numbers of one sign, though it be larger than any number.
fn logarithm(over: f64, under: f64) -> f64 {
    let quotient = over / under;
    let is_normal = quotient.is_finite() && quotient > 0.0;
    if is_normal { quotient.ln() } else { over.abs().ln() - under.abs().ln() }
}

/// Evenly spaced offsets, increasing; both ends are met exactly.
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

/// How the values of a diagram are spread over its range.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Spacing {
    /// Equal differences.
    #[default]
    Even,
    /// Equal ratios; both ends have one sign.
    Logarithmic,
    /// These offsets, increasing.
    Listed(Vec<f64>),
}

/// Where the orbits of a diagram or chart start.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Starts {
    /// Beside the fixed point of `P_smooth`.
    #[default]
    Smooth,
    /// At offsets by full-state component, `None` where the scene names none: several starts are
    /// several sweeps or charts.
    Given(Vec<Vec<Option<f64>>>),
    /// At so many states, spread evenly over the window.
    Spread(usize),
}

impl Starts {
    /// How many there are.
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
    /// Speed at which the surface is met (0 without contact).
    ImpactSpeed,
    /// An expression of states and parameters.
    Expression {
        /// As the user wrote it: the axis label.
        text: String,
        /// Its node in the model's graph.
        node: NodeId,
    },
}

/// Direction of a sweep; the last state is always carried.
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
}

/// `[[chart]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartRequest {
    /// The two parameters, horizontal first.
    pub parameters: [usize; 2],
    /// First and last offset of each.
    pub ranges: [[f64; 2]; 2],
    /// Points along each.
    pub points: [usize; 2],
    /// Whether every cell is computed, and not only those along borders.
    pub every_cell: bool,
    /// Where the orbits of the cells start.
    pub starts: Starts,
    /// Most attractors of a cell. With 1 every start has a chart of its own; with more the starts
    /// are taken together, and a cell has the attractors that they lead to.
    pub attractors: usize,
    /// Iterates dropped.
    pub transient: usize,
    /// Longest period looked for.
    pub keep: usize,
    /// What is shown.
    pub observe: ChartObservable,
    /// One chart for each method.
    pub with: Vec<Method>,
    /// Curves that are laid over the chart.
    pub overlay: Vec<ChartOverlay>,
    /// Itineraries of the orbits whose loci are laid over it, in digits; none for all of the
    /// shortest.
    pub itineraries: Vec<String>,
}

impl ChartRequest {
    /// A chart with what a scene gets that names parameters and ranges alone: 200 points along
    /// each axis, cells computed along borders, 1000 iterates dropped, periods up to 32, guarded.
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

    /// Charts that are made: one for each method, and for each start where these are not taken
    /// together.
    pub fn count(&self) -> usize {
        let starts = if self.attractors > 1 { 1 } else { self.starts.count() };
        self.with.len() * starts
    }
}

/// What a chart shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChartObservable {
    /// The period.
    Period,
    /// Which passages make contact, return by return.
    Itinerary,
    /// The largest Lyapunov exponent.
    Lyapunov,
    /// How many attractors there are.
    Attractors,
}

/// Curves laid over a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChartOverlay {
    /// Where the orbit of the scene grazes.
    Graze,
    /// Where periodic orbits graze, fold, flip or lose stability to a torus.
    Loci,
}

/// `[[basin]]`: what a scene says of it; the rest follows from the map.
#[derive(Clone, Debug, PartialEq)]
pub struct BasinPlan {
    /// Names of the two coordinates of the section that span the plane, the horizontal one first.
    pub axes: Option<[String; 2]>,
    /// First and last offset along each axis.
    pub ranges: Option<[[f64; 2]; 2]>,
    /// Cells along each axis.
    pub points: Option<[usize; 2]>,
    /// Offsets of parameters, those not named 0: their numbers in the model.
    pub at: Vec<(usize, f64)>,
    /// Offsets of coordinates that are no axes, those not named 0, by name.
    pub start: Vec<(String, f64)>,
    /// Longest period of the saddles whose manifolds are drawn; `None` for no manifolds.
    pub manifolds: Option<usize>,
    /// One basin for each method.
    pub with: Vec<Method>,
}
