//! Grazemap: bifurcation analysis of oscillators that hit a stop.
//!
//! A [`Scene`] describes an impact oscillator. [`graze`](FindGraze::graze) finds the orbit that
//! just touches the stop, [`map`](Graze::map) expands the Poincaré map near it, and a [`Map`] is
//! [stepped](Map::step) and [iterated](Map::iterate), [emitted](Map::emit) as Rust code, drawn as
//! [diagram](Map::diagram) or [chart](Map::chart), and [measured](Map::study) against event-driven
//! simulation. Every value is owned, `Send + Sync`, and [saved](Map::save) and [loaded](Map::load)
//! with its bits.
//!
//! # A first application
//!
//! ```rust,test_harness
#![doc = include_str!("../tests/program/quickstart.rs")]
//! ```
//!
//! # The floors
//!
//! Data flows one way: each module knows those before it and none after it. [`pipeline`] is the way
//! through them that programs take; what it does can be done by hand on each floor.

pub use grazemap_map::{
    analysis, atlas, convergence, expansion, flow, hybrid, interruption, iteration, jet, model,
    numeric, orbit,
};

pub mod emission;

pub mod report;

pub mod pipeline;

/// The nouns and verbs of a first application.
pub mod prelude {
    pub use crate::{DiscreteMap, Error, FindGraze, Graze, Map, Scene};
}

pub use analysis::chart::Chart;
pub use analysis::diagram::Diagram;
pub use convergence::ConvergenceStudy;
pub use emission::EmittedCrate;
pub use expansion::{Expander, LocalMap};
pub use iteration::{DiscreteMap, HornerMap};
pub use model::{MapOrders, Model, Scene};
pub use orbit::GrazingOrbit;
pub use pipeline::{Error, FindGraze, Graze, Image, Map};
