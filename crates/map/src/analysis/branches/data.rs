//! Requests and results of a continuation in one parameter, without their numbers' type.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{ContactItinerary, FoundOrbit};

/// What is asked of [`branches`](super::branches()).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchRequest {
    /// Itineraries whose orbits are looked for and continued, begun at any return.
    pub itineraries: Vec<ContactItinerary>,
    /// Returns of the longest period that is followed where a branch doubles or changes its
    /// itinerary.
    pub longest: usize,
    /// The active parameter that varies.
    pub along: usize,
    /// Its offsets, from and to.
    pub range: [f64; 2],
    /// Offsets of all active parameters; that of the one that varies is not used.
    pub at: Vec<f64>,
    /// Whether orbits are those of direct simulation, or the map's.
    pub direct: bool,
    /// States from which direct simulation looks for orbits beside those it tries by itself, in
    /// offsets; the map's orbits are all solved for and need none.
    pub starts: Vec<Vec<f64>>,
}

impl BranchRequest {
    /// The same with itineraries as they are listed.
    pub(super) fn listed(&self) -> Self {
        Self { itineraries: ContactItinerary::listed(&self.itineraries), ..self.clone() }
    }

    /// All active parameters at a value of the one that varies.
    pub(super) fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.at.clone();
        parameters[self.along] = value;
        parameters
    }

    /// The range, its lower end first.
    pub(super) fn ordered_range(&self) -> [f64; 2] {
        let [a, b] = self.range;
        [a.min(b), a.max(b)]
    }
}

/// What marks a special point of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BranchLabel {
    /// A passage grazes: one that makes contact, with speed zero, or one that does not, with gap
    /// zero.
    #[serde(rename = "GR")]
    Graze,
    /// Saddle-node: a multiplier 1, the branch turns back in the parameter.
    #[serde(rename = "SN")]
    SaddleNode,
    /// Period-doubling: a multiplier −1.
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
    /// Two letters.
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

/// What is known of a special point beside its orbit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Special {
    /// Which.
    pub label: BranchLabel,
    /// The passages that graze: return and passage, from 0.
    pub grazing: Vec<[usize; 2]>,
    /// Of a graze at which one contact begins, the change of the parameter with its speed. Of a
    /// saddle-node `b` in `ξ ↦ β + ξ + b ξ²`, of a period-doubling `c` in `ξ ↦ −(1 + β) ξ + c ξ³`,
    /// whose doubled orbits are stable where `c > 0`, of a Neimark–Sacker point the first Lyapunov
    /// coefficient, at which the closed curve is stable where it is negative; `ξ` is the distance
    /// along the eigenvector of unit length, coordinates in half-widths of the window. Of a Hopf
    /// point the angular frequency of the orbits that shrink to it.
    pub coefficient: Option<f64>,
}

/// An orbit of a branch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchPoint {
    /// The orbit; without multipliers where a contact has speed zero, at which one is infinite.
    pub orbit: FoundOrbit,
    /// What is special about it.
    pub special: Option<Special>,
}

/// Why a branch goes no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BranchEnd {
    /// At the end of the range of the parameter.
    Range,
    /// Where a coordinate or a depth is as far from the graze as branches are followed.
    Reach,
    /// It comes back to where it began.
    Closed,
    /// On the branch of the orbits of half its period.
    Doubling,
    /// At a graze beyond which it is not defined.
    Graze,
    /// At a Hopf point, where its orbits have shrunk to an equilibrium.
    Hopf,
    /// It continues another branch of the itinerary, which ends there: with or without the section
    /// points of its returns without contact.
    Continued,
    /// No step was short enough.
    StepTooSmall,
    /// After the most steps.
    StepLimit,
    /// After the most work.
    WorkLimit,
}

/// A branch of periodic orbits of one itinerary, in order along it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// The itinerary of its physical orbits.
    pub itinerary: ContactItinerary,
    /// Its orbits, special ones among them.
    pub points: Vec<BranchPoint>,
    /// Why it goes no further, at its first and last point.
    pub ends: [BranchEnd; 2],
    /// Stretches, by the parameter, in which more special points may lie than were found.
    pub unresolved: Vec<[f64; 2]>,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Branches {
    /// The branches, by itinerary: shorter periods first.
    pub branches: Vec<Branch>,
    /// Itineraries for which the work was at its end before all was followed.
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}
