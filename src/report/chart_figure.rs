//! Two-parameter charts as figures, tables and arrays.

use std::cmp::Reverse;
use std::collections::HashMap;

use super::diagram_figure::{
    GRAZE, OUTSIDE, end_word, method_word, offset_axis, orbit_header, period_cell, share_cell,
    start_cell, timed, value_scale,
};
use super::figure::{Annotation, Axis, CellCategory, CellChart, CellColor, ColorBar, Figure};
use super::loci_listing::draw_curves;
use super::{Cell, Column, ReportError, Rows, Table, npy_bytes};
use crate::analysis::chart::{Chart, ChartAttractor, ChartAxis, ChartCell, ChartClass};
use crate::analysis::periodic::ContactItinerary;
use crate::iteration::{OrbitEnd, Period};
use crate::model::ChartObservable;

/// Longest period with a colour of its own.
const LAST_OWN_PERIOD: usize = 8;

/// Number of itineraries with colours of their own: those of the most cells.
const OWN_ITINERARIES: usize = 8;

/// Number of colours of exponents, on either side of zero.
const LEVELS: i32 = 32;

/// Category of a cell, in the order of the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Category {
    /// One return, without contact.
    WithoutContact,
    /// Period in nominal returns, with contacts.
    Period(usize),
    /// Period above [`LAST_OWN_PERIOD`].
    Longer,
    /// Itinerary with a colour of its own, by rank among those of the most cells.
    Itinerary(usize),
    /// Any other itinerary.
    OtherItinerary,
    /// Exponent, in steps of the largest one's share of [`LEVELS`].
    Level(i32),
    /// Neither escaped nor with an exponent.
    NoExponent,
    /// Number of attractors.
    Attractors(usize),
    /// Not settled yet, but converging to a period.
    Converging,
    /// No period up to the longest one looked for.
    NoPeriod,
    /// The map alone was used outside its window.
    Outside,
    /// The orbit escaped or has no image.
    Escaped,
}

/// Chart with the itineraries that name its categories.
struct Shown<'a> {
    chart: &'a Chart,
    /// Itineraries with colours of their own, the shortest first.
    itineraries: Vec<&'a ContactItinerary>,
    /// Largest size of an exponent.
    largest_exponent: f64,
}

impl<'a> Shown<'a> {
    fn new(chart: &'a Chart) -> Self {
        let mut counts: HashMap<&ContactItinerary, usize> = HashMap::new();
        let attractors = chart.cells.iter().flat_map(ChartCell::attractors);
        let itineraries = attractors.filter_map(|attractor| attractor.itinerary.as_ref());
        for itinerary in itineraries.filter(|itinerary| itinerary.contacts() > 0) {
            *counts.entry(itinerary).or_default() += 1;
        }
        let key = |itinerary: &ContactItinerary| (itinerary.period(), itinerary.to_string());
        let mut itineraries: Vec<(&ContactItinerary, usize)> = counts.into_iter().collect();
        itineraries.sort_by_cached_key(|&(one, count)| (Reverse(count), key(one)));
        itineraries.truncate(OWN_ITINERARIES);
        itineraries.sort_by_cached_key(|&(one, _)| key(one));
        let exponents = chart.cells.iter().flat_map(ChartCell::attractors);
        let exponents = exponents.filter_map(|one| one.lyapunov).filter(|one| one.is_finite());
        Self {
            chart,
            itineraries: itineraries.into_iter().map(|(one, _)| one).collect(),
            largest_exponent: exponents.map(f64::abs).fold(0.0, f64::max),
        }
    }

    /// Category of a cell. With several attractors, cells show them in turn.
    fn category(&self, number: usize, cell: &ChartCell) -> Category {
        if self.chart.observe == ChartObservable::Attractors {
            return match attractor_count(self.chart, cell) {
                0 => self.of(&cell.attractor),
                count => Category::Attractors(count),
            };
        }
        let mut own: Vec<Category> = cell.attractors().map(|one| self.of(one)).collect();
        own.sort_unstable();
        let columns = self.chart.axes[0].offsets.len();
        own[(number / columns + number % columns) % own.len()]
    }

