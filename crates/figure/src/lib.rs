//! Figures as plain descriptions, drawn to SVG, PNG and PDF.
//!
//! A [`Figure`] describes the contents; the layout turns it into a `Drawing`, a flat list of shapes
//! in CSS pixels, and painters turn that list into an SVG, a PNG and a PDF that look alike. A
//! figure always gives the same bytes.
//!
//! Conventions of the field: stable branches solid, unstable ones dashed; axes are offsets, with
//! the power of ten at the axis label and short ticks; marks such as `G`, `PD`, `SN` stand beside
//! points.

use std::ops::RangeInclusive;

mod axis;
mod cells;
mod content;
mod drawing;
mod frame;
mod labels;
mod painter;
mod pdf;
mod raster;
mod series;
mod svg;
mod text;

pub use axis::{Axis, AxisScale, ShiftedScale};
pub use cells::{CellCategory, CellChart, CellColor, ColorBar};
pub use series::{Annotation, Guide, Marker, Palette, Series, SeriesColor, SeriesStyle, Stroke};
pub use text::{escape_html, symbol};

/// Smallest and largest side of a figure, in CSS pixels.
const SIDES: (u32, u32) = (160, 4000);

/// Most pixels of a PNG along a side.
const MOST_PIXELS: u32 = 16_384;

/// Resolutions of a PNG, in dots per inch.
const RESOLUTIONS: RangeInclusive<u32> = 24..=1200;

/// Description of a picture: axes, series, guides and annotations, or a chart of cells.
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
    /// Heading above the picture; empty if a caption replaces it.
    pub title: String,
    /// The axis below the picture.
    pub horizontal: Axis,
    /// A second scale of the horizontal axis, above the picture. Left out where the axis is not
    /// linear, or is so short that doubles cannot tell its ticks apart.
    pub above: Option<ShiftedScale>,
    /// A second scale of the vertical axis, right of the picture, under the same conditions.
    pub beside: Option<ShiftedScale>,
    /// The axis left of the picture.
    pub vertical: Axis,
    /// Series in the order of drawing, bottom to top. Among series of dots the lower ones have
    /// larger dots, so that coinciding dots show a rim.
    pub series: Vec<Series>,
    /// Reference lines, drawn under the series.
    pub guides: Vec<Guide>,
    /// Words beside points.
    pub annotations: Vec<Annotation>,
    /// A chart of categories, drawn under everything.
    pub cells: Option<CellChart>,
    /// Colours of the series.
    pub palette: Palette,
    /// Meanings of the line patterns, at the end of the legend. With any, names of lines stand
    /// beside solid keys.
    pub strokes: Vec<(Stroke, String)>,
    /// Width and height in CSS pixels, each from 160 to 4000; 96 are an inch.
    pub size: (u32, u32),
}

/// Result of thinning the dots of a figure, for its caption.
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
    /// Sentence for the caption.
    pub fn sentence(&self) -> String {
        let (columns, rows) = self.grid;
        format!(
            "{} points, drawn as the {} distinct cells of a grid of {columns} × {rows}, darker \
             where more points fall.",
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
            beside: None,
            vertical,
            series: Vec::new(),
            guides: Vec::new(),
            annotations: Vec::new(),
            cells: None,
            palette: Palette::Categorical,
            strokes: Vec::new(),
            size: (760, 460),
        }
    }

    /// The figure as an SVG document, text in the reader's sans-serif font.
    ///
    /// The document stays below 2 MB for any number of dots: see [`Figure::thinning`].
    ///
    /// # Errors
    ///
    /// [`FigureError::AxisRange`] for an explicit range that cannot be shown,
    /// [`FigureError::FigureSize`], [`FigureError::ChartShape`], and [`FigureError::Png`] from a
    /// chart of cells, which is embedded as a bitmap.
    pub fn to_svg(&self) -> Result<String, FigureError> {
        svg::paint(&self.layout()?.drawing)
    }

    /// The figure as a PNG with a number of dots per inch; a CSS pixel is the 96th part of an inch,
    /// so that 192 give twice the figure's size.
    ///
    /// # Errors
    ///
    /// The errors of [`Figure::to_svg`]; [`FigureError::Resolution`] beyond 24 to 1200;
    /// [`FigureError::Bitmap`] where a side would have over 16 384 pixels.
    pub fn to_png(&self, dots_per_inch: u32) -> Result<Vec<u8>, FigureError> {
        if !RESOLUTIONS.contains(&dots_per_inch) {
            return Err(FigureError::Resolution { asked: dots_per_inch });
        }
        raster::paint(&self.layout()?.drawing, f64::from(dots_per_inch) / 96.0)
    }

    /// The figure as a PDF of one page, with letters as outlines.
    ///
    /// # Errors
    ///
    /// The errors of [`Figure::to_svg`].
    pub fn to_pdf(&self) -> Result<Vec<u8>, FigureError> {
        pdf::paint(&self.layout()?.drawing)
    }

    /// Thinning of series of many dots: dots that fall in the same cell are drawn once, as a
    /// density.
    ///
    /// `None` if every dot is drawn at its exact place. Fewer dots are larger.
    ///
    /// # Errors
    ///
    /// The errors of [`Figure::to_svg`].
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

