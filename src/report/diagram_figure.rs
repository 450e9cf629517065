//! Bifurcation diagrams as figures, tables and arrays.

use super::figure::{Annotation, Axis, AxisScale, Figure, Guide, Series, ShiftedScale, symbol};
use super::table::ByColumn;
use super::{Cell, Column, ReportError, Rows, Table, npy_bytes};
use crate::analysis::diagram::{Diagram, DiagramPoint, Sweep, SweepHeading, Timing};
use crate::iteration::{OrbitEnd, Period};
use crate::model::Method;

/// Methods of sweeps, with the suffixes of their file names.
const METHODS: [(Method, &str); 4] = [
    (Method::Guarded, "-guarded"),
    (Method::Map, "-map"),
    (Method::Direct, "-direct"),
    (Method::Atlas, "-atlas"),
];

/// Figures of a diagram, each with the suffix of its file name.
///
/// If several methods were run: one figure of each, one of all, and one of their distance, over the
/// same axis of the parameter. Also a close-up of the graze, if other values are far from it, and
/// the largest Lyapunov exponent, if it was computed. Values of the map alone outside its window
/// are grey. A figure without values is left out.
pub fn diagram_figures(diagram: &Diagram) -> Vec<(&'static str, Figure)> {
    let has = |method| diagram.sweeps.iter().any(|sweep| sweep.method == method);
    let run: Vec<_> = METHODS.into_iter().filter(|(method, _)| has(*method)).collect();
    let mut figures: Vec<(&'static str, Figure)> = match run[..] {
        [_, _, ..] => run
            .into_iter()
            .map(|(method, ending)| {
                (ending, figure(diagram, |sweep| sweep.method == method, sweep_word))
            })
            .chain([(
                "-overlay",
                figure(diagram, |_| true, |sweep| method_word(sweep.method).into()),
            )])
            .chain(difference_figure(diagram).map(|figure| ("-difference", figure)))
            .collect(),
        _ => vec![("", figure(diagram, |_| true, sweep_word))],
    };
    figures.retain(|(_, figure)| !figure.series.is_empty());
    let whole = figures.iter().find(|(ending, _)| ["", "-overlay"].contains(ending));
    let near = whole.and_then(|(_, figure)| near_graze(figure, diagram.observable_at_graze));
    figures.extend(near.map(|figure| (NEAR_GRAZE, figure)));
    figures.extend(lyapunov_figure(diagram).map(|figure| ("-lyapunov", figure)));
    figures
}

/// One row per sweep and parameter value: attractor, its name, and the observable over one period
/// (over all kept iterates without a period).
///
/// Names count hits at the surfaces of the first diagram; all diagrams of a scene have the same
/// surfaces.
pub fn diagram_rows(diagrams: &[Diagram]) -> Rows<'_> {
    let lengths = diagrams.iter().flat_map(points).map(|(_, point)| distinct(point).count());
    let surfaces = diagrams.first().map_or(&[][..], |diagram| &diagram.surfaces);
    let columns = columns(surfaces, lengths.max().unwrap_or(0));
    let width = columns.len();
    let rows = diagrams.iter().enumerate().flat_map(move |(number, diagram)| {
        let row = move |(sweep, point): (&Sweep, &DiagramPoint)| {
            let mut row = vec![
                Cell::Integer(number as i64 + 1),
                Cell::text(diagram.parameter.clone()),
                Cell::text(method_word(sweep.method)),
                Cell::text(heading_word(sweep.heading)),
                start_cell(sweep.start.as_deref()),
                Cell::number(point.offset, 6),
                period_cell(point.period),
                Cell::Integer(point.kept_contacts.into()),
                point.lyapunov.map_or(Cell::Missing, |value| Cell::number(value, 6)),
                Cell::text(if sweep.is_outside(point) { OUTSIDE } else { end_word(point.end) }),
                share_cell(point.by_map),
                share_cell(point.outside),
                point.orbit.as_ref().map_or(Cell::Missing, |name| Cell::text(name.to_string())),
            ];
            row.extend(distinct(point).map(|value| Cell::number(value, 6)));
            row.resize(width - 2, Cell::Missing);
            row.extend([
                point.returns.map_or(Cell::Missing, |returns| Cell::Integer(returns as i64)),
                point.lyapunov_error.map_or(Cell::Missing, |value| Cell::number(value, 6)),
            ]);
            row
        };
        points(diagram).map(row)
    });
    Rows::new(columns, rows)
}

