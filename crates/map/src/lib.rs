//! Local maps of oscillators that graze a stop, and what is computed with them.
//!
//! [`orbit`] finds a grazing orbit, [`expansion`] expands the maps near it, [`iteration`] iterates
//! them, [`analysis`] draws their dynamics beside direct simulation, and [`convergence`] measures
//! them against it. The floors below are re-exported under their names.

pub use grazemap_sim::{flow, hybrid, interruption, jet, model, numeric};

pub mod orbit;

pub mod expansion;

pub mod iteration;

pub mod analysis;

pub mod convergence;
