//! Order and step length of Taylor's method.
//!
//! Jorba and Zou (2005) take order `n = ⌈−½ ln ε⌉ + 1` and the step `h = ρ e^{−2} e^{−0.7/(n−1)}`,
//! where `ρ` estimates the radius of convergence from the last coefficients, `ρ_k = (‖x_0‖ /
//! ‖x_k‖)^{1/k}`. The truncation error is then about `(h/ρ)^n ‖x_0‖ ≤ ε ‖x_0‖`. Three things differ
//! here:
//!
//! * every component is compared with itself, so that units do not matter, and a component whose
//!   last coefficients vanish (the phase of a forcing, a polynomial) sets no limit;
//! * the reference is its largest term, not `x_0` alone, which may vanish (at rest, or in the parts
//!   of a jet that the flow has not filled yet): `h` is the largest step with `|x_k| h^k ≤ ε_k
//!   max_j |x_j| h^j`, with `j` in the lower half and `ε_k = e^{−k(2 + 0.7/(n−1))}`;
//! * the last three coefficients are examined, not two, for fields with symmetries.

use std::ops::RangeInclusive;

use num_traits::Zero as _;

use crate::numeric::{Branched, Mask, Scalar};

/// Order for a relative tolerance.
pub(crate) fn order_for(tolerance: f64) -> usize {
    (-0.5 * tolerance.ln()).ceil().max(3.0) as usize + 1
}

/// Order for a relative tolerance of series with numbers as coefficients: higher than [`order_for`]
/// by four tenths.
///
/// NOTE: Jorba and Zou's order is best if products of series, whose cost grows as the square of the
/// order, are the whole cost. In a series of numbers, work that grows only linearly with the order
/// costs nearly as much.
pub(crate) fn order_for_numbers<S: Scalar>(tolerance: f64) -> usize {
    let order = order_for(tolerance);
    if S::ROUNDOFF >= f64::ROUNDOFF { order + 2 * order / 5 } else { order }
}

/// Natural logarithm, per degree, of the factor that bounds the last term if the coefficients are
/// numbers: that of Jorba and Zou's order, for any order taken, and `ε/e` if `ε` is the roundoff.
///
/// NOTE: terms fall by `h/ρ` each, at most 0.3 at the orders taken, so that the truncation error is
/// then below `ε/6`, less than rounding.
pub(crate) fn margin_for<S: Scalar>(tolerance: f64, order: usize) -> f64 {
    if tolerance <= S::ROUNDOFF {
        return (1.0 - tolerance.ln()) / order as f64;
    }
    let theirs = order_for(tolerance);
    margin_at(theirs) * theirs as f64 / order as f64
}

/// Margin of the step per degree by Jorba and Zou, at the order that they choose.
pub(crate) fn margin_at(order: usize) -> f64 {
    2.0 + 0.7 / (order - 1) as f64
}

/// Number of last coefficients that are examined.
const TAIL: usize = 3;

/// Longest admissible step of one component from the magnitudes of its Taylor coefficients, with a
/// margin per degree; infinite if the last coefficients vanish.
pub(crate) fn component_step(magnitudes: &[f64], margin: f64) -> f64 {
    log2_step(magnitudes, margin).exp2()
}

/// Binary logarithm of [`component_step`], for one series or for one in every lane.
#[inline(always)]
pub(crate) fn log2_step<S: Branched>(coefficients: &[S], margin: f64) -> S::Rounded {
    let margin = margin * std::f64::consts::LOG2_E;
    let (count, tails) = looked_at(coefficients.len() - 1);
    let of_zero = S::Rounded::from_f64(OF_ZERO);
    let (mut heads, mut largest) = ([of_zero; MAX_HEADS], of_zero);
    for (head, &coefficient) in heads[..count].iter_mut().zip(coefficients) {
        *head = log2(coefficient);
        largest = larger(largest, *head);
    }
    let has_heads = of_zero.is_below(largest);
    let mut step = S::Rounded::from_f64(f64::INFINITY);
    for degree in tails {
        let tail = coefficients[degree];
        let limits = S::Rounded::zero().is_below(tail.rounded().abs());
        if limits.is_over() {
            continue;
        }
        let needed = log2(tail) + S::Rounded::from_f64(margin * degree as f64);
        let mut own = longest(&heads, needed, degree);
        let alone = limits & !has_heads;
        if alone.any() {
            let radius = from_upper_half(coefficients, alone, (count, degree));
            own = S::Rounded::select(alone, radius - S::Rounded::from_f64(margin), own);
        }
        step = S::Rounded::select(limits, step.min(own), step);
    }
    step
}

/// Number of first coefficients of a series that are examined, and the range of the last ones.
#[inline(always)]
fn looked_at(order: usize) -> (usize, RangeInclusive<usize>) {
    let tails = (order + 1).saturating_sub(TAIL).max(1)..=order;
    ((tails.start() / 2 + 1).min(MAX_HEADS), tails)
}

/// Largest number of first coefficients that are examined.
const MAX_HEADS: usize = 16;

/// Highest order for which inverses are tabulated.
const MAX_ORDER: usize = 127;

