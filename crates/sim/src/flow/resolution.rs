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
    /// A power that is not a whole number: a singularity at 0, where the power vanishes; below a
    /// magnitude of its base it counts as zero.
    Root { vanishing: f64 },
    /// A power that may be flatter beside its zero than a series can show: the logarithm of its
    /// base moves by at most a share of the order, and below a magnitude of its base it counts as
    /// zero (above it, if the exponent is negative).
    Power { share: f64, vanishing: f64 },
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

/// Least magnitude of a base below which its power may count as zero, above the rounding of sums.
///
/// NOTE: a sum within rounding of zero has a series that does not tell where it grows again.
const LEAST_VANISHING: f64 = 1e-12;

/// Least order of a zero that the last coefficients of a series may not show.
const FLAT: u32 = 26;

impl Feature {
    /// A power of a base, as one of a number of factors; the power counts as zero if it is below
    /// `e^{−184}` after the factor `e^{gain}`.
    fn power(exponent: f64, factors: f64, gain: f64) -> Self {
        let vanishing = ((VANISHING_POWER - gain) / exponent).exp();
        Self::Power {
            share: SHARE_OF_ORDER / (factors * exponent),
            vanishing: vanishing.max(LEAST_VANISHING),
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
            Feature::Root { vanishing } => {
                let size = value.abs();
                (SHARE_OF_ZERO * size).max(vanishing - size)
            }
            Feature::Power { share, vanishing } => {
                let size = value.abs();
                let grows = (size * (share * order as f64).exp_m1()).abs();
                grows.max((vanishing - size) * share.signum())
            }
        }
    }
}

/// Arguments of a program's operations that need checks; `inputs` as in the lowering.
pub(super) fn arguments(program: &Program, inputs: &[InputKind]) -> Vec<Argument> {
    let moves = program.moving(inputs);
    let slots = Slots::new(program, inputs);
    let mut found: Vec<Argument> = Vec::new();
    for slot in inputs.len()..program.slots() {
        let feature = slots.feature(slot).into_iter();
        for (of, feature) in feature.chain(slots.flat_product(slot)) {
            let argument = Argument { slot: of, feature };
            if moves[of] && !found.contains(&argument) {
                found.push(argument);
            }
        }
    }
    found
}

/// Properties of the slots of a program that tell which of them may hide a narrow feature.
struct Slots<'p> {
    program: &'p Program,
    /// Every slot as a power of another one, up to the sign: the base and the exponent.
    powers: Vec<(Slot, u32)>,
    /// Order of the highest zero that a slot is expected to have: the sum of those of its factors,
    /// 2 for a state or a sum, which may have a turning point there.
    orders: Vec<u32>,
    /// Logarithm of the largest constant factor, at least 1, with which a slot enters an output.
    gains: Vec<f64>,
    /// Mask: a slot enters nothing but higher powers of its base.
    is_part: Vec<bool>,
}

impl<'p> Slots<'p> {
    fn new(program: &'p Program, inputs: &[InputKind]) -> Self {
        let mut powers: Vec<(Slot, u32)> = (0..inputs.len()).map(|slot| (slot, 1)).collect();
        let mut orders: Vec<u32> = inputs.iter().map(order_of_input).collect();
        for slot in inputs.len()..program.slots() {
            let operation = *program.operation(slot);
            powers.push(power(operation, slot, &powers));
            orders.push(order_of_zero(operation, &orders));
        }
        let mut gains = vec![0.0_f64; program.slots()];
        let mut is_part = vec![true; program.slots()];
        for output in 0..program.outputs() {
            is_part[program.output(output)] = false;
        }
        for slot in (inputs.len()..program.slots()).rev() {
            let (operation, (base, _)) = (*program.operation(slot), powers[slot]);
            let gain = gains[slot] + own_gain(operation);
            for read in operation.reads() {
                let multiplies =
                    !matches!(operation, Operation::Div(_, divisor) if divisor == read);
                if is_linear_in_operands(operation) && multiplies {
                    gains[read] = gains[read].max(gain);
                }
                let raises = matches!(operation, Operation::Mul(..)) && powers[read].0 == base;
                is_part[read] &= raises;
            }
        }
        Self { program, powers, orders, gains, is_part }
    }

