//! Time series as data and figures: phase portraits, states and gaps over time.

use serde::Serialize;

use super::diagram_figure::{GRAZE, extent};
use super::figure::{Annotation, Axis, Figure, Guide, Marker, Series, Stroke, symbol};
use super::table::{counted, significant};
use super::{Cell, Column, Named, Rows, SectionDocument, Table};
use crate::analysis::{SeriesPoint, TimeSeries, TimeSeriesRequest};
use crate::hybrid::MomentEvent;
use crate::model::{Model, Node, Scene};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Time series, column by column, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct TimeSeriesListing {
    /// The section.
    pub section: SectionDocument,
    /// Request.
    pub request: TimeSeriesRequest,
    /// All parameters.
    pub parameters: Named<f64>,
    /// Duration of a nominal return, in time.
    pub duration: f64,
    /// Times of the rows.
    pub t: Vec<f64>,
    /// Full states; the phase runs from 0 to its period.
    pub states: Named<Vec<f64>>,
    /// Gap of each surface.
    pub gaps: Named<Vec<f64>>,
    /// Events, by the index of the row.
    pub events: Vec<EventRecord>,
}

/// Event.
#[derive(Clone, Debug, Serialize)]
pub struct EventRecord {
    /// Index of the row, from 0; for an impact, of the row before it.
    pub row: usize,
    /// Time of the event.
    pub t: f64,
    /// `impact`, `contact`, `release` or `minimum`.
    pub event: &'static str,
    /// Name of the surface.
    pub surface: String,
}

impl TimeSeriesListing {
    /// Listing of a scene's series.
    pub fn new(
        scene: &Scene,
        section: SectionDocument,
        request: &TimeSeriesRequest,
        series: &TimeSeries,
    ) -> Self {
        let model = &scene.model;
        let column =
            |value: &dyn Fn(&SeriesPoint) -> f64| series.points.iter().map(value).collect();
        let states = model.full_state_names().into_iter().enumerate();
        let surfaces = model.surfaces.iter().enumerate();
        let events = series.points.iter().enumerate();
        Self {
            section,
            request: request.clone(),
            parameters: Named::new(
                model.parameter_names().into_iter().zip(series.parameters.iter().copied()),
            ),
            duration: series.duration,
            t: column(&|point| point.time),
            states: Named::new(
                states.map(|(place, name)| (name, column(&|point| point.state[place]))),
            ),
            gaps: Named::new(surfaces.map(|(place, surface)| {
                (surface.name.clone(), column(&|point| point.gaps[place]))
            })),
            events: events
                .filter_map(|(row, point)| {
                    point.event.map(|(event, surface)| EventRecord {
                        row,
                        t: point.time,
                        event: event.word(),
                        surface: model.surfaces[surface].name.clone(),
                    })
                })
                .collect(),
        }
    }
}

/// Columns of a series: `t`, the phase, the states, the gaps, the event and its surface.
pub fn time_series_columns(model: &Model) -> Vec<Column> {
    let mut columns = vec![Column::number("t")];
    columns.extend(model.phase.iter().map(|phase| Column::number(phase.name.clone())));
    columns.extend(model.states.iter().map(Column::number));
    let gaps = model.surfaces.iter();
    columns.extend(gaps.map(|surface| Column::number(format!("h_{}", surface.name))));
    columns.extend(["event", "surface"].map(Column::text));
    columns
}

/// Row of a series under these columns.
pub fn time_series_row(model: &Model, point: &SeriesPoint) -> Vec<Cell> {
    let number = |value: f64| Cell::number(value, 9);
    let (states, phase) = point.state.split_at(model.states.len());
    let numbers = [point.time].into_iter().chain(phase.iter().copied());
    let numbers = numbers.chain(states.iter().copied()).chain(point.gaps.iter().copied());
    let mut row: Vec<Cell> = numbers.map(number).collect();
    let (event, surface) = match point.event {
        Some((event, surface)) => (event.word(), model.surfaces[surface].name.as_str()),
        None => ("", ""),
    };
    row.extend([event, surface].map(Cell::text));
    row
}

/// Table of all rows of a series.
pub fn time_series_table(model: &Model, series: &TimeSeries) -> Table {
    let rows = series.points.iter().map(|point| time_series_row(model, point));
    Rows::new(time_series_columns(model), rows).into_table()
}

/// Digits of times in text, and the duration below which they are significant ones.
const TIME_DIGITS: usize = 6;
const SHORT: f64 = 0.1;

/// Length and events of a series, as text.
pub fn time_series_text(scene: &Scene, series: &TimeSeries) -> String {
    let surfaces = &scene.model.surfaces;
    let first = series.points.first().map_or(0.0, |point| point.time);
    let last = series.points.last().map_or(0.0, |point| point.time);
    // Times of a fast oscillator have no digits among the first decimals.
    let time = |time: f64| match last.abs() < SHORT {
        true => significant(time, TIME_DIGITS),
        false => format!("{time:.TIME_DIGITS$}"),
    };
    let mut text = format!(
        "trajectory of `{}` from t = {} to {} in {}\n",
        scene.identifier,
        time(first),
        time(last),
        counted(series.points.len(), "row")
    );
    for (event, surface, count) in series.event_counts() {
        text.push_str(&format!(
            "{} at `{}`\n",
            counted(count, event.word()),
            surfaces[surface].name
        ));
    }
    text
}

