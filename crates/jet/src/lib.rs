//! Numbers and truncated power series: the two lowest floors of Grazemap, of use by themselves.
//!
//! [`numeric`] holds scalars (`f64`, `f32`, double-double, SIMD lanes) and their tools; [`jet`]
//! holds truncated power series over any of them. Nothing here knows of oscillators.

pub mod numeric;

pub mod jet;
