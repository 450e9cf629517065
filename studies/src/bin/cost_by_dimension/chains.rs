//! Costs of chains: tables and figures by states, law, parameters and order.

use std::error::Error;

use grazemap::expansion::{Expander, MapOrders};
use grazemap::orbit::locate;
use grazemap::report::figure::{Axis, Figure, Marker, Series, Stroke};
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::chain::{Law, scene};
use crate::measure::{Cost, cost};

/// Orders `N` of the legs; the contact has the weight `W = N + 1`.
const ORDERS: std::ops::RangeInclusive<u32> = 2..=8;
/// Time for jets and composition, in seconds, above which higher orders are omitted.
const PATIENCE: f64 = 3.0;
/// Orders of the page's tables.
const SHOWN: [u32; 4] = [2, 4, 6, 8];

/// Measurements of one chain at every order.
pub(crate) struct Chain {
    masses: usize,
    law: Law,
    active: usize,
    costs: Vec<Cost>,
}

impl Chain {
    pub(crate) fn measure(masses: usize, law: Law, active: usize) -> Result<Self, Box<dyn Error>> {
        let scene = scene(masses, law, active);
        let orbit = locate(&scene)?.into_result()?;
        let expander = Expander::new(&scene, &orbit)?;
        let mut costs: Vec<Cost> = Vec::new();
        for smooth_order in ORDERS {
            let spent = costs.last().map_or(0.0, |cost| cost.seconds.iter().sum());
            if spent > PATIENCE {
                break;
            }
            let contact_weight = smooth_order + 1;
            let orders = MapOrders { smooth_order, contact_weight };
            costs.push(cost(&expander, orders)?);
        }
        Ok(Self { masses, law, active, costs })
    }

    fn states(&self) -> usize {
        2 * self.masses
    }

    fn name(&self) -> Vec<Cell> {
        vec![
            Cell::Integer(self.states() as i64),
            Cell::text(self.law.name()),
            Cell::Integer(self.active as i64),
        ]
    }

    fn points(&self, value: impl Fn(&Cost) -> f64) -> Vec<[f64; 2]> {
        let point = |cost: &Cost| [f64::from(cost.orders.smooth_order), value(cost)];
        self.costs.iter().map(point).collect()
    }
}

/// Table of all measurements.
pub(crate) fn table(chains: &[Chain], rate: f64) -> Result<Table, ReportError> {
    let mut table = table_of(&[
        "monomials, leg",
        "monomials, contact",
        "legs [ms]",
        "D [ms]",
        "composition [ms]",
        "operations, factored",
        "operations, composed",
        "frozen, factored",
        "frozen, composed",
        "step, factored [ns]",
        "step, composed [ns]",
        "step, frozen factored [ns]",
        "step, frozen composed [ns]",
        "floor, frozen factored [ns]",
    ]);
    fill(
        &mut table,
        chains,
        |_, _| true,
        |cost| {
            let mut row: Vec<Cell> = cost.monomials.map(|n| Cell::Integer(n as i64)).into();
            row.extend(cost.seconds.map(|seconds| Cell::number(1e3 * seconds, 3)));
            row.extend(cost.operations.map(|n| Cell::Integer(n as i64)));
            row.extend(cost.step_ns.map(|time| Cell::number(time, 3)));
            row.push(Cell::number(cost.operations[2] as f64 * rate, 3));
            row
        },
    )?;
    Ok(table)
}

/// Table of monomials and times of the jets, two active parameters. Legs are also given in dense
/// products of two jets, at the rate of multiply-adds.
pub(crate) fn jet_table(chains: &[Chain], rate: f64) -> Result<Table, ReportError> {
    let mut table = table_of(&[
        "monomials, leg",
        "contact",
        "legs [ms]",
        "in products",
        "D [ms]",
        "composition [ms]",
    ]);
    let chosen = |chain: &Chain, cost: &Cost| chain.active == 2 && shown(cost);
    let row = |cost: &Cost| {
        let mut row: Vec<Cell> = cost.monomials.map(|n| Cell::Integer(n as i64)).into();
        let [legs, contact, composition] = cost.seconds.map(|seconds| 1e3 * seconds);
        let products = 1e6 * legs / (cost.products as f64 * rate);
        row.extend([legs, products, contact, composition].map(|time| Cell::number(time, 3)));
        row
    };
    fill(&mut table, chains, chosen, row)?;
    Ok(table)
}

