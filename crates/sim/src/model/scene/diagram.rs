//! `[[diagram]]`, `[[chart]]` and `[[basin]]`: the requested pictures.

use super::document::{Field, Scope, Table};
use super::tables::{distinct, key_position, parameter, position, refuse_frozen};
use super::{
    BasinPlan, ChartObservable, ChartOverlay, ChartRequest, DiagramRequest, Method, Observable,
    Spacing, Starts, SweepDirection,
};
use crate::model::error::{Checked, Fault, SceneProblem};
use crate::model::oscillator::Model;

/// Keys of `[[diagram]]`.
const DIAGRAM_KEYS: [&str; 13] = [
    "parameter",
    "range",
    "points",
    "scale",
    "values",
    "start",
    "starts",
    "transient",
    "keep",
    "observe",
    "direction",
    "method",
    "with",
];

/// Keys of `[[chart]]`.
const CHART_KEYS: [&str; 14] = [
    "parameters",
    "ranges",
    "points",
    "cells",
    "start",
    "starts",
    "attractors",
    "transient",
    "keep",
    "observe",
    "method",
    "with",
    "overlay",
    "itineraries",
];

/// Keys of `[[basin]]`.
const BASIN_KEYS: [&str; 9] =
    ["axes", "ranges", "points", "cells", "at", "start", "manifolds", "method", "with"];

/// Longest period allowed for saddles whose manifolds are drawn.
const LONGEST_SADDLE: u64 = 12;

/// Largest number of points along one axis.
const MOST_POINTS: u64 = 10_000_000;

/// Largest number of cells of a chart; a cell takes a hundred bytes.
const MOST_CELLS: u64 = 4_000_000;

/// Largest number of values of a sweep; a value takes tens of bytes until it is written.
const MOST_VALUES: u64 = 20_000_000;

/// Largest number of starts.
const MOST_STARTS: u64 = 1000;

/// Largest number of iterates.
const MOST_ITERATES: u64 = 1_000_000_000;

/// Default numbers of points, of dropped iterates, and of kept iterates.
const DEFAULTS: [u64; 3] = [1000, 1000, 200];

/// Largest number of cells for which all are computed by default: in so small a chart a large part
/// of the cells lies along borders.
const ALL_CELLS: usize = 10_000;

/// Default number of starts of every cell when attractors are distinguished.
const SPREAD_STARTS: usize = 16;

/// Largest number of attractors of a cell.
const MOST_ATTRACTORS: u64 = 16;

/// Default for the largest number of attractors of a cell when their number is observed.
const COUNTED_ATTRACTORS: u64 = 4;

/// Largest number of itineraries whose loci are drawn over a chart.
const MOST_ITINERARIES: usize = 1000;

/// Reads one `[[diagram]]`.
pub(super) fn read(table: &Table<'_>, model: &mut Model, scope: &Scope) -> Checked<DiagramRequest> {
    table.only(&DIAGRAM_KEYS)?;
    let [_, transient, keep] = DEFAULTS;
    let parameter = parameter(&table.require("parameter")?.entry("a parameter's name")?, model)?;
    let (range, points, spacing) = values(table)?;
    let starts = starts(table, model)?;
    let keep = kept(table, points * starts.count(), keep)?;
    Ok(DiagramRequest {
        parameter,
        range,
        points,
        spacing,
        starts,
        transient: count(table, "transient", 0, MOST_ITERATES, transient)?,
        keep,
        observe: observable(table.field("observe"), model, scope)?,
        direction: direction(table.field("direction"))?,
        with: methods(table)?,
    })
}

