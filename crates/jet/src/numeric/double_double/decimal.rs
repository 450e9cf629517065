//! Decimal text of [`Dd`]: reading and writing, both exactly rounded.
//!
//! The one idea: a decimal literal is a ratio of natural numbers, and so is a double-double;
//! conversion in natural numbers rounds once.

use std::fmt;
use std::str::FromStr;

use num_bigint::BigUint;
use num_integer::Integer;
use num_traits::{ToPrimitive, Zero};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Dd, power_of_two};

/// Decimal exponents beyond this have no double-double (and would cost a long computation).
const LARGEST_EXPONENT: i64 = 400;

/// Significant digits tried, in turn, for a text that reads back as the same number.
const ROUND_TRIP_DIGITS: [usize; 8] = [17, 33, 34, 36, 50, 100, 300, 1100];

/// Reason why a text is not a [`Dd`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseDdError {
    /// The text has no digit.
    #[error("expected a decimal number, found no digit in `{text}`")]
    NoDigits {
        /// The text.
        text: String,
    },
    /// The text holds a character that a decimal literal cannot have there.
    #[error("expected a decimal number, found `{found}` at character {position} of `{text}`")]
    UnexpectedCharacter {
        /// First character out of place.
        found: char,
        /// Position of the character, counted in characters from 1.
        position: usize,
        /// The text.
        text: String,
    },
    /// The number is too large for the exponent range of `f64`.
    #[error("expected a number below 1.8e308 in magnitude, found `{text}`")]
    TooLarge {
        /// The text.
        text: String,
    },
}

impl Dd {
    /// Reads a decimal literal such as `-3.165565e-09`, `0.05` or `1000`, rounded once to the
    /// nearest double-double.
    ///
    /// Numbers below the range of `f64` become zero.
    ///
    /// # Errors
    ///
    /// [`ParseDdError`] if the text is not a decimal literal (`inf` and `NaN` are not) or exceeds
    /// the range.
    ///
    /// ```
    /// use grazemap_jet::numeric::Dd;
    /// let tenth = Dd::from_decimal("0.1")?;
    /// assert!((Dd::from(10.0) * tenth - Dd::ONE).abs() < Dd::from(1e-31));
    /// # Ok::<(), grazemap_jet::numeric::ParseDdError>(())
    /// ```
    pub fn from_decimal(text: &str) -> Result<Dd, ParseDdError> {
        let literal = Literal::read(text)?;
        let magnitude =
            literal.magnitude().ok_or_else(|| ParseDdError::TooLarge { text: text.to_owned() })?;
        Ok(if literal.is_negative { -magnitude } else { magnitude })
    }

    /// Decimal text with `digits` significant digits (at least one) in scientific notation, rounded
    /// half to even: `-3.16556500000000000e-9`.
    pub fn to_decimal(self, digits: usize) -> String {
        if !self.is_finite() {
            return self.hi.to_string();
        }
        let sign = if self.hi.is_sign_negative() { "-" } else { "" };
        let (digits, exponent) = significant_digits(self.abs(), digits.max(1));
        let (first, rest) = digits.split_at(1);
        let point = if rest.is_empty() { "" } else { "." };
        format!("{sign}{first}{point}{rest}e{exponent}")
    }

    /// The shortest text, of a few lengths, that reads back as the same number.
    fn to_round_trip_decimal(self) -> String {
        ROUND_TRIP_DIGITS
            .iter()
            .map(|&digits| without_trailing_zeros(&self.to_decimal(digits)))
            .find(|text| Dd::from_decimal(text).as_ref() == Ok(&self))
            .unwrap_or_else(|| self.to_decimal(33))
    }
}

/// Writes 32 significant digits, or one more than the requested precision: `{:.3}` writes four.
impl fmt::Display for Dd {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = formatter.precision().map_or(32, |places| places + 1);
        formatter.write_str(&self.to_decimal(digits))
    }
}

impl FromStr for Dd {
    type Err = ParseDdError;