/// Array of all kept values, of shape (sweeps, points, 1 + keep); the offset comes first. Values
/// are NaN after an early end.
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if a sweep has more values than were asked for.
pub fn diagram_array(diagram: &Diagram) -> Result<Vec<u8>, ReportError> {
    let count = diagram.sweeps.iter().map(|sweep| sweep.points.len()).max().unwrap_or(0);
    let width = diagram.keep + 1;
    let mut values = Vec::with_capacity(diagram.sweeps.len() * count * width);
    for sweep in &diagram.sweeps {
        for point in &sweep.points {
            let row = std::iter::once(point.offset).chain(point.kept_values());
            values.extend(row.chain(std::iter::repeat(f64::NAN)).take(width));
        }
    }
    npy_bytes(&[diagram.sweeps.len(), count, width], &values)
}

/// Table of the times of sweeps.
pub fn diagram_timing_table(diagrams: &[Diagram]) -> Table {
    let sweeps = diagrams.iter().flat_map(|one| one.sweeps.iter().map(move |sweep| (one, sweep)));
    let table = Table::of(sweeps)
        .text("diagram", |(one, _)| format!("{} over {}", one.observable, one.parameter))
        .text("sweep", |(_, sweep)| sweep_word(sweep) + &start_words(sweep))
        .count("values", |(_, sweep)| sweep.points.len())
        .number("by map", 4, |(_, sweep)| 100.0 * sweep.by_map)
        .unit("%")
        .number("outside", 4, |(_, sweep)| 100.0 * sweep.outside)
        .unit("%");
    timed(table, |(_, sweep)| &sweep.timing)
}

/// Adds the columns of measured times.
pub(super) fn timed<'a, R: Copy>(
    table: ByColumn<R>,
    timing: impl Fn(R) -> &'a Timing + Copy,
) -> Table {
    table
        .count("iterates", |of| timing(of).iterates)
        .count("threads", |of| timing(of).threads)
        .number("time", 3, |of| timing(of).seconds)
        .unit("s")
        .number("one iterate", 3, |of| timing(of).nanoseconds_per_iterate())
        .unit("ns")
        .made()
}

fn figure(
    diagram: &Diagram,
    shown: impl Fn(&Sweep) -> bool,
    name: impl Fn(&Sweep) -> String,
) -> Figure {
    let mut figure = Figure::new(parameter_axis(diagram), value_axis(diagram));
    figure.above = Some(value_scale(&diagram.parameter, diagram.grazing_value));
    let alone = diagram.sweeps.iter().filter(|sweep| shown(sweep)).count() == 1;
    let mut outside = Vec::new();
    for sweep in diagram.sweeps.iter().filter(|sweep| shown(sweep)) {
        let name = if alone { method_word(sweep.method).to_owned() } else { name(sweep) };
        let (beyond, trusted) = dots(sweep, |point| point.kept_values().collect());
        add_dots(&mut figure, name, trusted);
        outside.extend(beyond);
    }
    add_outside(&mut figure, outside);
    // NOTE: a logarithmic axis does not reach the graze.
    if !diagram.is_logarithmic {
        figure.guides.push(Guide::Vertical { at: 0.0, label: String::new() });
        figure.annotations.push(Annotation::ring([0.0, diagram.observable_at_graze], GRAZE));
    }
    figure
}

/// Name of the graze in figures.
pub(super) const GRAZE: &str = "GR";

/// Suffix of the file name of a close-up.
pub(super) const NEAR_GRAZE: &str = "-near";

/// Least ratio of the distances from the graze of far values and near ones.
const FAR: f64 = 10.0;

/// Least number of near values that are worth a figure.
const NEAR_VALUES: usize = 20;

/// Close-up of the values near the one at the graze, if the other values lie so far away that they
/// flatten these.
pub(super) fn near_graze(figure: &Figure, graze: f64) -> Option<Figure> {
    let values = figure.series.iter().flat_map(|series| &series.points);
    let mut distances: Vec<f64> = values
        .map(|point| (point[1] - graze).abs())
        .filter(|distance| distance.is_finite() && *distance > 0.0)
        .collect();
    distances.sort_by(f64::total_cmp);
    let gap = distances.windows(2).rposition(|pair| pair[1] > FAR * pair[0])?;
    if gap + 1 < NEAR_VALUES {
        return None;
    }
    let half = 1.1 * distances[gap];
    let mut near = figure.clone();
    near.vertical = near.vertical.with_range(graze - half, graze + half);
    Some(near)
}