/// Reads one `[[chart]]`.
pub(super) fn read_chart(table: &Table<'_>, model: &Model) -> Checked<ChartRequest> {
    table.only(&CHART_KEYS)?;
    let names = table.require("parameters")?;
    let parameters = distinct(
        &names.entry("a list of two parameters")?.pair("a list of two parameters")?,
        |entry| parameter(entry, model),
    )?;
    let ranges = chart_ranges(&table.require("ranges")?)?;
    let defaults = ChartRequest::new([parameters[0], parameters[1]], ranges);
    let observe = chart_observable(table.field("observe"))?;
    let attractors = match observe {
        ChartObservable::Attractors => COUNTED_ATTRACTORS,
        _ => defaults.attractors as u64,
    };
    let attractors = count(table, "attractors", 1, MOST_ATTRACTORS, attractors)?;
    let starts = match starts(table, model)? {
        Starts::Smooth if attractors > 1 => Starts::Spread(SPREAD_STARTS),
        starts => starts,
    };
    let points = table.field("points").map_or(Ok(defaults.points), |field| chart_points(&field))?;
    let every_cell = every_cell(table)?.unwrap_or(points[0] * points[1] <= ALL_CELLS);
    let transient = defaults.transient as u64;
    Ok(ChartRequest {
        points,
        every_cell,
        starts,
        attractors,
        transient: count(table, "transient", 0, MOST_ITERATES, transient)?,
        keep: count(table, "keep", 1, MOST_ITERATES, defaults.keep as u64)?,
        observe,
        with: methods(table)?,
        overlay: overlay(table.field("overlay"))?,
        itineraries: itineraries(table.field("itineraries"))?,
        ..defaults
    })
}

/// Reads one `[[basin]]`.
pub(super) fn read_basin(table: &Table<'_>, model: &Model, active: &[usize]) -> Checked<BasinPlan> {
    table.only(&BASIN_KEYS)?;
    let (states, parameters) = (model.full_state_names(), model.parameter_names());
    let axes = table.field("axes").map(|field| {
        let two = "a list of two coordinates";
        let entries = field.entry(two)?.pair(two)?;
        let names = entries.iter().map(|entry| {
            let name = entry.text("a coordinate's name")?;
            position("state", name, &states).map_err(|problem| entry.fault(problem))
        });
        let places: Vec<usize> = names.collect::<Checked<_>>()?;
        Ok([0, 1].map(|axis: usize| states[places[axis]].to_owned()))
    });
    let offsets = |key: &str| -> Checked<Vec<Field<'_>>> {
        let field = table.field(key).map(|field| field.table());
        Ok(field.transpose()?.map_or(Vec::new(), |table| table.fields()))
    };
    let at = offsets("at")?;
    let at = at.iter().map(|field| {
        let place = key_position("parameter", field, &parameters)?;
        refuse_frozen(field, place, active)?;
        Ok((place, field.double()?))
    });
    let start = offsets("start")?;
    let start = start.iter().map(|field| {
        let place = key_position("state", field, &states)?;
        Ok((states[place].to_owned(), field.double()?))
    });
    let manifolds = table.field("manifolds").map(|field| field.count(1, LONGEST_SADDLE));
    Ok(BasinPlan {
        axes: axes.transpose()?,
        ranges: table.field("ranges").map(|field| chart_ranges(&field)).transpose()?,
        points: table.field("points").map(|field| chart_points(&field)).transpose()?,
        at: at.collect::<Checked<_>>()?,
        start: start.collect::<Checked<_>>()?,
        every_cell: every_cell(table)?.unwrap_or(false),
        manifolds: manifolds.transpose()?.map(|period| period as usize),
        with: methods(table)?,
    })
}

/// Whether `cells` asks for every cell; `None` without the key.
fn every_cell(table: &Table<'_>) -> Checked<Option<bool>> {
    let choices = [("borders", false), ("all", true)];
    table.field("cells").map(|field| field.choice(&choices, "\"borders\", \"all\"")).transpose()
}

fn chart_observable(field: Option<Field<'_>>) -> Checked<ChartObservable> {
    let options = [
        ("period", ChartObservable::Period),
        ("itinerary", ChartObservable::Itinerary),
        ("lyapunov", ChartObservable::Lyapunov),
        ("attractors", ChartObservable::Attractors),
    ];
    let expected = "\"period\", \"itinerary\", \"lyapunov\", \"attractors\"";
    field.map_or(Ok(ChartObservable::Period), |field| field.choice(&options, expected))
}

