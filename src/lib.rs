//! Grazemap: fast, measured local maps of oscillators that graze a stop.
//!
//! A description of an impact oscillator (a [`Scene`]) becomes a [`GrazingOrbit`], that becomes a
//! [`LocalMap`], which is iterated as a [`DiscreteMap`], emitted as Rust code ([`EmittedCrate`]),
//! and measured against direct event-driven simulation ([`ConvergenceStudy`]). Data flows one way:
//! each module knows those before it and none after it.
//!
//! # A first application
//!
//! ```rust,test_harness
#![doc = include_str!("../tests/program/quickstart.rs")]
//! ```

pub use grazemap_sim::{flow, hybrid, jet, model, numeric};

pub mod orbit;

pub mod expansion;

pub mod emission;

pub mod iteration;

pub mod analysis;

pub mod convergence;

pub mod report;

pub mod pipeline;

/// The nouns and verbs of a first application.
pub mod prelude {
    pub use crate::{DiscreteMap, Error, FindGraze, Graze, Map, Scene};
}

pub use analysis::diagram::Diagram;
pub use convergence::ConvergenceStudy;
pub use emission::EmittedCrate;
pub use expansion::{Expander, LocalMap, MapOrders};
pub use iteration::{DiscreteMap, HornerMap};
pub use model::{Model, Scene};
pub use orbit::GrazingOrbit;
pub use pipeline::{Error, FindGraze, Graze, Map};
