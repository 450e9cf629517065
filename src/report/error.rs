//! Errors in laying out or writing results.

use std::path::PathBuf;

/// Error in laying out or writing a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The number of values does not fit the shape of the array.
    #[error("an array of shape {shape:?} takes {expected} values, found {found}")]
    ArrayShape {
        /// The shape asked for.
        shape: Vec<usize>,
        /// Product of the shape; `usize::MAX` if it overflows.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A figure could not be drawn.
    #[error(transparent)]
    Figure(#[from] grazemap_figure::FigureError),
    /// The page's template could not be filled.
    #[error("the page could not be laid out")]
    Template(#[from] tera::Error),
    /// A value could not be written as JSON.
    #[error("the value could not be written as JSON")]
    Json(#[from] serde_json::Error),
    /// A table could not be written as CSV.
    #[error("the table could not be written as CSV")]
    Csv(#[from] csv::Error),
    /// The destination of a result refused it.
    #[error("the result could not be written: {0}")]
    Refused(#[from] std::io::Error),
    /// A file name would leave the output folder.
    #[error("`{name}` does not name a file inside the output folder")]
    OutsideFolder {
        /// File name.
        name: String,
    },
    /// A file or folder could not be written.
    #[error("cannot {action} {path}: {source}", path = path.display())]
    Write {
        /// The step that failed, as a verb.
        action: &'static str,
        /// File or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}
