//! Numbers that are not finite, read back from documents: JSON has `null` in the place of NaN.

use serde::{Deserialize, Deserializer};

/// A number, NaN where a text has `null`; formats of bytes write NaN itself.
pub(crate) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    if !deserializer.is_human_readable() {
        return f64::deserialize(deserializer);
    }
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// A list of such numbers.
pub(crate) fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    if !deserializer.is_human_readable() {
        return Vec::deserialize(deserializer);
    }
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}
