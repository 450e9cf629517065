//! JSON for large data: lists of numbers on one line, and doubles with 17 significant digits where
//! that is promised.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;

use super::ReportError;

/// A value as indented JSON, lists of numbers and of words on one line; what is not finite becomes
/// `null`.
///
/// ```
/// let text = grazemap::report::to_dense_json(&[vec![0.1, f64::NAN], vec![]])?;
/// assert_eq!(text, "[\n  [0.1, null],\n  []\n]\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::Json`] if the value has a map whose keys are not text.
pub fn to_dense_json<T: Serialize + ?Sized>(value: &T) -> Result<String, ReportError> {
    written(value, Digits::Shortest)
}

/// As [`to_dense_json`], every double with 17 significant digits.
///
/// ```
/// let text = grazemap::report::to_exact_json(&[0.1, -2.5e-7])?;
/// assert_eq!(text, "[1.0000000000000001e-1, -2.4999999999999999e-7]\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::Json`] if the value has a map whose keys are not text.
pub fn to_exact_json<T: Serialize + ?Sized>(value: &T) -> Result<String, ReportError> {
    written(value, Digits::Seventeen)
}

fn written<T: Serialize + ?Sized>(value: &T, digits: Digits) -> Result<String, ReportError> {
    let mut bytes = Vec::new();
    let layout = Layout {
        digits,
        depth: 0,
        open: Vec::new(),
    };
    value.serialize(&mut Serializer::with_formatter(&mut bytes, layout))?;
    bytes.push(b'\n');
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// How doubles are written.
#[derive(Clone, Copy, Debug)]
enum Digits {
    /// As few as read back to the same double.
    Shortest,
    /// 17 significant ones.
    Seventeen,
}

/// Indentation that keeps a list on one line until something nested stands in it.
#[derive(Debug)]
struct Layout {
    digits: Digits,
    depth: usize,
    open: Vec<List>,
}

/// A list that is being written.
#[derive(Clone, Copy, Debug, Default)]
struct List {
    /// Whether a separator is due before the next value.
    pending: Option<Separator>,
    /// Whether something nested has been written.
    nested: bool,
}

#[derive(Clone, Copy, Debug)]
enum Separator {
    First,
    Comma,
}

impl Layout {
    fn line<W: ?Sized + Write>(&self, writer: &mut W) -> io::Result<()> {
        write!(writer, "\n{:1$}", "", 2 * self.depth)
    }

    /// Writes the separator of a list that is due, before a plain or a nested value.
    fn separate<W: ?Sized + Write>(&mut self, writer: &mut W, nested: bool) -> io::Result<()> {
        let Some(separator) = self.open.last_mut().and_then(|list| list.pending.take()) else {
            return Ok(());
        };
        match (separator, nested) {
            (Separator::First, false) => Ok(()),
            (Separator::Comma, false) => writer.write_all(b", "),
            (Separator::First, true) => self.line(writer),
            (Separator::Comma, true) => writer.write_all(b",").and_then(|()| self.line(writer)),
        }
    }

    fn enter<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.separate(writer, true)?;
        if let Some(list) = self.open.last_mut() {
            list.nested = true;
        }
        self.depth += 1;
        self.open.push(List::default());
        writer.write_all(bracket)
    }

    fn leave<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth -= 1;
        if self.open.pop().is_some_and(|list| list.nested) {
            self.line(writer)?;
        }
        writer.write_all(bracket)
    }
}

impl Formatter for Layout {
    fn write_f64<W: ?Sized + Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        self.separate(writer, false)?;
        match self.digits {
            Digits::Seventeen => write!(writer, "{value:.16e}"),
            Digits::Shortest => serde_json::ser::CompactFormatter.write_f64(writer, value),
        }
    }

    fn write_f32<W: ?Sized + Write>(&mut self, writer: &mut W, value: f32) -> io::Result<()> {
        self.write_f64(writer, value.into())
    }

    fn write_u8<W: ?Sized + Write>(&mut self, writer: &mut W, value: u8) -> io::Result<()> {
        self.write_u64(writer, value.into())
    }

    fn write_u16<W: ?Sized + Write>(&mut self, writer: &mut W, value: u16) -> io::Result<()> {
        self.write_u64(writer, value.into())
    }

    fn write_u32<W: ?Sized + Write>(&mut self, writer: &mut W, value: u32) -> io::Result<()> {
        self.write_u64(writer, value.into())
    }

    fn write_u64<W: ?Sized + Write>(&mut self, writer: &mut W, value: u64) -> io::Result<()> {
        self.separate(writer, false)?;
        write!(writer, "{value}")
    }

    fn write_i8<W: ?Sized + Write>(&mut self, writer: &mut W, value: i8) -> io::Result<()> {
        self.write_i64(writer, value.into())
    }

    fn write_i16<W: ?Sized + Write>(&mut self, writer: &mut W, value: i16) -> io::Result<()> {
        self.write_i64(writer, value.into())
    }

    fn write_i32<W: ?Sized + Write>(&mut self, writer: &mut W, value: i32) -> io::Result<()> {
        self.write_i64(writer, value.into())
    }

    fn write_i64<W: ?Sized + Write>(&mut self, writer: &mut W, value: i64) -> io::Result<()> {
        self.separate(writer, false)?;
        write!(writer, "{value}")
    }

    fn write_null<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.separate(writer, false)?;
        writer.write_all(b"null")
    }

    fn write_bool<W: ?Sized + Write>(&mut self, writer: &mut W, value: bool) -> io::Result<()> {
        self.separate(writer, false)?;
        write!(writer, "{value}")
    }

    fn begin_string<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.separate(writer, false)?;
        writer.write_all(b"\"")
    }

    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.enter(writer, b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.leave(writer, b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, _: &mut W, first: bool) -> io::Result<()> {
        if let Some(list) = self.open.last_mut() {
            list.pending = Some(if first {
                Separator::First
            } else {
                Separator::Comma
            });
        }
        Ok(())
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.enter(writer, b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.leave(writer, b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if let Some(list) = self.open.last_mut() {
            list.nested = true;
        }
        writer.write_all(if first { b"" } else { b"," })?;
        self.line(writer)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_stay_on_one_line_and_lists_of_lists_do_not() {
        let value = serde_json::json!({ "a": [1, -2, 0.5], "b": [{ "c": [], "d": {} }], "e": ["x", "y"], "f": [true, null] });
        let text = to_dense_json(&value).expect("JSON");
        let expected = "{\n  \"a\": [1, -2, 0.5],\n  \"b\": [\n    {\n      \"c\": [],\n      \"d\": {}\n    }\n  ],\n  \"e\": [\"x\", \"y\"],\n  \"f\": [true, null]\n}\n";
        assert_eq!(text, expected);
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&text).expect("JSON"),
            value
        );
    }
}
