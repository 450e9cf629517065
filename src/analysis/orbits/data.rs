//! Requests and results of a search for periodic orbits, without their numbers' type.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{BifurcationKind, ContactItinerary, PeriodicOrbit};
use crate::numeric::Real;

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

/// A periodic orbit that was found; everything in offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundOrbit {
    /// Its itinerary.
    pub itinerary: ContactItinerary,
    /// All active parameters.
    pub parameters: Vec<f64>,
    /// Its points, in order.
    pub states: Vec<Vec<f64>>,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all of them lie inside the unit circle.
    pub stable: bool,
    /// Its contacts, in order.
    pub contacts: Vec<OrbitContact>,
    /// Whether map or simulation make the contacts of the itinerary and no other.
    pub physical: bool,
    /// Whether its points, depths and parameters lie in the window.
    pub inside: bool,
    /// Contacts that no passage accounts for, by direct simulation.
    pub extra_contacts: usize,
    /// Largest difference of a coordinate of the last image and the first point, in half-widths of
    /// the window.
    pub residual: f64,
}

/// A contact of a periodic orbit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitContact {
    /// The return that it belongs to, from 0.
    #[serde(rename = "return")]
    pub number: usize,
    /// The passage, from 0.
    pub passage: usize,
    /// Speed at which the surface is met; negative on the other branch of the root.
    pub speed: f64,
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
    /// The bifurcation is not between the neighbours that the map has of it.
    NotBracketed,
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

/// Where direct simulation was searched for orbits by itself, beside the neighbourhood of the map's
/// orbits: from what it settles on, or nearly repeats, at values of one parameter far and wide,
/// along the branches through the orbits there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectReach {
    /// The parameter, its number among the active ones.
    pub parameter: usize,
    /// Its first and last offset at which orbits were flown.
    pub range: [f64; 2],
    /// How many offsets.
    pub values: usize,
}

/// Part of their size to which coordinates of one orbit agree.
const SAME: f64 = 1e-9;

impl FoundOrbit {
    /// Whether another orbit of the same itinerary and parameters is this one, begun at any of its
    /// points.
    pub(super) fn is_same_as(&self, other: &Self) -> bool {
        let near = |a: &[f64], b: &[f64]| {
            let mut pairs = a.iter().zip(b);
            pairs.all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()) + f64::EPSILON)
        };
        near(&self.parameters, &other.parameters)
            && self.states.iter().any(|state| near(state, &other.states[0]))
    }

    /// An orbit with its contacts; `None` where its multipliers are not numbers.
    pub(super) fn of<S: Real>(
        itinerary: &ContactItinerary,
        orbit: &PeriodicOrbit<S>,
        contacts: Vec<OrbitContact>,
        (physical, inside): (bool, bool),
    ) -> Option<Self> {
        let round = |values: &[S]| values.iter().map(|value| value.to_f64()).collect();
        let multipliers = orbit.multipliers().ok()?;
        Some(Self {
            itinerary: itinerary.clone(),
            parameters: round(&orbit.parameters),
            states: orbit.states.iter().map(|state| round(state)).collect(),
            stable: orbit.is_stable().ok()?,
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            contacts,
            physical,
            inside,
            extra_contacts: orbit.extra_contacts,
            residual: orbit.residual,
        })
    }
}
