//! The scene language: TOML and expressions in, a checked [`Model`] and [`Scene`] out.
//!
//! Deliberately absent: any one scalar type of a computation (constants are kept to 32 digits).

pub mod graph;
mod oscillator;
mod scene;

pub use graph::{Binary, ExpressionGraph, Node, NodeId, Unary};
pub use oscillator::{Model, Parameter, Phase, Response, Surface};
pub use scene::*;