    fn from_str(text: &str) -> Result<Dd, ParseDdError> {
        Dd::from_decimal(text)
    }
}

/// Serializes as a decimal string that reads back exactly; `inf`, `-inf` and `NaN` as these words.
impl Serialize for Dd {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_round_trip_decimal())
    }
}

impl<'de> Deserialize<'de> for Dd {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Dd, D::Error> {
        let text = String::deserialize(deserializer)?;
        match text.as_str() {
            "NaN" => Ok(Dd::NAN),
            "inf" => Ok(Dd::INFINITY),
            "-inf" => Ok(-Dd::INFINITY),
            literal => Dd::from_decimal(literal).map_err(D::Error::custom),
        }
    }
}

/// A parsed literal: `±digits * 10^exponent`.
struct Literal {
    is_negative: bool,
    digits: String,
    exponent: i64,
}

impl Literal {
    /// Parses a text.
    ///
    /// # Errors
    ///
    /// [`ParseDdError`] if the text is not a decimal literal.
    fn read(text: &str) -> Result<Literal, ParseDdError> {
        let mut rest = text;
        let is_negative = take_sign(&mut rest);
        let whole = take_digits(&mut rest);
        let fraction = match rest.strip_prefix('.') {
            Some(after) => {
                rest = after;
                take_digits(&mut rest)
            }
            None => "",
        };
        if whole.is_empty() && fraction.is_empty() && rest.is_empty() {
            return Err(ParseDdError::NoDigits { text: text.to_owned() });
        }
        let found_digits = !(whole.is_empty() && fraction.is_empty());
        let exponent = if found_digits { take_exponent(&mut rest) } else { None };
        if let Some(found) = rest.chars().next() {
            return Err(unexpected(text, rest, found));
        }
        let digits = [whole, fraction].concat();
        Ok(Literal {
            is_negative,
            digits: digits.trim_start_matches('0').to_owned(),
            exponent: exponent.unwrap_or(0) - fraction.len() as i64,
        })
    }

    /// The number without its sign; `None` if it is too large.
    fn magnitude(&self) -> Option<Dd> {
        let leading_exponent = self.digits.len() as i64 + self.exponent;
        if self.digits.is_empty() || leading_exponent < -LARGEST_EXPONENT {
            return Some(Dd::ZERO);
        }
        if leading_exponent > LARGEST_EXPONENT {
            return None;
        }
        let digits = BigUint::parse_bytes(self.digits.as_bytes(), 10)?;
        let number = Ratio::new(digits, 0, self.exponent);
        Some(number.nearest_dd()).filter(|value| value.is_finite())
    }
}

/// Reads an optional sign; returns whether it is `-`.
fn take_sign(rest: &mut &str) -> bool {
    let is_negative = rest.starts_with('-');
    *rest = rest.strip_prefix(['-', '+']).unwrap_or(rest);
    is_negative
}

fn take_digits<'a>(rest: &mut &'a str) -> &'a str {
    let text = *rest;
    let end = text.find(|character: char| !character.is_ascii_digit()).unwrap_or(text.len());
    let (digits, after) = text.split_at(end);
    *rest = after;
    digits
}

/// Reads the exponent after `e` or `E`, saturated; does not change the text if no digit follows.
fn take_exponent(rest: &mut &str) -> Option<i64> {
    let mut after = rest.strip_prefix(['e', 'E'])?;
    let is_negative = take_sign(&mut after);
    let digits = take_digits(&mut after);
    if digits.is_empty() {
        return None;
    }
    *rest = after;
    let magnitude = digits.parse::<i64>().unwrap_or(i64::MAX).min(1 << 60);
    Some(if is_negative { -magnitude } else { magnitude })
}

fn unexpected(text: &str, rest: &str, found: char) -> ParseDdError {
    let before = &text[..text.len() - rest.len()];
    ParseDdError::UnexpectedCharacter {
        found,
        position: before.chars().count() + 1,
        text: text.to_owned(),
    }
}

