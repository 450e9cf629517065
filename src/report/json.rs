//! JSON documents: indented, lists of plain values on one line, doubles with the digits that read
//! back to the same bits; the common head of all documents; values by name.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use serde::{Deserialize, Deserializer, Serialize};
use serde_json::ser::Formatter;
use serde_json::{Serializer, Value};

use super::ReportError;
use crate::model::{Digest, Scene};

/// Serialises a value as indented JSON with a final newline; lists of plain values are on one line.
///
/// A finite double is written with the fewest digits (at most 17) that read back as the same
/// double. JSON has no `NaN` or infinity: both become `null`, and a reader takes `null` in place of
/// a number as "no finite value".
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
    let mut bytes = Vec::new();
    write_json(&mut bytes, value)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Writes a value as [`to_json`] does, without holding all of the text in memory.
///
/// # Errors
///
/// As [`to_json`], and those of the writer.
pub fn write_json<T: Serialize + ?Sized>(
    out: &mut dyn io::Write,
    value: &T,
) -> Result<(), ReportError> {
    let held = Rc::default();
    let mut sink = Sink { out, held: Rc::clone(&held) };
    value.serialize(&mut Serializer::with_formatter(&mut sink, Layout::new(held)))?;
    Ok(sink.out.write_all(b"\n").map_err(serde_json::Error::io)?)
}

/// Buffer of a list's plain values, until it is known whether the list fits on one line.
type Held = Rc<RefCell<Option<Vec<u8>>>>;

/// Writer that passes text on, or into the buffer.
struct Sink<'a> {
    out: &'a mut dyn io::Write,
    held: Held,
}

impl io::Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *self.held.borrow_mut() {
            Some(held) => held.write(bytes),
            None => self.out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// List or object that is being written.
enum Level {
    /// List of plain values so far, with the ends of their texts in the buffer.
    Line(Vec<usize>),
    /// List or object with one item a line.
    Lines {
        /// Whether it has an item.
        begun: bool,
    },
}

/// Layout of documents: a list stays on one line unless it contains a list or an object.
struct Layout {
    levels: Vec<Level>,
    /// Buffer of the innermost list, while that is on one line.
    held: Held,
}

impl Layout {
    fn new(held: Held) -> Self {
        Self { levels: Vec::new(), held }
    }

    fn new_line<W: io::Write + ?Sized>(&self, out: &mut W, depth: usize) -> io::Result<()> {
        write!(out, "\n{:1$}", "", 2 * depth)
    }

    /// Begins a list or an object. A list that contains it is laid out one item a line.
    fn begin<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        let depth = self.levels.len();
        if let Some(level @ Level::Line(_)) = self.levels.last_mut() {
            let Level::Line(ends) = std::mem::replace(level, Level::Lines { begun: true }) else {
                return Ok(());
            };
            let held = self.held.take().unwrap_or_default();
            out.write_all(b"[")?;
            let mut start = 0;
            for end in ends {
                self.new_line(out, depth)?;
                out.write_all(&held[start..end])?;
                out.write_all(b",")?;
                start = end;
            }
            self.new_line(out, depth)?;
        }
        Ok(())
    }

    /// Begins an item of a list or an object with one item a line.
    fn item<W: io::Write + ?Sized>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        if !first {
            out.write_all(b",")?;
        }
        if let Some(Level::Lines { begun }) = self.levels.last_mut() {
            *begun = true;
        }
        self.new_line(out, self.levels.len())
    }

    /// Ends a list or an object with one item a line.
    fn end<W: io::Write + ?Sized>(&mut self, out: &mut W, bracket: &[u8]) -> io::Result<()> {
        if let Some(Level::Lines { begun: true }) = self.levels.pop() {
            self.new_line(out, self.levels.len())?;
        }
        out.write_all(bracket)
    }
}

