//! What stands inside the plot area: the chart, guides, series, words beside points.

use super::FigureError;
use super::drawing::{Point, Shape};
use super::frame::Frame;
use super::labels::Labeller;
use super::palette::{FAINT_INK, INK, PAPER, Rgb};
use super::series::{Guide, Marker, Series, SeriesStyle, Stroke};
use super::thinning::{EXACT_DOTS, diameter, thin};
use super::{Figure, Thinning};

const LINE: f64 = 1.7;
const MARKER: f64 = 3.2;
const WORDS: f64 = 12.0;
/// Width of the paper-white strip under a line over cells.
const CASING: f64 = 4.4;
/// How much larger dots are for every series above them.
const RIM: f64 = 0.7;

/// Shapes below and above the axes.
#[derive(Debug)]
pub(super) struct Content {
    pub(super) under: Vec<Shape>,
    pub(super) over: Vec<Shape>,
    pub(super) thinning: Option<Thinning>,
}

/// The shapes of a figure inside its frame.
pub(super) fn content(figure: &Figure, frame: &Frame) -> Result<Content, FigureError> {
    let mut under = Vec::new();
    if let Some(chart) = &figure.cells {
        let low = frame.at([chart.horizontal.0, chart.vertical.0]);
        let high = frame.at([chart.horizontal.1, chart.vertical.1]);
        under.extend(chart.mosaic(low, high, &frame.area)?.map(Shape::Mosaic));
    }
    let mut labeller = Labeller::new(frame.area, obstacles(figure, frame));
    let mut over = Vec::new();
    for guide in &figure.guides {
        guide_shapes(guide, frame, &mut labeller, &mut under, &mut over)?;
    }
    let thinning = series_shapes(figure, frame, &mut under);
    for annotation in &figure.annotations {
        let at = frame.at(annotation.at);
        if !frame.area.holds(at) {
            continue;
        }
        if let Some(marker) = annotation.marker {
            over.push(Shape::Mark { at, radius: 4.2, marker, color: INK });
        }
        if !annotation.text.is_empty() {
            over.push(labeller.beside(at, &annotation.text, WORDS, INK)?);
        }
    }
    Ok(Content { under, over, thinning })
}

fn color_of(figure: &Figure, index: usize) -> Rgb {
    figure.series[index].color.of(index, figure.palette, figure.series.len())
}

fn places(series: &Series, frame: &Frame) -> Vec<Point> {
    let inside = |&at: &Point| frame.area.holds(at);
    series.points.iter().map(|&point| frame.at(point)).filter(inside).collect()
}

fn series_shapes(figure: &Figure, frame: &Frame, shapes: &mut Vec<Shape>) -> Option<Thinning> {
    let thinning = dots(figure, frame, shapes);
    for (index, series) in figure.series.iter().enumerate() {
        let color = color_of(figure, index);
        let (stroke, marker) = match series.style {
            SeriesStyle::Dots => continue,
            SeriesStyle::Markers(marker) => (None, Some(marker)),
            SeriesStyle::Line(stroke) => (Some(stroke), None),
            SeriesStyle::LineWithMarkers(stroke, marker) => (Some(stroke), Some(marker)),
        };
        if let Some(stroke) = stroke {
            let line = series.points.iter().map(|&point| frame.at(point));
            let pieces = frame.area.pieces(line);
            if figure.cells.is_some() {
                shapes.extend(pieces.iter().cloned().map(|points| Shape::Line {
                    points,
                    width: CASING,
                    stroke: Stroke::Solid,
                    color: PAPER,
                }));
            }
            let line = |points| Shape::Line { points, width: LINE, stroke, color };
            shapes.extend(pieces.into_iter().map(line));
        }
        if let Some(marker) = marker {
            let marks = places(series, frame).into_iter();
            shapes.extend(marks.map(|at| Shape::Mark { at, radius: MARKER, marker, color }));
        }
    }
    thinning
}

