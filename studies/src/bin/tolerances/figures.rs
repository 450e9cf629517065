//! Figures of the page.

use grazemap::model::Shape;
use grazemap::report::figure::{Axis, Figure, Marker, Series, Stroke};

use crate::TOLERANCES;
use crate::measure::Row;
use crate::tables::{median, sorted};

/// Groups of scenes that are drawn in one style.
const GROUPS: [&str; 4] = ["two coordinates", "three to five", "six", "two, contact flown"];

fn group(row: &Row) -> usize {
    match (row.choice.shape, row.coordinates) {
        (Shape::Flown, _) => 3,
        (_, 2) => 0,
        (_, 6) => 2,
        _ => 1,
    }
}

/// Figure of the operations of a frozen step against the tolerance, a line for every scene.
pub(crate) fn cost(rows: &[Row]) -> Figure {
    let mut figure =
        Figure::new(Axis::log10("tolerance"), Axis::log10("operations of a frozen step"));
    figure.title = "What a tolerance costs, scene by scene".to_owned();
    lines(&mut figure, rows, |row| row.choice.operations as f64);
    figure
}

/// Figure of the ratio of a direct return's time to a step's against the tolerance, a line for
/// every scene.
pub(crate) fn speed(rows: &[Row]) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("tolerance"),
        Axis::log10("time of a direct return over that of a step"),
    );
    figure.title = "How much faster than direct simulation in double precision".to_owned();
    lines(&mut figure, rows, |row| row.direct_ns / row.step_ns);
    figure
}

fn lines(figure: &mut Figure, rows: &[Row], value: impl Fn(&Row) -> f64) {
    let mut named = [false; GROUPS.len()];
    for scene in rows.chunk_by(|a, b| a.scene == b.scene) {
        let group = scene.iter().map(group).max().unwrap_or(0);
        let name = if named[group] { "" } else { GROUPS[group] };
        named[group] = true;
        let met = scene.iter().filter(|row| row.choice.met);
        let points = met.map(|row| [row.choice.tolerance, value(row)]);
        let line = Series::line_with_markers(name, Marker::numbered(group), points.collect());
        figure.series.push(line.with_color(group));
    }
}

/// Order of a row.
type Order = fn(&Row) -> u32;
/// Statistic of sorted numbers.
type Statistic = fn(&[f64]) -> f64;

/// Figure of the chosen degrees and weights against the tolerance: median and range over the
/// scenes.
pub(crate) fn orders(rows: &[Row]) -> Figure {
    let mut figure = Figure::new(Axis::log10("tolerance"), Axis::linear("order"));
    figure.title = "Orders of the chosen maps over the scenes, contacts as series".to_owned();
    let kinds: [(&str, Order); 2] = [
        ("N", |row| row.choice.orders.smooth_order),
        ("W", |row| row.choice.orders.contact_weight),
    ];
    for (color, (name, order)) in kinds.into_iter().enumerate() {
        let at = |tolerance: f64| {
            let series =
                rows.iter().filter(|row| row.choice.met && row.choice.shape != Shape::Flown);
            let of = series.filter(|row| row.choice.tolerance == tolerance);
            sorted(of.map(|row| f64::from(order(row))))
        };
        let statistics: [(String, Stroke, Statistic); 3] = [
            (format!("{name}, median"), Stroke::Solid, median),
            (format!("{name}, lowest"), Stroke::Dotted, |values| values[0]),
            (format!("{name}, highest"), Stroke::Dashed, |values| values[values.len() - 1]),
        ];
        for (name, stroke, statistic) in statistics {
            let points = TOLERANCES.map(|tolerance| [tolerance, statistic(&at(tolerance))]);
            figure.series.push(Series::line(name, stroke, points.to_vec()).with_color(color));
        }
    }
    figure
}

/// Figure of the predicted degree against the chosen one.
pub(crate) fn predicted_degrees(rows: &[Row]) -> Figure {
    let pair = |row: &Row| [row.choice.predicted.smooth_order, row.choice.orders.smooth_order];
    predicted("degree N of the legs", rows, pair)
}

/// Figure of the predicted weight against the chosen one.
pub(crate) fn predicted_weights(rows: &[Row]) -> Figure {
    let pair = |row: &Row| [row.choice.predicted.contact_weight, row.choice.orders.contact_weight];
    predicted("weight W of the contacts", rows, pair)
}

fn predicted(what: &str, rows: &[Row], pair: impl Fn(&Row) -> [u32; 2]) -> Figure {
    let mut figure = Figure::new(
        Axis::linear(format!("{what}, predicted")),
        Axis::linear(format!("{what}, chosen")),
    );
    figure.title = format!("The rule: {what}; points side by side are equal");
    let mut highest: f64 = 1.0;
    for (number, tolerance) in TOLERANCES.into_iter().enumerate() {
        let series = rows.iter().filter(|row| row.choice.met && row.choice.shape != Shape::Flown);
        let of = series.filter(|row| row.choice.tolerance == tolerance);
        let mut seen = std::collections::BTreeMap::new();
        let points: Vec<[f64; 2]> = of
            .map(|row| {
                let [predicted, chosen] = pair(row);
                // Equal points are drawn side by side, a twentieth of an order apart.
                let before = seen.entry((predicted, chosen)).or_insert(0);
                *before += 1;
                let shift = 0.05 * f64::from(*before - 1);
                [f64::from(predicted) + shift, f64::from(chosen) + 0.2 * (number as f64 - 1.5)]
            })
            .collect();
        highest = points.iter().flatten().copied().fold(highest, f64::max);
        let name = format!("tolerance 10^{{{:.0}}}", tolerance.log10());
        figure.series.push(Series::markers(name, Marker::numbered(number), points));
    }
    let diagonal = vec![[1.0, 1.0], [highest, highest]];
    figure.series.push(Series::line("equal", Stroke::Solid, diagonal));
    figure
}
