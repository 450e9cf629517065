//! Requests and results of loci, for any number type.

use serde::{Deserialize, Serialize};

use super::equations::CodimensionTwo;
use crate::analysis::periodic::ContactItinerary;
use crate::continuation::ContinuationEnd;

/// Request of [`loci`](super::loci).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LociRequest {
    /// Indices of the two parameters among the active ones.
    pub plane: [usize; 2],
    /// Range of the first of them: first and last offset.
    pub range: [f64; 2],
    /// Offsets of all active parameters; those of the two are ignored.
    pub at: Vec<f64>,
    /// Kinds of loci.
    pub kinds: Vec<LocusKind>,
    /// Itineraries of the orbits, written from any return.
    pub itineraries: Vec<ContactItinerary>,
    /// Whether loci are those of direct simulation; otherwise those of the map.
    pub direct: bool,
}

/// Ratio of the second parameter's followed range to the first's, each in windows.
const WIDER: f64 = 4.0;

impl LociRequest {
    /// Value of the first parameter at a share of its range.
    pub(super) fn value(&self, share: f64) -> f64 {
        let [from, to] = self.range;
        from + share * (to - from)
    }

    /// Factor, at least 1, by which the range of the first parameter exceeds a window of this
    /// half-width.
    pub(super) fn wider(&self, width: f64) -> f64 {
        let asked = self.range.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        if width.is_finite() { (asked / width).max(1.0) } else { 1.0 }
    }

    /// Both parameters with their ranges, for a window with these half-widths.
    pub(super) fn free(&self, [width, other]: [f64; 2]) -> [(usize, [f64; 2]); 2] {
        let ([first, second], [from, to]) = (self.plane, self.range);
        let reach = other * WIDER * self.wider(width);
        [(first, [from.min(to), from.max(to)]), (second, [-reach, reach])]
    }

    /// Number of conditions `ξ_n` evaluated along a locus: up to the longest period on a graze of
    /// orbits without another contact; otherwise 0.
    pub(super) fn conditions(&self, kind: LocusKind, itinerary: &ContactItinerary) -> usize {
        match kind {
            LocusKind::Graze if itinerary.contacts() == 1 => {
                self.itineraries.iter().map(ContactItinerary::period).max().unwrap_or(1)
            }
            _ => 0,
        }
    }
}

/// A curve drawn in the plane of two parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneCurve {
    /// Kind of the locus.
    pub kind: LocusKind,
    /// Contacts of its orbits as digits; for a graze without the grazing one.
    pub itinerary: String,
    /// Points in order.
    pub points: Vec<PlanePoint>,
    /// Whether the curve is closed or was followed as far as asked for.
    pub whole: bool,
}

/// A point of a drawn curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanePoint {
    /// Offsets of the two parameters.
    pub at: [f64; 2],
    /// Whether all multipliers but the critical ones lie inside the unit circle.
    pub stable: bool,
    /// Whether the orbit makes the contacts of the itinerary and no other.
    pub physical: bool,
    /// Label of a point of codimension two.
    pub label: Option<String>,
}

/// Kind of locus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocusKind {
    /// Graze of an orbit.
    Graze,
    /// Saddle-node: a multiplier is 1.
    Fold,
    /// Period-doubling: a multiplier is −1.
    Flip,
    /// Neimark–Sacker: a pair of multipliers is `exp(±iθ)`.
    Torus,
    /// Crisis: the unstable manifold of a saddle, and an attractor with it, touches the stable one.
    Crisis,
}

impl LocusKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Graze, Self::Fold, Self::Flip, Self::Torus, Self::Crisis];
    /// Kinds that concern a single periodic orbit.
    pub const LOCAL: [Self; 4] = [Self::Graze, Self::Fold, Self::Flip, Self::Torus];

    /// Name: `graze`, `fold`, `flip`, `torus` or `crisis`.
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
    /// Kind of the locus.
    pub kind: LocusKind,
    /// Contacts of its orbits; for a graze without the grazing one; for a crisis those of the
    /// saddle.
    pub itinerary: ContactItinerary,
    /// Return and passage that graze, from 0; for a crisis in the excursion. `None` if nothing
    /// grazes along the locus.
    pub grazing: Option<[usize; 2]>,
    /// Contacts of a crisis from the saddle back to it, a grazing one included; `None` for other
    /// loci.
    pub excursion: Option<ContactItinerary>,
    /// Points in order.
    pub points: Vec<LocusPoint>,
    /// Reasons for the ends at the first and at the last point.
    pub ends: [LocusEnd; 2],
}

