//! The legend: a row above the plot area where it fits, else a column right of it.

use super::Figure;
use super::FigureError;
use super::drawing::{Anchor, Direction, Point, Shape};
use super::font::width;
use super::markup::runs;
use super::palette::{GREY, INK, PAPER, Rgb};
use super::series::{Marker, SeriesStyle};

const SIZE: f64 = 12.0;
const KEY: f64 = 24.0;
const LINE: f64 = 19.0;
const LONGEST: f64 = 190.0;

/// What an entry shows beside its name.
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
    /// The legend of a figure that has so much width for a row of entries.
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
            // The colour of the paper is seen by its frame.
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

/// The text, or as much of its beginning as fits, ended by an ellipsis.
pub(super) fn fitted(text: &str, size: f64, room: f64) -> Result<String, FigureError> {
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
