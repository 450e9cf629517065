//! Figures as plain descriptions, drawn to SVG and PNG.
//!
//! A [`Figure`] says what is shown; the layout turns it into a `Drawing`, a flat list of
//! shapes in CSS pixels, and two painters turn that list into an SVG and a PNG that look alike.
//! The same figure gives the same bytes.
//!
//! Conventions of the field: stable branches solid, unstable ones dashed; axes are offsets, with
//! the power of ten at the axis label and short ticks; marks such as `G`, `PD`, `SN` stand beside
//! points.

mod axis;
mod cells;
mod clip;
mod content;
mod dashing;
mod drawing;
mod error;
mod font;
mod frame;
mod labels;
mod legend;
mod markup;
mod palette;
mod raster;
mod series;
mod svg;
mod thinning;
mod ticks;

pub use axis::{Axis, AxisScale, ShiftedScale};
pub use cells::{CellCategory, CellChart, CellColor};
pub use error::FigureError;
pub use markup::{escape_html, symbol};
pub use palette::Palette;
pub use series::{Annotation, Guide, Marker, Series, SeriesColor, SeriesStyle, Stroke};

/// Smallest and largest side of a figure, in CSS pixels.
const SIDES: (u32, u32) = (160, 4000);

/// What a picture shows: axes, series, guides and annotations, or a chart of cells.
///
/// Text may raise and lower parts with `^{...}` and `_{...}`. Points that are not finite, or not
/// positive on a logarithmic axis, are left out and interrupt a line.
///
/// ```
/// use grazemap_figure::{Axis, Figure, Series, Stroke};
///
/// let mut figure = Figure::new(Axis::linear("α − α*"), Axis::linear("h"));
/// figure.series.push(Series::line("stable", Stroke::Solid, vec![[0.0, 0.0], [1e-3, 2e-4]]));
/// let svg = figure.to_svg()?;
/// assert!(svg.starts_with("<svg"));
/// # Ok::<(), grazemap_figure::FigureError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Heading above the picture; empty where a caption says it.
    pub title: String,
    /// The axis below the picture.
    pub horizontal: Axis,
    /// A second scale of the horizontal axis, above the picture. Left out where the axis is not
    /// linear, or is so short that doubles cannot tell its ticks apart.
    pub above: Option<ShiftedScale>,
    /// The axis left of the picture.
    pub vertical: Axis,
    /// What is drawn, bottom to top. Of several series of dots those below have larger dots, so
    /// that dots on the same place show a rim.
    pub series: Vec<Series>,
    /// Reference lines, drawn under the series.
    pub guides: Vec<Guide>,
    /// Words beside points.
    pub annotations: Vec<Annotation>,
    /// A chart of categories, drawn under everything.
    pub cells: Option<CellChart>,
    /// Colours of the series.
    pub palette: Palette,
    /// Width and height in CSS pixels, each from 160 to 4000; the PNG has twice as many.
    pub size: (u32, u32),
}

/// What thinning did to the dots of a figure, for its caption.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Thinning {
    /// Dots given inside the axes.
    pub given: usize,
    /// Distinct cells of the grid that were drawn.
    pub drawn: usize,
    /// Columns and rows of the grid.
    pub grid: (usize, usize),
}

impl Thinning {
    /// A sentence for the caption.
    pub fn sentence(&self) -> String {
        let (columns, rows) = self.grid;
        format!(
            "{} points, drawn as the {} distinct cells of a grid of {columns} × {rows}.",
            self.given, self.drawn
        )
    }
}

impl Figure {
    /// An empty figure of the usual size, 760 by 460.
    pub fn new(horizontal: Axis, vertical: Axis) -> Self {
        Self {
            title: String::new(),
            horizontal,
            above: None,
            vertical,
            series: Vec::new(),
            guides: Vec::new(),
            annotations: Vec::new(),
            cells: None,
            palette: Palette::Categorical,
            size: (760, 460),
        }
    }

    /// The figure as an SVG document, text in the reader's sans-serif font.
    ///
    /// Stays below 2 MB however many dots there are: see [`Figure::thinning`].
    ///
    /// # Errors
    ///
    /// [`FigureError::AxisRange`] for an explicit range that cannot be shown,
    /// [`FigureError::FigureSize`], [`FigureError::ChartShape`], and [`FigureError::Png`] from a
    /// chart of cells, which is embedded as a bitmap.
    pub fn to_svg(&self) -> Result<String, FigureError> {
        svg::paint(&self.layout()?.drawing)
    }

    /// The figure as a PNG of twice the figure's size.
    ///
    /// # Errors
    ///
    /// As for [`Figure::to_svg`], and [`FigureError::Bitmap`].
    pub fn to_png(&self) -> Result<Vec<u8>, FigureError> {
        raster::paint(&self.layout()?.drawing)
    }

    /// What was done to series of many dots: dots that fall in the same cell are drawn once.
    ///
    /// `None` if every dot is drawn where it is. Fewer dots are larger.
    ///
    /// # Errors
    ///
    /// As for [`Figure::to_svg`].
    pub fn thinning(&self) -> Result<Option<Thinning>, FigureError> {
        Ok(self.layout()?.thinning)
    }

    fn layout(&self) -> Result<frame::Layout, FigureError> {
        let (width, height) = self.size;
        let (smallest, largest) = SIDES;
        let fits = |side| (smallest..=largest).contains(&side);
        if !fits(width) || !fits(height) {
            return Err(FigureError::FigureSize { width, height, smallest, largest });
        }
        frame::lay_out(self)
    }
}

#[cfg(test)]
mod tests;
