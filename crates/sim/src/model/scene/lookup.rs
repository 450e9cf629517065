//! Parameters and components of the full state by name.

use super::document::{Entry, Field, shown};
use crate::model::error::{Checked, Fault};
use crate::model::names;
use crate::model::oscillator::Model;
use crate::model::problem::SceneProblem;

/// The parameter an entry names.
pub(super) fn parameter(entry: &Entry<'_>, model: &Model) -> Checked<usize> {
    let name = entry.text("a parameter's name")?;
    parameter_named(name, model).map_err(|problem| entry.fault(problem))
}

/// The parameter a key names.
pub(super) fn parameter_key(field: &Field<'_>, model: &Model) -> Checked<usize> {
    parameter_named(field.key, model).map_err(|problem| Fault::at(field.key_span.clone(), problem))
}

fn parameter_named(name: &str, model: &Model) -> Result<usize, SceneProblem> {
    let known = || {
        model
            .parameters
            .iter()
            .map(|parameter| parameter.name.as_str())
    };
    let unknown = || unknown("parameter", name, names::nearest(name, known()));
    known().position(|known| known == name).ok_or_else(unknown)
}

/// The component of the full state a key names.
pub(super) fn component(field: &Field<'_>, model: &Model) -> Checked<usize> {
    let known = model.full_state_names();
    known
        .iter()
        .position(|known| *known == field.key)
        .ok_or_else(|| {
            let nearest = names::nearest(field.key, known.iter().copied());
            Fault::at(field.key_span.clone(), unknown("state", field.key, nearest))
        })
}

/// The fault of a name that is not known.
pub(super) fn unknown(kind: &'static str, name: &str, nearest: Option<String>) -> SceneProblem {
    SceneProblem::UnknownName {
        name: shown(name),
        kind,
        nearest,
    }
}

/// The values of a list, none of which may stand twice.
pub(super) fn distinct<T: PartialEq>(
    entries: &[Entry<'_>],
    read: impl Fn(&Entry<'_>) -> Checked<T>,
) -> Checked<Vec<T>> {
    let mut values = Vec::new();
    for entry in entries {
        let value = read(entry)?;
        if values.contains(&value) {
            let name = shown(entry.value.as_str().unwrap_or_default());
            return Err(entry.fault(SceneProblem::Repeated {
                name,
                key: entry.path.clone(),
            }));
        }
        values.push(value);
    }
    Ok(values)
}
