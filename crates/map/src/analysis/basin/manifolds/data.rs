//! Request and results of manifolds.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::ContactItinerary;
use crate::model::Method;

/// Plane and parameters at which manifolds are computed.
pub(in crate::analysis::basin) struct ManifoldPlane<'a> {
    /// Offsets of all active parameters.
    pub(in crate::analysis::basin) parameters: &'a [f64],
    /// Indices of the coordinates along the axes, the horizontal one first.
    pub(in crate::analysis::basin) axes: [usize; 2],
    /// First and last offset along each axis.
    pub(in crate::analysis::basin) ranges: [[f64; 2]; 2],
    /// Method that iterates states.
    pub(in crate::analysis::basin) method: Method,
}

/// Manifolds of all saddles that were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifolds {
    /// Longest period of the saddles looked for.
    pub longest_period: usize,
    /// Saddles.
    pub saddles: Vec<Saddle>,
    /// Branches of their manifolds.
    pub branches: Vec<ManifoldBranch>,
}

/// A periodic orbit with one multiplier inside the unit circle and one outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saddle {
    /// Itinerary of the orbit.
    pub itinerary: ContactItinerary,
    /// Points of the orbit, as offsets of the section's coordinates.
    pub states: Vec<Vec<f64>>,
    /// Multipliers, the one with the larger magnitude first.
    pub multipliers: [f64; 2],
}

/// Kind of manifold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ManifoldKind {
    /// States that converge to the saddle.
    Stable,
    /// States that converge to the saddle backwards in time.
    Unstable,
}

impl ManifoldKind {
    /// Both kinds.
    pub const ALL: [Self; 2] = [Self::Stable, Self::Unstable];

    /// Name as one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
        }
    }
}

/// Side of the saddle on which a branch starts, by the plane's horizontal coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ManifoldSide {
    /// Side of larger values.
    #[serde(rename = "+")]
    Upper,
    /// Side of smaller values.
    #[serde(rename = "-")]
    Lower,
}

impl ManifoldSide {
    /// Both sides.
    pub const ALL: [Self; 2] = [Self::Upper, Self::Lower];

    /// Sign for tables.
    pub fn sign(self) -> &'static str {
        match self {
            Self::Upper => "+",
            Self::Lower => "-",
        }
    }
}

/// One branch of a manifold: starts at a point of a saddle, on one side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManifoldBranch {
    /// Stable or unstable.
    pub kind: ManifoldKind,
    /// Index of the saddle, from 0.
    pub saddle: usize,
    /// Index of its point, from 0.
    pub point: usize,
    /// Side of the saddle.
    pub side: ManifoldSide,
    /// Offsets of the section's coordinates, in order along the curve; a new piece begins where the
    /// curve is not followed or the map jumps.
    pub pieces: Vec<Vec<[f64; 2]>>,
    /// Reason why the branch ends.
    pub end: ManifoldEnd,
}

/// Reason why a branch ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ManifoldEnd {
    /// The largest length was reached.
    Length,
    /// The curve converges to an attractor (a repeller backwards in time).
    Rest,
    /// The curve leaves the neighbourhood of the plane.
    Plane,
    /// The curve leaves the window of a map used alone.
    Window,
    /// The map has no image here.
    NoImage,
    /// No preimage was found.
    NoPreimage,
    /// The map is not smooth enough at the saddle to start a curve.
    NotSmooth,
}

impl ManifoldEnd {
    /// Predicate for a sentence whose subject is "the curve".
    pub fn words(self) -> &'static str {
        match self {
            Self::Length => "is as long as curves are followed",
            Self::Rest => "comes to rest",
            Self::Plane => "leaves the plane",
            Self::Window => "leaves the window of the map",
            Self::NoImage => "comes to where there is no image",
            Self::NoPreimage => "comes to where no preimage was found",
            Self::NotSmooth => "does not begin: the map is not smooth at the saddle",
        }
    }
}

impl ManifoldBranch {
    /// Length of the curve with coordinates divided by `scales`.
    pub fn length(&self, scales: [f64; 2]) -> f64 {
        self.pieces
            .iter()
            .flat_map(|piece| piece.windows(2))
            .map(|pair| {
                ((pair[1][0] - pair[0][0]) / scales[0]).hypot((pair[1][1] - pair[0][1]) / scales[1])
            })
            .sum()
    }
}
