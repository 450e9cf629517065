//! Affine fields, recognised from the expression graph, and their exact flow.

mod economy;
mod expressions;
mod flow;
mod form;
mod leaps;
mod looks;
mod matrix;
mod nodes;
mod rows;

pub use expressions::{AffineExpressions, AffineRows};
pub use flow::{AffineFieldRows, AffineFlow};
pub use leaps::AffineLeaps;
pub use rows::RowTable;
