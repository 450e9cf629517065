//! A chart of categories over two parameters, such as the period of the attractor.

use super::FigureError;
use super::clip::Area;
use super::drawing::{Mosaic, Point};
use super::palette::{GREY, PAPER, Palette, Rgb, viridis};

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
    /// Category of every cell, as an index into `names`: row by row from the lower edge, each from
    /// the left. `None`, or an index without a name, stays paper-white.
    pub cells: Vec<Option<usize>>,
    /// Names of the categories, for the legend.
    pub names: Vec<String>,
    /// The category that is drawn in grey, of what is not to be trusted.
    pub grey: Option<usize>,
}

impl CellChart {
    /// Colour of a category.
    pub(super) fn color(&self, category: usize) -> Rgb {
        if self.grey == Some(category) {
            GREY
        } else if self.names.len() <= 8 {
            Palette::Categorical.color(category, self.names.len())
        } else {
            viridis(category as f64 / (self.names.len() - 1) as f64)
        }
    }

    /// The grid between two corners of the picture; cells wholly outside the area are cut away.
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
            .map(|cell| match cell {
                Some(category) if category < self.names.len() => self.color(category),
                _ => PAPER,
            })
            .collect();
        Ok(Some(Mosaic { from, to, columns: columns.len(), colors }))
    }
}