/// Figures of a series, each with the suffix of its file name: a phase portrait for each mass (each
/// state whose derivative is another state), the states over time, the gaps over time.
pub fn time_series_figures(
    scene: &Scene,
    orbit: &GrazingOrbit,
    series: &TimeSeries,
) -> Vec<(String, Figure)> {
    let sketch = Sketch::new(scene, orbit, series);
    let pairs = portrait_pairs(&scene.model);
    let mut figures = Vec::new();
    for &pair in &pairs {
        let ending = match pairs.len() {
            1 => String::new(),
            _ => format!("-{}", scene.model.states[pair.0]),
        };
        figures.push((ending, sketch.portrait(pair)));
    }
    for &(position, _) in &pairs {
        let ending = format!("-time-{}", scene.model.states[position]);
        figures.push((ending, sketch.state_over_time(position)));
    }
    figures.push(("-gaps".to_owned(), sketch.gaps_over_time()));
    figures
}

/// Positions with their velocities: pairs of a state and its derivative, if that is another state.
/// Without such a pair, the first two states.
pub(super) fn portrait_pairs(model: &Model) -> Vec<(usize, usize)> {
    let states = model.states.len();
    let velocity = |position: usize| match model.graph.node(model.flow[position]) {
        Node::Input(input) if input < states && input != position => Some((position, input)),
        _ => None,
    };
    let pairs: Vec<_> = (0..states).filter_map(velocity).collect();
    match (pairs.is_empty(), states) {
        (false, _) => pairs,
        (true, 0 | 1) => vec![(0, 0)],
        (true, _) => vec![(0, 1)],
    }
}

/// Distance from a whole number of returns, in returns, up to which a row counts as on the section.
const ON_SECTION: f64 = 1e-9;

/// Share of the extent of a trajectory within which it passes through a grazing point.
const ON_GRAZE: f64 = 1e-6;

/// Data of the figures.
struct Sketch<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    series: &'a TimeSeries,
    /// Whether the motion up to each row is in contact.
    held: Vec<bool>,
}

impl<'a> Sketch<'a> {
    fn new(scene: &'a Scene, orbit: &'a GrazingOrbit, series: &'a TimeSeries) -> Self {
        let mut contacts = 0_usize;
        let held = series.points.iter().map(|point| {
            let before = contacts > 0;
            match point.event {
                Some((MomentEvent::Contact, _)) => contacts += 1,
                Some((MomentEvent::Release, _)) => contacts = contacts.saturating_sub(1),
                _ => {}
            }
            before
        });
        Self { scene, orbit, series, held: held.collect() }
    }

    fn name(&self, state: usize) -> String {
        symbol(&self.scene.model.states[state])
    }

    /// Phase portrait of two states, with the stops that are at fixed places.
    fn portrait(&self, (horizontal, vertical): (usize, usize)) -> Figure {
        let axes = [horizontal, vertical].map(|state| Axis::linear(self.name(state)));
        let [across, up] = axes;
        let mut figure = Figure::new(across, up);
        self.draw(&mut figure, &|point| [point.state[horizontal], point.state[vertical]]);
        for (name, place) in self.stops(horizontal) {
            figure.guides.push(Guide::Vertical { at: place, label: name });
        }
        let grazes = self.grazes().map(|state| [state[horizontal], state[vertical]]);
        figure.annotations.extend(grazes.map(|at| Annotation::ring(at, GRAZE)));
        let sections =
            self.section_points().map(|point| [point.state[horizontal], point.state[vertical]]);
        let sections: Vec<_> = sections.collect();
        if !sections.is_empty() {
            figure.series.push(Series::markers("section", Marker::Square, sections));
        }
        figure
    }

    /// Grazing points that the trajectory passes through.
    fn grazes(&self) -> impl Iterator<Item = Vec<f64>> {
        let states = self.scene.model.states.len();
        let sizes: Vec<f64> = (0..states)
            .map(|state| {
                let (low, high) = extent(self.series.points.iter().map(|point| point.state[state]));
                ON_GRAZE * (high - low)
            })
            .collect();
        let grazes = self.orbit.passages.iter().map(move |passage| {
            passage.state.iter().take(states).map(|value| value.to_f64()).collect::<Vec<_>>()
        });
        grazes.filter(move |graze| {
            let near = |(place, size): (usize, &f64), point: &SeriesPoint| {
                (point.state[place] - graze[place]).abs() <= *size
            };
            let mut points = self.series.points.iter();
            points.any(|point| sizes.iter().enumerate().all(|size| near(size, point)))
        })
    }