/// An orbit on a locus; all values are offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocusPoint {
    /// All active parameters.
    pub parameters: Vec<f64>,
    /// Section points, in order; for a crisis those of the excursion.
    pub states: Vec<Vec<f64>>,
    /// Depth variable `y` of each contact, the grazing one included, negative on the other branch
    /// of the root; in direct simulation the speeds.
    pub depth_variables: Vec<f64>,
    /// Multipliers as `[re, im]`, largest first; for a graze those of the orbit without the grazing
    /// contact.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers but the critical ones lie inside the unit circle.
    pub stable: bool,
    /// Whether the orbit makes the contacts of the itinerary and no other.
    pub physical: bool,
    /// Whether the orbit lies in the window.
    pub inside: bool,
    /// Kind of codimension-two point; `None` at other points.
    pub label: Option<CodimensionTwo>,
}

/// Reason why a locus ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocusEnd {
    /// A parameter is at the end of its range, or a state or depth as far out as loci are followed.
    Border,
    /// Graze of another passage, beyond which direct simulation has no such orbit.
    Graze,
    /// The locus is closed.
    Closed,
    /// No step was short enough to succeed.
    Lost,
    /// The largest number of steps was reached.
    StepLimit,
    /// The bound on work was reached.
    WorkLimit,
}

impl LocusEnd {
    /// Whether the locus may continue beyond its end.
    pub fn is_early(self) -> bool {
        matches!(self, Self::Lost | Self::StepLimit | Self::WorkLimit)
    }

    pub(super) fn of(end: ContinuationEnd) -> Self {
        match end {
            ContinuationEnd::Border { .. } => Self::Border,
            ContinuationEnd::Closed => Self::Closed,
            ContinuationEnd::Last | ContinuationEnd::StepTooSmall => Self::Lost,
            ContinuationEnd::StepLimit => Self::StepLimit,
            ContinuationEnd::WorkLimit => Self::WorkLimit,
        }
    }
}

/// Result of [`loci`](super::loci).
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Loci {
    /// Loci: grazes first, then folds, flips and Neimark–Sacker points.
    pub loci: Vec<Locus>,
    /// Tangencies of folds and flips with grazing curves at points of codimension two.
    pub tangencies: Vec<Tangency>,
    /// Indices of the passages whose contact begins without a kick, as at compliant stops: their
    /// grazing curves have no points `ξ_n = 0` at which loci end, and no tangencies.
    pub without_kick: Vec<usize>,
    /// Itineraries that were not followed completely within the bound on work
    /// ([`MOST_WORK`](crate::analysis::MOST_WORK)).
    #[serde(default)]
    pub unfinished: Vec<ContactItinerary>,
}

/// Quadratic tangency of a locus with a grazing curve. With `t` the first parameter's distance from
/// the point:
///
/// ```text
/// Q − Q_graze = coefficient t² + O(t³),    y = slope t + O(t²)
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tangency {
    /// Kind of the locus: fold or flip.
    pub kind: LocusKind,
    /// Contacts of its orbits, the grazing one included.
    pub itinerary: ContactItinerary,
    /// Kind of the codimension-two point on the grazing curve.
    pub label: CodimensionTwo,
    /// All active parameters at the point.
    pub parameters: Vec<f64>,
    /// Coefficient, from the jets of the map at the point.
    pub coefficient: f64,
    /// Coefficient fitted to points of both curves on the physical side; `None` if a point was not
    /// found.
    pub fitted: Option<f64>,
    /// Growth of the grazing contact's depth variable with the first parameter; the locus is
    /// physical where `slope t` is positive.
    pub slope: f64,
}