/// The digits of a finite number that is not negative, and the decimal exponent of the first.
fn significant_digits(magnitude: Dd, digits: usize) -> (String, i64) {
    if magnitude.hi == 0.0 {
        return ("0".repeat(digits), 0);
    }
    let (number, exponent) = as_natural(magnitude);
    let mut leading = magnitude.hi.log10().floor() as i64;
    loop {
        let text =
            Ratio::new(number.clone(), exponent, digits as i64 - 1 - leading).rounded().to_string();
        match text.len() {
            length if length < digits => leading -= 1,
            length if length > digits => leading += 1,
            _ => return (text, leading),
        }
    }
}

/// `(n, e)` with `n 2^e` equal to the number, which is finite and positive.
fn as_natural(magnitude: Dd) -> (BigUint, i64) {
    let (hi, hi_exponent) = integer_mantissa(magnitude.hi);
    let (lo, lo_exponent) = integer_mantissa(magnitude.lo);
    let exponent = hi_exponent.min(lo_exponent);
    let hi = BigUint::from(hi) << (hi_exponent - exponent);
    let lo = BigUint::from(lo) << (lo_exponent - exponent);
    let number = if magnitude.lo < 0.0 && lo <= hi { hi - lo } else { hi + lo };
    (number, exponent)
}

/// The text without trailing zeros of its fraction.
fn without_trailing_zeros(text: &str) -> String {
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => {
            let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
            format!("{mantissa}e{exponent}")
        }
        _ => text.to_owned(),
    }
}

/// A rational number that is not negative.
struct Ratio {
    numerator: BigUint,
    denominator: BigUint,
}

impl Ratio {
    /// `natural · 2^binary · 10^decimal`.
    fn new(natural: BigUint, binary: i64, decimal: i64) -> Self {
        let mut ratio = Self { numerator: natural, denominator: BigUint::from(1u8) };
        let power = BigUint::from(10u8).pow(decimal.unsigned_abs() as u32);
        if decimal < 0 {
            ratio.denominator *= power;
        } else {
            ratio.numerator *= power;
        }
        ratio.shift(binary);
        ratio
    }

    /// Multiplies by a power of two.
    fn shift(&mut self, exponent: i64) {
        if exponent < 0 {
            self.denominator <<= exponent.unsigned_abs();
        } else {
            self.numerator <<= exponent.unsigned_abs();
        }
    }

    /// The nearest natural number, half to even.
    fn rounded(&self) -> BigUint {
        let (quotient, remainder) = self.numerator.div_rem(&self.denominator);
        let doubled = remainder << 1u8;
        if doubled > self.denominator || doubled == self.denominator && quotient.is_odd() {
            quotient + 1u8
        } else {
            quotient
        }
    }

    /// The double nearest to the number, and the double nearest to the remainder.
    fn nearest_dd(mut self) -> Dd {
        let hi = self.nearest();
        if !hi.is_finite() {
            return Dd::exact(hi);
        }
        let (mantissa, exponent) = integer_mantissa(hi);
        let taken = (&self.denominator * mantissa) << exponent.max(0);
        self.numerator <<= exponent.min(0).abs();
        let is_above = taken > self.numerator;
        self.numerator = if is_above { taken - self.numerator } else { self.numerator - taken };
        self.denominator <<= exponent.min(0).abs();
        let lo = self.nearest();
        Dd { hi, lo: if is_above { -lo } else { lo } }
    }

