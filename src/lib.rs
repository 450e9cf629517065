//! Grazemap: fast, measured local maps of oscillators that graze a stop.

pub mod model;
pub mod numeric;
