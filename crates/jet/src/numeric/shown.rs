//! A number in a message.

use std::fmt;

/// Shows a number by the fewest digits that read back to it, or to the decimals asked for; in
/// scientific notation where plain decimals would be long, or lose digits.
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
