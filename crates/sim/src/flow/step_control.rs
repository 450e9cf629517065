//! Order and step length of Taylor's method.
//!
//! Jorba and Zou (2005) take order `n = ⌈−½ ln ε⌉ + 1` and the step `h = ρ e^{−2} e^{−0.7/(n−1)}`,
//! where `ρ` estimates the radius of convergence from the last coefficients, `ρ_k = (‖x_0‖ /
//! ‖x_k‖)^{1/k}`. The truncation error is then about `(h/ρ)^n ‖x_0‖ ≤ ε ‖x_0‖`. Three things differ
//! here:
//!
//! * every component is measured against itself, so units do not matter, and one whose last
//!   coefficients vanish (the phase of a forcing, a polynomial) does not speak;
//! * it is measured against its largest term, not `x_0` alone, which may vanish (at rest, or the
//!   parts of a jet that the flow has not filled yet): `h` is the largest step with `|x_k| h^k ≤
//!   ε_k max_j |x_j| h^j`, `j` in the lower half, where `ε_k = e^{−k(2 + 0.7/(n−1))}`;
//! * the last three coefficients are looked at, not two, for fields with symmetries.

use std::ops::RangeInclusive;

use crate::numeric::{Lanes, Real, Scalar};

/// Order for a relative tolerance.
pub(crate) fn order_for(tolerance: f64) -> usize {
    (-0.5 * tolerance.ln()).ceil().max(3.0) as usize + 1
}

/// Order for a relative tolerance of series with numbers as coefficients: higher than [`order_for`]
/// by four tenths.
///
/// NOTE: Jorba and Zou's order is best where the products of series are all the cost, which grows
/// as the square of the order; a series of numbers costs nearly as much for what grows with the
/// order itself.
pub(crate) fn order_for_numbers<S: Real>(tolerance: f64) -> usize {
    let order = order_for(tolerance);
    if S::ROUNDOFF >= f64::ROUNDOFF {
        order + 2 * order / 5
    } else {
        order
    }
}

/// Natural logarithm, per degree, of the share to which the last term is held where numbers are the
/// coefficients: that of Jorba and Zou's order, whatever the order taken, and `ε/e` where `ε` is
/// the roundoff.
///
/// NOTE: terms fall by `h/ρ` each, at most 0.3 at the orders taken, so what is then left out is
/// below `ε/6`, less than rounding.
pub(crate) fn margin_for<S: Scalar>(tolerance: f64, order: usize) -> f64 {
    if tolerance <= S::ROUNDOFF {
        return (1.0 - tolerance.ln()) / order as f64;
    }
    let theirs = order_for(tolerance);
    margin_at(theirs) * theirs as f64 / order as f64
}

/// Jorba and Zou's margin at their order.
pub(crate) fn margin_at(order: usize) -> f64 {
    2.0 + 0.7 / (order - 1) as f64
}

/// Number of last coefficients looked at.
const TAIL: usize = 3;

/// Longest admissible step of one component from the magnitudes of its Taylor coefficients, with a
/// margin per degree; infinite if the last ones vanish.
pub(crate) fn component_step(magnitudes: impl Fn(usize) -> f64, order: usize, margin: f64) -> f64 {
    log2_step(magnitudes, order, margin).exp2()
}

/// Binary logarithm of [`component_step`].
#[inline]
pub(crate) fn log2_step(magnitudes: impl Fn(usize) -> f64, order: usize, margin: f64) -> f64 {
    let margin = margin * std::f64::consts::LOG2_E;
    let (count, tails) = looked_at(order);
    if tails.clone().all(|degree| magnitudes(degree) == 0.0) {
        return f64::INFINITY;
    }
    let heads = logarithms(&magnitudes, count);
    let has_heads = heads.iter().any(|&head| head > OF_ZERO);
    let mut step = f64::INFINITY;
    for degree in tails {
        let tail = magnitudes(degree);
        if tail > 0.0 {
            let tail = log2(tail);
            step = step.min(if has_heads {
                longest(&heads, tail + margin * degree as f64, degree)
            } else {
                from_upper_half(&magnitudes, tail, (count, degree)) - margin
            });
        }
    }
    step
}

