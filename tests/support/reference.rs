//! Reference numbers of `tests/data`, which keep their digits as text.

use grazemap::numeric::Dd;
use serde_json::Value;

/// A file of `tests/data`.
pub(crate) fn read(file: &str) -> Value {
    let path = format!("{}/tests/data/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"))
}

pub(crate) fn text(value: &Value) -> &str {
    value.as_str().expect("a decimal string")
}

/// A number in double precision.
pub(crate) fn number(value: &Value) -> f64 {
    text(value).parse().expect("a number")
}

/// A number in double-double.
pub(crate) fn exact(value: &Value) -> Dd {
    Dd::from_decimal(text(value)).expect("a decimal number")
}

/// A list of numbers in double-double.
pub(crate) fn exact_list(value: &Value) -> Vec<Dd> {
    let values = value.as_array().expect("a list").iter();
    values.map(exact).collect()
}
