//! Lengths on which narrow features of a field are resolved.
//!
//! A pulse such as `exp(K (cos θ − 1))` is zero to every digit over most of its period: no Taylor
//! coefficient at a point far from the pulse shows it. The arguments of such functions do, because
//! they vary slowly. One idea: within a step the argument of each function with a scale of its own
//! may move only as far as the series of the function is informative at the start of the step. With
//! the coefficients `a_k` of an argument
//!
//! ```text
//! |a(t) − a_0| ≤ Σ_{k ≥ 1} |a_k| h^k ≤ room(a_0)      for |t| ≤ h, real or complex
//! ```
//!
//! and the room is a share of the distance of `a_0` from the nearest singularity of the function
//! (`tanh`, quotients, roots), or is such that the largest term of its series is among those
//! computed (`exp`, high powers). Where the function is too small to be a number, or too flat, the
//! room is larger. The room is wider than the steps that Taylor coefficients allow when they show
//! the function, so that it limits steps only near features that they do not show. A field without
//! such functions has no arguments to check. See docs/mathematics/flow.md.

use std::f64::consts::{FRAC_PI_2, PI};

use super::program::{InputKind, Operation, Program, Slot};
use crate::jet::HeadFunction;
use crate::numeric::{Branched, Mask, Scalar as _, polynomial};

/// Argument of a function that may have a narrow feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Argument {
    slot: Slot,
    feature: Feature,
}

/// Kinds of features; each determines how far an argument may move from a value.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Feature {
    /// An exponential function of the argument.
    Exponential,
    /// A hyperbolic sine or cosine.
    Hyperbolic,
    /// A smooth step or bump at 0, flat elsewhere: the distance of its poles from 0, and the
    /// magnitude of the argument beyond which it is flat.
    Step { pole: f64, flat: f64 },
    /// A singularity at argument 0: divisors, roots, logarithms.
    Zero,
    /// A power that is not a whole number: a singularity at 0, where the power vanishes.
    Root(f64),
    /// A power whose exponent is larger in magnitude than the series can show.
    Power(f64),
}

/// Largest index of the largest term of an exponential series, as a share of the order.
const SHARE_OF_ORDER: f64 = 0.25;

/// Logarithm below which an exponential function counts as zero: near the smallest number.
const VANISHING: f64 = -690.0;

/// Room of a smooth step such as a hyperbolic tangent, as a share of the distance from the nearest
/// singularity.
///
/// NOTE: from `a_0` the deviation from ±1 grows to `2 e^{−1.2 a_0}` at the end of the step, and the
/// term of degree `n` of its series is `2 e^{−2 a_0} (0.8 a_0)^n/n!`: if the first is above the
/// roundoff of either format, the second is visible.
const SHARE_OF_STEP: f64 = 0.4;

/// Hyperbolic tangent: beyond `flat` it is ±1 to the square of double-double's roundoff.
const TANGENT: Feature = Feature::Step { pole: FRAC_PI_2, flat: 80.0 };

/// Reciprocal of the hyperbolic cosine.
const SECH: Feature = Feature::Step { pole: FRAC_PI_2, flat: 160.0 };

/// Logistic function: a hyperbolic tangent of half the argument.
const LOGISTIC: Feature = Feature::Step { pole: PI, flat: 160.0 };

/// Room as a share of the distance from a singularity at 0.
const SHARE_OF_ZERO: f64 = 0.9;

/// Least magnitude of a power that series may not show: about half of their order.
const HIGH_POWER: f64 = 16.0;

/// Least power that vanishes in so wide a neighbourhood of its zero that a step may pass it.
const LEAST_ROOT: f64 = 8.0;

/// Logarithm below which a high power counts as zero.
const VANISHING_POWER: f64 = -184.0;

impl Feature {
    /// One feature whose room is the smaller of both, if one of the two has it; `None` otherwise.
    fn joined(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Power(one), Self::Power(other)) => {
                let alike = one.signum() == other.signum();
                alike.then_some(Self::Power(if one.abs() > other.abs() { one } else { other }))
            }
            _ => (self == other).then_some(self),
        }
    }

    /// Room: the distance by which an argument may move from a value in a step, for series of an
    /// order.
    #[inline(always)]
    fn room(self, value: f64, order: usize) -> f64 {
        let growth = SHARE_OF_ORDER * order as f64;
        match self {
            Feature::Exponential => growth.max(VANISHING - value),
            Feature::Hyperbolic => growth,
            Feature::Step { pole, flat } => {
                (SHARE_OF_STEP * value.hypot(pole)).max(value.abs() - flat)
            }
            // NOTE: at the singularity there is no series at all, and no step to be shortened.
            Feature::Zero if value == 0.0 => f64::INFINITY,
            Feature::Zero => SHARE_OF_ZERO * value.abs(),
            Feature::Root(power) => {
                let size = value.abs();
                (SHARE_OF_ZERO * size).max((VANISHING_POWER / power).exp() - size)
            }
            Feature::Power(power) => {
                let (size, vanishing) = (value.abs(), (VANISHING_POWER / power).exp());
                let grows = (size * (growth / power).exp_m1()).abs();
                grows.max((vanishing - size) * power.signum())
            }
        }
    }
}

