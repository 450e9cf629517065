//! Costs of the catalogue's scenes at their own orders, interpreted and compiled.

use std::error::Error;

use grazemap::expansion::Expander;
use grazemap::model::{Orders, Scene, catalogue};
use grazemap::orbit::locate;
use grazemap::prelude::FindGraze;
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::compiled::compiled_step_ns;
use crate::measure::cost;

/// Jets and step of every scene that names its orders.
pub(crate) fn table(rate: f64) -> Result<Table, Box<dyn Error>> {
    let headings = [
        "N",
        "W",
        "legs [ms]",
        "D [ms]",
        "operations",
        "interpreted step [ns]",
        "compiled step [ns]",
        "floor [ns]",
        "interpreted, frozen [ns]",
        "its floor [ns]",
    ];
    let mut columns = vec![Column::text("scene")];
    columns.extend(headings.map(Column::number));
    let mut table = Table::new(columns);
    for name in catalogue::names() {
        if let Some(row) = row(name, rate)? {
            table.push(row);
        }
    }
    Ok(table)
}

fn row(name: &str, rate: f64) -> Result<Option<Vec<Cell>>, Box<dyn Error>> {
    let scene = Scene::of_catalogue(name)?;
    let Orders::Fixed(orders) = scene.expansion.orders else {
        return Ok(None);
    };
    let orbit = locate(&scene)?.into_result()?;
    let expander = Expander::new(&scene, &orbit)?;
    let cost = cost(&expander, orders)?;
    let [operations, _, frozen, _] = cost.operations;
    let map = Scene::of_catalogue(name)?.graze()?.map()?;
    let compiled = compiled_step_ns(&map, operations)?;
    let mut row = vec![
        Cell::text(name),
        Cell::Integer(orders.smooth_order.into()),
        Cell::Integer(orders.contact_weight.into()),
        Cell::number(1e3 * cost.seconds[0], 3),
        Cell::number(1e3 * cost.seconds[1], 3),
        Cell::Integer(operations as i64),
    ];
    let floors = [operations, frozen].map(|count| count as f64 * rate);
    let times = [cost.step_ns[0], compiled, floors[0], cost.step_ns[2], floors[1]];
    row.extend(times.map(|time| Cell::number(time, 3)));
    Ok(Some(row))
}

/// The rates of multiply-adds of this run.
pub(crate) fn rate_table(rates: [f64; 2]) -> Result<Table, ReportError> {
    let mut table =
        Table::new(vec![Column::text("multiply-adds in registers"), Column::number("one [ns]")]);
    for (name, rate) in ["one double at a time", "eight lanes, each"].into_iter().zip(rates) {
        table.push(vec![Cell::text(name), Cell::number(rate, 3)]);
    }
    Ok(table)
}
