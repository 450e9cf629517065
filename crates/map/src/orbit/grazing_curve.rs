//! Grazing curves: a grazing orbit continued in a second parameter, with its special points.

use super::grazing_orbit::{GrazingConditions, Penetration};
use super::outcome::{NamedValues, NotLocated, TaylorSteps};
use crate::numeric::Dd;

/// Step sizes and limits of a continuation. Steps are arclengths in the unknowns: the full state at
/// the first graze, the period of an autonomous system, the times of further independent grazes,
/// and the free parameters. States and parameters are in units of their own size, powers of 1024.
/// No step is longer than the range of the second parameter. If an unknown exceeds 32 units, the
/// largest step grows with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveOptions {
    /// Length of the first step.
    pub ds: f64,
    /// Smallest step; the curve ends if Newton's method fails at it.
    pub ds_min: f64,
    /// Length of the largest step.
    pub ds_max: f64,
    /// Largest number of steps.
    pub max_steps: usize,
    /// Number of conditions `xi_n` followed between every two passages.
    pub xi_count: usize,
    /// Work limit in products of series, in units of one product in `f64`; at most a fifteenth of
    /// it may be spent on a hundredth of the range.
    pub most_products: u64,
}

/// Default work limit of a curve: 1 to 2 minutes, and 5 s on a hundredth of the range.
pub(super) const MOST_PRODUCTS: u64 = 150_000_000;

impl Default for CurveOptions {
    fn default() -> Self {
        Self {
            ds: 0.01,
            ds_min: 1e-8,
            ds_max: 1.0,
            max_steps: 20_000,
            xi_count: 1,
            most_products: MOST_PRODUCTS,
        }
    }
}

