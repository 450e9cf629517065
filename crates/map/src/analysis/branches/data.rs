//! Requests and results of continuation in one parameter, for any number type.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{ContactItinerary, FoundOrbit};

/// Request of [`branches`](super::branches()).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchRequest {
    /// Itineraries whose orbits are looked for and continued, written from any return.
    pub itineraries: Vec<ContactItinerary>,
    /// Longest period, in returns, of branches that follow from period-doublings or changes of the
    /// itinerary.
    pub longest: usize,
    /// Index of the varied parameter among the active ones.
    pub along: usize,
    /// Range of its offsets: first and last value.
    pub range: [f64; 2],
    /// Offsets of all active parameters; that of the varied one is ignored.
    pub at: Vec<f64>,
    /// Whether orbits are those of direct simulation; otherwise those of the map.
    pub direct: bool,
    /// Additional start states for direct simulation, in offsets; the map needs none, as all its
    /// orbits are solved for.
    pub starts: Vec<Vec<f64>>,
}

impl BranchRequest {
    /// Request with itineraries in the standard form, each listed once.
    pub(super) fn listed(&self) -> Self {
        Self { itineraries: ContactItinerary::listed(&self.itineraries), ..self.clone() }
    }

    /// All active parameters at a value of the varied one.
    pub(super) fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.at.clone();
        parameters[self.along] = value;
        parameters
    }

    /// Range with the smaller end first.
    pub(super) fn ordered_range(&self) -> [f64; 2] {
        let [a, b] = self.range;
        [a.min(b), a.max(b)]
    }
}

/// Kind of a special point of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BranchLabel {
    /// Graze of a passage: of one that makes contact, with speed zero, or of one that does not,
    /// with gap zero.
    #[serde(rename = "GR")]
    Graze,
    /// Saddle-node: a multiplier is 1, and the branch turns back in the parameter.
    #[serde(rename = "SN")]
    SaddleNode,
    /// Period-doubling: a multiplier is −1.
    #[serde(rename = "PD")]
    PeriodDoubling,
    /// Neimark–Sacker: a complex pair on the unit circle.
    #[serde(rename = "NS")]
    NeimarkSacker,
    /// Branch point: another branch passes through this orbit.
    #[serde(rename = "BP")]
    BranchPoint,
    /// Hopf point of an autonomous system: the orbit shrinks to an equilibrium.
    #[serde(rename = "HB")]
    Hopf,
}

impl BranchLabel {
    /// Label of two letters.
    pub fn letters(self) -> &'static str {
        match self {
            Self::Graze => "GR",
            Self::SaddleNode => "SN",
            Self::PeriodDoubling => "PD",
            Self::NeimarkSacker => "NS",
            Self::BranchPoint => "BP",
            Self::Hopf => "HB",
        }
    }
}

/// Data of a special point beside its orbit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Special {
    /// Kind of the point.
    pub label: BranchLabel,
    /// Passages that graze, as return and passage, from 0.
    pub grazing: Vec<[usize; 2]>,
    /// Name of the surface that grazes, if it has no passage.
    #[serde(default)]
    pub surface: Option<String>,
    /// Graze at which one contact begins: derivative of the parameter by the contact's speed.
    /// Saddle-node: `b` in `ξ ↦ β + ξ + b ξ²`. Period-doubling: `c` in `ξ ↦ −(1 + β) ξ + c ξ³`; the
    /// doubled orbits are stable if `c > 0`. Neimark–Sacker: first Lyapunov coefficient; the closed
    /// curve is stable if it is negative. `ξ` is the distance along the eigenvector of unit length,
    /// with coordinates in half-widths of the window. Hopf: angular frequency of the orbits that
    /// shrink to the point.
    pub coefficient: Option<f64>,
}

impl Special {
    /// A special point of a kind, without further data.
    pub(super) fn new(label: BranchLabel) -> Self {
        Self { label, grazing: Vec::new(), surface: None, coefficient: None }
    }
}

/// An orbit of a branch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchPoint {
    /// The orbit; without multipliers if a contact has speed zero, because one is infinite.
    pub orbit: FoundOrbit,
    /// Data of a special point; `None` at other points.
    pub special: Option<Special>,
}