    fn of(&self, attractor: &ChartAttractor) -> Category {
        match (self.chart.class(attractor), self.chart.observe) {
            (ChartClass::Outside, _) => Category::Outside,
            (ChartClass::Escaped, _) => Category::Escaped,
            (_, ChartObservable::Lyapunov) => {
                let share = |exponent: f64| exponent / self.largest_exponent.max(f64::MIN_POSITIVE);
                match attractor.lyapunov.map(share).filter(|share| share.is_finite()) {
                    Some(share) => Category::Level((share * f64::from(LEVELS)).round() as i32),
                    None => Category::NoExponent,
                }
            }
            (ChartClass::Converging, _) => Category::Converging,
            (ChartClass::NoPeriod, _) => Category::NoPeriod,
            (_, ChartObservable::Itinerary) => {
                let own = attractor.itinerary.as_ref();
                if own.is_some_and(|own| own.contacts() == 0) {
                    return Category::WithoutContact;
                }
                let place = self.itineraries.iter().position(|&one| Some(one) == own);
                place.map_or(Category::OtherItinerary, Category::Itinerary)
            }
            (ChartClass::WithoutContact, _) => Category::WithoutContact,
            (ChartClass::Period(period), _) if period > LAST_OWN_PERIOD => Category::Longer,
            (ChartClass::Period(period), _) => Category::Period(period),
        }
    }

    fn words(&self, category: Category) -> String {
        let longest = self.chart.longest_period;
        match category {
            Category::WithoutContact => "no contact".to_owned(),
            Category::Period(period) => format!("period {period}"),
            Category::Longer => format!("period {} to {longest}", LAST_OWN_PERIOD + 1),
            Category::Itinerary(place) => format!("itinerary {}", self.itineraries[place]),
            Category::OtherItinerary => "other itineraries".to_owned(),
            // NOTE: the scale of colours explains all levels.
            Category::Level(_) => String::new(),
            Category::NoExponent => "λ not known".to_owned(),
            Category::Attractors(1) => "1 attractor".to_owned(),
            Category::Attractors(count) if count == self.chart.attractors => {
                format!("{count} attractors or more")
            }
            Category::Attractors(count) => format!("{count} attractors"),
            Category::Converging => "not settled, still converging".to_owned(),
            Category::NoPeriod => format!("none up to {longest}"),
            Category::Outside => "outside the window".to_owned(),
            Category::Escaped => "escaped or no image".to_owned(),
        }
    }
}

/// Share of paper in the colours of further itineraries of a period.
const PALER: f64 = 0.3;

impl Shown<'_> {
    /// Colour of a category, the same in every chart. The hue is that of the period; further
    /// itineraries of a period are paler.
    fn color(&self, category: Category) -> CellColor {
        match category {
            Category::WithoutContact => CellColor::Pale,
            Category::Period(period) => CellColor::Own(period - 1),
            Category::Longer | Category::OtherItinerary => CellColor::Own(LAST_OWN_PERIOD),
            Category::Itinerary(place) => {
                let period = self.itineraries[place].period();
                let before = &self.itineraries[..place];
                let rank = before.iter().filter(|one| one.period() == period).count();
                let hue = period.clamp(1, LAST_OWN_PERIOD + 1) - 1;
                match rank {
                    0 => CellColor::Own(hue),
                    _ => CellColor::Paler(hue, 1.0 - (1.0 - PALER).powi(rank as i32)),
                }
            }
            Category::Level(level) => CellColor::Signed(f64::from(level) / f64::from(LEVELS)),
            Category::Attractors(count) => {
                CellColor::Ordered(count as f64 / self.chart.attractors.max(1) as f64)
            }
            Category::NoExponent | Category::Converging => CellColor::FaintInk,
            Category::NoPeriod => CellColor::Chaos,
            Category::Outside => CellColor::Grey,
            Category::Escaped => CellColor::Paper,
        }
    }
}