fn overlay(field: Option<Field<'_>>) -> Checked<Vec<ChartOverlay>> {
    let Some(field) = field else { return Ok(Vec::new()) };
    let options = [("graze", ChartOverlay::Graze), ("loci", ChartOverlay::Loci)];
    let entries = field.one_or_list("a list of \"graze\", \"loci\"")?;
    distinct(&entries, |entry| entry.choice(&options, "\"graze\", \"loci\""))
}

fn itineraries(field: Option<Field<'_>>) -> Checked<Vec<String>> {
    let Some(field) = field else { return Ok(Vec::new()) };
    let expected = "a list of itineraries in digits, such as \"10\"";
    let entries = field.one_or_list(expected)?;
    field.check_length(entries.len(), MOST_ITINERARIES)?;
    entries.iter().map(|entry| Ok(entry.text(expected)?.to_owned())).collect()
}

/// Range of the swept parameter, number of its values, and their distribution: from `values`, or
/// from `range`, `points` and `scale`.
fn values(table: &Table<'_>) -> Checked<([f64; 2], usize, Spacing)> {
    if let Some(field) = table.field("values") {
        for first in ["range", "points", "scale"] {
            if table.field(first).is_some() {
                return Err(field.key_fault(SceneProblem::Exclusive { first, second: "values" }));
            }
        }
        return listed(&field);
    }
    let field = table.require("range")?;
    let range = field.range()?;
    let points = count(table, "points", 1, MOST_POINTS, DEFAULTS[0])?;
    let options = [("linear", Spacing::Even), ("log", Spacing::Logarithmic)];
    let spacing = table
        .field("scale")
        .map_or(Ok(Spacing::Even), |field| field.choice(&options, "\"linear\", \"log\""))?;
    let [first, last] = range;
    if spacing == Spacing::Logarithmic && first <= 0.0 && last >= 0.0 {
        let key = field.path.clone();
        return Err(field.fault(SceneProblem::LogarithmicRange { key, first, last }));
    }
    Ok((range, points, spacing))
}

/// Offsets that a scene lists, in increasing order.
fn listed(field: &Field<'_>) -> Checked<([f64; 2], usize, Spacing)> {
    let entries = field.list("a list of offsets")?;
    field.check_length(entries.len(), MOST_POINTS as usize)?;
    let mut values: Vec<f64> =
        entries.iter().map(|entry| entry.double()).collect::<Checked<_>>()?;
    values.sort_by(f64::total_cmp);
    values.dedup();
    let range = [values[0], values[values.len() - 1]];
    Ok((range, values.len(), Spacing::Listed(values)))
}

/// Starts from `start`, a list of offsets by name, or from `starts`, their number.
fn starts(table: &Table<'_>, model: &Model) -> Checked<Starts> {
    match (table.field("start"), table.field("starts")) {
        (Some(_), Some(count)) => {
            Err(count.key_fault(SceneProblem::Exclusive { first: "start", second: "starts" }))
        }
        (None, None) => Ok(Starts::Smooth),
        (None, Some(count)) => Ok(Starts::Spread(count.count(1, MOST_STARTS)? as usize)),
        (Some(field), None) => {
            let tables = field.tables()?;
            field.check_length(tables.len(), MOST_STARTS as usize)?;
            let states = tables.iter().map(|table| start(table, model));
            Ok(Starts::Given(states.collect::<Checked<_>>()?))
        }
    }
}

/// Offsets by component of the full state.
fn start(table: &Table<'_>, model: &Model) -> Checked<Vec<Option<f64>>> {
    let names = model.full_state_names();
    let mut offsets = vec![None; names.len()];
    for field in table.fields() {
        offsets[key_position("state", &field, &names)?] = Some(field.double()?);
    }
    Ok(offsets)
}

