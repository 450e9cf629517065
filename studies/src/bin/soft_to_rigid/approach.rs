//! Approach to the rigid stop: difference over its law, contact time over its limit, errors of both
//! maps.

use std::f64::consts::PI;

use grazemap::report::figure::{Axis, Figure, Guide, Marker, Series, SeriesStyle, Stroke};
use grazemap::report::{Cell, Column, ReportError, Table};
use grazemap_studies::soft_to_rigid::law::approach_law;

use crate::error::{DEEPEST, Measured};

/// Number of points per decade of `y`.
const PER_DECADE: i32 = 4;
/// Weights of the errors.
const WEIGHTS: [u32; 4] = [4, 8, 16, 24];

/// Measurements at one stiffness and depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    stiffness: f64,
    y: f64,
    /// Ratio of `y` to its value at which the contact turns stiff.
    scaled: f64,
    /// Contact time over half a period of the contact.
    contact: f64,
    /// Ratio of `D_soft − D_rigid` to its law, for `w` and `v`.
    ratio: [f64; 2],
    /// Errors of the series by weight, then the error of the rigid stop.
    errors: [f64; 5],
}

/// Samples on a grid of depths, from a thousandth of the series' radius to `1e4` times the depth at
/// which the contact turns stiff.
pub(crate) fn samples(family: &[Measured<'_>]) -> Vec<Sample> {
    let of = |stop: &Measured<'_>| {
        let softest = (stop.law_radius() / stop.turn()).log10().floor() as i32 - 3;
        let grid = (softest * PER_DECADE..=4 * PER_DECADE).map(|k| {
            let exponent = f64::from(k) / f64::from(PER_DECADE);
            10f64.powf(exponent) * stop.turn()
        });
        grid.filter(|y| *y <= DEEPEST).map(|y| sample(stop, y)).collect::<Vec<_>>()
    };
    family.iter().flat_map(of).collect()
}

fn sample(stop: &Measured<'_>, y: f64) -> Sample {
    let (soft, rigid) = stop.jumps(y);
    let law = approach_law(&stop.stop, &soft, stop.stiffness, stop.family.stop_damping());
    let errors = WEIGHTS.map(|weight| stop.series_error(weight, y));
    Sample {
        stiffness: stop.stiffness,
        y,
        scaled: y / stop.turn(),
        contact: soft.contact_time.to_f64() * stop.stiffness.sqrt() / PI,
        ratio: [0, 1].map(|k| (soft.change[k] - rigid.change[k]).to_f64() / law[k]),
        errors: std::array::from_fn(|k| match errors.get(k) {
            Some(error) => *error,
            None => stop.rigid_error(y),
        }),
    }
}

/// Table of the samples.
pub(crate) fn sample_table(samples: &[Sample]) -> Result<Table, ReportError> {
    let mut columns: Vec<_> =
        ["k2", "y", "y/y_s", "contact time k2^(1/2)/pi", "dw over law", "dv over law"]
            .map(Column::number)
            .into();
    columns.extend(WEIGHTS.map(|weight| Column::number(format!("error, W = {weight}"))));
    columns.push(Column::number("error, rigid"));
    let mut table = Table::new(columns);
    for sample in samples {
        let mut row = vec![sample.stiffness, sample.y, sample.scaled, sample.contact];
        row.extend(sample.ratio.iter().chain(&sample.errors));
        table.push(row.into_iter().map(|value| Cell::number(value, 4)).collect());
    }
    Ok(table)
}

/// Figure of the difference over its law against the scaled depth: one curve for all stiffnesses,
/// `(2/π) atan`.
pub(crate) fn collapse_figure(samples: &[Sample]) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("y / y_{s},  y_{s} = (a / 2k_{2})^{1/2}"),
        Axis::linear("jump of v, soft − rigid, over its law for k_{2} → ∞").with_range(0.0, 1.05),
    );
    figure.title = "Family A: every stiffness falls on one curve".to_owned();
    let curve = (-30..=40).map(|k| 10f64.powf(f64::from(k) / 10.0));
    let curve = curve.map(|scaled| [scaled, 2.0 / PI * scaled.atan()]);
    figure.series.push(Series::line("(2/π) arctan(y/y_{s})", Stroke::Solid, curve.collect()));
    for (index, decade) in [2, 4, 6, 8].into_iter().enumerate() {
        let stiffness = 10f64.powi(decade);
        let points = samples.iter().filter(|sample| sample.stiffness == stiffness);
        let points = points.map(|sample| [sample.scaled, sample.ratio[1]]);
        let name = format!("k_{{2}} = 10^{{{decade}}}");
        figure.series.push(Series::markers(name, Marker::numbered(index), points.collect()));
    }
    figure
}

/// Figure of the errors of series and rigid stop against the scaled depth, at one stiffness.
pub(crate) fn error_figure(name: &str, samples: &[Sample], decade: i32) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("y / y_{s}"),
        Axis::log10("error of the jump of v, relative").with_range(1e-12, 1e4),
    );
    figure.title = format!("Family {name}, k_{{2}} = 10^{{{decade}}}: no map serves in between");
    let chosen = || samples.iter().filter(move |sample| sample.stiffness == 10f64.powi(decade));
    for (column, weight) in WEIGHTS.into_iter().enumerate() {
        let points = chosen().map(|sample| [sample.scaled, sample.errors[column]]);
        figure.series.push(Series {
            style: SeriesStyle::LineWithMarkers(Stroke::Solid, Marker::numbered(column)),
            ..Series::line(format!("series, W = {weight}"), Stroke::Solid, points.collect())
        });
    }
    let rigid = chosen().map(|sample| [sample.scaled, sample.errors[4]]);
    figure.series.push(Series::line("rigid stop, r = 1", Stroke::Dashed, rigid.collect()));
    figure.guides.push(Guide::Horizontal { at: 1.0, label: "no contact at all".to_owned() });
    figure
}