    /// The feature of an operation, and the slot of its argument.
    fn feature(&self, slot: Slot) -> Option<(Slot, Feature)> {
        Some(match *self.program.operation(slot) {
            Operation::Exp { a, .. } => (a, Feature::Exponential),
            Operation::Function { function, a, .. } => match function {
                HeadFunction::Sin | HeadFunction::Cos => return None,
                HeadFunction::Sinh | HeadFunction::Cosh => (a, Feature::Hyperbolic),
                HeadFunction::Tanh | HeadFunction::LogCosh => (a, TANGENT),
                HeadFunction::Sech => (a, SECH),
                _ => (a, LOGISTIC),
            },
            // NOTE: exponential functions have no zeros, and their own arguments are checked.
            Operation::Div(_, b) if !self.is_exponential(b) => (b, Feature::Zero),
            Operation::Power { a, exponent, .. } => {
                (a, power_of_a_number(exponent.to_f64(), self.gains[slot]))
            }
            Operation::Sqrt(a) => (a, Feature::Zero),
            Operation::Primitive { w, .. } | Operation::Atan2 { w, .. } => (w, Feature::Zero),
            _ => return None,
        })
    }

    /// Whether a slot is a power of an exponential function.
    fn is_exponential(&self, slot: Slot) -> bool {
        let base = self.powers[slot].0;
        matches!(
            self.program.operation(base),
            Operation::Exp { .. } | Operation::Function { function: HeadFunction::Cosh, .. }
        )
    }

    /// Features of the factors of a product that may be flatter beside its zero than a series can
    /// show: its base, if it is a power; else both factors, if each alone is shown.
    fn flat_product(&self, slot: Slot) -> Vec<(Slot, Feature)> {
        let Operation::Mul(a, b) = *self.program.operation(slot) else { return Vec::new() };
        let ((base, exponent), gain) = (self.powers[slot], self.gains[slot]);
        let is_flat = self.orders[slot] >= FLAT;
        if exponent > 1 {
            let exponent = f64::from(exponent);
            let is_hidden = !self.is_part[slot] && (is_flat || is_high(exponent));
            return Vec::from_iter(is_hidden.then(|| (base, Feature::power(exponent, 1.0, gain))));
        }
        let are_shown = self.orders[a].max(self.orders[b]) < FLAT;
        match is_flat && are_shown {
            true => [a, b].map(|factor| (factor, Feature::power(1.0, 2.0, gain))).to_vec(),
            false => Vec::new(),
        }
    }
}

/// The feature of a power whose exponent is no whole number.
///
/// NOTE: a high power has less room than its zero allows, except where it vanishes.
fn power_of_a_number(exponent: f64, gain: f64) -> Feature {
    if is_high(exponent) {
        Feature::power(exponent, 1.0, gain)
    } else if exponent > LEAST_ROOT {
        Feature::Root { vanishing: ((VANISHING_POWER - gain) / exponent).exp() }
    } else {
        Feature::Zero
    }
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

/// Order of the highest zero that an input is expected to have.
fn order_of_input(kind: &InputKind) -> u32 {
    match kind {
        InputKind::Variable => 2,
        InputKind::LinearInTime => 1,
        InputKind::HeadOnly | InputKind::Bound(_) => 0,
    }
}

/// Order of the highest zero that the result of an operation is expected to have, from those of its
/// operands.
fn order_of_zero(operation: Operation, orders: &[u32]) -> u32 {
    match operation {
        Operation::Mul(a, b) => orders[a].saturating_add(orders[b]),
        Operation::Neg(a) | Operation::Scale(a, _) => orders[a],
        Operation::MulByHead { factor, .. } => orders[factor],
        Operation::Div(a, _) => orders[a],
        Operation::OfPhase { .. } => 1,
        Operation::Power { a, exponent, .. } => {
            (f64::from(orders[a]) * exponent.to_f64().max(1.0)) as u32
        }
        Operation::SignTimes { b, .. } => orders[b],
        _ => operation.operands().map(|operand| orders[operand]).max().unwrap_or(0).max(2),
    }
}

/// Logarithm of the constant factor of an operation.
fn own_gain(operation: Operation) -> f64 {
    match operation {
        Operation::Scale(_, factor) => factor.to_f64().abs().ln().max(0.0),
        _ => 0.0,
    }
}

/// Whether an operation multiplies its operands, or adds them.
fn is_linear_in_operands(operation: Operation) -> bool {
    matches!(
        operation,
        Operation::Add(..)
            | Operation::Sub(..)
            | Operation::Neg(_)
            | Operation::Scale(..)
            | Operation::AddConstant(..)
            | Operation::MulByHead { .. }
            | Operation::Mul(..)
            | Operation::Div(..)
            | Operation::SignTimes { .. }
    )
}

/// Whether a power is so high that series may not show it.
fn is_high(exponent: f64) -> bool {
    exponent.abs() >= HIGH_POWER
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
