//! Fits to measured points and orbits under noise: text, tables and figures.

use super::Table;
use super::diagram_figure::offset_axis;
use super::figure::{Axis, Figure, Series, Stroke, symbol};
use crate::analysis::fit::{Fit, FitEnd, misfit};
use crate::analysis::noise::{NoiseRequest, NoisyOrbits};
use crate::expansion::LocalMap;

/// Significant digits of estimates.
const DIGITS: usize = 6;

/// Table of the fitted parameters, one row each.
pub fn fit_table(fit: &Fit) -> Table {
    let table = Table::of(&fit.parameters)
        .text("parameter", |fitted| &fitted.parameter)
        .number("offset", DIGITS, |fitted| fitted.offset)
        .number("value", 12, |fitted| fitted.value)
        .number("standard_error", 3, |fitted| fitted.standard_error);
    table.made()
}

/// Fit as text.
pub fn fit_text(map: &LocalMap, fit: &Fit) -> String {
    let names = &map.section.coordinates;
    let pairs = |values: &[f64]| {
        let pairs = names.iter().zip(values);
        pairs.map(|(name, value)| format!("{name} {value:.3e}")).collect::<Vec<_>>().join(", ")
    };
    let known = if fit.noise_is_known { "stated" } else { "estimated" };
    let mut text = format!(
        "{}\n{} numbers in {} pieces, {} steps; sum of squares {:.1} at {} degrees of freedom\n\
         noise, {known}: {}\n",
        fit_table(fit).to_text(),
        fit.measured,
        fit.pieces,
        fit.steps,
        fit.sum_of_squares,
        fit.freedom,
        pairs(&fit.noise)
    );
    if let Some(withheld) = &fit.withheld {
        text.push_str(&format!(
            "{} points that were not fitted: error of their prediction over the noise {}\n",
            withheld.points,
            pairs(&withheld.error_over_noise)
        ));
    }
    text
}

/// Warnings about a fit; `by_map_alone` if no return is simulated.
pub fn fit_remarks(fit: &Fit, by_map_alone: bool) -> Vec<String> {
    let end = fit.end.words().map(|words| format!("warning: {words}"));
    let outside = outside_words(fit.outside).filter(|_| by_map_alone);
    let estimated = (!fit.noise_is_known && fit.end == FitEnd::Converged).then(|| {
        "note: the noise is estimated from the residuals, so that a false minimum cannot be told; \
         state the noise where it is known"
            .to_owned()
    });
    let (sum, freedom) = (fit.sum_of_squares, fit.freedom as f64);
    let is_small =
        fit.noise_is_known && fit.end == FitEnd::Converged && misfit(sum, freedom) < -1.0;
    let small = is_small.then(|| {
        format!(
            "warning: the sum of squares is {sum:.1} where {freedom} was to be expected: the noise \
             is smaller than stated"
        )
    });
    [end, outside, estimated, small].into_iter().flatten().collect()
}

/// Table of the densities of the coordinates, one row per cell.
pub fn noise_table(map: &LocalMap, request: &NoiseRequest, found: &NoisyOrbits) -> Table {
    let coordinates = map.section.coordinates.iter().enumerate();
    let cells = coordinates.flat_map(|(coordinate, name)| {
        densities(request, found, coordinate).map(move |cell| (name, cell))
    });
    let table = Table::of(cells)
        .text("coordinate", |(name, _)| name)
        .number("from", DIGITS, |(_, ([from, _], ..))| from)
        .number("to", DIGITS, |(_, ([_, to], ..))| to)
        .count("count", |(_, (_, count, _))| count)
        .number("density", DIGITS, |(_, (.., density))| density);
    table.made()
}

/// Figures of the density of every coordinate, with the suffix of each file name.
pub fn noise_figures(
    map: &LocalMap,
    request: &NoiseRequest,
    found: &NoisyOrbits,
) -> Vec<(String, Figure)> {
    let figure = |(coordinate, name): (usize, &String)| {
        let mut figure = Figure::new(offset_axis(name), Axis::linear("density"));
        let cells = densities(request, found, coordinate);
        let steps = cells.flat_map(|(ends, _, density)| ends.map(|end| [end, density]));
        figure.series.push(Series::line(symbol(name), Stroke::Solid, steps.collect()));
        (if coordinate == 0 { String::new() } else { format!("-{name}") }, figure)
    };
    map.section.coordinates.iter().enumerate().map(figure).collect()
}

/// Orbits under noise, as text.
pub fn noise_text(map: &LocalMap, found: &NoisyOrbits) -> String {
    let mut text = format!(
        "{} returns counted; contact in {:.4} % of them, {:.4} % by the map\n",
        found.points,
        100.0 * found.contacts,
        100.0 * found.by_map
    );
    for (number, name) in map.section.coordinates.iter().enumerate() {
        text.push_str(&format!(
            "{name}: mean {:.6e}, standard deviation {:.6e}\n",
            found.mean[number],
            found.covariance[number][number].max(0.0).sqrt()
        ));
    }
    text
}

/// Warnings about orbits under noise; `by_map_alone` if no return is simulated.
pub fn noise_remarks(found: &NoisyOrbits, by_map_alone: bool) -> Vec<String> {
    let outside = outside_words(found.outside).filter(|_| by_map_alone);
    let ended = (found.ended > 0)
        .then(|| format!("warning: {} orbits ended early, without an image", found.ended));
    outside.into_iter().chain(ended).collect()
}

/// Warning with the share of returns that begin outside the window, if any.
fn outside_words(share: f64) -> Option<String> {
    (share > 0.0).then(|| {
        format!(
            "warning: {:.2} % of the returns begin outside the window, where the map has not been \
             measured; guarded iteration simulates them",
            100.0 * share
        )
    })
}

/// Cells of a coordinate: ends, counts and densities.
fn densities(
    request: &NoiseRequest,
    found: &NoisyOrbits,
    coordinate: usize,
) -> impl Iterator<Item = ([f64; 2], u64, f64)> {
    let [first, last] = request.ranges[coordinate];
    let edge = move |edge: usize| first + (last - first) * edge as f64 / request.cells as f64;
    found.marginals[coordinate].iter().enumerate().map(move |(cell, &count)| {
        let (from, to) = (edge(cell), edge(cell + 1));
        ([from, to], count, count as f64 / found.points as f64 / (to - from))
    })
}
