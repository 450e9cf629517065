//! Requests and results of loci, without their numbers' type.

use serde::{Deserialize, Serialize};

use super::equations::CodimensionTwo;
use crate::analysis::continuation::CourseEnd;
use crate::analysis::periodic::ContactItinerary;

/// What is asked of [`loci`](super::loci).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LociRequest {
    /// The two parameters, as numbers of active ones.
    pub plane: [usize; 2],
    /// First and last offset of the first of them.
    pub range: [f64; 2],
    /// Offsets of all active parameters; of those two no value matters.
    pub at: Vec<f64>,
    /// Which loci.
    pub kinds: Vec<LocusKind>,
    /// Whose orbits, begun at any return.
    pub itineraries: Vec<ContactItinerary>,
    /// Whether they are those of direct simulation.
    pub direct: bool,
}

/// The second parameter is followed over this many times the share of its window that the first is.
const WIDER: f64 = 4.0;

impl LociRequest {
    /// The first parameter at a share of its range.
    pub(super) fn value(&self, share: f64) -> f64 {
        let [from, to] = self.range;
        from + share * (to - from)
    }

    /// By how much more than a window of this half-width in the first parameter is followed.
    pub(super) fn wider(&self, width: f64) -> f64 {
        let asked = self.range.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        if width.is_finite() { (asked / width).max(1.0) } else { 1.0 }
    }

    /// Both parameters with their ranges, where the window has these half-widths.
    pub(super) fn free(&self, [width, other]: [f64; 2]) -> [(usize, [f64; 2]); 2] {
        let ([first, second], [from, to]) = (self.plane, self.range);
        let reach = other * WIDER * self.wider(width);
        [(first, [from.min(to), from.max(to)]), (second, [-reach, reach])]
    }

    /// Conditions `ξ_n` that are followed along a locus: those of all periods on a graze of orbits
    /// without another contact.
    pub(super) fn conditions(&self, kind: LocusKind, itinerary: &ContactItinerary) -> usize {
        match kind {
            LocusKind::Graze if itinerary.contacts() == 1 => {
                self.itineraries.iter().map(ContactItinerary::period).max().unwrap_or(1)
            }
            _ => 0,
        }
    }
}

/// A curve as it is drawn over the plane of two parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneCurve {
    /// What happens along it.
    pub kind: LocusKind,
    /// The contacts of its orbits, in digits; of a graze, those beside the grazing one.
    pub itinerary: String,
    /// Its points, in order along it.
    pub points: Vec<PlanePoint>,
    /// Whether it was followed as far as it was asked for, or is closed.
    pub whole: bool,
}

/// A point of a curve as it is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanePoint {
    /// Offsets of the two parameters.
    pub at: [f64; 2],
    /// Whether all multipliers but those of the locus lie inside the unit circle.
    pub stable: bool,
    /// Whether the orbit makes the contacts of the itinerary and no other.
    pub physical: bool,
    /// The label of a point of codimension two.
    pub label: Option<String>,
}

/// What happens to an orbit along a locus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocusKind {
    /// It grazes.
    Graze,
    /// Saddle-node: a multiplier 1.
    Fold,
    /// Period-doubling: a multiplier −1.
    Flip,
    /// Neimark–Sacker: two multipliers `exp(±iθ)`.
    Torus,
    /// The unstable manifold of a saddle touches its stable one, and an attractor with it.
    Crisis,
}

impl LocusKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Graze, Self::Fold, Self::Flip, Self::Torus, Self::Crisis];
    /// Those that a periodic orbit tells by itself.
    pub const LOCAL: [Self; 4] = [Self::Graze, Self::Fold, Self::Flip, Self::Torus];

    /// `graze`, `fold`, `flip`, `torus` or `crisis`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Graze => "graze",
            Self::Fold => "fold",
            Self::Flip => "flip",
            Self::Torus => "torus",
            Self::Crisis => "crisis",
        }
    }
}

