//! Error-free transformations: a rounded result and its exact rounding error (Dekker 1971, Knuth).

/// `a + b` rounded, and the error of that rounding, for any `a` and `b`.
#[inline(always)]
pub(super) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_seen = sum - a;
    let a_seen = sum - b_seen;
    (sum, (a - a_seen) + (b - b_seen))
}

/// `a + b` rounded, and the error of that rounding, for `|a| >= |b|` or `a = 0`.
#[inline(always)]
pub(super) fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// `a b` rounded, and the error of that rounding.
///
/// Uses a fused multiply-add only where the machine has one: without it the function call would
/// cost far more than Dekker's splitting.
#[inline(always)]
pub(super) fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let error = if cfg!(target_feature = "fma") {
        a.mul_add(b, -product)
    } else {
        let (a_high, a_low) = split(a);
        let (b_high, b_low) = split(b);
        ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    };
    (product, error)
}

/// Veltkamp's splitting of a double into two halves of at most 26 bits.
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    const FACTOR: f64 = 134_217_729.0;
    let scaled = FACTOR * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// `2^exponent` for exponents of normal numbers; `0` below and infinity above.
pub(super) fn power_of_two(exponent: i32) -> f64 {
    match exponent {
        ..=-1023 => 0.0,
        1024.. => f64::INFINITY,
        _ => f64::from_bits(((exponent + 1023) as u64) << 52),
    }
}

/// The exponent `e` with `2^e <= |a| < 2^(e+1)` for normal numbers, `-1023` for zero and
/// subnormals.
pub(super) fn binary_exponent(a: f64) -> i32 {
    ((a.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_and_error_are_the_exact_product_of_integers() {
        let (a, b) = (9_007_199_254_740_881_i64, 4_503_599_627_370_449_i64);
        let (product, error) = two_product(a as f64, b as f64);
        assert_eq!(product as i128 + error as i128, a as i128 * b as i128);
        assert_ne!(error, 0.0);
    }

    #[test]
    fn binary_exponent_inverts_power_of_two() {
        for exponent in [-1022, -3, 0, 52, 1023] {
            assert_eq!(binary_exponent(power_of_two(exponent)), exponent);
        }
    }
}
