//! Numbers and truncated power series: the lowest floors of Grazemap, of use by themselves.
//!
//! [`interruption`] ends a computation that its caller no longer wants. [`numeric`] holds scalars
//! (`f64`, `f32`, double-double, SIMD lanes) and their tools; [`jet`] holds truncated power series
//! over any of them. Nothing here knows of oscillators.

pub mod interruption;

pub mod numeric;

pub mod jet;
