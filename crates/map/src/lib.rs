//! Local maps of oscillators that graze a stop, and the computations with them.
//!
//! [`continuation`] follows curves of solutions, [`orbit`] finds a grazing orbit, [`expansion`]
//! expands the maps near it, [`iteration`] iterates them, [`analysis`] computes their dynamics by
//! map and by direct simulation, and [`convergence`] measures the error of the maps against
//! simulation. The floors below are re-exported under their names.

pub use grazemap_atlas::atlas;
pub use grazemap_sim::{flow, hybrid, interruption, jet, model, numeric};

pub mod continuation;

pub mod orbit;

pub mod expansion;

pub mod iteration;

pub mod analysis;

pub mod convergence;
