//! Affine fields, recognised from the expression graph, and their exact flow.

mod economy;
mod expressions;
mod flow;
mod form;
mod matrix;
mod nodes;
mod rows;
mod span;

pub use expressions::{AffineExpressions, AffineRows};
pub use flow::AffineFlow;
pub use matrix::AffineFieldRows;
pub(crate) use nodes::{Backend, Batch, NumberMask, RoundedNumber, Single};
pub use rows::RowTable;
pub(crate) use span::SpanTables;
