//! Requests and results of a search for periodic orbits, without their numbers' type.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{ContactItinerary, FoundOrbit};

/// What is asked of [`orbits`](super::orbits).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitsRequest {
    /// Itineraries to look for.
    pub itineraries: Vec<ContactItinerary>,
    /// Parameters at which orbits are looked for: offsets of all active ones.
    pub at: Vec<Vec<f64>>,
    /// Whether each orbit of the map is looked for by direct simulation, and that one given.
    pub direct: bool,
    /// Whether direct simulation is searched by itself too, far beyond the map ([`DirectReach`]).
    #[serde(default)]
    pub far: bool,
    /// Folds and flips, where asked for.
    pub loci: Option<LociRequest>,
}

/// Folds and flips that are looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LociRequest {
    /// Which.
    pub kinds: Vec<BifurcationKind>,
    /// The active parameter that is solved for.
    pub free: usize,
    /// The one that is stepped through; `None` at one value of all others.
    pub stepped: Option<SteppedParameter>,
    /// Offsets of all active parameters; of those two no value matters.
    pub at: Vec<f64>,
}

/// A parameter that takes one value after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteppedParameter {
    /// Its number among the active ones.
    pub parameter: usize,
    /// Its offsets, in order.
    pub values: Vec<f64>,
}

/// A change of stability of a periodic orbit that one parameter meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BifurcationKind {
    /// Saddle-node: a multiplier 1, the branch turns back in the parameter.
    Fold,
    /// Period-doubling: a multiplier −1.
    Flip,
}

impl BifurcationKind {
    /// `fold` or `flip`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fold => "fold",
            Self::Flip => "flip",
        }
    }

    /// The multiplier.
    pub fn multiplier(self) -> f64 {
        match self {
            Self::Fold => 1.0,
            Self::Flip => -1.0,
        }
    }
}

/// Orbits of one itinerary at one kind of bifurcation, as a parameter is stepped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locus {
    /// Fold or flip.
    pub kind: BifurcationKind,
    /// The itinerary.
    pub itinerary: ContactItinerary,
    /// The orbits there, in the order of the steps.
    pub points: Vec<FoundOrbit>,
}

/// An orbit of the map for which direct simulation has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostOrbit {
    /// Its itinerary.
    pub itinerary: ContactItinerary,
    /// Its parameters.
    pub parameters: Vec<f64>,
    /// Why.
    pub reason: LostReason,
}

/// Why direct simulation has no orbit next to one of the map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostReason {
    /// The orbit there makes other contacts.
    OtherItinerary(ContactItinerary),
    /// Newton's method led to none.
    NotConverged,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Orbits {
    /// Orbits: by the parameters, then by the itineraries asked for.
    pub orbits: Vec<FoundOrbit>,
    /// Folds and flips; `None` where not asked for.
    pub loci: Option<Vec<Locus>>,
    /// What direct simulation has not.
    pub lost: Vec<LostOrbit>,
    /// How far direct simulation was searched alone; `None` where it was not.
    #[serde(default)]
    pub reach: Option<DirectReach>,
}

/// How far direct simulation was searched for orbits by itself: along the branches, in one
/// parameter, that begin at the graze or at what simulation settles on or nearly repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectReach {
    /// The parameter, its number among the active ones.
    pub parameter: usize,
    /// The offsets up to which branches are followed.
    pub range: [f64; 2],
}
