//! Numbers and truncated power series: the lowest floors of Grazemap, useful by themselves.
//!
//! [`interruption`] ends a computation whose result its caller no longer wants. [`numeric`] holds
//! scalars (`f64`, `f32`, double-double, SIMD lanes) and their tools; [`jet`] holds truncated power
//! series over any of them. Nothing here depends on oscillators.

pub mod interruption;

pub mod numeric;

pub mod jet;
