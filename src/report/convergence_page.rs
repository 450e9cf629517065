//! Convergence study as tables, figures and page sections.

use super::choice::{accuracy_words, chosen_words, sections_words, shape_word, validity_words};
use super::figure::{Annotation, Axis, Figure, Guide, Marker, Palette, Series, Stroke};
use super::table::ByColumn;
use super::{Cell, Column, Section, Table};
use crate::convergence::{
    ConvergenceStudy, DepthAccuracy, FactorRate, OrderResult, ParetoPoint, Validity,
};
use crate::model::Shape;

/// Factor by which an expected slope is drawn below the measured errors.
const BELOW: f64 = 0.25;

/// Study without measured times, which is reproducible.
pub fn without_times(study: &ConvergenceStudy) -> ConvergenceStudy {
    let mut study = study.clone();
    (study.multiply_add_ns, study.direct.period_ns) = (f64::NAN, f64::NAN);
    if let Some(taylor) = &mut study.direct_by_taylor {
        taylor.period_ns = f64::NAN;
    }
    study.chosen.seconds = f64::NAN;
    let sections = study.sections.iter_mut();
    for choice in sections.filter_map(|section| section.choice.as_mut()) {
        choice.seconds = f64::NAN;
    }
    study.pareto.clear();
    for order in &mut study.orders {
        (order.step_ns, order.floor_ns) = (f64::NAN, f64::NAN);
    }
    study
}

/// Table of every pair of orders and shape: error, rate, cost.
pub fn convergence_table(study: &ConvergenceStudy) -> Table {
    let all: Vec<&OrderResult> = study.orders.iter().collect();
    order_table(&all)
}

/// Study as text.
pub fn convergence_text(study: &ConvergenceStudy) -> String {
    let direct = format!(
        "direct simulation ({}): {:.0} ns a return, error {:.1e}",
        study.direct.method, study.direct.period_ns, study.direct.error_estimate
    );
    let sections = match sections_words(study) {
        words if words.is_empty() => words,
        words => words + "\n",
    };
    format!(
        "{}\n{direct}\n{sections}{}\n{}\n\n{}",
        chosen_words(study),
        validity_words(&study.validity),
        accuracy_words(&study.accuracy),
        convergence_table(study).to_text()
    )
}

/// Figures of a study, each with the suffix of its file name and a caption.
pub fn convergence_figures(study: &ConvergenceStudy) -> Vec<(&'static str, Figure, String)> {
    let mut figures = Vec::new();
    if is_measured(&study.discontinuity_rates) {
        let figure =
            rate_figure(&study.discontinuity_rates, "y / y at the edge of the window", "W");
        figures.push((
            "-contact",
            figure,
            "Error of the discontinuity mapping alone, cut at \
            weight W, against double-double flights through the contact; dashed, a little below \
            the range measured on: the expected slope W + 1."
                .to_owned(),
        ));
    }
    if is_measured(&study.smooth_rates) {
        let figure =
            rate_figure(&study.smooth_rates, "distance / distance to the edge of the window", "N");
        figures.push((
            "-smooth",
            figure,
            "Error of P_smooth alone, cut at degree N, against \
            double-double flights with the surface ignored; dashed, a little below the range \
            measured on: the expected slope N + 1."
                .to_owned(),
        ));
    }
    figures.push((
        "-speed",
        speed_figure(study),
        "Largest error on the window against the time of \
        one step, parameters frozen, interpreted in process; the points nearest to the lower left \
        corner are worth having, and labelled."
            .to_owned(),
    ));
    if let Some(figure) = accuracy_figure(&study.accuracy) {
        figures.push((
            "-depth",
            figure,
            "Largest error of the chosen map and of direct simulation \
            in double precision, both against double-double, in windows that shrink with their \
            depth."
                .to_owned(),
        ));
    }
    figures
}

/// Whether a factor has measured errors.
fn is_measured(rates: &[FactorRate]) -> bool {
    rates.iter().any(|factor| !factor.errors.is_empty())
}