/// A curve in the plane of two parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locus {
    /// What happens along it.
    pub kind: LocusKind,
    /// The contacts of its orbits; of a graze, those beside the grazing one; of a crisis, those of
    /// the saddle.
    pub itinerary: ContactItinerary,
    /// The return and the passage that graze, from 0. Of a crisis they are of the excursion; `None`
    /// where the manifolds touch without a graze.
    pub grazing: Option<[usize; 2]>,
    /// Of a crisis, the contacts from the saddle back to it, a grazing one included, and nothing of
    /// other loci.
    pub excursion: Option<ContactItinerary>,
    /// Its points, in order along it.
    pub points: Vec<LocusPoint>,
    /// Why it ends at its first and at its last point.
    pub ends: [LocusEnd; 2],
}

/// An orbit on a locus; everything in offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocusPoint {
    /// All active parameters.
    pub parameters: Vec<f64>,
    /// Its section points, in order; of a crisis, those of the excursion.
    pub states: Vec<Vec<f64>>,
    /// The depth variable `y` of each contact, the grazing one included; by direct simulation the
    /// speeds. Negative on the other branch of the root.
    pub depth_variables: Vec<f64>,
    /// Multipliers, `[re, im]`, the largest first; of a graze those without the grazing contact.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers but those of the locus lie inside the unit circle.
    pub stable: bool,
    /// Whether the orbit makes the contacts of the itinerary and no other.
    pub physical: bool,
    /// Whether it lies in the window.
    pub inside: bool,
    /// What of codimension two happens there.
    pub label: Option<CodimensionTwo>,
}

/// Why a locus ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocusEnd {
    /// A parameter is at the end of its range, or a state or depth as far out as loci are followed.
    Border,
    /// Where another passage grazes, beyond which direct simulation has no such orbit.
    Graze,
    /// It is closed.
    Closed,
    /// No step is short enough.
    Lost,
    /// After the most steps.
    StepLimit,
    /// After the most work.
    WorkLimit,
}

impl LocusEnd {
    /// Whether the locus may go on where it was no longer followed.
    pub fn is_early(self) -> bool {
        matches!(self, Self::Lost | Self::StepLimit | Self::WorkLimit)
    }

    pub(super) fn of(end: CourseEnd) -> Self {
        match end {
            CourseEnd::Border { .. } => Self::Border,
            CourseEnd::Closed => Self::Closed,
            CourseEnd::Last | CourseEnd::StepTooSmall => Self::Lost,
            CourseEnd::StepLimit => Self::StepLimit,
            CourseEnd::WorkLimit => Self::WorkLimit,
        }
    }
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Loci {
    /// Grazes first, then folds, flips and Neimark–Sacker points.
    pub loci: Vec<Locus>,
    /// How folds and flips leave the grazing curves at points of codimension two.
    pub tangencies: Vec<Tangency>,
    /// The passages whose contact begins without a kick, as those of compliant stops do: their
    /// grazing curves have no `ξ_n = 0` at which loci end, and no tangencies.
    pub without_kick: Vec<usize>,
    /// Itineraries of which direct simulation did not follow all: the work was at its bound
    /// ([`MOST_WORK`](crate::analysis::MOST_WORK)).
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}

/// The quadratic tangency of a locus with a grazing curve: with `t` the first parameter's distance
/// from the point,
///
/// ```text
/// Q − Q_graze = coefficient t² + O(t³),    y = slope t + O(t²)
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tangency {
    /// Fold or flip.
    pub kind: LocusKind,
    /// The contacts of its orbits, the grazing one included.
    pub itinerary: ContactItinerary,
    /// What the point is on the grazing curve.
    pub label: CodimensionTwo,
    /// All active parameters there.
    pub parameters: Vec<f64>,
    /// The coefficient, from the jets of the map at the point.
    pub coefficient: f64,
    /// The same, fitted to points of both curves on the physical side.
    pub fitted: Option<f64>,
    /// How fast the depth variable of the grazing contact grows; the locus is physical where
    /// `slope t` is positive.
    pub slope: f64,
}
