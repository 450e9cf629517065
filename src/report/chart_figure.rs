//! Two-parameter charts as pictures, tables and arrays.

use super::diagram_figure::{
    OUTSIDE, end_word, method_word, orbit_header, period_cell, share_cell, start_cell,
};
use super::figure::{Annotation, Axis, CellChart, Figure, Marker, symbol};
use super::{Cell, Column, ReportError, Rows, Table, npy_bytes};
use crate::analysis::chart::{Chart, ChartAxis, ChartCell};
use crate::iteration::{OrbitEnd, Period};

/// Most categories that keep colours of their own.
const MOST_CATEGORIES: usize = 8;

/// Periods beyond this one share a category where there are too many.
const LAST_OWN_PERIOD: usize = 5;

/// What a cell shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Category {
    /// One return, without contact.
    WithoutContact,
    /// A period in returns, with contacts.
    Period(usize),
    /// One of the periods above [`LAST_OWN_PERIOD`].
    Longer,
    /// No period up to the longest looked for.
    NoPeriod,
    /// The map alone, beyond its window.
    Outside,
}

impl Category {
    /// `None` where the orbit left.
    fn of(chart: &Chart, cell: &ChartCell) -> Option<Self> {
        if chart.is_outside(cell) {
            return Some(Self::Outside);
        }
        match (cell.end, cell.period) {
            (OrbitEnd::Completed, Period::Periodic(1)) if cell.kept_contacts == 0 => {
                Some(Self::WithoutContact)
            }
            (OrbitEnd::Completed, Period::Periodic(period)) => Some(Self::Period(period)),
            (OrbitEnd::Completed, Period::NotFound) => Some(Self::NoPeriod),
            _ => None,
        }
    }

    /// Long periods taken together.
    fn grouped(self) -> Self {
        match self {
            Self::Period(period) if period > LAST_OWN_PERIOD => Self::Longer,
            other => other,
        }
    }

    fn words(self, longest: usize) -> String {
        match self {
            Self::WithoutContact => "no contact".to_owned(),
            Self::Period(period) => format!("period {period}"),
            Self::Longer => format!("period {} to {longest}", LAST_OWN_PERIOD + 1),
            Self::NoPeriod => format!("none up to {longest}"),
            Self::Outside => "outside the window".to_owned(),
        }
    }
}

/// The chart of periods: a colour for each, grey where the map alone was used beyond its window,
/// paper-white where the orbit escaped.
pub fn chart_figure(chart: &Chart) -> Figure {
    let [horizontal, vertical] = &chart.axes;
    let mut figure = Figure::new(axis(horizontal), axis(vertical));
    figure.cells = Some(cells(chart));
    let shows = |axis: &ChartAxis| {
        let (low, high) = edges(&axis.offsets);
        low <= 0.0 && 0.0 <= high
    };
    if shows(horizontal) && shows(vertical) {
        figure.annotations.push(Annotation {
            at: [0.0, 0.0],
            text: "G".to_owned(),
            marker: Some(Marker::Ring),
        });
    }
    figure
}

/// One row per cell: its offsets, what the orbit settled on, its name.
pub fn chart_rows(charts: &[Chart]) -> Rows<'_> {
    let surfaces = charts.first().map_or(&[][..], |chart| &chart.surfaces);
    let mut columns = vec![Column::number("chart")];
    columns.extend(["parameter_1", "parameter_2", "method", "start"].map(Column::text));
    columns.extend(
        ["offset_1", "offset_2", "period", "kept_contacts", "lyapunov"].map(Column::number),
    );
    columns.push(Column::text("end"));
    columns.extend(["by_map", "outside"].map(Column::number));
    columns.push(Column::text(orbit_header(surfaces)));
    let rows = charts.iter().enumerate().flat_map(|(number, chart)| {
        chart.located().map(move |([first, second], cell)| {
            vec![
                Cell::Integer(number as i64 + 1),
                Cell::text(chart.axes[0].parameter.clone()),
                Cell::text(chart.axes[1].parameter.clone()),
                Cell::text(method_word(chart.method)),
                start_cell(chart.start.as_deref()),
                Cell::number(first, 6),
                Cell::number(second, 6),
                period_cell(cell.period),
                Cell::Integer(cell.kept_contacts.into()),
                cell.lyapunov.map_or(Cell::Missing, |value| Cell::number(value, 6)),
                Cell::text(if chart.is_outside(cell) { OUTSIDE } else { end_word(cell.end) }),
                share_cell(cell.by_map),
                share_cell(cell.outside),
                cell.orbit.as_ref().map_or(Cell::Missing, |name| Cell::text(name.to_string())),
            ]
        })
    });
    Rows::new(columns, rows)
}

