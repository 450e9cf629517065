//! The scene language, flows of smooth fields and direct event-driven simulation of oscillators
//! with stops.
//!
//! [`model`] reads a scene, [`flow`] integrates one smooth field, [`hybrid`] simulates from event
//! to event. The floors below, [`interruption`], [`numeric`] and [`jet`], are re-exported under
//! their names.

pub use grazemap_jet::{interruption, jet, numeric};

pub mod model;

pub mod flow;

pub mod hybrid;
