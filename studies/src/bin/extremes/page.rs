//! Table and figures of the study of extremes.

use grazemap::report::figure::{Axis, Figure, Marker, Series, Stroke};
use grazemap::report::{Cell, Column, ReportError, Table};
use grazemap_studies::extremes::data::{
    Coefficients, ExtremeAxis, ExtremeOutcome, ExtremeRow, Measured,
};

/// Axes, in the order of the study.
const AXES: [ExtremeAxis; 11] = [
    ExtremeAxis::Depth,
    ExtremeAxis::Restitution,
    ExtremeAxis::Damping,
    ExtremeAxis::Resonance,
    ExtremeAxis::NormalAcceleration,
    ExtremeAxis::Multiplier,
    ExtremeAxis::Frequency,
    ExtremeAxis::Stiffness,
    ExtremeAxis::Orders,
    ExtremeAxis::Scale,
    ExtremeAxis::Coefficients,
];

/// Number of promised digits below which the window counts as too deep.
const FEW_DIGITS: f64 = 2.0;

/// Table with one row per case: measured and promised digits, or the refusal.
///
/// # Errors
///
/// Never in practice: every row has one cell for every column.
pub(crate) fn table(rows: &[ExtremeRow]) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![
        Column::text("axis"),
        Column::number("value"),
        Column::text("scene"),
        Column::number("N"),
        Column::number("W"),
        Column::number("y²"),
        Column::text("coefficients"),
        Column::number("graze"),
        Column::number("contact"),
        Column::number("promised"),
        Column::number("map"),
        Column::number("promised of map"),
        Column::text("said"),
    ]);
    for row in rows {
        table.push(cells(row));
    }
    Ok(table)
}

fn cells(row: &ExtremeRow) -> Vec<Cell> {
    let mut cells = vec![
        Cell::text(words(row.axis)),
        Cell::number(row.value, 2),
        Cell::text(&row.scene),
        Cell::Integer(row.orders.smooth_order.into()),
        Cell::Integer(row.orders.contact_weight.into()),
        Cell::number(row.depth, 2),
        Cell::text(coefficients_word(row.coefficients)),
    ];
    match &row.outcome {
        ExtremeOutcome::Measured(measured) => cells.extend([
            digits(measured.grazing),
            digits(told(measured.contact, measured.contact_truth)),
            digits(Some(measured.promised())),
            digits(measured.map.and_then(|map| told(map, measured.map_truth))),
            digits(measured.map.map(|_| measured.promised_of_map())),
            Cell::text(verdict(measured)),
        ]),
        ExtremeOutcome::Refused { stage, message } => {
            cells.extend([const { Cell::Missing }; 5]);
            cells.push(Cell::text(format!("{stage}: {message}")));
        }
    }
    cells
}

/// Measured digits, at most those of the reference; `None` if the reference has none.
fn told(digits: f64, truth: f64) -> Option<f64> {
    (truth >= 1.0).then(|| digits.min(truth))
}

/// Number with one decimal; missing if not finite.
fn digits(value: Option<f64>) -> Cell {
    let rounded = value.map(|value| (10.0 * value).round() / 10.0);
    rounded.filter(|value| value.is_finite()).map_or(Cell::Missing, |value| Cell::number(value, 3))
}

fn verdict(measured: &Measured) -> &'static str {
    if measured.is_silent_loss() {
        "silent loss"
    } else if measured.truncation < FEW_DIGITS {
        "window too deep"
    } else {
        ""
    }
}

fn coefficients_word(coefficients: Coefficients) -> &'static str {
    match coefficients {
        Coefficients::Single => "f32",
        Coefficients::Double => "f64",
        Coefficients::DoubleDouble => "double-double",
    }
}

/// Numbers of cases measured, refused, and silently inaccurate, as text.
pub(crate) fn summary(rows: &[ExtremeRow]) -> String {
    let is_refused = |row: &&ExtremeRow| matches!(row.outcome, ExtremeOutcome::Refused { .. });
    let is_silent = |row: &&ExtremeRow| match &row.outcome {
        ExtremeOutcome::Measured(measured) => measured.is_silent_loss(),
        ExtremeOutcome::Refused { .. } => false,
    };
    let refused = rows.iter().filter(is_refused).count();
    let measured = rows.len() - refused;
    let silent = rows.iter().filter(is_silent).count();
    format!("{measured} cases measured, {refused} refused, {silent} silent losses")
}