/// A grazing orbit at one point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePoint {
    /// All parameters of the model.
    pub parameters: Vec<f64>,
    /// Full state at the graze, the phase in `[0, period)`.
    pub state: Vec<f64>,
    /// Duration of one period of the orbit.
    pub period: f64,
    /// `h''` at the graze.
    pub normal_acceleration: f64,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, …` from the first passage to itself.
    pub xi: Vec<f64>,
    /// Conditions `xi_n` between every two passages, ordered by `from`, then `to`.
    pub conditions: Vec<GrazingConditions<f64>>,
    /// Lowest minimum of any event function, grazes excepted.
    pub clearance: Option<f64>,
    /// Deepest passage through a surface, if there is one.
    pub penetration: Option<Penetration>,
}

impl CurvePoint {
    /// Whether the orbit stays on the free side of every surface.
    pub fn is_physical(&self) -> bool {
        self.clearance.is_none_or(|clearance| clearance >= 0.0)
    }
}

/// Kind of a special point of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecialKind {
    /// `xi_n = 0` between two passages: codimension two. With the half-period symmetry `from` is
    /// never a mirror image.
    Codimension2 {
        /// Index `n` of the condition.
        n: usize,
        /// Passage that stretches.
        from: usize,
        /// Passage whose gap neither opens nor closes.
        to: usize,
    },
    /// A parameter turns back along the curve.
    Fold {
        /// The parameter (index).
        parameter: usize,
    },
    /// A pair of multipliers changes between real and complex.
    MultiplierSwitch,
    /// The distance from the scene's own values is stationary; only [`margin`](super::margin())
    /// follows it.
    Nearest,
}

/// A special point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecialPoint {
    /// Kind of the special point.
    pub kind: SpecialKind,
    /// All parameters, in double-double.
    pub parameters: Vec<Dd>,
    /// The orbit at the point.
    pub point: CurvePoint,
}

/// A stretch of a curve that may hold more special points of a kind than were found: their test
/// function is zero to rounding there, or varies too fast for the smallest steps.
#[derive(Clone, Debug, PartialEq)]
pub struct UnresolvedStretch {
    /// The kind of special points.
    pub kind: SpecialKind,
    /// All parameters at the two ends.
    pub ends: [Vec<f64>; 2],
}

/// Reason why a curve ended.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveEnd {
    /// The requested parameter value was reached.
    Reached,
    /// The largest number of steps was made.
    StepLimit,
    /// Newton's method failed even at the smallest step.
    StepTooSmall {
        /// Length of that step.
        ds: f64,
    },
    /// The graze is no longer simple: `h''` is not positive.
    DegenerateGraze {
        /// `h''` at the first such point.
        normal_acceleration: f64,
    },
    /// A passage without an adjusted parameter ceased to graze, or to follow in the order named.
    PassageLost {
        /// Number of the passage, from 1.
        passage: usize,
    },
    /// A function in the free field, an event function or a reset reached its corner: see
    /// [`NotLocated::Corner`].
    Corner {
        /// `abs`, `sign`, `min` or `max`.
        function: &'static str,
        /// Key of the expression in the scene.
        key: String,
        /// Full state at the corner.
        at: NamedValues,
    },
    /// The continuation exceeded its work limit.
    WorkLimit {
        /// Duration of a period at the last point.
        period: f64,
        /// Number of Taylor steps in that period.
        steps: u64,
    },
    /// The second parameter left the requested range by more than its width.
    LeftRange,
    /// The curve came back to its first point, without the requested value.
    Closed,
}

impl std::fmt::Display for CurveEnd {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            CurveEnd::Reached => write!(formatter, "the value asked for was reached"),
            CurveEnd::StepLimit => write!(formatter, "the most steps allowed were made"),
            CurveEnd::StepTooSmall { ds } => {
                write!(formatter, "no convergence even at a step of {ds:.1e}")
            }
            CurveEnd::DegenerateGraze { normal_acceleration } => {
                write!(formatter, "the graze ceases to be simple: h'' = {normal_acceleration:.6e}")
            }
            CurveEnd::PassageLost { passage } => {
                write!(formatter, "passage {passage} does not graze beyond this point")
            }
            CurveEnd::Corner { function, key, at } => {
                write!(
                    formatter,
                    "`{function}` in `{key}` comes to its corner at {at}, where there is no Taylor \
                     series"
                )
            }
            CurveEnd::WorkLimit { period, steps } => {
                write!(
                    formatter,
                    "the continuation exceeded its work limit: a period lasts {period:.6} here and \
                     takes {}",
                    TaylorSteps(*steps)
                )
            }
            CurveEnd::LeftRange => {
                write!(formatter, "the curve left the range asked for by more than its width")
            }
            CurveEnd::Closed => write!(formatter, "the curve is closed"),
        }
    }
}

/// A grazing curve, with its special points and its end.
#[derive(Clone, Debug, PartialEq)]
pub struct GrazingCurve {
    /// The adjusted parameters, then the second parameter.
    pub free: Vec<usize>,
    /// Points in order along the curve.
    pub points: Vec<CurvePoint>,
    /// Special points in order.
    pub special: Vec<SpecialPoint>,
    /// Stretches that may hold more special points.
    pub unresolved: Vec<UnresolvedStretch>,
    /// Reason why the curve ended.
    pub end: CurveEnd,
}

impl GrazingCurve {
    /// Adds an unresolved stretch, or extends the known one that ends where it begins.
    pub(super) fn add_unresolved(&mut self, kind: SpecialKind, [from, to]: [&[f64]; 2]) {
        let mut known = self.unresolved.iter_mut();
        match known.find(|stretch| stretch.kind == kind && stretch.ends[1] == from) {
            Some(stretch) => stretch.ends[1] = to.to_vec(),
            None => {
                let ends = [from.to_vec(), to.to_vec()];
                self.unresolved.push(UnresolvedStretch { kind, ends });
            }
        }
    }

    /// Points with `xi_n = 0`, each with `n` and the passages `[from, to]`.
    pub fn codim2(&self) -> impl Iterator<Item = (usize, [usize; 2], &SpecialPoint)> {
        self.special.iter().filter_map(|special| match special.kind {
            SpecialKind::Codimension2 { n, from, to } => Some((n, [from, to], special)),
            _ => None,
        })
    }

    /// Folds, each with the parameter that turns back.
    pub fn folds(&self) -> impl Iterator<Item = (usize, &SpecialPoint)> {
        self.special.iter().filter_map(|special| match special.kind {
            SpecialKind::Fold { parameter } => Some((parameter, special)),
            _ => None,
        })
    }

    /// Points at which multipliers change between real and complex.
    pub fn multiplier_switches(&self) -> impl Iterator<Item = &SpecialPoint> {
        self.special.iter().filter(|special| special.kind == SpecialKind::MultiplierSwitch)
    }
}

/// Outcome of a continuation.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveOutcome {
    /// A curve; [`GrazingCurve::end`] says whether it is complete.
    Traced(GrazingCurve),
    /// There is no grazing orbit to start from.
    NotLocated(NotLocated),
    /// The curve from the scene's own parameters did not reach the requested start.
    StartNotReached(GrazingCurve),
}