    /// The nearest double, half to even; infinite or zero beyond the range.
    fn nearest(&self) -> f64 {
        if self.numerator.is_zero() {
            return 0.0;
        }
        // NOTE: 65 bits, the last of which represents all bits that follow, are rounded to 53 like
        // the number itself.
        let shift = 65 + self.denominator.bits() as i64 - self.numerator.bits() as i64;
        let (numerator, denominator) = if shift < 0 {
            (self.numerator.clone(), &self.denominator << -shift)
        } else {
            (&self.numerator << shift, self.denominator.clone())
        };
        let (quotient, rest) = numerator.div_rem(&denominator);
        let leading = quotient.to_u128().unwrap_or(0) | u128::from(!rest.is_zero());
        let exponent = (-shift).clamp(-2200, 2200) as i32;
        let third = power_of_two(exponent / 3);
        leading as f64 * third * third * power_of_two(exponent - 2 * (exponent / 3))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::fixed_samples;
    use proptest::prelude::*;

    fn read(text: &str) -> Dd {
        Dd::from_decimal(text).expect("a literal of the test")
    }

    #[test]
    fn literals_of_models_are_read() {
        assert_eq!(read("1000"), Dd::from(1000.0));
        assert_eq!(read("-0.5"), Dd::from(-0.5));
        assert_eq!(read("+.25e1"), Dd::from(2.5));
        assert_eq!(read("5."), Dd::from(5.0));
        assert_eq!(read("-3.165565e-09"), read("-0.000000003165565"));
        assert_eq!(read("0e999999999999999999999"), Dd::ZERO);
        assert_eq!(read("1e-500"), Dd::ZERO);
        let large = 123_456_789_012_345_678_901_234_567_890_i128;
        let number = read("123456789012345678901234567890");
        assert_eq!(number.hi as i128 + number.lo as i128, large);
    }

    #[test]
    fn pi_is_read_from_its_digits() {
        assert_eq!(read("3.14159265358979323846264338327950288419716939937510"), Dd::PI);
        assert_eq!(read("0.69314718055994530941723212145817656807550013436026"), Dd::LN_2);
    }

    #[test]
    fn numbers_are_written_in_scientific_notation() {
        assert_eq!(read("-3.165565e-09").to_decimal(18), "-3.16556500000000000e-9");
        assert_eq!(Dd::PI.to_string(), "3.1415926535897932384626433832795e0");
        assert_eq!(Dd::from(9.995).to_decimal(1), "1e1");
        assert_eq!(Dd::from(2.5).to_decimal(1), "2e0");
        assert_eq!(Dd::new(2.5, 1e-40).to_decimal(1), "3e0");
        assert_eq!(format!("{:.3}", read("6.02214076e23")), "6.022e23");
        assert_eq!(Dd::ZERO.to_decimal(3), "0.00e0");
        assert_eq!((-Dd::INFINITY).to_string(), "-inf");
    }

    #[test]
    fn text_that_is_no_number_is_refused_where_it_fails() {
        for (text, position) in
            [("1_000", 2), ("1e", 2), ("--1", 2), ("abc", 1), ("1.5 ", 4), (".", 1), ("e5", 1)]
        {
            match Dd::from_decimal(text) {
                Err(ParseDdError::UnexpectedCharacter { position: found, .. }) => {
                    assert_eq!(found, position, "{text}")
                }
                Err(ParseDdError::NoDigits { .. }) => assert_eq!(text, "."),
                other => panic!("{text}: {other:?}"),
            }
        }
        assert!(matches!(Dd::from_decimal(""), Err(ParseDdError::NoDigits { .. })));
        assert!(matches!(Dd::from_decimal("2e308"), Err(ParseDdError::TooLarge { .. })));
    }

    proptest! {
        #![proptest_config(fixed_samples(256))]

        #[test]
        fn serialised_numbers_read_back_exactly(
            hi in proptest::num::f64::NORMAL,
            part in -1.0..1.0_f64,
        ) {
            let number = Dd::new(hi, hi * part * 1e-17);
            let text = serde_json::to_string(&number).expect("numbers serialise");
            let back: Dd = serde_json::from_str(&text).expect("what was written");
            prop_assert_eq!(back, number);
        }

        #[test]
        fn literals_agree_with_the_reading_of_doubles(
            text in "-?[0-9]{1,30}(\\.[0-9]{0,30})?(e-?[0-9]{1,2})?",
        ) {
            let expected: f64 = text.parse().expect("the standard library reads the same literals");
            prop_assert_eq!(read(&text).hi, expected);
        }
    }
}
