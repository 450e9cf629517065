//! JSON documents: indented, lists of plain values on one line, doubles with the digits that read
//! back to the same bits; what every document says of itself; values by name.

use std::fmt::Write as _;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::ReportError;
use crate::model::{Digest, Scene};

/// A value as indented JSON with a newline at its end, lists of plain values on one line.
///
/// A finite double is written with the fewest digits (at most 17) that read back as the same
/// double. JSON has no way to write `NaN` or an infinity: both become `null`, everywhere, and a
/// reader takes `null` in a number's place as "no finite value".
///
/// ```
/// let text = grazemap::report::to_json(&[vec![0.1, f64::NAN], vec![]])?;
/// assert_eq!(text, "[\n  [0.1, null],\n  []\n]\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::Json`] if the value has a map whose keys are not text.
pub fn to_json<T: Serialize + ?Sized>(value: &T) -> Result<String, ReportError> {
    let mut text = String::new();
    write_value(&mut text, &serde_json::to_value(value)?, 0);
    text.push('\n');
    Ok(text)
}

fn write_value(text: &mut String, value: &Value, depth: usize) {
    let is_nested = |value: &Value| value.is_array() || value.is_object();
    match value {
        Value::Array(values) if !values.iter().any(is_nested) => {
            text.push('[');
            for (number, value) in values.iter().enumerate() {
                text.push_str(if number == 0 { "" } else { ", " });
                write_value(text, value, depth);
            }
            text.push(']');
        }
        Value::Array(values) => {
            let items = values.iter().map(|value| (None, value));
            write_lines(text, ['[', ']'], items, depth);
        }
        Value::Object(members) if members.is_empty() => text.push_str("{}"),
        Value::Object(members) => {
            let items = members.iter().map(|(key, value)| (Some(key), value));
            write_lines(text, ['{', '}'], items, depth);
        }
        plain => write!(text, "{plain}").expect("a String takes all"),
    }
}

/// Writes one item a line, between brackets.
fn write_lines<'a>(
    text: &mut String,
    [open, close]: [char; 2],
    items: impl Iterator<Item = (Option<&'a String>, &'a Value)>,
    depth: usize,
) {
    text.push(open);
    for (number, (key, value)) in items.enumerate() {
        let comma = if number == 0 { "" } else { "," };
        write!(text, "{comma}\n{:1$}", "", 2 * depth + 2).expect("a String takes all");
        if let Some(key) = key {
            write!(text, "{}: ", Value::from(key.as_str())).expect("a String takes all");
        }
        write_value(text, value, depth + 1);
    }
    write!(text, "\n{:1$}{close}", "", 2 * depth).expect("a String takes all");
}

/// What a document holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DocumentKind {
    /// A grazing orbit.
    Orbit,
    /// A grazing curve in two parameters.
    Curve,
    /// A local map.
    Map,
    /// Periodic orbits by itinerary.
    Orbits,
    /// A bifurcation diagram.
    Diagram,
    /// A two-parameter chart.
    Chart,
    /// A study of convergence.
    Convergence,
    /// A time series.
    Trajectory,
}

impl DocumentKind {
    /// Number of the format of documents; it changes when a document of before is read no more.
    pub const FORMAT: u32 = 1;
}

/// A document: what it holds, the number of its format, the scene it is of, and its content.
#[derive(Clone, Debug, Serialize)]
pub struct Document<T> {
    document: DocumentKind,
    format: u32,
    scene: String,
    digest: Digest,
    version: &'static str,
    #[serde(flatten)]
    content: T,
}

impl<T> Document<T> {
    /// Of a scene.
    pub fn new(kind: DocumentKind, scene: &Scene, content: T) -> Self {
        Self {
            document: kind,
            format: DocumentKind::FORMAT,
            scene: scene.identifier.clone(),
            digest: scene.digest,
            version: env!("CARGO_PKG_VERSION"),
            content,
        }
    }
}

/// Values by name, in the order given: an object whose keys stand in this order.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<T> Named<T> {
    /// Pairs of names and values.
    pub fn new<N: Into<String>>(pairs: impl IntoIterator<Item = (N, T)>) -> Self {
        let pairs = pairs.into_iter().map(|(name, value)| (name.into(), value));
        Self(pairs.collect())
    }

    /// The value of a name.
    pub fn get(&self, name: &str) -> Option<&T> {
        let mut pairs = self.0.iter();
        pairs.find(|(known, _)| known == name).map(|(_, value)| value)
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de, T: serde::de::DeserializeOwned> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let members: serde_json::Map<String, Value> = Deserialize::deserialize(deserializer)?;
        let pair = |(name, value)| Ok((name, serde_json::from_value(value)?));
        let pairs = members.into_iter().map(pair).collect::<Result<_, _>>();
        pairs.map(Self).map_err(|error: serde_json::Error| serde::de::Error::custom(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_read_back_bit_for_bit() {
        let values = [0.1, 1.0 / 3.0, 1e-12, -2.2250738585072014e-308, 5e-324, -0.0];
        let text = to_json(&values).expect("numbers are JSON");
        let read: Vec<f64> = serde_json::from_str(&text).expect("the text is JSON");
        assert_eq!(read.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), values.map(f64::to_bits));
    }

    #[test]
    fn what_json_cannot_say_becomes_null() {
        let text = to_json(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]).expect("written");
        assert_eq!(text.matches("null").count(), 3);
    }

    #[test]
    fn keys_that_are_not_text_are_refused() {
        let map = std::collections::BTreeMap::from([((1, 2), 3)]);
        assert!(matches!(to_json(&map), Err(ReportError::Json(_))));
    }

    #[test]
    fn lists_of_plain_values_stay_on_one_line_and_lists_of_lists_do_not() {
        let value = serde_json::json!({
            "a": [1, -2, 0.5], "b": [{ "c": [], "d": {} }], "e": ["x", "\"y"], "f": [true, null]
        });
        let text = to_json(&value).expect("JSON");
        let expected = "{\n  \"a\": [1, -2, 0.5],\n  \"b\": [\n    {\n      \"c\": [],\n      \
                        \"d\": {}\n    }\n  ],\n  \"e\": [\"x\", \"\\\"y\"],\n  \
                        \"f\": [true, null]\n}\n";
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), value);
    }

    #[test]
    fn named_values_are_read_in_their_order() {
        let named = Named::new([("b", 0.1), ("a", -0.0)]);
        let text = to_json(&named).expect("JSON");
        assert_eq!(serde_json::from_str::<Named<f64>>(&text).expect("an object"), named);
    }
}
