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

use super::program::{InputKind, Operation, Program, Slot};
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
    /// A hyperbolic tangent: flat but for a step at 0.
    Tangent,
    /// A singularity where the argument is 0: divisors, roots, logarithms.
    Zero,
    /// An integer power that is higher than the series show beside its zero.
    Power(f64),
}

/// Share of the order that the place of the largest term of an exponential series may reach.
const SHARE_OF_ORDER: f64 = 0.25;

/// Logarithm below which an exponential function counts as zero: next to the smallest number.
const VANISHING: f64 = -690.0;

/// Share of the distance from the nearest singularity of a hyperbolic tangent.
///
/// NOTE: from `a_0` the deviation from ±1 grows to `2 e^{−1.2 a_0}` at the end of the step, and the
/// term of degree `n` of its series is `2 e^{−2 a_0} (0.8 a_0)^n/n!`: where the first is above
/// the roundoff of either format, the second is seen.
const SHARE_OF_TANGENT: f64 = 0.4;

/// Arguments beyond which a hyperbolic tangent is ±1 to the roundoff of double-double, squared.
const FLAT: f64 = 80.0;

/// Share of the distance from a singularity at 0.
const SHARE_OF_ZERO: f64 = 0.9;

/// Least integer power that series may not show beside its zero: about half of their order.
const HIGH_POWER: u32 = 16;

/// Logarithm of what a high power counts as zero below.
const VANISHING_POWER: f64 = -184.0;

impl Feature {
    /// How far an argument may move from a value in a step with series of an order.
    #[inline(always)]
    fn room(self, value: f64, order: usize) -> f64 {
        let growth = SHARE_OF_ORDER * order as f64;
        match self {
            Feature::Exponential => growth.max(VANISHING - value),
            Feature::Hyperbolic => growth,
            Feature::Tangent => {
                let distance = value.hypot(std::f64::consts::FRAC_PI_2);
                (SHARE_OF_TANGENT * distance).max(value.abs() - FLAT)
            }
            // NOTE: on the singularity there is no series at all, and no step to be shortened.
            Feature::Zero if value == 0.0 => f64::INFINITY,
            Feature::Zero => SHARE_OF_ZERO * value.abs(),
            Feature::Power(power) => {
                let (size, vanishing) = (value.abs(), (VANISHING_POWER / power).exp());
                (size * (growth / power).exp_m1()).max(vanishing - size)
            }
        }
    }
}

/// The arguments of a program's operations to be looked at; `inputs` as it was lowered with.
pub(super) fn arguments(program: &Program, inputs: &[InputKind]) -> Vec<Argument> {
    let is_moving =
        |kind: &InputKind| matches!(kind, InputKind::Variable | InputKind::LinearInTime);
    let mut moves: Vec<bool> = inputs.iter().map(is_moving).collect();
    let mut powers: Vec<(Slot, u32)> = (0..inputs.len()).map(|slot| (slot, 1)).collect();
    let mut found = Vec::new();
    for slot in inputs.len()..program.slots() {
        let moving = program.operands(slot).any(|operand| moves[operand]);
        moves.push(moving);
        powers.push(power(*program.operation(slot), slot, &powers));
        if let Some((of, feature)) = feature(program, slot, &powers)
            && moves[of]
        {
            found.push(Argument { slot: of, feature });
        }
    }
    without_repetition(found)
}

/// A slot as a power of another one: its base and the exponent.
fn power(operation: Operation, slot: Slot, powers: &[(Slot, u32)]) -> (Slot, u32) {
    match operation {
        Operation::Mul(a, b) if powers[a].0 == powers[b].0 => {
            (powers[a].0, powers[a].1.saturating_add(powers[b].1))
        }
        _ => (slot, 1),
    }
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
        Operation::Tanh { a, .. } => (a, Feature::Tangent),
        // NOTE: exponential functions have no zeros, and their own arguments are looked at.
        Operation::Div(_, b) if !exponential(b) => (b, Feature::Zero),
        Operation::Sqrt(a) | Operation::Power { a, .. } => (a, Feature::Zero),
        Operation::Primitive { w, .. } | Operation::Atan2 { w, .. } => (w, Feature::Zero),
        Operation::Mul(..) if powers[slot].1 >= HIGH_POWER => {
            let (base, exponent) = powers[slot];
            (base, Feature::Power(f64::from(exponent)))
        }
        _ => return None,
    })
}

/// Arguments once each, of the powers of one base the highest.
fn without_repetition(found: Vec<Argument>) -> Vec<Argument> {
    let mut kept: Vec<Argument> = Vec::new();
    for argument in found {
        let same = kept.iter_mut().find(|other| {
            let (one, other_feature) = (argument.feature, other.feature);
            other.slot == argument.slot
                && std::mem::discriminant(&one) == std::mem::discriminant(&other_feature)
        });
        match same {
            // NOTE: the powers of a base come in ascending order.
            Some(other) => other.feature = argument.feature,
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
