//! Contents of the plot area: the chart, guides, series, words beside points.
//!
//! Very many dots are drawn as a density: once for every cell of a grid that holds any, and paler
//! where fewer fall. The cells are smaller than dots; where they would still make the SVG too large
//! the grid is halved until they do not.

use std::collections::BTreeMap;

use super::drawing::{Area, DotRuns, Point, Shape};
use super::frame::Frame;
use super::labels::Labeller;
use super::series::{FAINT_INK, Guide, INK, Marker, PAPER, Rgb, Series, SeriesStyle, Stroke};
use super::{Figure, FigureError, Thinning};

const LINE: f64 = 1.7;
const MARKER: f64 = 3.2;
const WORDS: f64 = 12.0;
/// Width of the paper-white strip under a line over cells.
const CASING: f64 = 4.4;
/// Growth of the dots' diameter, as a fraction, for every series drawn above them.
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

/// Draws all series of dots: at their exact places if they are few, else on a grid.
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
    let exact = thinned.cells <= EXACT_DOTS;
    for (rank, levels) in thinned.dots.into_iter().enumerate() {
        let diameter = rimmed(thinned.cells, above(rank));
        for mut dots in levels {
            if exact {
                shapes.extend(circles(dots.centres(), diameter, groups[rank].1));
            } else {
                dots.diameter = dots.diameter.max(diameter);
                shapes.push(Shape::Dots(dots));
            }
        }
    }
    Some(Thinning { given, drawn: thinned.cells, grid: thinned.grid })
}

/// Diameter of a figure's dots below `above` other series.
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

/// Largest number of dots that are drawn at their exact places.
const EXACT_DOTS: usize = 4000;
/// Columns and rows of the finest grid: cells a little smaller than the smallest dots.
const FINEST: (usize, usize) = (800, 500);
/// Runs of cells, about eight bytes each, that keep an SVG well below 2 MB.
const MOST_RUNS: usize = 170_000;
/// Smallest and largest diameter of a dot, in pixels.
const DIAMETERS: (f64, f64) = (0.9, 3.0);

/// Diameter for this many dots: 1.8 pixels for [`EXACT_DOTS`]; the area of the ink shrinks with the
/// root of their number.
pub(super) fn diameter(dots: usize) -> f64 {
    let share = EXACT_DOTS as f64 / dots.max(1) as f64;
    (1.8 * share.powf(0.25)).clamp(DIAMETERS.0, DIAMETERS.1)
}

/// All dots of a figure on one grid, the diameter not yet set.
#[derive(Debug, Clone, PartialEq)]
struct ThinnedDots {
    pub(super) grid: (usize, usize),
    pub(super) cells: usize,
    /// Dots of each series by density, the sparsest first.
    pub(super) dots: Vec<Vec<DotRuns>>,
}

/// The series of a figure, each with its colour, on the finest grid that stays within bounds.
fn thin(series: &[(Vec<Point>, Rgb)], area: &Area) -> ThinnedDots {
    let mut grid = FINEST;
    loop {
        let found = on_grid(series, area, grid);
        let runs: usize = found.dots.iter().flatten().map(|dots| dots.runs.len()).sum();
        if runs <= MOST_RUNS || grid.0 < 100 {
            return found;
        }
        grid = (grid.0 / 2, grid.1 / 2);
    }
}

fn on_grid(series: &[(Vec<Point>, Rgb)], area: &Area, grid: (usize, usize)) -> ThinnedDots {
    let pitch = (area.width() / grid.0 as f64, area.height() / grid.1 as f64);
    let cell_of = |x: f64, start: f64, size: f64, count: usize| {
        (((x - start) / size).max(0.0) as u32).min(count as u32 - 1)
    };
    let mut cells = 0;
    let dots = series
        .iter()
        .map(|(points, color)| {
            let mut counts: BTreeMap<(u32, u32), u32> = BTreeMap::new();
            for &(x, y) in points {
                let column = cell_of(x, area.left, pitch.0, grid.0);
                let row = cell_of(y, area.top, pitch.1, grid.1);
                *counts.entry((row, column)).or_default() += 1;
            }
            cells += counts.len();
            let full = usual(counts.values().copied());
            let of_level = |level: usize| DotRuns {
                origin: (area.left + pitch.0 / 2.0, area.top + pitch.1 / 2.0),
                pitch,
                runs: runs(counts.iter().filter_map(|(&cell, &count)| {
                    (density_level(count, full) == level).then_some(cell)
                })),
                diameter: pitch.0.max(pitch.1),
                color: *color,
                share: DENSITIES[level],
            };
            (0..DENSITIES.len()).map(of_level).filter(|dots| !dots.runs.is_empty()).collect()
        })
        .collect();
    ThinnedDots { grid, cells, dots }
}

