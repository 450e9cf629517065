//! Grazing curves: a grazing orbit continued in a second parameter, with its special points.

use super::grazing_orbit::{GrazingConditions, Penetration};
use super::outcome::{NamedValues, NotLocated};
use crate::numeric::Dd;

/// Steps of a continuation, in arclength over its unknowns: the full state at the first graze, the
/// period where no clock gives it, the times of further independent grazes, and the free
/// parameters. States and parameters are in units of their own size, powers of 1024. No step is
/// longer than the range of the second parameter. Where an unknown comes to more than 32 units,
/// steps grow with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveOptions {
    /// First step.
    pub ds: f64,
    /// Smallest step before the curve is given up.
    pub ds_min: f64,
    /// Largest step.
    pub ds_max: f64,
    /// Most steps.
    pub max_steps: usize,
    /// How many `xi_n` are followed from every passage to every other.
    pub xi_count: usize,
    /// Most products of series that are formed, in units of one of numbers in `f64`; on a hundredth
    /// of the range no more than a fifteenth of them.
    pub most_products: u64,
}

/// Most products of series that a curve forms where nothing else is said: 1 to 2 minutes, and 5 s
/// on a hundredth of the range.
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

/// A grazing orbit on a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePoint {
    /// All parameters of the model.
    pub parameters: Vec<f64>,
    /// Full state at the graze, the phase in `[0, period)`.
    pub state: Vec<f64>,
    /// Duration of one period of the orbit.
    pub period: f64,
    /// `h''`.
    pub normal_acceleration: f64,
    /// Multipliers, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, …` from the first passage to itself.
    pub xi: Vec<f64>,
    /// The same from every passage to every passage, ordered by `from`, then `to`.
    pub conditions: Vec<GrazingConditions<f64>>,
    /// Lowest other minimum of any event function.
    pub clearance: Option<f64>,
    /// The deepest passage through a surface, where there is one.
    pub penetration: Option<Penetration>,
}

impl CurvePoint {
    /// Whether the orbit stays on the free side of every surface.
    pub fn is_physical(&self) -> bool {
        self.clearance.is_none_or(|clearance| clearance >= 0.0)
    }
}

/// What happens at a special point of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecialKind {
    /// `xi_n = 0` between two passages: codimension two. With the half-period symmetry only
    /// passages that mirror no other stand as `from`.
    Codimension2 {
        /// `n`.
        n: usize,
        /// The passage that stretches.
        from: usize,
        /// The passage whose gap neither opens nor closes.
        to: usize,
    },
    /// The curve turns back in a parameter.
    Fold {
        /// The parameter.
        parameter: usize,
    },
    /// A pair of multipliers changes between real and complex.
    MultiplierSwitch,
    /// The distance from the scene's own values is stationary: followed by
    /// [`margin`](super::margin()) alone.
    Nearest,
}

/// A special point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecialPoint {
    /// What happens there.
    pub kind: SpecialKind,
    /// All parameters, in double-double.
    pub parameters: Vec<Dd>,
    /// The orbit there.
    pub point: CurvePoint,
}

/// A stretch of a curve on which not all special points of a kind are known: the function whose
/// zeros they are is rounding there, or varies faster than the smallest steps follow.
#[derive(Clone, Debug, PartialEq)]
pub struct UnresolvedStretch {
    /// The kind of special points.
    pub kind: SpecialKind,
    /// All parameters at the ends.
    pub ends: [Vec<f64>; 2],
}

/// How a curve ended.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveEnd {
    /// At the parameter value asked for.
    Reached,
    /// After the most steps allowed.
    StepLimit,
    /// Newton's method fails even at the smallest step.
    StepTooSmall {
        /// The step.
        ds: f64,
    },
    /// The graze ceases to be simple: `h''` no longer positive.
    DegenerateGraze {
        /// `h''` at the first such point.
        normal_acceleration: f64,
    },
    /// A passage that no adjusted parameter is for ceased to graze, or to follow in the order
    /// named.
    PassageLost {
        /// Number of the passage, from 1.
        passage: usize,
    },
    /// A function in the free field, an event function or a reset came to its corner: see
    /// [`NotLocated::Corner`].
    Corner {
        /// `abs`, `sign`, `min` or `max`.
        function: &'static str,
        /// Key of the expression in the scene.
        key: String,
        /// The full state there.
        at: NamedValues,
    },
    /// The continuation has computed as much as it may.
    WorkLimit {
        /// Duration of a period at the last point.
        period: f64,
        /// Taylor steps of that period.
        steps: u64,
    },
    /// The second parameter ran away from the range asked for by more than its width.
    LeftRange,
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
                    "the continuation did the most work it may do on so short a stretch, or at \
                     all: a period lasts {period:.6} here and takes about {steps} Taylor steps"
                )
            }
            CurveEnd::LeftRange => {
                write!(formatter, "the curve left the range asked for by more than its width")
            }
        }
    }
}

/// A grazing curve.
#[derive(Clone, Debug, PartialEq)]
pub struct GrazingCurve {
    /// The adjusted parameters, then the one continued in.
    pub free: Vec<usize>,
    /// Points in order.
    pub points: Vec<CurvePoint>,
    /// Special points in order.
    pub special: Vec<SpecialPoint>,
    /// Stretches on which more special points may lie.
    pub unresolved: Vec<UnresolvedStretch>,
    /// How the curve ended.
    pub end: CurveEnd,
}

impl GrazingCurve {
    /// Adds a stretch to the unresolved ones, or to the end of the one that it goes on from.
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

    /// Points where some `xi_n` vanishes, with `n` and the passages from and to which it is.
    pub fn codim2(&self) -> impl Iterator<Item = (usize, [usize; 2], &SpecialPoint)> {
        self.special.iter().filter_map(|special| match special.kind {
            SpecialKind::Codimension2 { n, from, to } => Some((n, [from, to], special)),
            _ => None,
        })
    }

    /// Points where a parameter turns back, with the parameter.
    pub fn folds(&self) -> impl Iterator<Item = (usize, &SpecialPoint)> {
        self.special.iter().filter_map(|special| match special.kind {
            SpecialKind::Fold { parameter } => Some((parameter, special)),
            _ => None,
        })
    }

    /// Points where multipliers change between real and complex.
    pub fn multiplier_switches(&self) -> impl Iterator<Item = &SpecialPoint> {
        self.special.iter().filter(|special| special.kind == SpecialKind::MultiplierSwitch)
    }
}

/// Outcome of a continuation.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveOutcome {
    /// A curve, perhaps not to its end.
    Traced(GrazingCurve),
    /// No grazing orbit to start from.
    NotLocated(NotLocated),
    /// From the scene's own parameters the curve did not reach the start asked for.
    StartNotReached(GrazingCurve),
}
