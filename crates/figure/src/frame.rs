//! Layout of a figure as shapes: margins, axes, grid, the place of every value, and the legend: a
//! row above the plot area if it fits, else a column right of it. The legend holds what is drawn
//! inside the axes, and nothing else.

use super::axis::{Axis, AxisScale, ShiftedScale, Ticks, power_suffix, row_ticks, ticks};
use super::cells::ColorBar;
use super::content::{Content, content};
use super::drawing::{Anchor, Area, Direction, Drawing, Mosaic, Point, Shape};
use super::series::{
    FAINT_INK, GREY, GRID, INK, Marker, PAPER, Rgb, Series, SeriesStyle, Stroke, diverging,
};
use super::text::{runs, width};
use super::{Figure, FigureError, Thinning};

const TITLE_SIZE: f64 = 15.5;
const LABEL_SIZE: f64 = 13.0;
const TICK_SIZE: f64 = 11.5;
/// Height of a second scale above the picture.
const SECOND_SCALE: f64 = 40.0;
/// Width of a scale of colours, without its ticks.
const BAR: f64 = 14.0;
/// Height between ticks of vertical scales.
const TICK_HEIGHT: f64 = 44.0;

/// A drawing and the thinning of its dots.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) drawing: Drawing,
    pub(super) thinning: Option<Thinning>,
}

/// Transformation from values to places in the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) area: Area,
    scales: (AxisScale, AxisScale),
    ends: ((f64, f64), (f64, f64)),
}

impl Frame {
    /// Place of a pair of values; not finite if a value is not on its scale.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> Point {
        (self.across(self.scales.0.place(x)), self.down(self.scales.1.place(y)))
    }

    /// Whether anything of a series lies inside the axes.
    fn shows(&self, series: &Series) -> bool {
        let places = || series.points.iter().map(|&point| self.at(point));
        let joined = || match series.style {
            SeriesStyle::Line(_) | SeriesStyle::LineWithMarkers(..) => {
                !self.area.pieces(places()).is_empty()
            }
            SeriesStyle::Dots | SeriesStyle::Markers(_) => false,
        };
        places().any(|at| self.area.holds(at)) || joined()
    }

    fn across(&self, place: f64) -> f64 {
        let (lower, upper) = self.ends.0;
        self.area.left + (place - lower) / (upper - lower) * self.area.width()
    }

    fn down(&self, place: f64) -> f64 {
        let (lower, upper) = self.ends.1;
        self.area.bottom - (place - lower) / (upper - lower) * self.area.height()
    }
}