/// A figure that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// An axis range that is empty, not finite, or not positive on a logarithmic axis.
    #[error("axis `{axis}` cannot show the range {lower:e} to {upper:e} on a {scale} scale")]
    AxisRange {
        /// Label of the axis.
        axis: String,
        /// Requested lower end.
        lower: f64,
        /// Requested upper end.
        upper: f64,
        /// `linear`, `logarithmic` or `symmetric logarithmic`.
        scale: &'static str,
    },
    /// A grid of categories whose cells do not fill it, or that has no extent.
    #[error(
        "a chart of {columns} x {rows} cells takes {expected} values, found {found}",
        expected = columns.saturating_mul(*rows)
    )]
    ChartShape {
        /// Number of columns.
        columns: usize,
        /// Number of rows.
        rows: usize,
        /// Number of cells given.
        found: usize,
    },
    /// A picture too small or too large to be drawn.
    #[error(
        "a figure of {width} x {height} pixels cannot be drawn; each side must be between \
         {smallest} and {largest}"
    )]
    FigureSize {
        /// Requested width, in pixels.
        width: u32,
        /// Requested height, in pixels.
        height: u32,
        /// Smallest side that is drawn.
        smallest: u32,
        /// Largest side that is drawn.
        largest: u32,
    },
    /// A resolution that is too low to be read, or higher than any printer's.
    #[error(
        "a PNG has {lowest} to {highest} dots per inch, not {asked}",
        lowest = RESOLUTIONS.start(), highest = RESOLUTIONS.end()
    )]
    Resolution {
        /// Requested dots per inch.
        asked: u32,
    },
    /// A bitmap with more pixels a side than are drawn.
    #[error(
        "a PNG of {width} x {height} pixels cannot be drawn; each side has at most {MOST_PIXELS}"
    )]
    Bitmap {
        /// Width, in pixels.
        width: u32,
        /// Height, in pixels.
        height: u32,
    },
    /// The built-in fonts could not be read.
    #[error("the built-in fonts are unreadable")]
    Font,
    /// The PNG encoder refused the bitmap.
    #[error("the PNG could not be encoded")]
    Png(#[from] png::EncodingError),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Figure {
        let mut figure = Figure::new(Axis::linear("α − α*"), Axis::linear("h"));
        figure.size = (320, 220);
        let branch = |from: f64| vec![[0.0, from], [1e-3, from + 1.0], [2e-3, from + 1.5]];
        figure.series.push(Series::line("stable", Stroke::Solid, branch(0.0)));
        figure.series.push(Series::line("unstable", Stroke::Dashed, branch(0.5)).with_color(0));
        figure.annotations.push(Annotation::ring([0.0, 0.0], "G"));
        figure
    }

    #[test]
    fn a_small_figure_is_as_recorded() {
        let svg = small().to_svg().expect("drawn");
        assert_eq!(svg, small().to_svg().expect("drawn again"));
        insta::assert_snapshot!(svg);
    }

    /// Pixels of a figure, three bytes each, with their number along each side.
    fn pixels(figure: &Figure, dots_per_inch: u32) -> ((u32, u32), Vec<u8>) {
        let png = figure.to_png(dots_per_inch).expect("drawn");
        assert_eq!(png, figure.to_png(dots_per_inch).expect("drawn again"));
        let mut reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().expect("a PNG");
        let size = (reader.info().width, reader.info().height);
        let mut bytes = vec![0; reader.output_buffer_size().expect("few")];
        reader.next_frame(&mut bytes).expect("pixels");
        (size, bytes)
    }

    #[test]
    fn a_bitmap_has_the_pixels_of_its_resolution_and_the_same_every_time() {
        assert_eq!(pixels(&small(), 192).0, (640, 440));
        assert_eq!(pixels(&small(), 600).0, (2000, 1375));
        assert!(matches!(small().to_png(23), Err(FigureError::Resolution { asked: 23 })));
        let wide = Figure { size: (4000, 400), ..small() };
        assert!(matches!(wide.to_png(600), Err(FigureError::Bitmap { width: 25_000, .. })));
    }

    /// Share of the pixels that have a colour.
    fn share(figure: &Figure, color: [u8; 3]) -> f64 {
        let (_, bytes) = pixels(figure, 192);
        let of = bytes.chunks_exact(3).filter(|pixel| **pixel == color).count();
        of as f64 / (bytes.len() / 3) as f64
    }

    #[test]
    fn dots_and_cells_of_a_bitmap_have_their_colours() {
        let mut figure = small();
        figure.series.clear();
        assert!(share(&figure, [0xff; 3]) > 0.9);
        figure.cells = Some(CellChart {
            horizontal: (0.0, 1.0),
            vertical: (0.0, 1.0),
            columns: 30,
            rows: 30,
            cells: vec![Some(0); 900],
            categories: vec![CellCategory::new("none", CellColor::Chaos)],
            bar: None,
        });
        // Cells meet without seams: the shares of paper and of cells are all but the letters.
        let cells = share(&figure, [0xf4, 0xa5, 0x82]);
        assert!(cells > 0.4 && cells + share(&figure, [0xff; 3]) > 0.9, "{cells}");
    }

    #[test]
    fn a_pdf_has_one_page_of_the_size_and_is_the_same_every_time() {
        let pdf = small().to_pdf().expect("drawn");
        assert_eq!(pdf, small().to_pdf().expect("drawn again"));
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-") && text.trim_end().ends_with("%%EOF"));
        assert!(text.contains("/MediaBox [0 0 240 165]"), "{text}");
    }

    #[test]
    fn four_hundred_thousand_dots_stay_below_two_megabytes() {
        let scattered = |k: u64| {
            let bits = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            [(bits >> 40) as f64, (bits & 0xff_ffff) as f64]
        };
        let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
        figure.series.push(Series::dots("map", (0..200_000).map(scattered).collect()));
        figure.series.push(Series::dots("direct", (200_000..400_000).map(scattered).collect()));
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.len() < 2_000_000, "{}", svg.len());
        let thinning = figure.thinning().expect("drawn").expect("thinned");
        assert_eq!(thinning.given, 400_000);
        assert!(thinning.drawn <= 400_000);
    }

    #[test]
    fn values_without_a_place_never_reach_the_picture() {
        let wild = vec![
            [f64::NAN, 1.0],
            [1.0, f64::INFINITY],
            [-1.0, 1.0],
            [0.0, 0.0],
            [f64::MAX, f64::MIN_POSITIVE],
            [1.0, 1.0],
            [5e-324, 5e-324],
        ];
        for axes in [|label: &str| Axis::linear(label), |label: &str| Axis::log10(label)] {
            let mut figure = Figure::new(axes("x"), axes("y"));
            figure.guides.push(Guide::Slope {
                through: [-1.0, 0.0],
                exponent: 1.5,
                to: 2.0,
                label: "?".to_owned(),
            });
            for style in [SeriesStyle::Dots, SeriesStyle::Line(Stroke::Dashed)] {
                figure.series.push(Series { style, ..Series::dots("wild", wild.clone()) });
            }
            let svg = figure.to_svg().expect("drawn");
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
            assert!(figure.to_png(192).is_ok() && figure.to_pdf().is_ok());
        }
    }

    #[test]
    fn figures_that_cannot_be_drawn_are_refused() {
        let mut figure = small();
        figure.size = (10, 10);
        assert!(matches!(figure.to_svg(), Err(FigureError::FigureSize { .. })));
        let mut figure = small();
        figure.horizontal = Axis::log10("x").with_range(-1.0, 1.0);
        assert!(matches!(figure.to_png(192), Err(FigureError::AxisRange { .. })));
        let mut figure = small();
        figure.cells = Some(CellChart {
            horizontal: (0.0, 1.0),
            vertical: (0.0, 1.0),
            columns: 2,
            rows: 2,
            cells: vec![None; 3],
            categories: Vec::new(),
            bar: None,
        });
        assert!(matches!(figure.to_svg(), Err(FigureError::ChartShape { found: 3, .. })));
    }

    #[test]
    fn a_second_scale_has_ticks_at_round_values_of_its_own() {
        let mut figure = small();
        figure.above = Some(ShiftedScale { label: "α".to_owned(), shift: 2.2471 });
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.contains(">2.248<"), "{svg}");
        // So short an axis that doubles near the shift cannot tell its ticks apart.
        figure.horizontal = Axis::linear("α − α*").with_range(0.0, 1e-15);
        assert!(!figure.to_svg().expect("drawn").contains(">2.24"));
        let mut logarithmic = small();
        logarithmic.horizontal = Axis::log10("α − α*").with_range(1e-4, 1e-3);
        logarithmic.above = Some(ShiftedScale { label: "α".to_owned(), shift: 2.2471 });
        assert!(!logarithmic.to_svg().expect("drawn").contains(">2.24"));
    }

    #[test]
    fn a_second_scale_beside_the_picture_is_as_the_one_above_it() {
        let mut figure = small();
        figure.beside = Some(ShiftedScale { label: "h₀".to_owned(), shift: 40.0 });
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.contains(">41") && svg.contains("h₀"), "{svg}");
        figure.vertical = Axis::log10("h").with_range(1.0, 10.0);
        assert!(!figure.to_svg().expect("drawn").contains("h₀"));
    }

    #[test]
    fn named_rows_stand_in_place_of_ticks_from_the_top() {
        let mut figure = Figure::new(
            Axis::linear("change"),
            Axis::of_rows(["alpha", "omega"].map(str::to_owned).to_vec()),
        );
        figure.series.push(Series::line("clear", Stroke::Solid, vec![[0.0, -1.0], [1.0, -1.0]]));
        let svg = figure.to_svg().expect("drawn");
        let height = |word: &str| -> f64 {
            let (before, _) = svg.split_once(&format!(">{word}<")).expect("a row");
            let (_, after) = before.rsplit_once(" y=\"").expect("its height");
            after.split('"').next().unwrap_or("").parse().expect("a number")
        };
        assert!(height("alpha") < height("omega"), "{svg}");
        assert!(!svg.contains(">−1<"), "{svg}");
    }

    #[test]
    fn the_legend_holds_what_is_inside_the_axes() {
        let mut figure = small();
        figure.series.push(Series::dots("no dots", Vec::new()));
        figure.series.push(Series::dots("far dots", vec![[5.0, 0.0]]));
        let across = vec![[-1.0, 0.2], [1.0, 0.2]];
        figure.series.push(Series::line("across", Stroke::Solid, across));
        figure.horizontal = Axis::linear("α").with_range(0.0, 2e-3);
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.contains(">stable<") && svg.contains(">across<"), "{svg}");
        assert!(!svg.contains("no dots") && !svg.contains("far dots"), "{svg}");
    }

    #[test]
    fn meanings_of_strokes_end_the_legend_and_names_stand_beside_solid_keys() {
        let mut figure = small();
        figure.series.remove(0);
        let dashed =
            |figure: &Figure| figure.to_svg().expect("drawn").matches("stroke-dasharray").count();
        let own = dashed(&figure);
        figure.strokes = vec![(Stroke::Solid, "attracts".to_owned())];
        assert_eq!(dashed(&figure), own - 1);
        assert!(figure.to_svg().expect("drawn").contains(">attracts<"));
    }

    #[test]
    fn a_scale_of_colours_has_a_zero_in_its_middle() {
        let mut figure = small();
        figure.cells = Some(CellChart {
            horizontal: (0.0, 1.0),
            vertical: (0.0, 1.0),
            columns: 1,
            rows: 1,
            cells: vec![Some(0)],
            categories: vec![CellCategory::new("", CellColor::Signed(0.5))],
            bar: Some(ColorBar { label: "λ".to_owned(), largest: 30.0 }),
        });
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.contains(">−20<") && svg.contains(">20<") && svg.contains("λ"), "{svg}");
    }

    #[test]
    fn dark_pages_exchange_the_inks_and_keep_the_colours_of_cells() {
        let mut figure = small();
        let light = figure.to_svg().expect("drawn");
        let (style, rest) = light.split_once("</style>").expect("a style");
        assert!(style.contains("prefers-color-scheme:dark"), "{style}");
        for color in ["#ffffff", "#1f2328"] {
            assert!(style.contains(&format!(".grazemap-figure [fill=\"{color}\"]")), "{style}");
            assert!(rest.contains(&format!("fill=\"{color}\"")), "{rest}");
        }
        figure.cells = Some(CellChart {
            horizontal: (0.0, 1.0),
            vertical: (0.0, 1.0),
            columns: 1,
            rows: 1,
            cells: vec![Some(0)],
            categories: vec![CellCategory::new("none", CellColor::Chaos)],
            bar: None,
        });
        let svg = figure.to_svg().expect("drawn");
        assert!(svg.contains("style=\"fill:#f4a582\""), "{svg}");
    }

    #[test]
    fn dots_under_others_show_a_rim_and_fewer_dots_are_larger() {
        let radii = |count: usize| -> Vec<f64> {
            let points = || (0..count).map(|k| [k as f64, (k * k % 97) as f64]).collect();
            let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
            figure.series.push(Series::dots("", points()));
            figure.series.push(Series::dots("", points()));
            let svg = figure.to_svg().expect("drawn");
            let parts = svg.split(" r=\"").skip(1);
            parts
                .map(|part| part.split('"').next().unwrap_or("").parse().expect("a radius"))
                .collect()
        };
        let few = radii(100);
        assert!(few[0] > 1.5 * few[199], "{few:?}");
        let many = radii(1000);
        assert!(few[0] > many[0] && many[0] > 1.5 * many[1999], "{} {}", few[0], many[0]);
    }
}
