//! Errors of the algorithms of this floor.

/// A broken promise to a numerical algorithm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NumericError {
    /// Elimination met a pivot too small to divide by.
    #[error(
        "expected a regular matrix, found pivot {pivot:e} in column {column} of equilibrated rows"
    )]
    Singular {
        /// Magnitude of the pivot, its rows scaled to a largest entry of about one.
        pivot: f64,
        /// Column of the pivot, counted from 0.
        column: usize,
    },
    /// A matrix or vector has the wrong shape.
    #[error(
        "expected {expected_rows} rows and {expected_columns} columns, found {rows} and {columns}"
    )]
    Shape {
        /// Rows needed.
        expected_rows: usize,
        /// Columns needed.
        expected_columns: usize,
        /// Rows given.
        rows: usize,
        /// Columns given.
        columns: usize,
    },
    /// A matrix holds an infinite entry or NaN.
    #[error("expected finite entries, found {value} in row {row}, column {column}")]
    NotFinite {
        /// The entry.
        value: f64,
        /// Its row, counted from 0.
        row: usize,
        /// Its column, counted from 0.
        column: usize,
    },
    /// The reduction to Schur form did not converge.
    #[error(
        "the eigenvalues of a matrix of {rows} rows did not converge in {iterations} iterations"
    )]
    NoSchurForm {
        /// Rows of the matrix.
        rows: usize,
        /// Iterations spent.
        iterations: usize,
    },
    /// The values at the ends of a bracket do not have opposite signs.
    #[error(
        "expected values of opposite signs, found {value_lower:e} at {lower} and \
            {value_upper:e} at {upper}"
    )]
    NoSignChange {
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
        /// Value at the lower end.
        value_lower: f64,
        /// Value at the upper end.
        value_upper: f64,
    },
}