/// Figure of the distance between the attractors of each method and those of direct simulation or,
/// without it, of the first method: Hausdorff distance of the sets of values.
fn difference_figure(diagram: &Diagram) -> Option<Figure> {
    let reference = match diagram.sweeps.iter().any(|sweep| sweep.method == Method::Direct) {
        true => Method::Direct,
        false => diagram.sweeps.first()?.method,
    };
    let (mut settled, mut others) = (Vec::new(), Vec::new());
    for (method, _) in METHODS.into_iter().filter(|(method, _)| *method != reference) {
        let (mut same, mut rest) = (Vec::new(), Vec::new());
        for sweep in diagram.sweeps.iter().filter(|sweep| sweep.method == method) {
            let twin = diagram.sweeps.iter().find(|other| {
                let asked = |sweep: &Sweep| (sweep.heading, sweep.start.clone());
                other.method == reference && asked(other) == asked(sweep)
            })?;
            for (point, other) in sweep.points.iter().zip(&twin.points) {
                let Some(distance) = distance(point, other) else { continue };
                let periodic = point.period == other.period && point.period != Period::NotFound;
                let trusted = periodic && !sweep.is_outside(point);
                let dots = if trusted { &mut same } else { &mut rest };
                dots.push([point.offset, distance]);
            }
        }
        settled.push(Series::dots(format!("{}, same period", method_word(method)), same));
        others.extend(rest);
    }
    let words = format!("distance to {}", method_word(reference));
    let mut figure = Figure::new(parameter_axis(diagram), Axis::log10(words));
    figure.size = (760, 300);
    figure.series.push(Series::dots("no period, another, or outside", others).in_grey());
    figure.series.extend(settled);
    figure.series.retain(|series| !series.points.is_empty());
    (!figure.series.is_empty()).then_some(figure)
}

/// Hausdorff distance of two sets of values; `None` if one is empty or they are equal, which a
/// logarithmic axis cannot show.
fn distance(point: &DiagramPoint, other: &DiagramPoint) -> Option<f64> {
    let sorted = |point: &DiagramPoint| {
        let mut values: Vec<f64> = distinct(point).filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(point), sorted(other));
    let one_way = |from: &[f64], to: &[f64]| {
        let nearest = |value: &f64| {
            let place = to.partition_point(|other| other < value);
            let around = to[place.saturating_sub(1)..to.len().min(place + 1)].iter();
            around.map(|other| (other - value).abs()).fold(f64::INFINITY, f64::min)
        };
        from.iter().map(nearest).fold(0.0, f64::max)
    };
    let distance = one_way(&a, &b).max(one_way(&b, &a));
    (distance > 0.0 && distance.is_finite()).then_some(distance)
}

fn lyapunov_figure(diagram: &Diagram) -> Option<Figure> {
    let mut figure = Figure::new(parameter_axis(diagram), exponent_axis(diagram));
    figure.above = Some(value_scale(&diagram.parameter, diagram.grazing_value));
    figure.size = (760, 320);
    let mut outside = Vec::new();
    for sweep in &diagram.sweeps {
        let (beyond, trusted) = dots(sweep, |point| point.lyapunov.into_iter().collect());
        add_dots(&mut figure, sweep_word(sweep), trusted);
        outside.extend(beyond);
    }
    add_outside(&mut figure, outside);
    figure.guides.push(Guide::Horizontal { at: 0.0, label: String::new() });
    if !diagram.is_logarithmic {
        figure.guides.push(Guide::Vertical { at: 0.0, label: GRAZE.to_owned() });
    }
    (!figure.series.is_empty()).then_some(figure)
}

/// Axis of the exponents. It shows zero, where chaos begins.
fn exponent_axis(diagram: &Diagram) -> Axis {
    let axis = Axis::linear("exponent λ per iterate");
    let exponents = points(diagram).filter_map(|(_, point)| point.lyapunov);
    let (lower, upper) = extent(exponents.filter(|value| value.is_finite()).chain([0.0]));
    let margin = 0.06 * (upper - lower);
    if margin > 0.0 { axis.with_range(lower - margin, upper + margin) } else { axis }
}

