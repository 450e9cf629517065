//! Numbers in files that may be infinite: JSON has no infinity, and `null` stands for it.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Widths that may be infinite, for `#[serde(with)]`.
pub mod unbounded {
    use super::{Deserialize, Deserializer, Serializer};

    /// Writes a list of widths.
    ///
    /// # Errors
    ///
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(widths: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        let finite = |&width: &f64| Some(width).filter(|width| width.is_finite());
        serializer.collect_seq(widths.iter().map(finite))
    }

    /// Reads a list of widths.
    ///
    /// # Errors
    ///
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        let widths: Vec<Option<f64>> = Deserialize::deserialize(deserializer)?;
        let width = |width: Option<f64>| width.unwrap_or(f64::INFINITY);
        Ok(widths.into_iter().map(width).collect())
    }
}

/// One number that may be infinite, as in [`unbounded`].
pub mod unbounded_number {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes a number.
    ///
    /// # Errors
    ///
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        let finite = Some(number).filter(|number| number.is_finite());
        finite.serialize(serializer)
    }

    /// Reads a number.
    ///
    /// # Errors
    ///
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        let number: Option<f64> = Deserialize::deserialize(deserializer)?;
        Ok(number.unwrap_or(f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
