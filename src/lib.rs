//! Grazemap: fast, measured local maps of oscillators that graze a stop.

pub mod numeric;

pub mod jet;

pub mod model;

pub mod flow;

pub mod hybrid;

pub mod orbit;

pub mod expansion;

pub mod emission;

pub mod iteration;

pub mod analysis;

pub mod convergence;

pub mod report;

pub mod cli;