/// Binary logarithms of the longest steps of one component in several lanes, each that of
/// [`log2_step`].
#[inline(always)]
pub(crate) fn log2_steps<const N: usize>(coefficients: &[Lanes<N>], margin: f64) -> Lanes<N> {
    let scaled = margin * std::f64::consts::LOG2_E;
    let order = coefficients.len() - 1;
    let (count, tails) = looked_at(order);
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    let mut heads = [Lanes::splat(OF_ZERO); MAX_HEADS];
    let mut largest = Lanes::splat(OF_ZERO);
    for (head, coefficient) in heads[..count].iter_mut().zip(coefficients) {
        *head = coefficient.map(|value| log2(value.abs()));
        largest = largest.zip_map(*head, larger);
    }
    let mut steps = Lanes::splat(f64::INFINITY);
    let mut least = Lanes::splat(f64::INFINITY);
    for degree in tails {
        let tail = coefficients[degree].map(|value| log2(value.abs()));
        let needed = tail + Lanes::splat(scaled * degree as f64);
        let mut longest = Lanes::splat(f64::NEG_INFINITY);
        for (head, &inverse) in heads[..count].iter().zip(&INVERSES[degree.min(MAX_ORDER)]) {
            let room = (*head - needed) * Lanes::splat(inverse);
            longest = room.zip_map(longest, larger);
        }
        steps = steps.zip_map(longest, f64::min);
        least = least.zip_map(tail, f64::min);
    }
    let is_common = |lane: usize| largest[lane] > OF_ZERO && least[lane] > OF_ZERO;
    for lane in 0..N {
        if !is_common(lane) {
            let magnitude = |degree: usize| coefficients[degree][lane].abs();
            steps[lane] = log2_step(magnitude, order, margin);
        }
    }
    steps
}

/// How many of the first coefficients of a series are looked at, and which of the last.
#[inline(always)]
fn looked_at(order: usize) -> (usize, RangeInclusive<usize>) {
    let tails = (order + 1).saturating_sub(TAIL).max(1)..=order;
    ((tails.start() / 2 + 1).min(MAX_HEADS), tails)
}

/// `log2 |x_j|` of the first coefficients, that of zero for all beyond.
#[inline(always)]
fn logarithms(magnitudes: impl Fn(usize) -> f64, count: usize) -> [f64; MAX_HEADS] {
    let mut heads = [OF_ZERO; MAX_HEADS];
    for (degree, head) in heads[..count].iter_mut().enumerate() {
        *head = log2(magnitudes(degree));
    }
    heads
}

/// Most of the first coefficients that are looked at.
const MAX_HEADS: usize = 16;

/// Highest order whose inverses are listed.
const MAX_ORDER: usize = 127;

/// `1/(k − j)` in row `k` and column `j < k`; ones beyond.
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
fn longest(heads: &[f64; MAX_HEADS], needed: f64, degree: usize) -> f64 {
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    let inverses = &INVERSES[degree.min(MAX_ORDER)];
    let mut steps = [f64::NEG_INFINITY; 4];
    for chunk in 0..MAX_HEADS / 4 {
        for i in 0..4 {
            let room = (heads[4 * chunk + i] - needed) * inverses[4 * chunk + i];
            steps[i] = larger(steps[i], room);
        }
    }
    steps.into_iter().fold(f64::NEG_INFINITY, larger)
}

/// The same by the first term that does not vanish, in the upper half, but for the margin per
/// degree.
///
/// NOTE: there the condition would ask for a tiny step though the component is itself tiny; the
/// radius of convergence alone decides.
#[cold]
fn from_upper_half(
    magnitudes: impl Fn(usize) -> f64,
    tail: f64,
    (count, degree): (usize, usize),
) -> f64 {
    let first = (count..degree).find(|&lower| magnitudes(lower) > 0.0);
    first.map_or(f64::INFINITY, |lower| {
        (log2(magnitudes(lower)) - tail) / (degree - lower) as f64
    })
}

/// Binary logarithm of a number that is not negative, within 0.09: exponent and mantissa, the
/// latter linearly and by its first 20 bits; [`OF_ZERO`] at zero.
///
/// NOTE: in a step length the error is divided by the order, so this is good to half a percent.
#[inline(always)]
fn log2(value: f64) -> f64 {
    const MANTISSA: f64 = 1_048_576.0;
    let bits = (value.to_bits() >> 32) as i32;
    f64::from(bits) * (1.0 / MANTISSA) + OF_ZERO
}

/// What [`log2`] says of zero: less than of any normal number.
const OF_ZERO: f64 = -1023.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometric_coefficients_give_the_step_of_jorba_and_zou() {
        let (order, radius) = (20, 3.0_f64);
        let step = component_step(
            |degree| radius.powi(-(degree as i32)),
            order,
            margin_at(order),
        );
        let expected = radius * (-2.0 - 0.7 / 19.0_f64).exp();
        assert!((step / expected - 1.0).abs() < 0.01, "{step} {expected}");
    }

    #[test]
    fn vanishing_tails_do_not_limit_the_step_and_vanishing_heads_do_not_shrink_it() {
        let linear = |degree: usize| if degree < 2 { 1e4 } else { 0.0 };
        assert_eq!(component_step(linear, 20, margin_at(20)), f64::INFINITY);
        let from_rest = |degree: usize| if degree < 2 { 0.0 } else { 1.0 };
        assert!(component_step(from_rest, 20, margin_at(20)) > 0.08);
        let even = |degree: usize| f64::from(degree.is_multiple_of(2));
        assert!(component_step(even, 19, margin_at(19)) < 0.2);
    }

    #[test]
    fn order_follows_the_tolerance() {
        assert_eq!(order_for(1.1e-16), 20);
        assert_eq!(order_for(1.2e-32), 38);
    }
}
