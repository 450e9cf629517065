//! Exact free flight of a model whose free flow is affine.
//!
//! One idea: with all expressions as rows over one extended state (`flow::AffineExpressions`),
//! flows, gaps, their derivatives and resets are products with that state. Free flight proceeds by
//! exact steps from event to event (`exact_step`): each gap is tested on each piece of a span
//! (`enclosure`) by its control points (`polygon`), then zeros and minima are located (`zeros`).
//! Shorter steps of the same flow (`extended`) serve contacts, and flights that exact steps leave
//! undecided. Parts that are not affine (a contact's field, a reset) are treated in the general
//! way. The same code serves one orbit and several in lanes (`tools`).

mod enclosure;
mod exact_step;
mod extended;
mod polygon;
mod system;
mod tools;
mod zeros;

pub(super) use system::AffineSystem;
pub(super) use tools::{AffineTools, LaneTools, OrbitTables};