/// Reason why a branch ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BranchEnd {
    /// End of the range of the parameter.
    Range,
    /// A coordinate or a depth is as far from the graze as branches are followed.
    Reach,
    /// The branch returns to its first point.
    Closed,
    /// Period-doubling point on the branch of the orbits of half the period.
    Doubling,
    /// Graze beyond which the branch is undefined.
    Graze,
    /// Hopf point, at which the orbits have shrunk to an equilibrium.
    Hopf,
    /// Start of a branch that continues another one of the same itinerary, with or without the
    /// section points of returns without contact.
    Continued,
    /// The orbit loses a point of the tangency section, where `h'' = 0`; steps towards it became
    /// shorter until their largest number was reached.
    SectionPoint,
    /// No step was short enough to succeed.
    StepTooSmall,
    /// The largest number of steps was reached.
    StepLimit,
    /// The bound on work was reached.
    WorkLimit,
}

/// A branch of periodic orbits of one itinerary, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// Itinerary of the physical orbits.
    pub itinerary: ContactItinerary,
    /// Orbits, special points included.
    pub points: Vec<BranchPoint>,
    /// Reasons for the ends at the first and at the last point.
    pub ends: [BranchEnd; 2],
    /// Intervals of the parameter that may contain more special points than were found.
    pub unresolved: Vec<[f64; 2]>,
}

impl Branch {
    /// Whether a kept branch has orbits of an itinerary, and the sizes of its trace: numbers of
    /// section points, of their coordinates, and of active parameters.
    pub(super) fn fits(
        &self,
        itinerary: &ContactItinerary,
        [states, dimension, parameters]: [usize; 3],
    ) -> bool {
        let is_known = |number: usize, passage: usize| {
            number < itinerary.period() && passage < itinerary.passages()
        };
        let fits = |BranchPoint { orbit, special }: &BranchPoint| {
            let mut grazing = special.iter().flat_map(|special| &special.grazing);
            orbit.itinerary == *itinerary
                && orbit.parameters.len() == parameters
                && orbit.states.len() == states
                && orbit.states.iter().all(|state| state.len() == dimension)
                && orbit.contacts.iter().all(|contact| is_known(contact.number, contact.passage))
                && grazing.all(|&[number, passage]| is_known(number, passage))
        };
        self.itinerary == *itinerary && !self.points.is_empty() && self.points.iter().all(fits)
    }
}

/// Branch of direct simulation through an attractor.
#[derive(Clone, Debug, PartialEq)]
pub struct AttractorBranch {
    /// Branch, to both sides of the attractor.
    pub branch: Branch,
    /// Index of the attractor among the points.
    pub place: usize,
}

impl AttractorBranch {
    /// Points about the attractor, up to the nearest special point on either side and with it: a
    /// point at which the attractor becomes unstable or changes its contacts. Branch points do not
    /// end the stretch, nor do folds and flips nearer to a graze than `near` in the parameter
    /// `along`.
    pub fn stretch(&self, along: usize, near: f64) -> &[BranchPoint] {
        let points = &self.branch.points;
        let label = |number: usize| points[number].special.as_ref().map(|special| special.label);
        let at = |number: usize| points[number].orbit.parameters[along];
        let bounds = |number: &usize| match label(*number) {
            None | Some(BranchLabel::BranchPoint) => false,
            Some(BranchLabel::Graze) => true,
            Some(_) => [0, points.len() - 1].into_iter().all(|end| {
                label(end) != Some(BranchLabel::Graze) || (at(end) - at(*number)).abs() > near
            }),
        };
        let first = (0..self.place).rev().find(bounds).unwrap_or(0);
        let last = (self.place..points.len()).find(bounds).unwrap_or(points.len() - 1);
        &points[first..=last]
    }
}

/// Result of [`branches`](super::branches()).
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Branches {
    /// Branches by itinerary, shorter periods first.
    pub branches: Vec<Branch>,
    /// Itineraries that were not followed completely within the bound on work.
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}
