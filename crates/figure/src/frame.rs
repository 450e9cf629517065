//! Layout of a figure as shapes: margins, axes, grid, the place of every value, and the legend: a
//! row above the plot area if it fits, else a column right of it.

use super::axis::{Axis, AxisScale, Ticks, power_suffix, ticks};
use super::content::{Content, content};
use super::drawing::{Anchor, Area, Direction, Drawing, Point, Shape};
use super::series::{FAINT_INK, GREY, GRID, INK, Marker, PAPER, Rgb, SeriesStyle, Stroke};
use super::text::{runs, width};
use super::{Figure, FigureError, Thinning};

const TITLE_SIZE: f64 = 15.5;
const LABEL_SIZE: f64 = 13.0;
const TICK_SIZE: f64 = 11.5;
/// Height of a second scale above the picture.
const SECOND_SCALE: f64 = 40.0;

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
    let ends = ends(figure)?;
    let legend = Legend::of(figure, wide - 110.0)?;
    let title_height = if figure.title.is_empty() { 0.0 } else { 26.0 };
    let scale = figure.above.as_ref();
    let scale = scale.and_then(|scale| scale.ends(&figure.horizontal, ends.0).zip(Some(scale)));
    let scale_height = if scale.is_some() { SECOND_SCALE } else { 0.0 };
    let top = 14.0 + title_height + legend.above() + scale_height;
    let bottom = tall - 50.0;
    let vertical = ticks(figure.vertical.scale, ends.1, ((bottom - top) / 44.0) as usize);
    let left = 36.0 + widest(&vertical)?;
    let right = (wide - 20.0 - legend.beside()).max(left + 40.0);
    let area = Area { left, top, right, bottom: bottom.max(top + 40.0) };
    let horizontal = horizontal_ticks(figure.horizontal.scale, ends.0, area.width())?;
    let scales = (figure.horizontal.scale, figure.vertical.scale);
    let frame = Frame { area, scales, ends };

    let Content { under, over, thinning } = content(figure, &frame)?;
    let mut shapes = grid(&frame, &horizontal, &vertical);
    shapes.extend(under);
    shapes.extend(edges(&area));
    shapes.extend(tick_texts(&frame, &horizontal, &vertical));
    shapes.extend(axis_labels(figure, &frame, &horizontal, &vertical)?);
    if let Some((ends, scale)) = scale {
        shapes.extend(second_scale(&scale.label, ends, &area)?);
    }
    shapes.extend(legend.shapes((area.left, area.top - scale_height), (area.right, area.top)));
    shapes.extend(over);
    if !figure.title.is_empty() {
        let text = fitted(&figure.title, TITLE_SIZE, wide - left - 10.0)?;
        shapes.push(words((left, 22.0), Anchor::Start, TITLE_SIZE, text));
    }
    let drawing = Drawing { size: figure.size, title: spoken_title(figure), shapes };
    Ok(Layout { drawing, thinning })
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
fn second_scale(label: &str, ends: (f64, f64), area: &Area) -> Result<Vec<Shape>, FigureError> {
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
        Shape::Text {
            at: (18.0, middle.1),
            anchor: Anchor::Middle,
            direction: Direction::Upwards,
            size: LABEL_SIZE,
            color: INK,
            text: beside,
            halo: false,
        },
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
    /// The legend of a figure; `room` is the width for a row of entries, in pixels.
    pub(super) fn of(figure: &Figure, room: f64) -> Result<Self, FigureError> {
        let count = figure.series.len();
        let series = figure.series.iter().enumerate().filter(|(_, series)| !series.name.is_empty());
        let mut entries: Vec<(String, Key, Rgb)> = series
            .map(|(index, series)| {
                let color = series.color.of(index, figure.palette, count);
                (series.name.clone(), Key::Series(series.style), color)
            })
            .collect();
        if let Some(chart) = &figure.cells {
            let categories = chart.categories.iter();
            entries.extend(
                categories
                    .map(|category| (category.name.clone(), Key::Category, category.color.rgb())),
            );
        }
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