impl Formatter for Layout {
    fn begin_array<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.begin(out)?;
        self.levels.push(Level::Line(Vec::new()));
        self.held.replace(Some(Vec::new()));
        Ok(())
    }

    fn begin_array_value<W: io::Write + ?Sized>(
        &mut self,
        out: &mut W,
        first: bool,
    ) -> io::Result<()> {
        match self.levels.last() {
            Some(Level::Lines { .. }) => self.item(out, first),
            _ => Ok(()),
        }
    }

    fn end_array_value<W: io::Write + ?Sized>(&mut self, _: &mut W) -> io::Result<()> {
        if let Some(Level::Line(ends)) = self.levels.last_mut() {
            ends.push(self.held.borrow().as_ref().map_or(0, Vec::len));
        }
        Ok(())
    }

    fn end_array<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        let Some(Level::Line(ends)) = self.levels.last_mut() else {
            return self.end(out, b"]");
        };
        let ends = std::mem::take(ends);
        self.levels.pop();
        let held = self.held.take().unwrap_or_default();
        out.write_all(b"[")?;
        let mut start = 0;
        for end in ends {
            if start > 0 {
                out.write_all(b", ")?;
            }
            out.write_all(&held[start..end])?;
            start = end;
        }
        out.write_all(b"]")
    }

    fn begin_object<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.begin(out)?;
        self.levels.push(Level::Lines { begun: false });
        out.write_all(b"{")
    }

    fn begin_object_key<W: io::Write + ?Sized>(
        &mut self,
        out: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.item(out, first)
    }

    fn begin_object_value<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        out.write_all(b": ")
    }

    fn end_object<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.end(out, b"}")
    }
}

/// Kind of a document.
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
    /// Loci in two parameters.
    Loci,
    /// A bifurcation diagram.
    Diagram,
    /// A two-parameter chart.
    Chart,
    /// A study of convergence.
    Convergence,
    /// A time series.
    Trajectory,
    /// Basins of attraction.
    Basin,
    /// The smallest change of parameters that grazes.
    Margin,
    /// Branches of periodic orbits.
    Branch,
    /// Parameters fitted to measured points.
    Fit,
    /// Orbits under noise.
    Noise,
    /// Safety: margins and intervals without contact.
    Safety,
    /// Derivatives of a trajectory through hits.
    Derivatives,
    /// Soft stops of a wanted restitution.
    Contact,
    /// An atlas about a grazing orbit.
    Atlas,
}

impl DocumentKind {
    /// Format number of documents. It changes when older documents can no longer be read.
    pub const FORMAT: u32 = 1;
}

/// Document: kind, format number, scene, and content.
#[derive(Clone, Debug, Serialize)]
pub struct Document<T> {
    document: DocumentKind,
    format: u32,
    scene: Option<String>,
    digest: Option<Digest>,
    version: &'static str,
    #[serde(flatten)]
    content: T,
}

impl<T> Document<T> {
    /// Document about a scene.
    pub fn new(kind: DocumentKind, scene: &Scene, content: T) -> Self {
        Self::about(kind, Some(scene), content)
    }

    /// Document about a scene, or about none.
    pub fn about(kind: DocumentKind, scene: Option<&Scene>, content: T) -> Self {
        Self {
            document: kind,
            format: DocumentKind::FORMAT,
            scene: scene.map(|scene| scene.identifier.clone()),
            digest: scene.map(|scene| scene.digest),
            version: env!("CARGO_PKG_VERSION"),
            content,
        }
    }
}

/// Values by name: an object whose keys keep the order given.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<T> Default for Named<T> {
    /// No values.
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Named<T> {
    /// Values from pairs of name and value.
    pub fn new<N: Into<String>>(pairs: impl IntoIterator<Item = (N, T)>) -> Self {
        let pairs = pairs.into_iter().map(|(name, value)| (name.into(), value));
        Self(pairs.collect())
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Value of a name.
    pub fn get(&self, name: &str) -> Option<&T> {
        let mut pairs = self.0.iter();
        pairs.find(|(known, _)| known == name).map(|(_, value)| value)
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
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