/// Operations and times of a step, rigid stop.
pub(crate) fn step_table(chains: &[Chain], rate: f64) -> Result<Table, ReportError> {
    let mut table = table_of(&[
        "operations, factored",
        "composed",
        "frozen factored",
        "frozen composed",
        "step, factored [ns]",
        "frozen factored [ns]",
        "its floor [ns]",
        "over floor",
    ]);
    fill(
        &mut table,
        chains,
        |chain, cost| chain.law == Law::Rigid && shown(cost),
        |cost| {
            let floor = cost.operations[2] as f64 * rate;
            let mut row: Vec<Cell> = cost.operations.map(|n| Cell::Integer(n as i64)).into();
            let times = [cost.step_ns[0], cost.step_ns[2], floor, cost.step_ns[2] / floor];
            row.extend(times.map(|time| Cell::number(time, 3)));
            row
        },
    )?;
    Ok(table)
}

/// Times of the legs and of `D` against the order, two active parameters.
pub(crate) fn jet_figure(chains: &[Chain]) -> Figure {
    let mut figure = Figure::new(
        Axis::linear("order N (contact weight W = N + 1)"),
        Axis::log10("time of the jets [ms]"),
    );
    figure.title = "Jets of a map, two active parameters".to_owned();
    for chain in chains.iter().filter(|chain| chain.active == 2) {
        let color = chain.masses - 1;
        let states = chain.states();
        if chain.law == Law::Rigid {
            let points = chain.points(|cost| 1e3 * cost.seconds[0]);
            let legs = Series::line_with_markers(
                format!("{states} states: legs"),
                Marker::numbered(color),
                points,
            );
            figure.series.push(legs.with_color(color));
        }
        let stroke = if chain.law == Law::Rigid { Stroke::Dotted } else { Stroke::Dashed };
        let points = chain.points(|cost| 1e3 * cost.seconds[1]);
        let name = format!("{states} states: D, {}", chain.law.name());
        figure.series.push(Series::line(name, stroke, points).with_color(color));
    }
    figure
}

/// Time of a frozen factored step and its floor against the order, two active parameters, rigid.
pub(crate) fn step_figure(chains: &[Chain], rate: f64) -> Figure {
    let mut figure = Figure::new(
        Axis::linear("order N (contact weight W = N + 1)"),
        Axis::log10("one step, parameters frozen [ns]"),
    );
    figure.title = "One interpreted step of a rigid stop's map".to_owned();
    let chosen = chains.iter().filter(|chain| chain.active == 2 && chain.law == Law::Rigid);
    for chain in chosen {
        let (color, states) = (chain.masses - 1, chain.states());
        let forms = [("factored", 2, Stroke::Solid), ("composed", 3, Stroke::Dashed)];
        for (form, column, stroke) in forms {
            let name = format!("{states} states: {form}");
            let points = chain.points(|cost| cost.step_ns[column]);
            figure.series.push(Series::line(name, stroke, points).with_color(color));
        }
        let floor = chain.points(|cost| rate * cost.operations[2] as f64);
        let name = format!("{states} states: floor, factored");
        figure.series.push(Series::line(name, Stroke::Dotted, floor).with_color(color));
    }
    figure
}

fn shown(cost: &Cost) -> bool {
    SHOWN.contains(&cost.orders.smooth_order)
}

fn table_of(headings: &[&str]) -> Table {
    let mut columns = vec![
        Column::number("states"),
        Column::text("stop"),
        Column::number("parameters"),
        Column::number("N"),
    ];
    columns.extend(headings.iter().map(|heading| Column::number(*heading)));
    Table::new(columns)
}

/// Adds a row for every chosen cost.
fn fill(
    table: &mut Table,
    chains: &[Chain],
    chosen: impl Fn(&Chain, &Cost) -> bool,
    row: impl Fn(&Cost) -> Vec<Cell>,
) -> Result<(), ReportError> {
    for chain in chains {
        for cost in chain.costs.iter().filter(|cost| chosen(chain, cost)) {
            let mut cells = chain.name();
            cells.push(Cell::Integer(cost.orders.smooth_order.into()));
            cells.extend(row(cost));
            table.push(cells);
        }
    }
    Ok(())
}
