//! From a double-double to its decimal digits.

use crate::numeric::double_double::Dd;
use crate::numeric::double_double::natural::{Natural, Remainder, rounded_half};

/// The digits of a finite number that is not negative, and the decimal exponent of the first.
pub(super) fn significant_digits(magnitude: Dd, digits: usize) -> (String, i64) {
    if magnitude.hi == 0.0 {
        return ("0".repeat(digits), 0);
    }
    let (number, exponent) = as_natural(magnitude);
    let mut leading = magnitude.hi.log10().floor() as i64;
    loop {
        let text = rounded_to_places(&number, exponent, digits as i64 - 1 - leading).to_decimal();
        match text.len() {
            length if length < digits => leading -= 1,
            length if length > digits => leading += 1,
            _ => return (text, leading),
        }
    }
}

/// `(n, e)` with `n 2^e` the number, which is finite and positive.
fn as_natural(magnitude: Dd) -> (Natural, i64) {
    let (hi, hi_exponent) = integer_mantissa(magnitude.hi);
    let (lo, lo_exponent) = integer_mantissa(magnitude.lo);
    let exponent = hi_exponent.min(lo_exponent);
    let hi = Natural::from_u64(hi).shifted_up((hi_exponent - exponent) as usize);
    let lo = Natural::from_u64(lo).shifted_up((lo_exponent - exponent) as usize);
    let number = if magnitude.lo < 0.0 && lo <= hi {
        hi.minus(&lo)
    } else {
        hi.plus(&lo)
    };
    (number, exponent)
}

/// `(m, e)` with `m 2^e` the magnitude of a finite double; zero as `(0, 1023)`.
fn integer_mantissa(value: f64) -> (u64, i64) {
    let bits = value.abs().to_bits();
    let fraction = bits & ((1 << 52) - 1);
    match ((bits >> 52) as i64, fraction) {
        (0, 0) => (0, 1023),
        (0, subnormal) => (subnormal, -1074),
        (biased, fraction) => (fraction | (1 << 52), biased - 1075),
    }
}

/// `n 2^e 10^places` rounded to a natural number, half to even.
fn rounded_to_places(number: &Natural, exponent: i64, places: i64) -> Natural {
    let mut scaled = number.shifted_up(1);
    if places > 0 {
        scaled.multiply_by_power_of_ten(places as usize);
    }
    if exponent > 0 {
        scaled = scaled.shifted_up(exponent as usize);
    }
    let mut remainder = Remainder::Zero;
    if places < 0 {
        remainder = scaled.divide_by_power_of_ten(places.unsigned_abs() as usize);
    }
    if exponent < 0 {
        let (quotient, dropped) = scaled.shifted_down(exponent.unsigned_abs() as usize);
        (scaled, remainder) = (quotient, remainder.or(dropped));
    }
    rounded_half(scaled, remainder)
}

/// The text without the zeros that end its fraction.
pub(super) fn without_trailing_zeros(text: &str) -> String {
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => {
            let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
            format!("{mantissa}e{exponent}")
        }
        _ => text.to_owned(),
    }
}
