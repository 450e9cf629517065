//! Grazemap: fast, measured local maps of oscillators that graze a stop.

pub mod numeric;
pub mod model;
pub mod report;