/// Number of attractors of a cell; 0 if every orbit left.
fn attractor_count(chart: &Chart, cell: &ChartCell) -> usize {
    let stays = |attractor: &&ChartAttractor| {
        !matches!(chart.class(attractor), ChartClass::Outside | ChartClass::Escaped)
    };
    cell.attractors().filter(stays).count()
}

/// Figure of a chart. Colours are the same in every chart: pale without contact, apricot without a
/// period, slate where the orbit still converges, grey where the map alone was used outside its
/// window, white where the orbit escaped. Cells with several attractors show their colours in turn.
pub fn chart_figure(chart: &Chart) -> Figure {
    let [horizontal, vertical] = &chart.axes;
    let mut figure = Figure::new(axis(horizontal), axis(vertical));
    figure.above = Some(value_scale(&horizontal.parameter, horizontal.grazing_value));
    figure.beside = Some(value_scale(&vertical.parameter, vertical.grazing_value));
    figure.cells = Some(cells(chart));
    let curves = chart.overlay.iter().flat_map(|overlay| overlay.curves.iter().cloned());
    draw_curves(&mut figure, &curves.collect::<Vec<_>>(), &Some);
    let shows = |axis: &ChartAxis| {
        let (low, high) = edges(&axis.offsets);
        low <= 0.0 && 0.0 <= high
    };
    if shows(horizontal) && shows(vertical) {
        figure.annotations.push(Annotation::ring([0.0, 0.0], GRAZE));
    }
    figure
}

/// One row per cell: offsets, attractor, its name, other attractors. Columns that vary from cell to
/// cell are empty in cells that were not computed.
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
    columns.push(Column::text("itinerary"));
    columns.extend(["computed", "attractors"].map(Column::number));
    columns.push(Column::text("others"));
    columns.extend(["lyapunov_error", "converging"].map(Column::number));
    let rows = charts.iter().enumerate().flat_map(|(number, chart)| {
        chart.located().map(move |([first, second], cell)| {
            let one = &cell.attractor;
            let own = |value: Cell| if cell.computed { value } else { Cell::Missing };
            let outside = chart.class(one) == ChartClass::Outside;
            vec![
                Cell::Integer(number as i64 + 1),
                Cell::text(chart.axes[0].parameter.clone()),
                Cell::text(chart.axes[1].parameter.clone()),
                Cell::text(method_word(chart.method)),
                start_cell(chart.start.as_deref()),
                Cell::number(first, 6),
                Cell::number(second, 6),
                period_cell(one.period),
                own(Cell::Integer(one.kept_contacts.into())),
                one.lyapunov.map_or(Cell::Missing, |value| Cell::number(value, 6)),
                Cell::text(if outside { OUTSIDE } else { end_word(one.end) }),
                own(share_cell(one.by_map)),
                own(share_cell(one.outside)),
                name_cell(one),
                one.itinerary.as_ref().map_or(Cell::Missing, |one| Cell::text(one.to_string())),
                Cell::Integer(cell.computed.into()),
                Cell::Integer(attractor_count(chart, cell) as i64),
                others_cell(cell),
                one.lyapunov_error.map_or(Cell::Missing, |value| Cell::number(value, 6)),
                Cell::Integer(one.converging.into()),
            ]
        })
    });
    Rows::new(columns, rows)
}

fn name_cell(attractor: &ChartAttractor) -> Cell {
    attractor.orbit.as_ref().map_or(Cell::Missing, |name| Cell::text(name.to_string()))
}

/// Names of other attractors.
fn others_cell(cell: &ChartCell) -> Cell {
    let name = |one: &ChartAttractor| match &one.orbit {
        Some(name) => name.to_string(),
        None if one.converging => "not settled".to_owned(),
        None => "no period".to_owned(),
    };
    let names: Vec<String> = cell.others.iter().map(name).collect();
    if names.is_empty() { Cell::Missing } else { Cell::text(names.join("; ")) }
}

