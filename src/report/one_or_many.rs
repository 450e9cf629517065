//! What a map has once for every passage: a value where there is one, a list where there are
//! several.

use serde::Serialize;

/// One value, or a list of any other number of them; serialised as the value or the list alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OneOrMany<T> {
    /// One.
    One(T),
    /// Any other number.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// The values of an iterator.
    pub fn of(values: impl IntoIterator<Item = T>) -> Self {
        let mut values: Vec<T> = values.into_iter().collect();
        match (values.pop(), values.is_empty()) {
            (Some(only), true) => OneOrMany::One(only),
            (last, _) => {
                values.extend(last);
                OneOrMany::Many(values)
            }
        }
    }

    /// All values.
    pub fn as_slice(&self) -> &[T] {
        match self {
            OneOrMany::One(value) => std::slice::from_ref(value),
            OneOrMany::Many(values) => values,
        }
    }
}
