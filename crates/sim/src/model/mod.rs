//! The scene language: TOML and expressions in, a checked [`Model`] and [`Scene`] out.
//!
//! Deliberately absent: a fixed scalar type (constants are kept to 32 digits).

pub mod catalogue;
mod error;
mod expression;
mod fraction;
pub mod graph;
mod names;
mod oscillator;
mod scene;
mod snippet;
mod stick;

pub use error::{OverrideReason, Repeats, SceneError, SceneHeadline, SceneProblem};
pub use expression::ExpressionError;
pub use graph::{Binary, CornerOperation, ExpressionGraph, Node, NodeId, Unary};
pub use names::nearest;
pub use oscillator::{Model, Parameter, Phase, Response, Surface};
pub use scene::*;
pub use stick::stick_field;
