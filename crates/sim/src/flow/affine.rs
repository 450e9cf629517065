//! Affine fields, recognised from the expression graph, and their exact flow.

mod economy;
mod expressions;
mod fixed;
mod flow;
mod form;
mod lane_leaps;
mod lane_nodes;
mod leaps;
mod looks;
mod matrix;
mod nodes;
mod rows;

pub use expressions::{AffineExpressions, AffineRows};
pub(crate) use fixed::{FixedLeaps, FixedVisit, SERIES, ShapedLeaps};
pub use flow::{AffineFieldRows, AffineFlow};
pub(crate) use lane_leaps::LaneLeaps;
pub use leaps::AffineLeaps;
pub(crate) use leaps::{LeapTables, NumberMask, RoundedNumber};
pub(crate) use rows::FixedRows;
pub use rows::RowTable;