/// Computes the layout of a figure.
pub(super) fn lay_out(figure: &Figure) -> Result<Layout, FigureError> {
    let (wide, tall) = (f64::from(figure.size.0), f64::from(figure.size.1));
    let scales = (figure.horizontal.scale, figure.vertical.scale);
    let ends = ends(figure)?;
    let legend = Legend::of(figure, &Frame { area: Area::UNIT, scales, ends }, wide - 110.0)?;
    let title_height = if figure.title.is_empty() { 0.0 } else { 26.0 };
    let above = shifted(figure.above.as_ref(), &figure.horizontal, ends.0);
    let scale_height = if above.is_some() { SECOND_SCALE } else { 0.0 };
    let top = 14.0 + title_height + legend.above() + scale_height;
    let bottom = (tall - 50.0).max(top + 40.0);
    let upright = |scale, ends| ticks(scale, ends, ((bottom - top) / TICK_HEIGHT) as usize);
    let vertical = match &figure.vertical.rows[..] {
        [] => upright(figure.vertical.scale, ends.1),
        names => row_ticks(names),
    };
    let beside = shifted(figure.beside.as_ref(), &figure.vertical, ends.1);
    let beside = beside.map(|(label, ends)| (label, ends, upright(AxisScale::Linear, ends)));
    let bar = figure.cells.as_ref().and_then(|chart| chart.bar.as_ref());
    let bar = bar.filter(|bar| bar.largest > 0.0 && bar.largest.is_finite());
    let bar = bar.map(|bar| {
        let ends = (-bar.largest, bar.largest);
        (bar, upright(AxisScale::Linear, ends))
    });

    let left = 36.0 + widest(&vertical)?;
    let scale_width = match &beside {
        Some((.., ticks)) => upright_width(ticks)?,
        None => 0.0,
    };
    let bar_width = match &bar {
        Some((_, ticks)) => 16.0 + BAR + upright_width(ticks)?,
        None => 0.0,
    };
    let used = 20.0 + scale_width + bar_width + legend.beside();
    let right = (wide - used).max(left + 40.0);
    let area = Area { left, top, right, bottom };
    let horizontal = horizontal_ticks(figure.horizontal.scale, ends.0, area.width())?;
    let frame = Frame { area, scales, ends };

    let Content { under, over, thinning } = content(figure, &frame)?;
    let mut shapes = grid(&frame, &horizontal, &vertical);
    shapes.extend(under);
    shapes.extend(edges(&area));
    shapes.extend(tick_texts(&frame, &horizontal, &vertical));
    shapes.extend(axis_labels(figure, &frame, &horizontal, &vertical)?);
    if let Some((label, ends)) = above {
        shapes.extend(scale_above(label, ends, &area)?);
    }
    if let Some((label, ends, ticks)) = &beside {
        shapes.push(rule((right, top), (right, bottom), 1.0, FAINT_INK));
        shapes.extend(upright_scale(label, *ends, ticks, &area)?);
    }
    if let Some((bar, ticks)) = &bar {
        shapes.extend(color_bar(bar, ticks, right + scale_width + 16.0, &area)?);
    }
    let corner = (right + scale_width + bar_width, top);
    shapes.extend(legend.shapes((left, top - scale_height), corner));
    shapes.extend(over);
    if !figure.title.is_empty() {
        let text = fitted(&figure.title, TITLE_SIZE, wide - left - 10.0)?;
        shapes.push(words((left, 22.0), Anchor::Start, TITLE_SIZE, text));
    }
    let drawing = Drawing { size: figure.size, title: spoken_title(figure), shapes };
    Ok(Layout { drawing, thinning })
}

/// Label and ends of a second scale, if it can be shown.
fn shifted<'a>(
    scale: Option<&'a ShiftedScale>,
    axis: &Axis,
    ends: (f64, f64),
) -> Option<(&'a str, (f64, f64))> {
    scale.and_then(|scale| Some((scale.label.as_str(), scale.ends(axis, ends)?)))
}

fn spoken_title(figure: &Figure) -> String {
    if figure.title.is_empty() {
        format!("{} against {}", figure.vertical.label, figure.horizontal.label)
    } else {
        figure.title.clone()
    }
}

type Ends = ((f64, f64), (f64, f64));

fn ends(figure: &Figure) -> Result<Ends, FigureError> {
    let shown = |[x, y]: &[f64; 2]| {
        let scales = (figure.horizontal.scale, figure.vertical.scale);
        scales.0.place(*x).is_finite() && scales.1.place(*y).is_finite()
    };
    let data = || {
        let series = figure.series.iter().flat_map(|series| series.points.iter().copied());
        let marked = figure.annotations.iter().map(|annotation| annotation.at);
        series.chain(marked).filter(shown)
    };
    let fixed = |axis: &Axis, chart: Option<(f64, f64)>| Axis {
        range: axis.range.or(chart),
        ..axis.clone()
    };
    let chart = figure.cells.as_ref();
    let horizontal = fixed(&figure.horizontal, chart.map(|chart| chart.horizontal));
    let vertical = fixed(&figure.vertical, chart.map(|chart| chart.vertical));
    Ok((horizontal.ends(data().map(|[x, _]| x))?, vertical.ends(data().map(|[_, y]| y))?))
}

fn widest(ticks: &Ticks) -> Result<f64, FigureError> {
    let mut widest: f64 = 0.0;
    for tick in &ticks.ticks {
        widest = widest.max(width(&tick.text, TICK_SIZE)?);
    }
    Ok(widest)
}

/// Horizontal ticks, as many as fit without touching.
fn horizontal_ticks(scale: AxisScale, ends: (f64, f64), room: f64) -> Result<Ticks, FigureError> {
    let mut wanted = ((room / 70.0) as usize).max(2);
    loop {
        let found = ticks(scale, ends, wanted);
        let named: Vec<f64> =
            found.ticks.iter().filter(|t| !t.text.is_empty()).map(|t| t.place).collect();
        let nearest = named.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let spacing = nearest / (ends.1 - ends.0) * room;
        if wanted <= 2 || spacing > widest(&found)? + 12.0 {
            return Ok(found);
        }
        wanted -= 1;
    }
}