/// Page section about a study.
pub fn convergence_section(study: &ConvergenceStudy) -> Section {
    let excluded = match study.sample.excluded {
        0 => String::new(),
        count => format!(
            " {count} further points were left out: about contacts other than those of the \
                grazing passages a local map has nothing to say."
        ),
    };
    let mut section = Section::new("Distance from direct simulation").prose(format!(
        "Maps of {} pairs of orders were compared with direct simulation in double-double at {} \
            points that fill the window.{excluded} {}",
        study.orders.len(),
        study.sample.points,
        chosen_words(study)
    ));
    section = section.table(
        page_table(&diagonal(study)),
        "Factored maps whose orders grow \
        together: error of one image over the window, its rate in y measured beside the one \
        expected, time of a step with the parameters frozen, interpreted in process.",
    );
    for (_, figure, caption) in convergence_figures(study) {
        section = section.figure(figure, caption);
    }
    section = section.table(rate_table(study), "Measured exponents of the errors of both factors.");
    section = section
        .table(
            pareto_table(study),
            "Speed against accuracy: the maps that no other one beats in both, and direct \
                simulation.",
        )
        .table(
            validity_table(&study.validity),
            "The largest window on which the chosen map stays within the tolerance; below the \
                first row each width alone, all else being that of the scaled window.",
        )
        .prose(format!("{} {}", validity_words(&study.validity), accuracy_words(&study.accuracy)));
    section.prose(format!(
        "Direct simulation ({}) takes {:.0} ns a return and differs from double-double by up to \
            {:.1e} on the same points.",
        study.direct.method, study.direct.period_ns, study.direct.error_estimate
    ))
}

/// Maps evaluated stage by stage on the diagonal of orders, `W = N + 1`.
fn diagonal(study: &ConvergenceStudy) -> Vec<&OrderResult> {
    let with = |order: &&OrderResult| {
        order.shape != Shape::Composed
            && order.orders.contact_weight == order.orders.smooth_order + 1
    };
    study.orders.iter().filter(with).collect()
}

/// Table with a row for each pair of orders; its first columns hold the orders.
fn ordered<'a>(orders: &[&'a OrderResult]) -> ByColumn<&'a OrderResult> {
    Table::of(orders.iter().copied())
        .count("N", |order| order.orders.smooth_order)
        .count("W", |order| order.orders.contact_weight)
}

fn order_table(orders: &[&OrderResult]) -> Table {
    let table = ordered(orders)
        .text("shape", |order| shape_word(order.shape))
        .number("largest error", 3, |order| finite(order.error.max))
        .number("median error", 3, |order| finite(order.error.median))
        .number("measured rate", 4, |order| finite(order.rate.measured))
        .number("±", 2, |order| finite(order.rate.uncertainty))
        .number("expected rate", 3, |order| order.rate.expected)
        .count("coefficients", |order| order.coefficients)
        .count("operations", |order| order.operations)
        .number("step", 3, |order| finite(order.step_ns))
        .unit("ns")
        .number("floor", 3, |order| finite(order.floor_ns))
        .unit("ns");
    table.made()
}

/// Table with as many columns as a page has room for; the CSV holds all.
fn page_table(orders: &[&OrderResult]) -> Table {
    let table = ordered(orders)
        .number("largest error", 3, |order| finite(order.error.max))
        .number("median error", 3, |order| finite(order.error.median))
        .number("rate", 4, |order| finite(order.rate.measured))
        .number("expected", 3, |order| order.rate.expected)
        .count("coefficients", |order| order.coefficients)
        .number("step", 3, |order| finite(order.step_ns))
        .unit("ns");
    table.made()
}

fn rate_table(study: &ConvergenceStudy) -> Table {
    let factors = [
        ("D, in y", &study.discontinuity_rates),
        ("P_smooth, in the distance", &study.smooth_rates),
    ];
    let measured = factors.into_iter().filter(|(_, rates)| is_measured(rates));
    let rates = measured.flat_map(|(name, rates)| rates.iter().map(move |rate| (name, rate)));
    let table = Table::of(rates)
        .text("factor", |(name, _)| name)
        .count("order", |(_, of)| of.order)
        .number("measured", 4, |(_, of)| finite(of.rate.measured))
        .number("±", 2, |(_, of)| finite(of.rate.uncertainty))
        .number("expected", 3, |(_, of)| of.rate.expected);
    table.made()
}

/// Finite value, or `None`.
fn finite(value: impl Into<Option<f64>>) -> Option<f64> {
    value.into().filter(|value| value.is_finite())
}

/// Figure of error against size, one curve per order, each with its expected slope over the
/// measured range.
fn rate_figure(rates: &[FactorRate], size: &str, letter: &str) -> Figure {
    let mut figure = Figure::new(Axis::log10(size), Axis::log10("error of one image"));
    figure.palette = Palette::Sequential;
    for (index, factor) in rates.iter().enumerate() {
        let name = format!("{letter} = {}", factor.order);
        figure.series.push(Series::line_with_markers(
            name,
            Marker::numbered(index),
            factor.errors.clone(),
        ));
        figure.guides.extend(expected_slope(factor));
    }
    if !figure.guides.is_empty() {
        figure.strokes.push((Stroke::Dashed, "expected slope".to_owned()));
    }
    figure
}

