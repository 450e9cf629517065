//! `[expansion]`: active parameters, orders and weights.

use super::document::Table;
use super::lookup::{distinct, parameter, unknown};
use super::{Expansion, Grazing, MapOrders, Orders};
use crate::model::error::{Checked, Fault};
use crate::model::names;
use crate::model::oscillator::Model;
use crate::model::problem::SceneProblem;

/// Keys of `[expansion]`.
const KEYS: [&str; 5] = [
    "active",
    "smooth_order",
    "contact_weight",
    "weights",
    "tolerance",
];

/// Highest order or weight.
const HIGHEST: u64 = 64;

/// Orders where the scene names none.
const DEFAULT: MapOrders = MapOrders::new(5, 6);

/// Reads `[expansion]`; without it, the parameters solved for are active and the orders are 5 and
/// 6.
pub(super) fn read(
    table: Option<&Table<'_>>,
    model: &Model,
    grazing: &Grazing,
) -> Checked<Expansion> {
    let Some(table) = table else {
        return Ok(Expansion {
            active: grazing.solve_for.clone(),
            orders: Orders::Fixed(DEFAULT),
            weights: Vec::new(),
        });
    };
    table.only(&KEYS)?;
    let active = match table.field("active") {
        Some(field) => distinct(&field.one_or_list("a parameter's name")?, |entry| {
            parameter(entry, model)
        })?,
        None => grazing.solve_for.clone(),
    };
    let orders = orders(table)?;
    let weights = table
        .field("weights")
        .map(|field| weights(&field.table()?, model))
        .transpose()?;
    Ok(Expansion {
        active,
        orders,
        weights: weights.unwrap_or_default(),
    })
}

fn orders(table: &Table<'_>) -> Checked<Orders> {
    if let Some(tolerance) = table.field("tolerance") {
        for first in ["smooth_order", "contact_weight"] {
            if table.field(first).is_some() {
                let second = "tolerance";
                let problem = SceneProblem::Exclusive { first, second };
                return Err(Fault::at(tolerance.key_span, problem));
            }
        }
        return Ok(Orders::Tolerance(tolerance.positive()?.hi));
    }
    let order = |key: &str, default: u32| -> Checked<u32> {
        let given = table.field(key).map(|field| field.count(1, HIGHEST));
        Ok(given.transpose()?.map_or(default, |order| order as u32))
    };
    Ok(Orders::Fixed(MapOrders::new(
        order("smooth_order", DEFAULT.smooth_order)?,
        order("contact_weight", DEFAULT.contact_weight)?,
    )))
}

/// Weights by the name of a full-state component or a parameter.
fn weights(table: &Table<'_>, model: &Model) -> Checked<Vec<(String, u32)>> {
    let mut known = model.full_state_names();
    known.extend(
        model
            .parameters
            .iter()
            .map(|parameter| parameter.name.as_str()),
    );
    let mut weights = Vec::new();
    for field in table.fields() {
        if !known.contains(&field.key) {
            let nearest = names::nearest(field.key, known.iter().copied());
            return Err(Fault::at(
                field.key_span,
                unknown("state or parameter", field.key, nearest),
            ));
        }
        weights.push((field.key.to_owned(), field.count(1, HIGHEST)? as u32));
    }
    Ok(weights)
}