fn rule(from: Point, to: Point, width: f64, color: [u8; 3]) -> Shape {
    Shape::Line { points: vec![from, to], width, stroke: Stroke::Solid, color }
}

fn words(at: Point, anchor: Anchor, size: f64, text: String) -> Shape {
    Shape::Text { at, anchor, direction: Direction::Across, size, color: INK, text, halo: false }
}

fn grid(frame: &Frame, horizontal: &Ticks, vertical: &Ticks) -> Vec<Shape> {
    let area = frame.area;
    let weight = |text: &str| if text.is_empty() { 0.5 } else { 1.0 };
    let upright = horizontal.ticks.iter().map(|tick| {
        let x = frame.across(tick.place);
        rule((x, area.top), (x, area.bottom), weight(&tick.text), GRID)
    });
    let level = vertical.ticks.iter().map(|tick| {
        let y = frame.down(tick.place);
        rule((area.left, y), (area.right, y), weight(&tick.text), GRID)
    });
    upright.chain(level).collect()
}

fn edges(area: &Area) -> Vec<Shape> {
    let corner = (area.left, area.bottom);
    vec![
        rule(corner, (area.right, area.bottom), 1.0, FAINT_INK),
        rule((area.left, area.top), corner, 1.0, FAINT_INK),
    ]
}

fn tick_texts(frame: &Frame, horizontal: &Ticks, vertical: &Ticks) -> Vec<Shape> {
    let area = frame.area;
    let mut shapes = Vec::new();
    for tick in horizontal.ticks.iter().filter(|tick| !tick.text.is_empty()) {
        let x = frame.across(tick.place);
        shapes.push(rule((x, area.bottom), (x, area.bottom + 4.0), 1.0, FAINT_INK));
        shapes.push(words((x, area.bottom + 17.0), Anchor::Middle, TICK_SIZE, tick.text.clone()));
    }
    for tick in vertical.ticks.iter().filter(|tick| !tick.text.is_empty()) {
        let y = frame.down(tick.place);
        shapes.push(rule((area.left - 4.0, y), (area.left, y), 1.0, FAINT_INK));
        shapes.push(words((area.left - 7.0, y + 4.0), Anchor::End, TICK_SIZE, tick.text.clone()));
    }
    shapes
}

/// Ticks and words of a scale above the picture.
fn scale_above(label: &str, ends: (f64, f64), area: &Area) -> Result<Vec<Shape>, FigureError> {
    let found = horizontal_ticks(AxisScale::Linear, ends, area.width())?;
    let mut shapes = vec![rule((area.left, area.top), (area.right, area.top), 1.0, FAINT_INK)];
    for tick in &found.ticks {
        let x = area.left + (tick.place - ends.0) / (ends.1 - ends.0) * area.width();
        shapes.push(rule((x, area.top - 4.0), (x, area.top), 1.0, FAINT_INK));
        shapes.push(words((x, area.top - 8.0), Anchor::Middle, TICK_SIZE, tick.text.clone()));
    }
    let middle = ((area.left + area.right) / 2.0, area.top - 26.0);
    let label = fitted(label, LABEL_SIZE, area.width())? + &power_suffix(found.power);
    shapes.push(words(middle, Anchor::Middle, LABEL_SIZE, label));
    Ok(shapes)
}

/// Width that [`upright_scale`] takes.
fn upright_width(ticks: &Ticks) -> Result<f64, FigureError> {
    Ok(7.0 + widest(ticks)? + 10.0 + LABEL_SIZE)
}