    /// Rows on a stroboscopic section. A tangency section is met at minima and contacts, which are
    /// drawn anyway.
    fn section_points(&self) -> impl Iterator<Item = &SeriesPoint> {
        let stroboscopic =
            matches!(self.orbit.section.kind, PoincareSectionKind::Stroboscopic { .. });
        let duration = self.series.duration;
        let at_section = move |point: &&SeriesPoint| {
            let returns = point.time / duration;
            point.event.is_none() && (returns - returns.round()).abs() < ON_SECTION
        };
        self.series.points.iter().filter(move |_| stroboscopic).filter(at_section)
    }

    /// Figure of a state over time.
    fn state_over_time(&self, state: usize) -> Figure {
        let mut figure = Figure::new(Axis::linear("t"), Axis::linear(self.name(state)));
        figure.size = (760, 300);
        self.draw(&mut figure, &|point| [point.time, point.state[state]]);
        for (name, place) in self.stops(state) {
            figure.guides.push(Guide::Horizontal { at: place, label: name });
        }
        figure
    }

    /// Figure of all gaps over time.
    fn gaps_over_time(&self) -> Figure {
        let mut figure = Figure::new(Axis::linear("t"), Axis::linear("gap h"));
        figure.size = (760, 300);
        for (place, surface) in self.scene.model.surfaces.iter().enumerate() {
            let points = self.series.points.iter();
            let points = points.map(|point| [point.time, point.gaps[place]]).collect();
            figure.series.push(Series::line(surface.name.clone(), Stroke::Solid, points));
        }
        figure.guides.push(Guide::Horizontal { at: 0.0, label: String::new() });
        figure
    }

    /// Draws free flight, contact phases, jumps at impacts, and marks where contact is made.
    fn draw(&self, figure: &mut Figure, at: &dyn Fn(&SeriesPoint) -> [f64; 2]) {
        let mut lines: [Vec<[f64; 2]>; 3] = Default::default();
        let [flights, contacts, jumps] = &mut lines;
        for (number, pair) in self.series.points.windows(2).enumerate() {
            let [from, to] = [at(&pair[0]), at(&pair[1])];
            let line = match pair[0].event {
                Some((MomentEvent::Impact, _)) => &mut *jumps,
                _ if self.held[number + 1] => &mut *contacts,
                _ => &mut *flights,
            };
            if line.last() != Some(&from) {
                line.extend([[f64::NAN; 2], from]);
            }
            line.push(to);
        }
        let strokes = [Stroke::Solid, Stroke::Solid, Stroke::Dotted];
        let names = ["free flight", "contact", ""];
        for (number, (points, (name, stroke))) in
            lines.into_iter().zip(names.into_iter().zip(strokes)).enumerate()
        {
            if !points.is_empty() {
                figure.series.push(Series::line(name, stroke, points).with_color(number));
            }
        }
        for (name, event, marker) in [
            ("impact", MomentEvent::Impact, Marker::Cross),
            ("contact begins", MomentEvent::Contact, Marker::Triangle),
        ] {
            let here = |point: &&SeriesPoint| point.event.is_some_and(|(made, _)| made == event);
            let points: Vec<_> = self.series.points.iter().filter(here).map(at).collect();
            if !points.is_empty() {
                figure.series.push(Series::markers(name, marker, points).with_color(2));
            }
        }
    }

    /// Stops of a state: names of the surfaces that depend on that state alone, with their places.
    fn stops(&self, state: usize) -> Vec<(String, f64)> {
        let model = &self.scene.model;
        let alone = |surface: &&crate::model::Surface| {
            let inputs = model.graph.dependencies(surface.event);
            let mut inputs = inputs.into_iter().filter(|&input| input < model.dimension());
            inputs.next() == Some(state) && inputs.next().is_none()
        };
        let place = |surface: &crate::model::Surface| {
            let mut values = Vec::new();
            let gap = |place: f64| {
                let mut inputs = vec![0.0; model.dimension()];
                inputs[state] = place;
                inputs.extend(&self.series.parameters);
                model.graph.evaluate(&inputs, &mut values);
                values[surface.event.index()]
            };
            let places = self.series.points.iter().map(|point| point.state[state]);
            zero_near(gap, places).map(|place| (surface.name.clone(), place))
        };
        model.surfaces.iter().filter(alone).filter_map(place).collect()
    }
}

/// Number of bisections: enough for full precision.
const HALVINGS: usize = 80;

/// Zero of a function within twice the extent of some places.
fn zero_near(
    mut function: impl FnMut(f64) -> f64,
    places: impl Iterator<Item = f64>,
) -> Option<f64> {
    let ends = extent(places);
    let margin = 0.5 * (ends.1 - ends.0);
    let (mut low, mut high) = (ends.0 - margin, ends.1 + margin);
    let rises = function(high) > 0.0;
    if low.is_nan() || low >= high || (function(low) > 0.0) == rises {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = low + 0.5 * (high - low);
        match (function(middle) > 0.0) == rises {
            true => high = middle,
            false => low = middle,
        }
    }
    Some(low + 0.5 * (high - low))
}