/// Values of a sweep over the parameter, in two groups: those of the map alone outside its window,
/// and all others.
fn dots(
    sweep: &Sweep,
    values: impl Fn(&DiagramPoint) -> Vec<f64>,
) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let (mut outside, mut trusted) = (Vec::new(), Vec::new());
    for point in &sweep.points {
        let dots = if sweep.is_outside(point) { &mut outside } else { &mut trusted };
        dots.extend(values(point).into_iter().map(|value| [point.offset, value]));
    }
    (outside, trusted)
}

/// Adds values of the map alone outside its window, in grey.
fn add_outside(figure: &mut Figure, dots: Vec<[f64; 2]>) {
    if has_values(&dots) {
        figure.series.push(Series::dots("outside the window", dots).in_grey());
    }
}

fn has_values(dots: &[[f64; 2]]) -> bool {
    dots.iter().any(|[_, value]| value.is_finite())
}

/// Adds dots to the series of this name. Sweeps from several starts share one series.
fn add_dots(figure: &mut Figure, name: String, dots: Vec<[f64; 2]>) {
    if !has_values(&dots) {
        return;
    }
    match figure.series.iter_mut().find(|series| series.name == name) {
        Some(series) => series.points.extend(dots),
        None => figure.series.push(Series::dots(name, dots)),
    }
}

/// Axis of the offset of a variable from the graze.
pub(super) fn offset_axis(name: &str) -> Axis {
    let letter = symbol(name);
    Axis::linear(format!("{letter} − {letter}*"))
}

/// Smallest and largest value; (∞, −∞) if there are none.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

fn parameter_axis(diagram: &Diagram) -> Axis {
    let offsets = diagram.sweeps.iter().flat_map(|sweep| &sweep.points).map(|point| point.offset);
    let (lower, upper) = extent(offsets);
    let mut axis = offset_axis(&diagram.parameter);
    axis.scale = match diagram.is_logarithmic {
        false => AxisScale::Linear,
        true if lower > 0.0 => AxisScale::Log10,
        // NOTE: below the graze the axis is logarithmic in the size, from the smallest offset on.
        true => AxisScale::Symlog { threshold: 0.1 * upper.abs() },
    };
    if lower < upper { axis.with_range(lower, upper) } else { axis }
}

/// Second scale with the values of a parameter or coordinate, beside its offsets.
pub(super) fn value_scale(name: &str, at_graze: f64) -> ShiftedScale {
    ShiftedScale { label: symbol(name), shift: at_graze }
}

/// Axis that covers every value of every sweep.
fn value_axis(diagram: &Diagram) -> Axis {
    let axis = Axis::linear(observable_words(&diagram.observable));
    let points = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
    let values = points.flat_map(|point| &point.values).filter(|value| value.is_finite());
    let (lower, upper) = extent(values.copied());
    let margin = 0.04 * (upper - lower);
    if margin > 0.0 { axis.with_range(lower - margin, upper + margin) } else { axis }
}

pub(super) fn observable_words(observable: &str) -> String {
    match observable {
        "h" => "gap h (below 0: virtual depth)".to_owned(),
        "impact_speed" => "impact speed".to_owned(),
        name if name.chars().all(|c| c.is_alphanumeric() || c == '_') => symbol(name),
        expression => expression.to_owned(),
    }
}

fn columns(surfaces: &[String], values: usize) -> Vec<Column> {
    let mut columns = vec![Column::number("diagram")];
    columns.extend(["parameter", "method", "heading", "start"].map(Column::text));
    columns.extend(["offset", "period", "kept_contacts", "lyapunov"].map(Column::number));
    columns.push(Column::text("end"));
    columns.extend(["by_map", "outside"].map(Column::number));
    columns.push(Column::text(orbit_header(surfaces)));
    columns.extend((1..=values).map(|number| Column::number(format!("value_{number}"))));
    columns.extend(["returns", "lyapunov_error"].map(Column::number));
    columns
}

/// Header `orbit (left,right,periods)`: the order of the counts in names of orbits.
pub(super) fn orbit_header(surfaces: &[String]) -> String {
    let counted = surfaces.iter().map(String::as_str).chain(["periods"]);
    format!("orbit ({})", counted.collect::<Vec<_>>().join(","))
}

