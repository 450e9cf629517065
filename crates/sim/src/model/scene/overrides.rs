//! `--set name=value`: values put into the text of a scene before it is read.

use toml_edit::{DocumentMut, Item, Table, Value};

use crate::model::error::{Checked, Fault};
use crate::model::names::nearest;
use crate::model::problem::{OverrideReason, SceneProblem};

/// Most parts of a dotted key.
const MOST_PARTS: usize = 16;

/// The document with every override in it.
///
/// A bare name is a parameter of the model; a dotted key is a place of the scene, list entries by
/// number. A value that is not TOML is taken as text.
pub(super) fn apply(document: &mut DocumentMut, overrides: &[(String, String)]) -> Checked<()> {
    for (key, text) in overrides {
        let value = text
            .trim()
            .parse::<Value>()
            .unwrap_or_else(|_| Value::from(text.as_str()));
        let key = key.trim();
        let parts: Vec<&str> = if key.contains('.') {
            key.split('.').collect()
        } else {
            vec!["model", "parameters", key]
        };
        let fail = |part: &str, reason| {
            let (key, part) = (super::document::shown(key), super::document::shown(part));
            Fault::nowhere(SceneProblem::Override {
                key,
                part,
                reason,
                nearest: None,
            })
        };
        if let Some(empty) = parts
            .iter()
            .take(MOST_PARTS + 1)
            .find(|part| part.is_empty())
        {
            return Err(fail(empty, OverrideReason::Empty));
        }
        if parts.len() > MOST_PARTS {
            return Err(fail(parts[MOST_PARTS], OverrideReason::NotATable));
        }
        if !key.contains('.') && !parameters(document).any(|known| known == key) {
            return Err(unknown_parameter(document, key));
        }
        set(document.as_item_mut(), &parts, value).map_err(|(part, reason)| fail(part, reason))?;
    }
    give_way(document, overrides);
    Ok(())
}

/// Takes out of `[expansion]` what an override excludes: a tolerance takes the place of the orders,
/// and orders that of a tolerance, unless both are set.
fn give_way(document: &mut DocumentMut, overrides: &[(String, String)]) {
    let is_set = |name: &str| {
        let key = format!("expansion.{name}");
        overrides.iter().any(|(set, _)| set.trim() == key)
    };
    let orders = ["smooth_order", "contact_weight"];
    let tolerance = ["tolerance"];
    let ways = [(&tolerance[..], &orders[..]), (&orders, &tolerance)];
    let expansion = document.get_mut("expansion");
    let Some(expansion) = expansion.and_then(Item::as_table_like_mut) else {
        return;
    };
    for (these, those) in ways {
        let is_overridden = |names: &[&str]| names.iter().any(|name| is_set(name));
        if is_overridden(these) && !is_overridden(those) {
            for name in those {
                expansion.remove(name);
            }
        }
    }
}

/// The parameters that the document names.
fn parameters(document: &DocumentMut) -> impl Iterator<Item = &str> {
    let model = document.get("model").and_then(Item::as_table_like);
    let parameters = model.and_then(|model| model.get("parameters"));
    let parameters = parameters.and_then(Item::as_table_like);
    parameters
        .into_iter()
        .flat_map(|table| table.iter().map(|(name, _)| name))
}

fn unknown_parameter(document: &DocumentMut, key: &str) -> Fault {
    let shown = super::document::shown(key);
    Fault::nowhere(SceneProblem::Override {
        key: shown.clone(),
        part: shown,
        reason: OverrideReason::UnknownParameter,
        nearest: nearest(key, parameters(document)),
    })
}

/// Puts `value` at the place `parts` names under `item`; the part that failed and why otherwise.
fn set<'k>(
    item: &mut Item,
    parts: &[&'k str],
    value: Value,
) -> Result<(), (&'k str, OverrideReason)> {
    let Some((&part, rest)) = parts.split_first() else {
        replace(item, value);
        return Ok(());
    };
    if item.is_array() || item.is_array_of_tables() {
        return set_in_list(item, part, rest, value);
    }
    let Some(table) = item.as_table_like_mut() else {
        return Err((part, OverrideReason::NotATable));
    };
    if !table.contains_key(part) {
        let fresh = if rest.is_empty() {
            Item::Value(value.clone())
        } else {
            Item::Table(implicit())
        };
        table.insert(part, fresh);
    }
    match table.get_mut(part) {
        Some(inner) => set(inner, rest, value),
        None => Err((part, OverrideReason::NotATable)),
    }
}

/// As [`set`], for an entry of a list.
fn set_in_list<'k>(
    item: &mut Item,
    part: &'k str,
    rest: &[&'k str],
    value: Value,
) -> Result<(), (&'k str, OverrideReason)> {
    let index = part
        .parse::<usize>()
        .map_err(|_| (part, OverrideReason::NotAnEntry))?;
    if let Some(tables) = item.as_array_of_tables_mut() {
        let table = tables
            .get_mut(index)
            .ok_or((part, OverrideReason::NotAnEntry))?;
        let Some((&key, _)) = rest.split_first() else {
            return Err((part, OverrideReason::NotATable));
        };
        let mut entry = Item::Table(std::mem::take(table));
        let outcome = set(&mut entry, rest, value);
        *table = entry
            .into_table()
            .map_err(|_| (key, OverrideReason::NotATable))?;
        return outcome;
    }
    let slot = item
        .as_array_mut()
        .and_then(|list| list.get_mut(index))
        .ok_or((part, OverrideReason::NotAnEntry))?;
    let mut entry = Item::Value(slot.clone());
    set(&mut entry, rest, value)?;
    *slot = entry
        .into_value()
        .map_err(|_| (part, OverrideReason::NotATable))?;
    Ok(())
}

/// Replaces a value, the space and comment around it kept.
fn replace(item: &mut Item, mut value: Value) {
    if let Some(old) = item.as_value() {
        *value.decor_mut() = old.decor().clone();
    }
    *item = Item::Value(value);
}

/// A table whose header is not written where it is empty.
fn implicit() -> Table {
    let mut table = Table::new();
    table.set_implicit(true);
    table
}