/// Name of an axis, for people.
fn words(axis: ExtremeAxis) -> &'static str {
    match axis {
        ExtremeAxis::Depth => "depth y²",
        ExtremeAxis::Restitution => "restitution r",
        ExtremeAxis::Damping => "damping zeta",
        ExtremeAxis::Resonance => "resonance, omega - 1",
        ExtremeAxis::NormalAcceleration => "h'' over its usual size",
        ExtremeAxis::Multiplier => "double multiplier 1, omega - 1/2",
        ExtremeAxis::Frequency => "frequency omega",
        ExtremeAxis::Stiffness => "stiffness ratio k2/k1",
        ExtremeAxis::Orders => "orders N = W",
        ExtremeAxis::Scale => "scale of lengths",
        ExtremeAxis::Coefficients => "bits of the coefficients",
    }
}

/// Name of an axis, for files.
fn stem(axis: ExtremeAxis) -> &'static str {
    match axis {
        ExtremeAxis::Depth => "depth",
        ExtremeAxis::Restitution => "restitution",
        ExtremeAxis::Damping => "damping",
        ExtremeAxis::Resonance => "resonance",
        ExtremeAxis::NormalAcceleration => "normal-acceleration",
        ExtremeAxis::Multiplier => "multiplier",
        ExtremeAxis::Frequency => "frequency",
        ExtremeAxis::Stiffness => "stiffness",
        ExtremeAxis::Orders => "orders",
        ExtremeAxis::Scale => "scale",
        ExtremeAxis::Coefficients => "coefficients",
    }
}

/// Figures, one per axis, with the stem of its file name: measured and promised digits of the
/// contact.
pub(crate) fn figures(rows: &[ExtremeRow]) -> Vec<(&'static str, Figure)> {
    let figure = |axis: ExtremeAxis| {
        let rows: Vec<_> = rows.iter().filter(|row| row.axis == axis).collect();
        (!rows.is_empty()).then(|| (stem(axis), axis_figure(axis, &rows)))
    };
    AXES.into_iter().filter_map(figure).collect()
}

fn axis_figure(axis: ExtremeAxis, rows: &[&ExtremeRow]) -> Figure {
    let horizontal = match axis {
        ExtremeAxis::Orders | ExtremeAxis::Coefficients => Axis::linear(words(axis)),
        _ => Axis::log10(words(axis)),
    };
    let mut figure = Figure::new(horizontal, Axis::linear("digits of the contact's correction"));
    for (index, (name, rows)) in by_curve(axis, rows).iter().enumerate() {
        let points = |of: fn(&Measured) -> Option<f64>| {
            let measured = rows.iter().filter_map(|row| match &row.outcome {
                ExtremeOutcome::Measured(measured) => Some([row.value, of(measured)?]),
                ExtremeOutcome::Refused { .. } => None,
            });
            measured.collect::<Vec<_>>()
        };
        let found = points(|measured| told(measured.contact, measured.contact_truth));
        let found = Series::markers(name, Marker::numbered(index), found);
        let promised = points(|measured| Some(measured.promised()));
        let promised = Series::line(format!("{name}, promised"), Stroke::Solid, promised);
        figure.series.push(found.with_color(index));
        figure.series.push(promised.with_color(index));
    }
    figure
}

/// Curves of a figure: consecutive rows of one scene. A value that repeats begins a new curve.
fn by_curve<'a>(axis: ExtremeAxis, rows: &[&'a ExtremeRow]) -> Vec<(String, Vec<&'a ExtremeRow>)> {
    let mut curves: Vec<(String, Vec<&ExtremeRow>)> = Vec::new();
    for &row in rows {
        let name = match axis {
            ExtremeAxis::Stiffness | ExtremeAxis::NormalAcceleration => {
                format!("{}, y² = {}", row.scene, format_args!("{:e}", row.depth))
            }
            _ => row.scene.clone(),
        };
        match curves.last_mut() {
            Some((last, rows)) if *last == name && rows[0].value != row.value => rows.push(row),
            _ => curves.push((name, vec![row])),
        }
    }
    curves
}
