//! JSON whose doubles are written with 17 significant digits.

use std::io;

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::{Formatter, PrettyFormatter};

use super::ReportError;

/// A value as indented JSON, every double with 17 significant digits; what is not finite becomes `null`.
///
/// ```
/// let text = grazemap::report::to_exact_json(&[0.1, -2.5e-7])?;
/// assert_eq!(text, "[\n  1.0000000000000001e-1,\n  -2.4999999999999999e-7\n]\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::Json`] if the value has a map whose keys are not text.
pub fn to_exact_json<T: Serialize + ?Sized>(value: &T) -> Result<String, ReportError> {
    let mut bytes = Vec::new();
    value.serialize(&mut Serializer::with_formatter(
        &mut bytes,
        Exact(PrettyFormatter::new()),
    ))?;
    bytes.push(b'\n');
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The pretty formatter, but for doubles.
struct Exact<'a>(PrettyFormatter<'a>);

/// Hands a method of the formatter on to the pretty one.
macro_rules! as_pretty {
    ($($method:ident($($argument:ident: $type:ty),*)),* $(,)?) => {
        $(fn $method<W: ?Sized + io::Write>(&mut self, writer: &mut W $(, $argument: $type)*) -> io::Result<()> {
            self.0.$method(writer $(, $argument)*)
        })*
    };
}

impl Formatter for Exact<'_> {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        write!(writer, "{value:.16e}")
    }

    as_pretty! {
        begin_array(),
        end_array(),
        begin_array_value(first: bool),
        end_array_value(),
        begin_object(),
        end_object(),
        begin_object_key(first: bool),
        begin_object_value(),
        end_object_value(),
    }
}