/// Arguments of a program's operations that need checks; `inputs` as in the lowering.
pub(super) fn arguments(program: &Program, inputs: &[InputKind]) -> Vec<Argument> {
    let moves = program.moving(inputs);
    let mut powers: Vec<(Slot, u32)> = (0..inputs.len()).map(|slot| (slot, 1)).collect();
    let mut found = Vec::new();
    for slot in inputs.len()..program.slots() {
        powers.push(power(*program.operation(slot), slot, &powers));
        let features = [feature(program, slot, &powers), high_power(program, slot, &powers)];
        for (of, feature) in features.into_iter().flatten() {
            if moves[of] {
                found.push(Argument { slot: of, feature });
            }
        }
    }
    without_repetition(found)
}

/// A slot as a power of another one, up to the sign: the base and the exponent.
///
/// NOTE: not a power of a multiple of the base, whose value vanishes elsewhere.
fn power(operation: Operation, slot: Slot, powers: &[(Slot, u32)]) -> (Slot, u32) {
    match operation {
        Operation::Mul(a, b) if powers[a].0 == powers[b].0 => {
            (powers[a].0, powers[a].1.saturating_add(powers[b].1))
        }
        Operation::Neg(a) => powers[a],
        _ => (slot, 1),
    }
}

/// A high power as a feature of its base.
fn high_power(program: &Program, slot: Slot, powers: &[(Slot, u32)]) -> Option<(Slot, Feature)> {
    let (base, exponent) = match *program.operation(slot) {
        Operation::Mul(..) => (powers[slot].0, f64::from(powers[slot].1)),
        Operation::Power { a, exponent, .. } => (a, exponent.to_f64()),
        _ => return None,
    };
    is_high(exponent).then_some((base, Feature::Power(exponent)))
}

/// Whether a power is so high that series may not show it.
fn is_high(exponent: f64) -> bool {
    exponent.abs() >= HIGH_POWER
}

/// The feature of an operation, and the slot of its argument.
fn feature(program: &Program, slot: Slot, powers: &[(Slot, u32)]) -> Option<(Slot, Feature)> {
    let exponential = |slot: Slot| {
        let base = powers[slot].0;
        matches!(program.operation(base), Operation::Exp { .. } | Operation::Cosh { .. })
    };
    Some(match *program.operation(slot) {
        Operation::Exp { a, .. } => (a, Feature::Exponential),
        Operation::Sinh { a, .. } | Operation::Cosh { a, .. } => (a, Feature::Hyperbolic),
        Operation::Tanh { a, .. } => (a, TANGENT),
        Operation::Function { function, a, .. } => match function {
            HeadFunction::Sech => (a, SECH),
            HeadFunction::LogCosh => (a, TANGENT),
            _ => (a, LOGISTIC),
        },
        // NOTE: exponential functions have no zeros, and their own arguments are checked.
        Operation::Div(_, b) if !exponential(b) => (b, Feature::Zero),
        // NOTE: a high power has less room than its zero allows, except where it vanishes.
        Operation::Power { exponent, .. } if is_high(exponent.to_f64()) => return None,
        Operation::Power { a, exponent, .. } if exponent.to_f64() > LEAST_ROOT => {
            (a, Feature::Root(exponent.to_f64()))
        }
        Operation::Sqrt(a) | Operation::Power { a, .. } => (a, Feature::Zero),
        Operation::Primitive { w, .. } | Operation::Atan2 { w, .. } => (w, Feature::Zero),
        _ => return None,
    })
}

/// Arguments without repetition; among powers of one base only the highest of either sign.
fn without_repetition(found: Vec<Argument>) -> Vec<Argument> {
    let mut kept: Vec<Argument> = Vec::new();
    for argument in found {
        let mut same = kept.iter_mut().filter(|other| other.slot == argument.slot);
        match same.find_map(|other| Some((other.feature.joined(argument.feature)?, other))) {
            Some((feature, other)) => other.feature = feature,
            None => kept.push(argument),
        }
    }
    kept
}

/// Largest number of halvings of a length.
const MAX_HALVINGS: usize = 80;

/// Factor by which an argument may exceed its room: rounding.
const EXCESS: f64 = 1.0 + 1e-6;

impl Argument {
    /// Slot of the argument's series.
    pub(super) fn slot(&self) -> Slot {
        self.slot
    }

    /// A length, shortened until the argument stays within its room.
    ///
    /// The bound is convex in the length and 0 at 0, so that the quotient of room and bound is a
    /// sufficient factor.
    #[inline(always)]
    pub(super) fn resolved<S: Branched>(
        &self,
        coefficients: &[S],
        mut length: S::Rounded,
    ) -> S::Rounded {
        let order = coefficients.len() - 1;
        let room = coefficients[0].mapped(|value| self.feature.room(value, order));
        let (half, most) = (S::Rounded::from_f64(0.5), room * S::Rounded::from_f64(EXCESS));
        for _ in 0..MAX_HALVINGS {
            let moved = polynomial::sizes(&coefficients[1..], length) * length;
            let is_over = most.is_below(moved);
            if !is_over.any() {
                break;
            }
            let factor = half.max(room / moved);
            length = S::Rounded::select(is_over, length * factor, length);
        }
        length
    }
}