/// Periods: an array of shape (rows, columns), the second parameter's values by the first's; 0
/// without a period, −1 where the map alone was used beyond its window, NaN where the orbit ended
/// early.
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if there are not as many cells as the axes have offsets.
pub fn chart_array(chart: &Chart) -> Result<Vec<u8>, ReportError> {
    let period = |cell: &ChartCell| match (cell.end, cell.period) {
        _ if chart.is_outside(cell) => -1.0,
        (OrbitEnd::Completed, Period::Periodic(period)) => period as f64,
        (OrbitEnd::Completed, Period::NotFound) => 0.0,
        _ => f64::NAN,
    };
    let values: Vec<f64> = chart.cells.iter().map(period).collect();
    let [columns, rows] = [&chart.axes[0], &chart.axes[1]].map(|axis| axis.offsets.len());
    npy_bytes(&[rows, columns], &values)
}

/// What charts cost and how their cells are shared out, for people.
///
/// # Errors
///
/// Never in practice: every row has one cell for every column.
pub fn chart_timing_table(charts: &[Chart]) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![
        Column::text("chart"),
        Column::text("method"),
        Column::number("cells"),
        Column::number("without contact"),
        Column::number("without period"),
        Column::number("outside the window"),
        Column::number("left"),
        Column::number("by map").with_unit("%"),
        Column::number("iterates"),
        Column::number("threads"),
        Column::number("time").with_unit("s"),
        Column::number("one iterate").with_unit("ns"),
    ]);
    for chart in charts {
        let count = |wanted: Option<Category>| {
            let cells = chart.cells.iter().map(|cell| Category::of(chart, cell));
            Cell::Integer(cells.filter(|&category| category == wanted).count() as i64)
        };
        table.push(vec![
            Cell::text(format!("{} by {}", chart.axes[0].parameter, chart.axes[1].parameter)),
            Cell::text(method_word(chart.method)),
            Cell::Integer(chart.cells.len() as i64),
            count(Some(Category::WithoutContact)),
            count(Some(Category::NoPeriod)),
            count(Some(Category::Outside)),
            count(None),
            Cell::number(100.0 * chart.by_map, 4),
            Cell::Integer(chart.timing.iterates as i64),
            Cell::Integer(chart.timing.threads as i64),
            Cell::number(chart.timing.seconds, 3),
            Cell::number(chart.timing.nanoseconds_per_iterate(), 3),
        ])?;
    }
    Ok(table)
}

fn cells(chart: &Chart) -> CellChart {
    let own = chart.cells.iter().map(|cell| Category::of(chart, cell));
    let mut categories: Vec<_> = own.collect();
    let mut found = distinct(&categories);
    if found.len() > MOST_CATEGORIES {
        let grouped = categories.iter().map(|category| category.map(Category::grouped));
        categories = grouped.collect();
        found = distinct(&categories);
    }
    let place = |category| found.binary_search(&category).ok();
    let [horizontal, vertical] = &chart.axes;
    CellChart {
        horizontal: edges(&horizontal.offsets),
        vertical: edges(&vertical.offsets),
        columns: horizontal.offsets.len(),
        rows: vertical.offsets.len(),
        cells: categories.iter().map(|&cell| cell.and_then(place)).collect(),
        names: found.iter().map(|category| category.words(chart.longest_period)).collect(),
        grey: found.binary_search(&Category::Outside).ok(),
    }
}

/// Every category that occurs, in order.
fn distinct(categories: &[Option<Category>]) -> Vec<Category> {
    let mut found: Vec<Category> = categories.iter().copied().flatten().collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Edges of the cells of an axis, whose centres are these.
pub(super) fn edges(offsets: &[f64]) -> (f64, f64) {
    match *offsets {
        [first, second, ..] => {
            let half = 0.5 * (second - first);
            (first - half, offsets[offsets.len() - 1] + half)
        }
        [only] => (only - 0.5, only + 0.5),
        [] => (0.0, 1.0),
    }
}

fn axis(axis: &ChartAxis) -> Axis {
    let letter = symbol(&axis.parameter);
    let (low, high) = edges(&axis.offsets);
    Axis::linear(format!("{letter} − {letter}*")).with_range(low, high)
}
