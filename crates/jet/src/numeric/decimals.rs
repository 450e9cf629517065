//! Numbers as text: with few decimal digits, in messages; and in files, where `null` stands for an
//! infinite number, because JSON has no infinity.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The smallest number with at most `digits` decimal digits (1 to 15) that is not below a positive
/// finite number; 0 for a number that is not positive.
///
/// Numbers rounded up in this way are the same on machines whose arithmetic differs in the last
/// place, and print with that many digits.
///
/// ```
/// use grazemap_jet::numeric::decimal_above;
///
/// assert_eq!(decimal_above(1.2301e-8, 3), 1.24e-8);
/// assert_eq!(decimal_above(9.96e-8, 2), 1e-7);
/// ```
pub fn decimal_above(value: f64, digits: u32) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    if !value.is_finite() {
        return value;
    }
    let mut exponent = value.log10().floor() as i32 + 1 - digits as i32;
    let mut shown = (value / 10f64.powi(exponent)).ceil() as u64;
    if shown >= 10u64.pow(digits) {
        (shown, exponent) = (10u64.pow(digits - 1), exponent + 1);
    }
    // The text is parsed: a product would be wrong in its last place.
    format!("{shown}e{exponent}").parse().unwrap_or(value)
}

/// The largest number with at most `digits` decimal digits (1 to 15) that is not above a positive
/// finite number; 0 for a number that is not positive. Like [`decimal_above`], the same on every
/// machine.
///
/// ```
/// use grazemap_jet::numeric::decimal_below;
///
/// assert_eq!(decimal_below(1.2399e-8, 3), 1.23e-8);
/// assert_eq!(decimal_below(1e-7, 2), 1e-7);
/// ```
pub fn decimal_below(value: f64, digits: u32) -> f64 {
    let above = decimal_above(value, digits);
    if above <= value || !above.is_finite() {
        return above;
    }
    let exponent = value.log10().floor() as i32 + 1 - digits as i32;
    let shown = (above / 10f64.powi(exponent)).round() as u64 - 1;
    format!("{shown}e{exponent}").parse().unwrap_or(value)
}

/// Displays a number with the fewest digits that read back to it, or with the requested decimals;
/// in scientific notation if plain decimals would be long or lose digits.
///
/// ```
/// use grazemap_jet::numeric::Shown;
///
/// assert_eq!(Shown(-1.8).to_string(), "-1.8");
/// assert_eq!(Shown(1e300).to_string(), "1e300");
/// assert_eq!(format!("{:.6}", Shown(2.25)), "2.250000");
/// assert_eq!(format!("{:.6}", Shown(2.25e-9)), "2.250000e-9");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown(pub f64);

impl fmt::Display for Shown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        let precision = formatter.precision();
        let plain = match precision {
            None => 1e-5..1e16,
            Some(_) => 1e-3..1e6,
        };
        let is_plain = value == 0.0 || !value.is_finite() || plain.contains(&value.abs());
        match (precision, is_plain) {
            (None, true) => write!(formatter, "{value}"),
            (None, false) => write!(formatter, "{value:e}"),
            (Some(digits), true) => write!(formatter, "{value:.digits$}"),
            (Some(digits), false) => write!(formatter, "{value:.digits$e}"),
        }
    }
}

/// Serialization of widths that may be infinite, for `#[serde(with)]`.
pub mod unbounded {
    use super::{Deserialize, Deserializer, Serializer};

    /// Writes a list of widths.
    ///
    /// # Errors
    ///
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(widths: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        let finite = |&width: &f64| Some(width).filter(|width| width.is_finite());
        serializer.collect_seq(widths.iter().map(finite))
    }

    /// Reads a list of widths.
    ///
    /// # Errors
    ///
    /// The errors of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        let widths: Vec<Option<f64>> = Deserialize::deserialize(deserializer)?;
        let width = |width: Option<f64>| width.unwrap_or(f64::INFINITY);
        Ok(widths.into_iter().map(width).collect())
    }
}

/// Serialization of one number that may be infinite, as in [`unbounded`].
pub mod unbounded_number {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes a number.
    ///
    /// # Errors
    ///
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        let finite = Some(number).filter(|number| number.is_finite());
        finite.serialize(serializer)
    }

    /// Reads a number.
    ///
    /// # Errors
    ///
    /// The errors of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        let number: Option<f64> = Deserialize::deserialize(deserializer)?;
        Ok(number.unwrap_or(f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_few_digits_stay_as_they_are() {
        for value in [1.0, 0.05, 2.5e-3, 1e-12, 123.0, 9.99e7] {
            assert_eq!(decimal_above(value, 3), value);
            assert_eq!(decimal_below(value, 3), value);
        }
    }

    #[test]
    fn others_are_rounded_by_less_than_one_of_the_last_digit() {
        for value in [1.001, 0.98765, 2.3456e-7, 999.5, 3.0e5 / 7.0] {
            let above = decimal_above(value, 3);
            assert!(above > value && above <= value * 1.01, "{value}: {above}");
            let below = decimal_below(value, 3);
            assert!(below < value && below >= value / 1.01, "{value}: {below}");
        }
        assert_eq!((decimal_above(0.0, 3), decimal_below(0.0, 3)), (0.0, 0.0));
    }

    #[test]
    fn infinite_widths_are_read_back() {
        #[derive(Serialize, Deserialize, PartialEq, Debug)]
        struct Widths(#[serde(with = "unbounded")] Vec<f64>);
        let widths = Widths(vec![0.1, f64::INFINITY]);
        let text = serde_json::to_string(&widths).expect("numbers");
        assert_eq!(text, "[0.1,null]");
        assert_eq!(serde_json::from_str::<Widths>(&text).expect("numbers"), widths);
    }
}