/// Array of periods, or of exponents if these are observed. Its shape is (rows, columns), second
/// parameter by first, or (attractors, rows, columns) with several attractors. Periods are 0
/// without a period, −1 where the map alone was used outside its window, −2 without another
/// attractor, −3 where the orbit still converges; NaN where the orbit ended early or has no
/// exponent.
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if there are not as many cells as the axes have offsets.
pub fn chart_array(chart: &Chart) -> Result<Vec<u8>, ReportError> {
    let period = |attractor: &ChartAttractor| match (attractor.end, attractor.period) {
        _ if chart.class(attractor) == ChartClass::Outside => -1.0,
        (OrbitEnd::Completed, Period::Periodic(period)) => period as f64,
        (OrbitEnd::Completed, Period::NotFound) if attractor.converging => -3.0,
        (OrbitEnd::Completed, Period::NotFound) => 0.0,
        _ => f64::NAN,
    };
    let value = |attractor: Option<&ChartAttractor>| match chart.observe {
        ChartObservable::Lyapunov => attractor.and_then(|one| one.lyapunov).unwrap_or(f64::NAN),
        _ => attractor.map_or(-2.0, period),
    };
    let layer =
        |number: usize| chart.cells.iter().map(move |cell| value(cell.attractors().nth(number)));
    let values: Vec<f64> = (0..chart.attractors).flat_map(layer).collect();
    let [columns, rows] = [&chart.axes[0], &chart.axes[1]].map(|axis| axis.offsets.len());
    match chart.attractors {
        1 => npy_bytes(&[rows, columns], &values),
        count => npy_bytes(&[count, rows, columns], &values),
    }
}

/// Table of the times of charts and of the shares of their cells.
pub fn chart_timing_table(charts: &[Chart]) -> Table {
    let axes =
        |chart: &Chart| chart.axes.each_ref().map(|axis| axis.parameter.clone()).join(" by ");
    let table = Table::of(charts)
        .text("chart", axes)
        .text("method", |chart| method_word(chart.method))
        .count("cells", |chart| chart.cells.len())
        .count("computed", |chart| chart.computed)
        .count("without contact", |chart| chart.count(ChartClass::WithoutContact))
        .count("not settled", |chart| chart.count(ChartClass::Converging))
        .count("without period", |chart| chart.count(ChartClass::NoPeriod))
        .count("outside the window", |chart| chart.count(ChartClass::Outside))
        .count("left", |chart| chart.count(ChartClass::Escaped))
        .number("by map", 4, |chart| 100.0 * chart.by_map)
        .unit("%");
    timed(table, |chart| &chart.timing)
}

fn cells(chart: &Chart) -> CellChart {
    let shown = Shown::new(chart);
    let numbered = chart.cells.iter().enumerate();
    let categories: Vec<Category> =
        numbered.map(|(number, cell)| shown.category(number, cell)).collect();
    let mut found = categories.clone();
    found.sort_unstable();
    found.dedup();
    let [horizontal, vertical] = &chart.axes;
    let named = found.iter().map(|&one| CellCategory::new(shown.words(one), shown.color(one)));
    let levels = found.iter().any(|one| matches!(one, Category::Level(_)));
    let bar = levels.then(|| ColorBar {
        label: "exponent λ per iterate".to_owned(),
        largest: shown.largest_exponent,
    });
    CellChart {
        horizontal: edges(&horizontal.offsets),
        vertical: edges(&vertical.offsets),
        columns: horizontal.offsets.len(),
        rows: vertical.offsets.len(),
        categories: named.collect(),
        cells: categories.iter().map(|category| found.binary_search(category).ok()).collect(),
        bar,
    }
}

/// Outer edges of the cells of an axis with these centres.
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
    let (low, high) = edges(&axis.offsets);
    offset_axis(&axis.parameter).with_range(low, high)
}
