//! A model whose free flight is affine, taken apart for its exact flow.
//!
//! One idea: with all expressions as rows over one extended state (`flow::AffineExpressions`),
//! flows, gaps, their derivatives and resets are products with it. Free flight goes by exact steps
//! from event to event (`exact_step`): a test of each gap on each piece of a span (`enclosure`) by
//! what its control points say (`polygon`), zeros and minima (`zeros`). Taylor-like
//! steps (`flight`) are for contacts and for what exact steps leave undecided. What is not affine
//! (a contact's field, a reset) keeps the general way. One text serves one orbit (`tools`) and
//! several in lanes (`lane_tools`).

mod enclosure;
mod exact_step;
mod extended;
mod flight;
mod lane_tools;
mod polygon;
mod surface;
mod system;
mod tools;
mod zeros;

pub(super) use lane_tools::LaneTools;
pub(super) use system::AffineSystem;
pub(super) use tools::{AffineTools, OrbitTables};