/// Ticks and words of a scale at the right edge of an area.
fn upright_scale(
    label: &str,
    ends: (f64, f64),
    ticks: &Ticks,
    area: &Area,
) -> Result<Vec<Shape>, FigureError> {
    let mut shapes = Vec::new();
    for tick in ticks.ticks.iter().filter(|tick| !tick.text.is_empty()) {
        let y = area.bottom - (tick.place - ends.0) / (ends.1 - ends.0) * area.height();
        shapes.push(rule((area.right, y), (area.right + 4.0, y), 1.0, FAINT_INK));
        let at = (area.right + 7.0, y + 4.0);
        shapes.push(words(at, Anchor::Start, TICK_SIZE, tick.text.clone()));
    }
    let label = fitted(label, LABEL_SIZE, area.height())? + &power_suffix(ticks.power);
    let at = (area.right + upright_width(ticks)? - 3.0, (area.top + area.bottom) / 2.0);
    shapes.push(upwards(at, label));
    Ok(shapes)
}

/// Scale of colours, with its left edge at an abscissa.
fn color_bar(
    bar: &ColorBar,
    ticks: &Ticks,
    left: f64,
    area: &Area,
) -> Result<Vec<Shape>, FigureError> {
    const STEPS: usize = 64;
    let area = Area { left, right: left + BAR, ..*area };
    let share = |step: usize| 2.0 * (step as f64 + 0.5) / STEPS as f64 - 1.0;
    let colors = (0..STEPS).rev().map(|step| diverging(share(step))).collect();
    let (from, to) = ((area.left, area.top), (area.right, area.bottom));
    let mut shapes = vec![Shape::Mosaic(Mosaic { from, to, columns: 1, colors })];
    shapes.extend(upright_scale(&bar.label, (-bar.largest, bar.largest), ticks, &area)?);
    Ok(shapes)
}

fn upwards(at: Point, text: String) -> Shape {
    Shape::Text {
        at,
        anchor: Anchor::Middle,
        direction: Direction::Upwards,
        size: LABEL_SIZE,
        color: INK,
        text,
        halo: false,
    }
}

fn axis_labels(
    figure: &Figure,
    frame: &Frame,
    horizontal: &Ticks,
    vertical: &Ticks,
) -> Result<Vec<Shape>, FigureError> {
    let area = frame.area;
    let label = |axis: &Axis, ticks: &Ticks, room: f64| -> Result<String, FigureError> {
        let suffix = power_suffix(ticks.power);
        let room = (room - width(&suffix, LABEL_SIZE)?).max(20.0);
        Ok(fitted(&axis.label, LABEL_SIZE, room)? + &suffix)
    };
    let middle = ((area.left + area.right) / 2.0, (area.top + area.bottom) / 2.0);
    let below = label(&figure.horizontal, horizontal, area.width() + 40.0)?;
    let beside = label(&figure.vertical, vertical, area.height() + 40.0)?;
    Ok(vec![
        words((middle.0, area.bottom + 39.0), Anchor::Middle, LABEL_SIZE, below),
        upwards((18.0, middle.1), beside),
    ])
}

const SIZE: f64 = 12.0;
const KEY: f64 = 24.0;
const LINE: f64 = 19.0;
const LONGEST: f64 = 190.0;

/// Symbol beside the name of an entry.
#[derive(Debug, Clone, Copy)]
enum Key {
    Series(SeriesStyle),
    Category,
}

/// The entries of a figure's legend.
#[derive(Debug)]
pub(super) struct Legend {
    entries: Vec<(String, Key, Rgb)>,
    widths: Vec<f64>,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    None,
    Row,
    Column,
}

impl Legend {
    /// The legend of a figure, of the series and categories that `frame` shows; `room` is the width
    /// for a row of entries, in pixels.
    fn of(figure: &Figure, frame: &Frame, room: f64) -> Result<Self, FigureError> {
        let count = figure.series.len();
        let series = figure.series.iter().enumerate();
        let shown = series.filter(|(_, one)| !one.name.is_empty() && frame.shows(one));
        let mut entries: Vec<(String, Key, Rgb)> = shown
            .map(|(index, series)| {
                let color = series.color.of(index, figure.palette, count);
                let style = match series.style {
                    SeriesStyle::Line(_) if !figure.strokes.is_empty() => {
                        SeriesStyle::Line(Stroke::Solid)
                    }
                    style => style,
                };
                (series.name.clone(), Key::Series(style), color)
            })
            .collect();
        if let Some(chart) = &figure.cells {
            let named = chart.categories.iter().filter(|category| !category.name.is_empty());
            entries.extend(
                named.map(|category| (category.name.clone(), Key::Category, category.color.rgb())),
            );
        }
        let strokes = figure.strokes.iter();
        entries.extend(strokes.map(|(stroke, words)| {
            (words.clone(), Key::Series(SeriesStyle::Line(*stroke)), FAINT_INK)
        }));
        let most = (f64::from(figure.size.1) / LINE) as usize - 4;
        entries.truncate(most);
        let mut widths = Vec::new();
        for (name, ..) in &mut entries {
            *name = fitted(name, SIZE, LONGEST)?;
            widths.push(width(name, SIZE)?);
        }
        let row: f64 = widths.iter().map(|wide| wide + KEY + 26.0).sum();
        let form = match entries.len() {
            0 => Form::None,
            1..=6 if row <= room => Form::Row,
            _ => Form::Column,
        };
        Ok(Self { entries, widths, form })
    }

