//! Sine and cosine at the nodes of an element, all nodes together.
//!
//! The standard functions take the nodes one by one, a tenth of the way to an orbit. Here arguments are reduced by multiples of
//! `π/2` in three parts, and the polynomials on `[−π/4, π/4]` are those of fdlibm (Sun Microsystems 1993, `k_sin.c` and
//! `k_cos.c`): within one unit in the last place.

use std::f64::consts::FRAC_2_PI;

use super::gauss::{NODES, NodeValues};
use crate::jet::{HeadFunction, scalar_head};
use crate::numeric::{Lanes, Scalar};

/// Largest argument that is reduced here: the products with the first two parts of `π/2` are exact.
const LARGEST: f64 = 1e5;

/// `π/2` in three parts, the first two of 33 bits.
const HALF_PI: [f64; 3] = [
    f64::from_bits(0x3FF9_21FB_5440_0000),
    f64::from_bits(0x3DD0_B461_1A60_0000),
    f64::from_bits(0x3BA3_198A_2E03_7073),
];

/// What added to a number and taken away again rounds it to an integer.
const ROUNDING: f64 = 1.5 / f64::EPSILON;

/// `(sin x − x)/x³` in powers of `x²`.
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// `(cos x − 1 + x²/2)/x⁴` in powers of `x²`.
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// A function of node values.
#[inline(always)]
pub(super) fn head(function: HeadFunction, a: NodeValues) -> NodeValues {
    let quarters = match function {
        HeadFunction::Sin => 0.0,
        HeadFunction::Cos => 1.0,
        _ => return scalar_head(function, a),
    };
    if a.magnitude() <= LARGEST {
        sine(a, quarters)
    } else {
        scalar_head(function, a)
    }
}

/// `sin(x + quarters · π/2)`.
#[inline(always)]
fn sine(x: NodeValues, quarters: f64) -> NodeValues {
    let one = Lanes::splat(1.0);
    let turns = rounded(x * Lanes::splat(FRAC_2_PI));
    let [sine, cosine] = reduced(x, turns);
    let turns = turns + Lanes::splat(quarters);
    let quadrant = turns - rounded(turns * Lanes::splat(0.25)) * Lanes::splat(4.0);
    // NOTE: numbers in place of choices, which would be made node by node: `is_odd` is 0 or 1, and one of the factors is 0.
    let square = quadrant * quadrant;
    let is_odd = square * (Lanes::splat(4.0) - square) * Lanes::splat(1.0 / 3.0);
    let of_sine = (one - is_odd) * (one - square * Lanes::splat(0.5));
    sine * of_sine + cosine * (is_odd * quadrant)
}

/// The nearest integers.
#[inline(always)]
fn rounded(x: NodeValues) -> NodeValues {
    x + Lanes::splat(ROUNDING) - Lanes::splat(ROUNDING)
}

/// Sine and cosine of `x − turns · π/2`, at most `π/4` in size.
#[inline(always)]
fn reduced(x: NodeValues, turns: NodeValues) -> [NodeValues; 2] {
    let [first, second, third] = HALF_PI.map(|part| turns * Lanes::splat(part));
    let partly = x - first;
    let near = partly - second;
    let rest = third - (partly - near - second);
    let y = near - rest;
    let tail = near - y - rest;
    let (one, half) = (Lanes::splat(1.0), Lanes::splat(0.5));
    let square = y * y;
    let cube = square * y;
    let [lead, higher @ ..] = SINE;
    let correction = square * (half * tail - cube * polynomial(&higher, square)) - tail;
    let sine = y - (correction - cube * Lanes::splat(lead));
    let fourth = square * polynomial(&COSINE, square);
    let rough = one - half * square;
    let cosine = rough + ((one - rough - half * square) + (square * fourth - y * tail));
    [sine, cosine]
}

#[inline(always)]
fn polynomial(coefficients: &[f64], x: NodeValues) -> NodeValues {
    let mut sum = Lanes([0.0; NODES]);
    for &coefficient in coefficients.iter().rev() {
        sum = sum.mul_add(x, Lanes::splat(coefficient));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_the_standard_ones_up_to_two_units_in_the_last_place() {
        let mut worst = 0.0_f64;
        for step in 0..200_000 {
            let scale = [1.0, 30.0, 1e5][step % 3];
            let x = Lanes::from_fn(|node| scale * (0.618 * (16 * step + node) as f64).sin());
            let values = [HeadFunction::Sin, HeadFunction::Cos].map(|function| head(function, x));
            for node in 0..NODES {
                let (sine, cosine) = x.0[node].sin_cos();
                let difference = |value: f64, exact: f64| (value - exact).abs() / exact.abs();
                worst = worst.max(difference(values[0].0[node], sine));
                worst = worst.max(difference(values[1].0[node], cosine));
            }
        }
        // NOTE: one unit here, and at most one there.
        assert!(worst <= 2.0 * f64::EPSILON, "{worst:e}");
    }

    #[test]
    fn multiples_of_a_quarter_turn_and_arguments_beyond_the_reduction_are_exact_enough() {
        let x = Lanes::from_fn(|node| (node as f64 - 8.0) * std::f64::consts::FRAC_PI_2);
        let large = Lanes([3e22; NODES]);
        for (function, standard) in [
            (HeadFunction::Sin, f64::sin as fn(f64) -> f64),
            (HeadFunction::Cos, f64::cos),
        ] {
            for x in [x, large] {
                let exact = x.map(standard);
                let difference = (head(function, x) - exact).0;
                let close = |(d, e): (&f64, &f64)| d.abs() <= 2.0 * f64::EPSILON * e.abs();
                assert!(difference.iter().zip(&exact.0).all(close), "{function:?}");
            }
        }
        assert!(head(HeadFunction::Sin, Lanes([f64::NAN; NODES])).0[0].is_nan());
    }
}
