//! What can go wrong while a figure is drawn.

/// A figure that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// An axis range that is empty, not finite, or not positive on a logarithmic axis.
    #[error("axis `{axis}` cannot show the range {lower:e} to {upper:e} on a {scale} scale")]
    AxisRange {
        /// Label of the axis.
        axis: String,
        /// Lower end asked for.
        lower: f64,
        /// Upper end asked for.
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
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// Smallest side that is drawn.
        smallest: u32,
        /// Largest side that is drawn.
        largest: u32,
    },
    /// The bitmap backend refused to draw.
    #[error("the bitmap could not be drawn: {0}")]
    Bitmap(String),
    /// The PNG encoder refused the bitmap.
    #[error("the PNG could not be encoded")]
    Png(#[from] png::EncodingError),
}
