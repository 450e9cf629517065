//! A chart of categories over two parameters, such as the period of the attractor.

use super::FigureError;
use super::drawing::{Area, Mosaic, Point};
use super::series::{
    CELLS, CHAOS, FAINT_INK, GREY, PALE, PAPER, Palette, Rgb, diverging, mixed, viridis,
};

/// A grid of categories that fills a rectangle of the axes.
///
/// Cells are spaced evenly along the axes as drawn. Without an explicit range the axes show the
/// rectangle exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct CellChart {
    /// Left and right edge of the grid.
    pub horizontal: (f64, f64),
    /// Lower and upper edge of the grid.
    pub vertical: (f64, f64),
    /// Number of cells along the horizontal axis.
    pub columns: usize,
    /// Number of cells along the vertical axis.
    pub rows: usize,
    /// Category of every cell, as an index into `categories`: row by row from the lower edge, each
    /// from the left. `None`, or an index without a category, stays paper-white.
    pub cells: Vec<Option<usize>>,
    /// Categories in the order of the legend.
    pub categories: Vec<CellCategory>,
    /// Scale of the values that [`CellColor::Signed`] colours stand for, right of the picture.
    pub bar: Option<ColorBar>,
}

/// Scale of values of two signs, from purple through pale at zero to orange.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorBar {
    /// Name of the quantity.
    pub label: String,
    /// Value at the upper end; the lower end is its negative.
    pub largest: f64,
}

/// A category of cells: its name and its colour.
#[derive(Debug, Clone, PartialEq)]
pub struct CellCategory {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour of its cells.
    pub color: CellColor,
}

/// Colour of the cells of a category.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CellColor {
    /// One of nine colours that stay distinct on areas, by index modulo nine.
    Own(usize),
    /// One of the nine colours, mixed with so much of the paper: a number from 0 to 1.
    Paler(usize, f64),
    /// Colour of the series of dots with this index.
    Series(usize),
    /// Dark to light, for ordered categories; a number from 0 to 1.
    Ordered(f64),
    /// Purple, pale, orange, for values of two signs; a number from −1 to 1.
    Signed(f64),
    /// Pale, where nothing happens.
    Pale,
    /// Apricot, where nothing repeats: it can fill a picture, and lines are seen on it.
    Chaos,
    /// Colour of secondary text.
    FaintInk,
    /// Grey, for untrusted results.
    Grey,
    /// Colour of the paper.
    Paper,
}

impl CellCategory {
    /// A category with a name and a colour.
    pub fn new(name: impl Into<String>, color: CellColor) -> Self {
        Self { name: name.into(), color }
    }

    /// A category with a number, one of `count` that are unordered.
    pub fn numbered(name: impl Into<String>, number: usize, count: usize) -> Self {
        let color = match count {
            0..=8 => CellColor::Series(number),
            _ => CellColor::Ordered(number as f64 / (count - 1) as f64),
        };
        Self::new(name, color)
    }
}

impl CellColor {
    pub(super) fn rgb(self) -> Rgb {
        match self {
            Self::Own(number) => CELLS[number % CELLS.len()],
            Self::Paler(number, share) => mixed(CELLS[number % CELLS.len()], PAPER, share),
            Self::Series(number) => Palette::Categorical.color(number, number + 1),
            Self::Ordered(share) => viridis(share),
            Self::Signed(share) => diverging(share),
            Self::Pale => PALE,
            Self::Chaos => CHAOS,
            Self::FaintInk => FAINT_INK,
            Self::Grey => GREY,
            Self::Paper => PAPER,
        }
    }
}

impl CellChart {
    /// Cells as a rectangle between two corners of the picture; cells wholly outside the area are
    /// cut away.
    ///
    /// # Errors
    ///
    /// [`FigureError::ChartShape`] if `cells` does not fill the grid, or the grid is empty.
    pub(super) fn mosaic(
        &self,
        lower_left: Point,
        upper_right: Point,
        area: &Area,
    ) -> Result<Option<Mosaic>, FigureError> {
        if self.columns.checked_mul(self.rows) != Some(self.cells.len()) || self.cells.is_empty() {
            return Err(FigureError::ChartShape {
                columns: self.columns,
                rows: self.rows,
                found: self.cells.len(),
            });
        }
        let pitch = (
            (upper_right.0 - lower_left.0) / self.columns as f64,
            (lower_left.1 - upper_right.1) / self.rows as f64,
        );
        let inside = |low: f64, high: f64, from: f64, to: f64| high > from && low < to;
        let columns: Vec<usize> = (0..self.columns)
            .filter(|&c| {
                let x = lower_left.0 + c as f64 * pitch.0;
                inside(x, x + pitch.0, area.left, area.right)
            })
            .collect();
        let rows: Vec<usize> = (0..self.rows)
            .rev()
            .filter(|&r| {
                let y = lower_left.1 - r as f64 * pitch.1;
                inside(y - pitch.1, y, area.top, area.bottom)
            })
            .collect();
        let (Some(&left), Some(&top)) = (columns.first(), rows.first()) else {
            return Ok(None);
        };
        let from =
            (lower_left.0 + left as f64 * pitch.0, lower_left.1 - (top + 1) as f64 * pitch.1);
        let to = (from.0 + columns.len() as f64 * pitch.0, from.1 + rows.len() as f64 * pitch.1);
        let colors = rows
            .iter()
            .flat_map(|&r| columns.iter().map(move |&c| self.cells[r * self.columns + c]))
            .map(|cell| {
                let category = cell.and_then(|category| self.categories.get(category));
                category.map_or(PAPER, |category| category.color.rgb())
            })
            .collect();
        Ok(Some(Mosaic { from, to, columns: columns.len(), colors }))
    }
}