    /// Height taken above the plot area.
    pub(super) fn above(&self) -> f64 {
        if self.form == Form::Row { 24.0 } else { 0.0 }
    }

    /// Width taken right of the plot area.
    pub(super) fn beside(&self) -> f64 {
        let widest = self.widths.iter().copied().fold(0.0, f64::max);
        if self.form == Form::Column { widest + KEY + 22.0 } else { 0.0 }
    }

    /// The legend's shapes, for a plot area whose upper corners are given.
    pub(super) fn shapes(&self, upper_left: Point, upper_right: Point) -> Vec<Shape> {
        let mut shapes = Vec::new();
        let (mut x, mut y) = match self.form {
            Form::Column => (upper_right.0 + 16.0, upper_right.1 + 8.0),
            _ => (upper_left.0, upper_left.1 - 15.0),
        };
        for ((name, key, color), wide) in self.entries.iter().zip(&self.widths) {
            shapes.extend(key_shapes(*key, (x, y), *color));
            shapes.push(Shape::Text {
                at: (x + KEY + 6.0, y + 4.2),
                anchor: Anchor::Start,
                direction: Direction::Across,
                size: SIZE,
                color: INK,
                text: name.clone(),
                halo: false,
            });
            match self.form {
                Form::Column => y += LINE,
                _ => x += wide + KEY + 26.0,
            }
        }
        shapes
    }
}

fn key_shapes(key: Key, (x, y): Point, color: Rgb) -> Vec<Shape> {
    let middle = (x + KEY / 2.0, y);
    let mark = |marker, radius| Shape::Mark { at: middle, radius, marker, color };
    let line =
        |stroke| Shape::Line { points: vec![(x, y), (x + KEY, y)], width: 1.8, stroke, color };
    match key {
        Key::Category => {
            let square = |half: f64, fill| Shape::Rectangle {
                from: (middle.0 - half, y - half),
                to: (middle.0 + half, y + half),
                fill,
            };
            // A frame makes a square in the colour of the paper visible.
            let frame = (color == PAPER).then(|| square(6.8, GREY));
            frame.into_iter().chain([square(6.0, color)]).collect()
        }
        Key::Series(SeriesStyle::Dots) => vec![mark(Marker::Circle, 3.4)],
        Key::Series(SeriesStyle::Markers(marker)) => vec![mark(marker, 3.6)],
        Key::Series(SeriesStyle::Line(stroke)) => vec![line(stroke)],
        Key::Series(SeriesStyle::LineWithMarkers(stroke, marker)) => {
            vec![line(stroke), mark(marker, 3.4)]
        }
    }
}

/// The text, or the longest beginning that fits, ended by an ellipsis.
fn fitted(text: &str, size: f64, room: f64) -> Result<String, FigureError> {
    if width(text, size)? <= room {
        return Ok(text.to_owned());
    }
    let letters: Vec<char> =
        runs(text).into_iter().flat_map(|(_, run)| run.chars().collect::<Vec<_>>()).collect();
    // NOTE: an estimate first, so that a hostile length costs nothing.
    let mut kept = letters.len().min((room / size * 4.0) as usize + 1);
    while kept > 0 {
        let short: String = letters[..kept].iter().copied().chain(['…']).collect();
        if width(&short, size)? <= room {
            return Ok(short);
        }
        kept -= 1;
    }
    Ok("…".to_owned())
}
