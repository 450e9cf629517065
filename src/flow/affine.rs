//! Affine fields, recognised from the expression graph, and their exact flow.

mod expressions;
mod flow;
mod form;
mod leaps;
mod matrix;
mod series;

pub use expressions::{AffineExpressions, AffineRows};
pub use flow::{AffineFieldRows, AffineFlow, dot};
pub use leaps::AffineLeaps;