fn points(diagram: &Diagram) -> impl Iterator<Item = (&Sweep, &DiagramPoint)> {
    diagram.sweeps.iter().flat_map(|sweep| sweep.points.iter().map(move |point| (sweep, point)))
}

/// Values over one period, or all values without a period.
fn distinct(point: &DiagramPoint) -> impl Iterator<Item = f64> {
    point.kept_values().take(point.returns.unwrap_or(point.kept))
}

pub(super) fn period_cell(period: Period) -> Cell {
    match period {
        Period::Periodic(period) => Cell::Integer(period as i64),
        _ => Cell::Missing,
    }
}

fn sweep_word(sweep: &Sweep) -> String {
    format!("{}, {}", method_word(sweep.method), heading_word(sweep.heading))
}

/// Offsets of the start; missing for a start beside the fixed point of `P_smooth`.
pub(super) fn start_cell(start: Option<&[f64]>) -> Cell {
    start.map_or(Cell::Missing, |offsets| {
        let offsets: Vec<String> = offsets.iter().map(f64::to_string).collect();
        Cell::text(offsets.join(" "))
    })
}

fn start_words(sweep: &Sweep) -> String {
    match start_cell(sweep.start.as_deref()) {
        Cell::Text(offsets) => format!(", from ({})", offsets.replace(' ', ", ")),
        _ => String::new(),
    }
}

pub(super) fn method_word(method: Method) -> &'static str {
    match method {
        Method::Map => "map",
        Method::Guarded => "guarded",
        Method::Direct => "direct simulation",
        Method::Atlas => "atlas",
    }
}

fn heading_word(heading: SweepHeading) -> &'static str {
    match heading {
        SweepHeading::Up => "up",
        SweepHeading::Down => "down",
    }
}

/// Share in as few digits as necessary.
pub(super) fn share_cell(share: f64) -> Cell {
    Cell::text(share.to_string())
}

/// Word for the use of a map outside its window.
pub(super) const OUTSIDE: &str = "outside";

pub(super) fn end_word(end: OrbitEnd) -> &'static str {
    match end {
        OrbitEnd::Completed => "completed",
        OrbitEnd::Escaped { .. } => "escaped",
        OrbitEnd::NoImage { .. } => "no image",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settled_on(values: &[f64]) -> DiagramPoint {
        DiagramPoint {
            offset: 0.0,
            values: values.to_vec(),
            kept: values.len(),
            period: Period::Periodic(values.len()),
            returns: Some(values.len()),
            contacts: None,
            orbit: None,
            kept_contacts: 0,
            lyapunov: None,
            lyapunov_error: None,
            end: OrbitEnd::Completed,
            by_map: 1.0,
            outside: 0.0,
        }
    }

    #[test]
    fn a_far_attractor_makes_a_close_up_of_the_graze() {
        let mut figure = Figure::new(Axis::linear("α"), Axis::linear("h"));
        let value = |k: i32| [f64::from(k), 2.0 + 1e-4 * f64::from(k)];
        figure.series.push(Series::dots("", (0..40).map(value).collect()));
        assert_eq!(near_graze(&figure, 2.0), None);
        figure.series.push(Series::dots("", vec![[0.0, -7.0], [1.0, f64::NAN]]));
        let near = near_graze(&figure, 2.0).expect("a close-up");
        let (lower, upper) = near.vertical.range.expect("a range");
        assert!(lower > 1.9 && upper < 2.1 && upper > 2.0039, "{lower} {upper}");
        figure.series[0].points.truncate(10);
        assert_eq!(near_graze(&figure, 2.0), None);
    }

    #[test]
    fn sets_of_values_are_as_far_apart_as_their_loneliest_value() {
        let apart = |a: &[f64], b: &[f64]| distance(&settled_on(a), &settled_on(b));
        assert_eq!(apart(&[1.0, 3.0], &[3.5, 1.25]), Some(0.5));
        assert_eq!(apart(&[1.0], &[1.0, 4.0]), Some(3.0));
        assert_eq!(apart(&[1.0, 4.0], &[1.0]), Some(3.0));
        assert_eq!(apart(&[2.0, 1.0], &[1.0, 2.0]), None);
        assert_eq!(apart(&[], &[1.0]), None);
    }
}