fn expected_slope(factor: &FactorRate) -> Option<Guide> {
    let [low, high] = factor.rate.range?;
    let within =
        |point: &&[f64; 2]| point[0] >= low * 0.999 && point[0] <= high * 1.001 && point[1] > 0.0;
    let last = factor.errors.iter().filter(within).min_by(|a, b| a[0].total_cmp(&b[0]))?;
    // NOTE: a guide on the measured points would hide them, so it is drawn slightly below.
    Some(Guide::Slope {
        through: [last[0], BELOW * last[1]],
        exponent: factor.rate.expected,
        to: high,
        label: String::new(),
    })
}

/// Figure of error against time. The cheapest map of each accuracy is labelled.
fn speed_figure(study: &ConvergenceStudy) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("time of one step (ns)"),
        Axis::log10("largest error on the window"),
    );
    for (shape, marker) in [
        (Shape::Factored, Marker::Circle),
        (Shape::Composed, Marker::Square),
        (Shape::Flown, Marker::Triangle),
    ] {
        let points: Vec<[f64; 2]> =
            study.orders.iter().filter(|order| order.shape == shape).filter_map(place).collect();
        if !points.is_empty() {
            figure.series.push(Series::markers(shape_word(shape), marker, points));
        }
    }
    for direct in study.direct_by_taylor.iter().chain([&study.direct]) {
        figure.series.push(Series::markers(
            direct_words(&direct.method),
            Marker::Diamond,
            vec![[direct.period_ns, direct.error_estimate]],
        ));
    }
    let best = frontier(study);
    let line: Vec<_> = best.iter().copied().filter_map(place).collect();
    if line.len() > 1 {
        let words = "none is faster and more exact";
        figure.series.push(Series::line(words, Stroke::Solid, line).in_grey());
    }
    for order in best {
        let (n, w) = (order.orders.smooth_order, order.orders.contact_weight);
        let text = format!("N = {n}, W = {w}");
        figure.annotations.extend(place(order).map(|at| Annotation { at, text, marker: None }));
    }
    figure
        .guides
        .push(Guide::Horizontal { at: study.chosen.tolerance, label: "tolerance".to_owned() });
    figure
}

fn direct_words(method: &str) -> String {
    format!("direct, f64, {method}")
}

fn place(order: &OrderResult) -> Option<[f64; 2]> {
    order.error.max.map(|error| [order.step_ns, error])
}

/// Maps that no other map beats in both time and error, at least a decade of error apart.
fn frontier(study: &ConvergenceStudy) -> Vec<&OrderResult> {
    let mut orders: Vec<&OrderResult> =
        study.orders.iter().filter(|order| order.error.max.is_some()).collect();
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

/// Table of the Pareto front, fastest map first, direct simulation last.
fn pareto_table(study: &ConvergenceStudy) -> Table {
    let method = |point: &ParetoPoint| match &point.map {
        Some(map) => shape_word(map.shape).to_owned(),
        None => direct_words(point.direct.as_deref().unwrap_or_default()),
    };
    let order = |order: Option<u32>| order.map_or(Cell::Missing, |n| Cell::Integer(n.into()));
    let orders = |point: &ParetoPoint| point.map.as_ref().map(|map| map.orders);
    let table = Table::of(&study.pareto)
        .text("method", method)
        .column(Column::number("N"), |point| order(orders(point).map(|of| of.smooth_order)))
        .column(Column::number("W"), |point| order(orders(point).map(|of| of.contact_weight)))
        .number("step", 3, |point| finite(point.step_ns))
        .unit("ns")
        .number("largest error", 3, |point| finite(point.error));
    table.made()
}

/// Table of the window's scale factor, then of every half-width.
fn validity_table(validity: &Validity) -> Table {
    let whole = [("factor of the scene's window", validity.scale), ("depth y²", validity.depth)];
    let widths = validity.state.iter().chain(&validity.parameter);
    let widths = widths.map(|(name, width)| (name.as_str(), *width));
    let table = Table::of(whole.into_iter().chain(widths)).text("window", |(name, _)| name).number(
        "largest",
        3,
        |(_, width)| finite(width),
    );
    table.made()
}

/// Figure of the errors of map and direct simulation against depth; `None` without windows.
fn accuracy_figure(accuracy: &DepthAccuracy) -> Option<Figure> {
    let windows = || accuracy.windows.iter();
    windows().next()?;
    let mut figure =
        Figure::new(Axis::log10("depth of the window"), Axis::log10("largest error of one image"));
    for (name, marker, points) in [
        ("map", Marker::Circle, windows().map(|w| [w.depth, w.map]).collect::<Vec<_>>()),
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
