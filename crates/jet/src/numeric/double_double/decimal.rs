//! Decimal text of [`Dd`]: reading and writing, both exactly rounded.
//!
//! The one idea: a decimal literal is a ratio of natural numbers, and so is a double-double;
//! conversion in natural numbers rounds once.

mod reading;
mod writing;

use std::fmt;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Dd;
use reading::{Literal, Sign};
use writing::{significant_digits, without_trailing_zeros};

/// Significant digits tried, in turn, for a text that reads back as the same number.
const ROUND_TRIP_DIGITS: [usize; 8] = [17, 33, 34, 36, 50, 100, 300, 1100];

/// Why a text is not read as a [`Dd`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseDdError {
    /// The text has no digit.
    #[error("expected a decimal number, found no digit in `{text}`")]
    NoDigits {
        /// What was given.
        text: String,
    },
    /// The text holds a character that no decimal literal has there.
    #[error("expected a decimal number, found `{found}` at character {position} of `{text}`")]
    UnexpectedCharacter {
        /// The first character out of place.
        found: char,
        /// Its place, counted in characters from 1.
        position: usize,
        /// What was given.
        text: String,
    },
    /// The number is too large for the exponent range of `f64`.
    #[error("expected a number below 1.8e308 in magnitude, found `{text}`")]
    TooLarge {
        /// What was given.
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
    /// [`ParseDdError`] if the text is no decimal literal (`inf` and `NaN` are none) or exceeds the
    /// range.
    ///
    /// ```
    /// use grazemap_jet::numeric::Dd;
    /// let tenth = Dd::from_decimal("0.1")?;
    /// assert!((Dd::from(10.0) * tenth - Dd::ONE).abs() < Dd::from(1e-31));
    /// # Ok::<(), grazemap_jet::numeric::ParseDdError>(())
    /// ```
    pub fn from_decimal(text: &str) -> Result<Dd, ParseDdError> {
        let literal = Literal::read(text)?;
        let magnitude = literal.magnitude().ok_or_else(|| ParseDdError::TooLarge {
            text: text.to_owned(),
        })?;
        Ok(match literal.sign {
            Sign::Positive => magnitude,
            Sign::Negative => -magnitude,
        })
    }

    /// Writes so many significant digits (at least one) in scientific notation, rounded half to
    /// even: `-3.16556500000000000e-9`.
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

    /// The shortest of a few lengths of text that reads back as the same number.
    fn to_round_trip_decimal(self) -> String {
        ROUND_TRIP_DIGITS
            .iter()
            .map(|&digits| without_trailing_zeros(&self.to_decimal(digits)))
            .find(|text| Dd::from_decimal(text).as_ref() == Ok(&self))
            .unwrap_or_else(|| self.to_decimal(33))
    }
}

/// 32 significant digits, or one more than the precision asked for: `{:.3}` writes four.
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

/// A decimal string that reads back exactly; `inf`, `-inf` and `NaN` as these words.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::sampling::fixed_samples;
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
        assert_eq!(
            read("3.14159265358979323846264338327950288419716939937510"),
            Dd::PI
        );
        assert_eq!(
            read("0.69314718055994530941723212145817656807550013436026"),
            Dd::LN_2
        );
    }

    #[test]
    fn numbers_are_written_in_scientific_notation() {
        assert_eq!(
            read("-3.165565e-09").to_decimal(18),
            "-3.16556500000000000e-9"
        );
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
        for (text, position) in [
            ("1_000", 2),
            ("1e", 2),
            ("--1", 2),
            ("abc", 1),
            ("1.5 ", 4),
            (".", 1),
            ("e5", 1),
        ] {
            match Dd::from_decimal(text) {
                Err(ParseDdError::UnexpectedCharacter {
                    position: found, ..
                }) => assert_eq!(found, position, "{text}"),
                Err(ParseDdError::NoDigits { .. }) => assert_eq!(text, "."),
                other => panic!("{text}: {other:?}"),
            }
        }
        assert!(matches!(
            Dd::from_decimal(""),
            Err(ParseDdError::NoDigits { .. })
        ));
        assert!(matches!(
            Dd::from_decimal("2e308"),
            Err(ParseDdError::TooLarge { .. })
        ));
    }

    proptest! {
        #![proptest_config(fixed_samples(256))]

        #[test]
        fn serialised_numbers_read_back_exactly(hi in proptest::num::f64::NORMAL, part in -1.0..1.0_f64) {
            let number = Dd::new(hi, hi * part * 1e-17);
            let text = serde_json::to_string(&number).expect("numbers serialise");
            let back: Dd = serde_json::from_str(&text).expect("what was written");
            prop_assert_eq!(back, number);
        }

        #[test]
        fn literals_agree_with_the_reading_of_doubles(text in "-?[0-9]{1,30}(\\.[0-9]{0,30})?(e-?[0-9]{1,2})?") {
            let expected: f64 = text.parse().expect("the standard library reads the same literals");
            prop_assert_eq!(read(&text).hi, expected);
        }
    }
}
