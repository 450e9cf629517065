//! Depths that each map reaches, by stiffness: radius, reach of the series, crossing, rigid limit.

use grazemap::report::figure::{Axis, Figure, Series, Stroke};
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::error::Measured;

/// Weights and tolerances of the table of reaches.
const WEIGHTS: [u32; 4] = [4, 8, 16, 24];
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];
/// Tolerances of the rigid limit.
const RIGID: [f64; 3] = [1e-1, 1e-2, 1e-3];
/// Weight and tolerance of the figure and of the table of the gap.
const SHOWN_WEIGHT: u32 = 8;
const SHOWN_TOLERANCE: f64 = 1e-2;

/// Table of the estimated radius and that of the uniform law.
pub(crate) fn radius_table(stops: &[&Measured<'_>]) -> Result<Table, ReportError> {
    let headings = ["radius, uniform law", "radius, estimated", "ratio"];
    let mut table = table_of(headings.map(str::to_owned).to_vec());
    for stop in stops {
        let (law, estimate) = (stop.law_radius(), stop.series.radius().unwrap_or(f64::NAN));
        push(&mut table, stop, &[law, estimate, estimate / law]);
    }
    Ok(table)
}

/// Table of the largest `y`, over the radius of the law, at which a weight is within a tolerance.
pub(crate) fn reach_table(stops: &[&Measured<'_>]) -> Result<Table, ReportError> {
    let pairs = || WEIGHTS.into_iter().flat_map(|w| TOLERANCES.map(|tolerance| (w, tolerance)));
    let mut table = table_of(pairs().map(|(w, t)| format!("W = {w}, {t:.0e}")).collect());
    for stop in stops {
        let reach = |(weight, tolerance)| stop.series_reach(weight, tolerance) / stop.law_radius();
        push(&mut table, stop, &pairs().map(reach).collect::<Vec<_>>());
    }
    Ok(table)
}

/// Table of depths `y²`: reach of the series, crossing, and start of the rigid limit.
pub(crate) fn gap_table(family: &[Measured<'_>]) -> Result<Table, ReportError> {
    let mut headings = vec![
        format!("W = {SHOWN_WEIGHT} to {SHOWN_TOLERANCE:.0e}"),
        "radius²".to_owned(),
        "rigid nearer".to_owned(),
    ];
    headings.extend(RIGID.map(|tolerance| format!("rigid to {tolerance:.0e}")));
    let mut table = table_of(headings);
    for stop in family {
        push(&mut table, stop, &depths(stop));
    }
    Ok(table)
}

fn depths(stop: &Measured<'_>) -> Vec<f64> {
    let mut found = vec![
        stop.series_reach(SHOWN_WEIGHT, SHOWN_TOLERANCE),
        stop.law_radius(),
        stop.crossing(SHOWN_WEIGHT),
    ];
    found.extend(RIGID.map(|tolerance| stop.rigid_reach(tolerance)));
    found.into_iter().map(|y| y * y).collect()
}

/// Figure of the gap between the two maps, depth against stiffness.
pub(crate) fn gap_figure(family: &[Measured<'_>]) -> Figure {
    let name = family.first().map_or("", |stop| stop.family.name());
    let mut figure = Figure::new(
        Axis::log10("stiffness k_{2}"),
        Axis::log10("depth y^{2} (units of the gap σ)"),
    );
    figure.title = format!("Family {name}: where each map serves");
    let names = [
        "series, W = 8: 1 % below",
        "radius of the series",
        "rigid nearer above",
        "rigid: 10 % above",
        "rigid: 1 % above",
    ];
    let strokes = [Stroke::Solid, Stroke::Dotted, Stroke::Dashed, Stroke::Solid, Stroke::Solid];
    let rows: Vec<_> = family.iter().map(|stop| (stop.stiffness, depths(stop))).collect();
    for (column, (name, stroke)) in names.into_iter().zip(strokes).enumerate() {
        let points = rows.iter().map(|(stiffness, depths)| [*stiffness, depths[column]]);
        figure.series.push(Series::line(name, stroke, points.collect()));
    }
    figure
}

fn table_of(headings: Vec<String>) -> Table {
    let mut columns = vec![Column::text("family"), Column::number("k2")];
    columns.extend(headings.into_iter().map(Column::number));
    Table::new(columns)
}

fn push(table: &mut Table, stop: &Measured<'_>, values: &[f64]) {
    let mut row = vec![Cell::text(stop.family.name()), Cell::number(stop.stiffness, 1)];
    let cell = |&value: &f64| {
        if value.is_finite() { Cell::number(value, 3) } else { Cell::Missing }
    };
    row.extend(values.iter().map(cell));
    table.push(row);
}
