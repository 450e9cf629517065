//! Speed against accuracy, and accuracy against the depth, as pictures and tables.

use super::convergence_page::{number, shape_word};
use super::figure::{Annotation, Axis, Figure, Guide, Marker, Series};
use super::{Cell, Column, ReportError, Table};
use crate::convergence::{ConvergenceStudy, DepthAccuracy, OrderResult, Validity};
use crate::model::Shape;

/// Error against time, the cheapest map of each accuracy labelled.
pub(super) fn speed_figure(study: &ConvergenceStudy) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("time of one step (ns)"),
        Axis::log10("largest error on the window"),
    );
    for (shape, marker) in [
        (Shape::Factored, Marker::Circle),
        (Shape::Composed, Marker::Square),
        (Shape::Flown, Marker::Triangle),
    ] {
        let points: Vec<[f64; 2]> = study
            .orders
            .iter()
            .filter(|order| order.shape == shape)
            .filter_map(place)
            .collect();
        if !points.is_empty() {
            figure
                .series
                .push(Series::markers(shape_word(shape), marker, points));
        }
    }
    for direct in study.direct_by_taylor.iter().chain([&study.direct]) {
        figure.series.push(Series::markers(
            direct_words(&direct.method),
            Marker::Diamond,
            vec![[direct.period_ns, direct.error_estimate]],
        ));
    }
    for order in frontier(study) {
        let text = order.orders.to_string();
        figure.annotations.extend(place(order).map(|at| Annotation {
            at,
            text,
            marker: None,
        }));
    }
    figure.guides.push(Guide::Horizontal {
        at: study.chosen.tolerance,
        label: "tolerance".to_owned(),
    });
    figure
}

fn direct_words(method: &str) -> String {
    format!("direct, f64, {method}")
}

fn place(order: &OrderResult) -> Option<[f64; 2]> {
    order.error.max.map(|error| [order.step_ns, error])
}

/// Maps that no other one beats in both time and error, a decade of error apart.
fn frontier(study: &ConvergenceStudy) -> Vec<&OrderResult> {
    let mut orders: Vec<&OrderResult> = study
        .orders
        .iter()
        .filter(|order| order.error.max.is_some())
        .collect();
    orders.sort_by(|a, b| a.step_ns.total_cmp(&b.step_ns));
    let mut best = f64::INFINITY;
    orders.retain(|order| {
        let error = order.error.max.unwrap_or(f64::INFINITY);
        let better = error < 0.2 * best;
        if better {
            best = error;
        }
        better
    });
    orders
}

/// The front: fastest first, direct simulation last.
pub(super) fn pareto_table(study: &ConvergenceStudy) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![
        Column::text("method"),
        Column::number("N"),
        Column::number("W"),
        Column::number("step").with_unit("ns"),
        Column::number("largest error"),
    ]);
    for point in &study.pareto {
        let (method, orders) = match &point.map {
            Some(map) => (
                shape_word(map.shape).to_owned(),
                [map.orders.smooth_order, map.orders.contact_weight]
                    .map(|order| Cell::Integer(order.into())),
            ),
            None => (
                direct_words(point.direct.as_deref().unwrap_or_default()),
                [Cell::Missing, Cell::Missing],
            ),
        };
        let [n, w] = orders;
        table.push(vec![
            Cell::text(method),
            n,
            w,
            number(Some(point.step_ns), 3),
            number(Some(point.error), 3),
        ])?;
    }
    Ok(table)
}

/// The window's factor, then every width alone.
pub(super) fn validity_table(validity: &Validity) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![Column::text("window"), Column::number("largest")]);
    table.push(vec![
        Cell::text("factor of the scene's window"),
        number(validity.scale, 3),
    ])?;
    table.push(vec![Cell::text("depth y²"), number(validity.depth, 3)])?;
    for (name, width) in validity.state.iter().chain(&validity.parameter) {
        table.push(vec![Cell::text(name.clone()), number(*width, 3)])?;
    }
    Ok(table)
}

/// Errors of the map and of direct simulation against the depth; `None` without windows.
pub(super) fn accuracy_figure(accuracy: &DepthAccuracy) -> Option<Figure> {
    let windows = || accuracy.windows.iter();
    windows().next()?;
    let mut figure = Figure::new(
        Axis::log10("depth of the window"),
        Axis::log10("largest error of one image"),
    );
    for (name, marker, points) in [
        (
            "map",
            Marker::Circle,
            windows().map(|w| [w.depth, w.map]).collect::<Vec<_>>(),
        ),
        (
            "direct simulation, f64",
            Marker::Diamond,
            windows().map(|w| [w.depth, w.direct]).collect(),
        ),
    ] {
        let positive = points.into_iter().filter(|point| point[1] > 0.0);
        let series = Series::line_with_markers(name, marker, positive.collect());
        figure.series.push(series);
    }
    Some(figure)
}
