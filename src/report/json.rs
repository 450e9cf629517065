//! JSON for other programs: indented, doubles exact, one rule for what JSON cannot say.

use serde::Serialize;

use super::ReportError;

/// A value as indented JSON with a newline at its end.
///
/// A finite double is written with the fewest digits (at most 17) that read back as the same
/// double. JSON has no way to write `NaN` or an infinity: both become `null`, everywhere, and a
/// reader takes `null` in a number's place as "no finite value".
///
/// ```
/// let text = grazemap::report::to_json(&[0.1, f64::NAN])?;
/// assert_eq!(text, "[\n  0.1,\n  null\n]\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::Json`] if the value has a map whose keys are not text.
pub fn to_json<T: Serialize + ?Sized>(value: &T) -> Result<String, ReportError> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_read_back_bit_for_bit() {
        let values = [0.1, 1.0 / 3.0, 1e-12, -2.2250738585072014e-308, 5e-324];
        let text = to_json(&values).expect("numbers are JSON");
        let read: Vec<f64> = serde_json::from_str(&text).expect("the text is JSON");
        assert_eq!(read, values);
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
}
