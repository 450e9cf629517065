//! From a decimal literal to the nearest double-double.

use super::ParseDdError;
use crate::numeric::double_double::Dd;
use crate::numeric::double_double::exact::power_of_two;
use crate::numeric::double_double::natural::{Natural, Remainder, rounded_half};

/// Decimal exponents beyond this have no double-double (and would cost a long computation).
const LARGEST_EXPONENT: i64 = 400;

/// Digits beyond this count only say whether they are all zero.
const LARGEST_DIGIT_COUNT: usize = 1200;

/// Quotients carry this many bits, so that two roundings to 53 bits see all that matters.
const QUOTIENT_BITS: usize = 256;

/// The sign before a literal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    /// `+` or nothing.
    Positive,
    /// `-`.
    Negative,
}

/// A literal taken apart: `±digits * 10^exponent`.
pub(super) struct Literal {
    pub(super) sign: Sign,
    digits: Natural,
    digit_count: i64,
    exponent: i64,
}

impl Literal {
    /// Takes a text apart.
    ///
    /// # Errors
    ///
    /// [`ParseDdError`] where the text is no decimal literal.
    pub(super) fn read(text: &str) -> Result<Literal, ParseDdError> {
        let mut rest = text;
        let sign = take_sign(&mut rest);
        let whole = take_digits(&mut rest);
        let fraction = match rest.strip_prefix('.') {
            Some(after) => {
                rest = after;
                take_digits(&mut rest)
            }
            None => "",
        };
        if whole.is_empty() && fraction.is_empty() && rest.is_empty() {
            return Err(ParseDdError::NoDigits {
                text: text.to_owned(),
            });
        }
        let found_digits = !(whole.is_empty() && fraction.is_empty());
        let exponent = if found_digits {
            take_exponent(&mut rest)
        } else {
            None
        };
        if let Some(found) = rest.chars().next() {
            return Err(unexpected(text, rest, found));
        }
        let digits = [whole, fraction].concat();
        let (significant, dropped) = kept_digits(digits.trim_start_matches('0'));
        Ok(Literal {
            sign,
            digit_count: significant.len() as i64,
            digits: natural(&significant),
            exponent: exponent.unwrap_or(0) - fraction.len() as i64 + dropped as i64,
        })
    }

    /// The number without its sign; `None` if it is too large.
    pub(super) fn magnitude(&self) -> Option<Dd> {
        let leading_exponent = self.digit_count + self.exponent;
        if self.digits.is_zero() || leading_exponent < -LARGEST_EXPONENT {
            return Some(Dd::ZERO);
        }
        if leading_exponent > LARGEST_EXPONENT {
            return None;
        }
        let mut numerator = self.digits.clone();
        if self.exponent >= 0 {
            numerator.multiply_by_power_of_ten(self.exponent as usize);
            return Some(nearest(&numerator, 0)).filter(|value| value.is_finite());
        }
        let places = self.exponent.unsigned_abs() as usize;
        // NOTE: 10^places has fewer than 10 places / 3 + 1 bits.
        let shift = QUOTIENT_BITS + places * 10 / 3 + 1;
        let mut quotient = numerator.shifted_up(shift);
        if quotient.divide_by_power_of_ten(places) == Remainder::Positive {
            quotient = sticky(quotient);
        }
        Some(nearest(&quotient, -(shift as i64))).filter(|value| value.is_finite())
    }
}

fn take_sign(rest: &mut &str) -> Sign {
    if let Some(after) = rest.strip_prefix('-') {
        *rest = after;
        return Sign::Negative;
    }
    *rest = rest.strip_prefix('+').unwrap_or(rest);
    Sign::Positive
}

fn take_digits<'a>(rest: &mut &'a str) -> &'a str {
    let text = *rest;
    let end = text
        .find(|character: char| !character.is_ascii_digit())
        .unwrap_or(text.len());
    let (digits, after) = text.split_at(end);
    *rest = after;
    digits
}

/// The exponent after `e` or `E`, saturated; leaves the text alone if no digit follows.
fn take_exponent(rest: &mut &str) -> Option<i64> {
    let mut after = rest.strip_prefix(['e', 'E'])?;
    let sign = take_sign(&mut after);
    let digits = take_digits(&mut after);
    if digits.is_empty() {
        return None;
    }
    *rest = after;
    let magnitude = digits.parse::<i64>().unwrap_or(i64::MAX).min(1 << 60);
    Some(match sign {
        Sign::Positive => magnitude,
        Sign::Negative => -magnitude,
    })
}

fn unexpected(text: &str, rest: &str, found: char) -> ParseDdError {
    let before = &text[..text.len() - rest.len()];
    ParseDdError::UnexpectedCharacter {
        found,
        position: before.chars().count() + 1,
        text: text.to_owned(),
    }
}

/// At most [`LARGEST_DIGIT_COUNT`] digits, the last made nonzero if it stands for more, and the
/// count of those dropped.
fn kept_digits(digits: &str) -> (String, usize) {
    if digits.len() <= LARGEST_DIGIT_COUNT {
        return (digits.to_owned(), 0);
    }
    let (kept, dropped) = digits.split_at(LARGEST_DIGIT_COUNT - 1);
    let last = if dropped.bytes().all(|digit| digit == b'0') {
        "0"
    } else {
        "1"
    };
    (format!("{kept}{last}"), dropped.len() - 1)
}

fn natural(digits: &str) -> Natural {
    let mut number = Natural::from_u64(0);
    for digit in digits.bytes() {
        number.multiply_add(10, u32::from(digit - b'0'));
    }
    number
}

/// The number made odd, so that a dropped remainder still decides a tie.
fn sticky(number: Natural) -> Natural {
    if number.is_odd() {
        number
    } else {
        number.plus(&Natural::from_u64(1))
    }
}

/// `number * 2^exponent` as a double-double: the nearest double, and the double nearest to the
/// rest.
fn nearest(number: &Natural, exponent: i64) -> Dd {
    let (mantissa, shift) = nearest_mantissa(number);
    let hi = scaled(mantissa, shift as i64 + exponent);
    let leading = Natural::from_u64(mantissa).shifted_up(shift);
    let rest_of = |rest: Natural| {
        let (mantissa, shift) = nearest_mantissa(&rest);
        scaled(mantissa, shift as i64 + exponent)
    };
    let lo = if leading > *number {
        -rest_of(leading.minus(number))
    } else {
        rest_of(number.minus(&leading))
    };
    Dd::guarded(hi, lo)
}

/// `(m, s)` with `m 2^s` the number rounded to 53 bits, half to even.
fn nearest_mantissa(number: &Natural) -> (u64, usize) {
    let shift = number.bit_length().saturating_sub(53);
    if shift == 0 {
        return (number.to_u64().unwrap_or(0), 0);
    }
    let (doubled, remainder) = number.shifted_down(shift - 1);
    (
        rounded_half(doubled, remainder).to_u64().unwrap_or(0),
        shift,
    )
}

/// `mantissa * 2^exponent`, infinite or zero beyond the range.
fn scaled(mantissa: u64, exponent: i64) -> f64 {
    let exponent = exponent.clamp(-2200, 2200) as i32;
    let third = exponent / 3;
    let factor = power_of_two(third);
    mantissa as f64 * factor * factor * power_of_two(exponent - 2 * third)
}