/// `1/(k − j)` in row `k` and column `j < k`; 1 elsewhere.
static INVERSES: [[f64; MAX_HEADS]; MAX_ORDER + 1] = {
    let mut inverses = [[1.0; MAX_HEADS]; MAX_ORDER + 1];
    let mut k = 1;
    while k <= MAX_ORDER {
        let mut j = 0;
        while j < MAX_HEADS && j < k {
            inverses[k][j] = 1.0 / (k - j) as f64;
            j += 1;
        }
        k += 1;
    }
    inverses
};

/// `max_j log2 h_j` with `|x_k| h_j^{k−j} = ε_k |x_j|`; `heads` holds `log2 |x_j|`, and `needed` is
/// `log2 |x_k|/ε_k`.
#[inline(always)]
fn longest<R: Branched>(heads: &[R; MAX_HEADS], needed: R, degree: usize) -> R {
    let inverses = &INVERSES[degree.min(MAX_ORDER)];
    let mut steps = [R::from_f64(f64::NEG_INFINITY); 4];
    for chunk in 0..MAX_HEADS / 4 {
        for i in 0..4 {
            let inverse = R::from_f64(inverses[4 * chunk + i]);
            let room = (heads[4 * chunk + i] - needed) * inverse;
            steps[i] = larger(steps[i], room);
        }
    }
    let [first, second, third, fourth] = steps;
    larger(larger(first, second), larger(third, fourth))
}

#[inline(always)]
fn larger<R: Branched>(one: R, other: R) -> R {
    R::select(other.is_below(one), one, other)
}

/// Admissible step, without the margin per degree, from the first nonzero term in the upper half.
///
/// NOTE: there the condition would ask for a tiny step although the component is itself tiny; only
/// the radius of convergence decides.
#[cold]
#[inline(never)]
fn from_upper_half<S: Branched>(
    coefficients: &[S],
    wanted: S::Mask,
    (count, degree): (usize, usize),
) -> S::Rounded {
    let mut steps = S::Rounded::zero();
    for lane in wanted.lanes() {
        let magnitude = |degree: usize| coefficients[degree].lane(lane).abs();
        let first = (count..degree).find(|&lower| magnitude(lower) > 0.0);
        let step = first.map_or(f64::INFINITY, |lower| {
            let fall = log2_of(magnitude(lower)) - log2_of(magnitude(degree));
            fall / (degree - lower) as f64
        });
        let step = S::Rounded::from_f64(step);
        steps = S::Rounded::select(S::Mask::only(lane), step, steps);
    }
    steps
}

/// Binary logarithms of the magnitudes of numbers, as in [`log2_of`].
#[inline(always)]
fn log2<S: Branched>(number: S) -> S::Rounded {
    number.mapped(|value| log2_of(value.abs()))
}

/// Binary logarithm of a number that is not negative, within 0.09: exponent and mantissa, the
/// latter linearly and by its first 20 bits; [`OF_ZERO`] at zero.
///
/// NOTE: in a step length the error is divided by the order, so that it is half a percent.
#[inline(always)]
fn log2_of(value: f64) -> f64 {
    const MANTISSA: f64 = 1_048_576.0;
    let bits = (value.to_bits() >> 32) as i32;
    f64::from(bits) * (1.0 / MANTISSA) + OF_ZERO
}

/// Value of [`log2_of`] at zero: less than at any normal number.
const OF_ZERO: f64 = -1023.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Lanes;

    fn stepped(magnitude: impl Fn(usize) -> f64, order: usize) -> f64 {
        let magnitudes: Vec<f64> = (0..=order).map(magnitude).collect();
        let step = component_step(&magnitudes, margin_at(order));
        let of_lanes: Vec<_> = magnitudes.iter().map(|&m| Lanes([1.0, m, 0.0])).collect();
        assert_eq!(log2_step(&of_lanes, margin_at(order))[1].exp2(), step);
        step
    }

    #[test]
    fn geometric_coefficients_give_the_step_of_jorba_and_zou() {
        let (order, radius) = (20, 3.0_f64);
        let step = stepped(|degree| radius.powi(-(degree as i32)), order);
        let expected = radius * (-2.0 - 0.7 / 19.0_f64).exp();
        assert!((step / expected - 1.0).abs() < 0.01, "{step} {expected}");
    }

    #[test]
    fn vanishing_tails_do_not_limit_the_step_and_vanishing_heads_do_not_shrink_it() {
        let linear = |degree: usize| if degree < 2 { 1e4 } else { 0.0 };
        assert_eq!(stepped(linear, 20), f64::INFINITY);
        let from_rest = |degree: usize| if degree < 2 { 0.0 } else { 1.0 };
        assert!(stepped(from_rest, 20) > 0.08);
        let even = |degree: usize| f64::from(degree.is_multiple_of(2));
        assert!(stepped(even, 19) < 0.2);
    }

    #[test]
    fn order_follows_the_tolerance() {
        assert_eq!(order_for(1.1e-16), 20);
        assert_eq!(order_for(1.2e-32), 38);
    }
}
