//! What is asked of manifolds, and what was found.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::ContactItinerary;
use crate::model::Method;

/// Where manifolds are followed.
pub(in crate::analysis::basin) struct Plane<'a> {
    /// Offsets of all active parameters.
    pub(in crate::analysis::basin) parameters: &'a [f64],
    /// Numbers of the coordinates along the axes, the horizontal one first.
    pub(in crate::analysis::basin) axes: [usize; 2],
    /// First and last offset along each axis.
    pub(in crate::analysis::basin) ranges: [[f64; 2]; 2],
    /// What iterates states.
    pub(in crate::analysis::basin) method: Method,
}

/// The curves of all saddles that were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifolds {
    /// Longest period of the saddles looked for.
    pub longest_period: usize,
    /// The saddles.
    pub saddles: Vec<Saddle>,
    /// Their curves.
    pub branches: Vec<ManifoldBranch>,
}

/// A periodic orbit with one multiplier inside the unit circle and one outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saddle {
    /// Its itinerary.
    pub itinerary: ContactItinerary,
    /// Its points, offsets of the section's coordinates.
    pub states: Vec<Vec<f64>>,
    /// Its multipliers, that of larger magnitude first.
    pub multipliers: [f64; 2],
}

/// Which curve of a saddle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ManifoldKind {
    /// States that come to the saddle.
    Stable,
    /// States that come from it.
    Unstable,
}

impl ManifoldKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Stable, Self::Unstable];

    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
        }
    }
}

/// The side of its saddle on which a curve begins: that of larger or of smaller values of the
/// plane's horizontal coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ManifoldSide {
    /// Of larger values.
    #[serde(rename = "+")]
    Upper,
    /// Of smaller values.
    #[serde(rename = "-")]
    Lower,
}

impl ManifoldSide {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Upper, Self::Lower];

    /// Its sign, as tables have it.
    pub fn sign(self) -> &'static str {
        match self {
            Self::Upper => "+",
            Self::Lower => "-",
        }
    }
}

/// Half of a curve: from a point of a saddle on, on one side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManifoldBranch {
    /// Stable or unstable.
    pub kind: ManifoldKind,
    /// The number of the saddle, from 0.
    pub saddle: usize,
    /// The number of its point, from 0.
    pub point: usize,
    /// The side.
    pub side: ManifoldSide,
    /// Offsets of the section's coordinates, in order along the curve; it is interrupted between
    /// one piece and the next where it is not followed or the map jumps.
    pub pieces: Vec<Vec<[f64; 2]>>,
    /// Why it ends.
    pub end: ManifoldEnd,
}

/// Why a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ManifoldEnd {
    /// It is as long as curves are followed.
    Length,
    /// It comes to rest at an attractor, or, against time, at a repeller.
    Rest,
    /// It leaves the surroundings of the plane.
    Plane,
    /// It leaves the window of the map, which is used alone.
    Window,
    /// The map has no image there.
    NoImage,
    /// No state was found that the map sends there.
    NoPreimage,
    /// The map is not smooth enough at the saddle for a curve to begin.
    NotSmooth,
}

impl ManifoldEnd {
    /// In words, after "the curve".
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
    /// The length of the curve, in units of what a point's coordinates are divided by.
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
