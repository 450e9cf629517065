//! Affine fields, recognised in the expression graph, and their exact flow.

mod form;
mod matrix;
mod nodes;
mod rows;
mod span;

pub use form::{AffineExpressions, AffineRows};
pub use matrix::{AffineFieldRows, AffineFlow};
pub(crate) use nodes::{Backend, Batch, NumberMask, RoundedNumber, Single};
pub use rows::RowTable;
pub(crate) use span::SpanTables;