/// All series of dots: where they are if they are few, else on a grid.
fn dots(figure: &Figure, frame: &Frame, shapes: &mut Vec<Shape>) -> Option<Thinning> {
    let dotted =
        figure.series.iter().enumerate().filter(|(_, series)| series.style == SeriesStyle::Dots);
    let groups: Vec<(Vec<Point>, Rgb)> =
        dotted.map(|(index, series)| (places(series, frame), color_of(figure, index))).collect();
    let given = groups.iter().map(|(points, _)| points.len()).sum();
    let above = |rank: usize| groups.len() - 1 - rank;
    if given <= EXACT_DOTS {
        for (rank, (points, color)) in groups.iter().enumerate() {
            shapes.extend(circles(points.iter().copied(), rimmed(given, above(rank)), *color));
        }
        return None;
    }
    let thinned = thin(&groups, &frame.area);
    for (rank, mut dots) in thinned.dots.into_iter().enumerate() {
        let diameter = rimmed(thinned.cells, above(rank));
        if thinned.cells <= EXACT_DOTS {
            shapes.extend(circles(dots.centres(), diameter, dots.color));
        } else {
            dots.diameter = dots.diameter.max(diameter);
            shapes.push(Shape::Dots(dots));
        }
    }
    Some(Thinning { given, drawn: thinned.cells, grid: thinned.grid })
}

/// The diameter of a figure's dots where so many series lie above them.
fn rimmed(dots: usize, above: usize) -> f64 {
    diameter(dots) * (1.0 + RIM * above as f64)
}

fn circles(
    places: impl Iterator<Item = Point>,
    diameter: f64,
    color: Rgb,
) -> impl Iterator<Item = Shape> {
    let (radius, marker) = (diameter / 2.0, Marker::Circle);
    places.map(move |at| Shape::Mark { at, radius, marker, color })
}

fn guide_shapes(
    guide: &Guide,
    frame: &Frame,
    labeller: &mut Labeller,
    under: &mut Vec<Shape>,
    over: &mut Vec<Shape>,
) -> Result<(), FigureError> {
    let area = frame.area;
    let (ends, label) = match guide {
        Guide::Horizontal { at, label } => {
            let (_, y) = frame.at([f64::NAN, *at]);
            ([(area.left, y), (area.right, y)], label)
        }
        Guide::Vertical { at, label } => {
            let (x, _) = frame.at([*at, f64::NAN]);
            ([(x, area.bottom), (x, area.top)], label)
        }
        Guide::Slope { through, exponent, to, label } => {
            let end = through[1] * (to / through[0]).powf(*exponent);
            ([frame.at(*through), frame.at([*to, end])], label)
        }
    };
    let color = FAINT_INK;
    for points in area.pieces(ends.into_iter()) {
        let last = points.last().copied().filter(|_| !label.is_empty());
        under.push(Shape::Line { points, width: 1.1, stroke: Stroke::Dashed, color });
        if let Some(at) = last {
            over.push(labeller.beside(at, label, WORDS - 1.0, color)?);
        }
    }
    Ok(())
}

/// Places that words should not cover: at most some thousands, lines at every few pixels.
fn obstacles(figure: &Figure, frame: &Frame) -> Vec<Point> {
    const MOST: usize = 3000;
    let mut found = Vec::new();
    for series in &figure.series {
        let stride = series.points.len().div_ceil(MOST).max(1);
        let points = series.points.iter().step_by(stride).map(|&point| frame.at(point));
        match series.style {
            SeriesStyle::Dots | SeriesStyle::Markers(_) => found.extend(points),
            SeriesStyle::Line(_) | SeriesStyle::LineWithMarkers(..) => {
                for piece in frame.area.pieces(points) {
                    found.extend(piece.windows(2).flat_map(|pair| along(pair[0], pair[1])));
                }
            }
        }
    }
    found
}

fn along(a: Point, b: Point) -> impl Iterator<Item = Point> {
    let steps = ((b.0 - a.0).hypot(b.1 - a.1) / 5.0).ceil().max(1.0);
    (0..=steps as usize).map(move |k| {
        let t = k as f64 / steps;
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    })
}