/// Shares of ink of the levels of density.
const DENSITIES: [f64; 4] = [0.3, 0.5, 0.75, 1.0];

/// Count that all but the fullest twentieth of the cells do not exceed.
fn usual(counts: impl Iterator<Item = u32>) -> u32 {
    let mut counts: Vec<u32> = counts.collect();
    counts.sort_unstable();
    counts.get((counts.len() * 19 / 20).min(counts.len().saturating_sub(1))).copied().unwrap_or(1)
}

/// Index into [`DENSITIES`] for a cell with `count` dots: it grows with the logarithm of the count,
/// and is the last one from the count `full` on.
fn density_level(count: u32, full: u32) -> usize {
    let last = DENSITIES.len() - 1;
    let share = f64::from(count).ln_1p() / f64::from(full).ln_1p();
    ((share * DENSITIES.len() as f64).ceil() as usize).clamp(1, last + 1) - 1
}

/// Runs of neighbours in rows, of cells in ascending order.
fn runs(cells: impl Iterator<Item = (u32, u32)>) -> Vec<(u32, u32, u32)> {
    let mut runs: Vec<(u32, u32, u32)> = Vec::new();
    for (row, column) in cells {
        match runs.last_mut() {
            Some((r, first, count)) if *r == row && *first + *count == column => *count += 1,
            _ => runs.push((row, column, 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { left: 0.0, top: 0.0, right: 800.0, bottom: 500.0 };

    #[test]
    fn dots_of_one_cell_are_drawn_once_and_neighbours_join() {
        let points = vec![(0.1, 0.1), (1.2, 0.1), (800.0, 500.0)];
        let thinned = thin(&[([points.clone(), points].concat(), [0, 0, 0])], &AREA);
        assert_eq!(thinned.grid, FINEST);
        assert_eq!(thinned.cells, 3);
        let [dots] = &thinned.dots[0][..] else { panic!("one density: {thinned:?}") };
        assert_eq!(dots.runs, [(0, 0, 2), (499, 799, 1)]);
        assert!(dots.share > 0.99, "{}", dots.share);
    }

    #[test]
    fn cells_of_fewer_dots_are_paler_and_drawn_first() {
        let often = |at: Point, times: usize| std::iter::repeat_n(at, times);
        let points = often((0.1, 0.1), 1).chain(often((9.0, 9.0), 40)).collect();
        let thinned = thin(&[(points, [0, 0, 0])], &AREA);
        let [sparse, dense] = &thinned.dots[0][..] else { panic!("two densities: {thinned:?}") };
        assert_eq!(sparse.runs, [(0, 0, 1)]);
        assert!(sparse.share < dense.share, "{} {}", sparse.share, dense.share);
    }

    #[test]
    fn a_full_plane_takes_a_coarser_grid() {
        let points: Vec<Point> = (0..1_000_000_u64)
            .map(|k| {
                let scattered = k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 20;
                ((scattered % 8000) as f64 / 10.0, (scattered / 8000 % 5000) as f64 / 10.0)
            })
            .collect();
        let thinned = thin(&[(points, [0, 0, 0])], &AREA);
        assert!(thinned.grid.0 < FINEST.0);
        let runs: usize = thinned.dots[0].iter().map(|dots| dots.runs.len()).sum();
        assert!(runs <= MOST_RUNS, "{runs}");
    }
}
