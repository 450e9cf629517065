//! A model whose free flight is affine, taken apart for its exact flow.
//!
//! One idea: with all expressions as rows over one extended state (`flow::AffineExpressions`),
//! flows, gaps, their derivatives and resets are products with it. Free flight goes by exact steps
//! from event to event (`exact_step`): a test of each gap on each piece of a span (`enclosure`) by
//! what its control points say (`polygon`), zeros and minima (`zeros`). Shorter steps of the same
//! flow (`extended`) are for contacts and for what exact steps leave undecided. What is not affine
//! (a contact's field, a reset) keeps the general way. One text serves one orbit and several in
//! lanes (`tools`).

mod enclosure;
mod exact_step;
mod extended;
mod polygon;
mod system;
mod tools;
mod zeros;

pub(super) use system::AffineSystem;
pub(super) use tools::{AffineTools, LaneTools, OrbitTables};