fn count(table: &Table<'_>, key: &str, least: u64, most: u64, default: u64) -> Checked<usize> {
    let count = table.field(key).map_or(Ok(default), |field| field.count(least, most))?;
    Ok(count as usize)
}

/// Number of iterates kept at each of `points` values.
fn kept(table: &Table<'_>, points: usize, default: u64) -> Checked<usize> {
    let keep = count(table, "keep", 1, MOST_ITERATES, default)?;
    let found = points as u64 * keep as u64;
    if found <= MOST_VALUES {
        return Ok(keep);
    }
    let field = table.field("keep").or_else(|| table.field("points"));
    let (span, key) = field.map_or((0..0, "keep".to_owned()), |field| (field.span(), field.path));
    Err(Fault::at(span, SceneProblem::DiagramValues { key, found, most: MOST_VALUES }))
}

/// Observable: `h`, `impact_speed`, or an expression.
fn observable(field: Option<Field<'_>>, model: &mut Model, scope: &Scope) -> Checked<Observable> {
    let Some(field) = field else {
        return Ok(Observable::EventFunction);
    };
    let entry = field.entry("an expression")?;
    match entry.text("an expression")? {
        "h" => Ok(Observable::EventFunction),
        "impact_speed" => Ok(Observable::ImpactSpeed),
        text => {
            let node = scope.expression(&entry, &mut model.graph)?;
            Ok(Observable::Expression { text: text.to_owned(), node })
        }
    }
}

fn direction(field: Option<Field<'_>>) -> Checked<SweepDirection> {
    let options = [
        ("up", SweepDirection::Up),
        ("down", SweepDirection::Down),
        ("both", SweepDirection::Both),
    ];
    field.map_or(Ok(SweepDirection::Both), |field| {
        field.choice(&options, "\"up\", \"down\", \"both\"")
    })
}

/// Methods under `method`, or under its older name `with`.
fn methods(table: &Table<'_>) -> Checked<Vec<Method>> {
    let field = match (table.field("method"), table.field("with")) {
        (Some(_), Some(older)) => {
            let problem = SceneProblem::Exclusive { first: "method", second: "with" };
            return Err(older.key_fault(problem));
        }
        (Some(field), None) | (None, Some(field)) => field,
        (None, None) => return Ok(vec![Method::Guarded]),
    };
    let entries = field.one_or_list("a list of \"guarded\", \"map\", \"direct\", \"atlas\"")?;
    field.check_length(entries.len(), usize::MAX)?;
    let options = [
        ("guarded", Method::Guarded),
        ("map", Method::Map),
        ("direct", Method::Direct),
        ("atlas", Method::Atlas),
    ];
    distinct(&entries, |entry| {
        entry.choice(&options, "\"guarded\", \"map\", \"direct\", \"atlas\"")
    })
}

/// Number of points: one for both axes, or one for each.
fn chart_points(field: &Field<'_>) -> Checked<[usize; 2]> {
    let entries = field.one_or_list("a whole number, or a list of two")?;
    let points: Vec<u64> =
        entries.iter().map(|entry| entry.count(1, MOST_POINTS)).collect::<Checked<_>>()?;
    let axes = match points[..] {
        [both] => [both; 2],
        [first, second] => [first, second],
        _ => {
            let problem =
                SceneProblem::Length { key: field.path.clone(), expected: 2, found: points.len() };
            return Err(field.fault(problem));
        }
    };
    let cells = axes[0] * axes[1];
    if cells > MOST_CELLS {
        let problem =
            SceneProblem::ChartCells { key: field.path.clone(), found: cells, most: MOST_CELLS };
        return Err(field.fault(problem));
    }
    Ok(axes.map(|points| points as usize))
}

/// Two pairs of offsets, the horizontal parameter's pair first.
fn chart_ranges(field: &Field<'_>) -> Checked<[[f64; 2]; 2]> {
    let [first, second] = field.entry("a list of two ranges")?.pair("a list of two ranges")?;
    Ok([first.range()?, second.range()?])
}
