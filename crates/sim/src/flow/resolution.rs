//! Lengths on which narrow features of a field are seen.
//!
//! A pulse such as `exp(K (cos θ − 1))` is zero to every digit over most of its period: no Taylor
//! coefficient at a point far from it tells that it comes. The arguments of such functions do tell,
//! for they vary slowly. One idea: within a step the argument of each function with a scale of its
//! own moves no farther than the function shows where the step begins. With the coefficients `a_k`
//! of an argument
//!
//! ```text
//! |a(t) − a_0| ≤ Σ_{k ≥ 1} |a_k| h^k ≤ room(a_0)      for |t| ≤ h, real or complex
//! ```
//!
//! and the room is a share of the distance of `a_0` from the nearest singularity of the function
//! (`tanh`, quotients, roots), or such that the terms of its series are largest among those
//! computed (`exp`, high powers). What is too small to be a number, or too flat, leaves more room.
//! The room is wider than the steps that Taylor coefficients allow where they see the function, so
//! that it limits steps only beside what they do not see. A field without such functions has no
//! arguments to look at. See docs/mathematics/flow.md.

use std::f64::consts::{FRAC_PI_2, PI};

use super::program::{InputKind, Operation, Program, Slot};
use crate::jet::HeadFunction;
use crate::numeric::{Branched, Mask, Scalar as _, polynomial};

/// The argument of a function that may have a narrow feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Argument {
    slot: Slot,
    feature: Feature,
}

/// Kinds of features, by how far an argument may move from a value.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Feature {
    /// An exponential function of the argument.
    Exponential,
    /// A hyperbolic sine or cosine.
    Hyperbolic,
    /// A smooth step or bump at 0, flat beside it: the distance of its poles from 0, and arguments
    /// beyond which it is flat.
    Step { pole: f64, flat: f64 },
    /// A singularity where the argument is 0: divisors, roots, logarithms.
    Zero,
    /// A power that is no whole number: a singularity at 0, where it vanishes.
    Root(f64),
    /// A power that is higher, in size, than the series show.
    Power(f64),
}

/// Share of the order that the place of the largest term of an exponential series may reach.
const SHARE_OF_ORDER: f64 = 0.25;

/// Logarithm below which an exponential function counts as zero: next to the smallest number.
const VANISHING: f64 = -690.0;

/// Share of the distance from the nearest singularity of a smooth step, as of a hyperbolic tangent.
///
/// NOTE: from `a_0` the deviation from ±1 grows to `2 e^{−1.2 a_0}` at the end of the step, and the
/// term of degree `n` of its series is `2 e^{−2 a_0} (0.8 a_0)^n/n!`: where the first is above
/// the roundoff of either format, the second is seen.
const SHARE_OF_STEP: f64 = 0.4;

/// A hyperbolic tangent: ±1 beyond the end to the roundoff of double-double, squared.
const TANGENT: Feature = Feature::Step { pole: FRAC_PI_2, flat: 80.0 };

/// A reciprocal of a hyperbolic cosine.
const SECH: Feature = Feature::Step { pole: FRAC_PI_2, flat: 160.0 };

/// A logistic function: of half the argument a hyperbolic tangent.
const LOGISTIC: Feature = Feature::Step { pole: PI, flat: 160.0 };

/// Share of the distance from a singularity at 0.
const SHARE_OF_ZERO: f64 = 0.9;

/// Least power, in size, that series may not show: about half of their order.
const HIGH_POWER: f64 = 16.0;

/// Least power that vanishes in so wide a part of what is beside its zero that a step may pass it.
const LEAST_ROOT: f64 = 8.0;

/// Logarithm of what a high power counts as zero below.
const VANISHING_POWER: f64 = -184.0;

impl Feature {
    /// The feature that leaves no more room than either of two; `None` where neither does.
    fn joined(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Power(one), Self::Power(other)) => {
                let alike = one.signum() == other.signum();
                alike.then_some(Self::Power(if one.abs() > other.abs() { one } else { other }))
            }
            _ => (self == other).then_some(self),
        }
    }

    /// How far an argument may move from a value in a step with series of an order.
    #[inline(always)]
    fn room(self, value: f64, order: usize) -> f64 {
        let growth = SHARE_OF_ORDER * order as f64;
        match self {
            Feature::Exponential => growth.max(VANISHING - value),
            Feature::Hyperbolic => growth,
            Feature::Step { pole, flat } => {
                (SHARE_OF_STEP * value.hypot(pole)).max(value.abs() - flat)
            }
            // NOTE: on the singularity there is no series at all, and no step to be shortened.
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

/// The arguments of a program's operations to be looked at; `inputs` as it was lowered with.
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

/// A slot as a power of another one, but for its sign: the base and the exponent.
///
/// NOTE: not of a multiple of it, which vanishes elsewhere.
fn power(operation: Operation, slot: Slot, powers: &[(Slot, u32)]) -> (Slot, u32) {
    match operation {
        Operation::Mul(a, b) if powers[a].0 == powers[b].0 => {
            (powers[a].0, powers[a].1.saturating_add(powers[b].1))
        }
        Operation::Neg(a) => powers[a],
        _ => (slot, 1),
    }
}

/// The base of an operation that is a high power, as a feature.
fn high_power(program: &Program, slot: Slot, powers: &[(Slot, u32)]) -> Option<(Slot, Feature)> {
    let (base, exponent) = match *program.operation(slot) {
        Operation::Mul(..) => (powers[slot].0, f64::from(powers[slot].1)),
        Operation::Power { a, exponent, .. } => (a, exponent.to_f64()),
        _ => return None,
    };
    is_high(exponent).then_some((base, Feature::Power(exponent)))
}

/// Whether series may not show a power.
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
        // NOTE: exponential functions have no zeros, and their own arguments are looked at.
        Operation::Div(_, b) if !exponential(b) => (b, Feature::Zero),
        // NOTE: a high power keeps to less room than its zero leaves, but where it vanishes.
        Operation::Power { exponent, .. } if is_high(exponent.to_f64()) => return None,
        Operation::Power { a, exponent, .. } if exponent.to_f64() > LEAST_ROOT => {
            (a, Feature::Root(exponent.to_f64()))
        }
        Operation::Sqrt(a) | Operation::Power { a, .. } => (a, Feature::Zero),
        Operation::Primitive { w, .. } | Operation::Atan2 { w, .. } => (w, Feature::Zero),
        _ => return None,
    })
}

/// Arguments once each, of the powers of one base the highest of either sign.
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

/// Most times that a length is halved.
const MAX_HALVINGS: usize = 80;

/// Excess over its room that an argument may have: rounding.
const EXCESS: f64 = 1.0 + 1e-6;

impl Argument {
    /// Slot of the argument's series.
    pub(super) fn slot(&self) -> Slot {
        self.slot
    }

    /// The length, shortened until the argument keeps to its room within it.
    ///
    /// The bound is convex in the length and 0 at 0, so that the share of the room in it is a
    /// factor that suffices.
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
