//! Bifurcation diagrams: what a map settles on, parameter by parameter, the last state carried
//! along.
//!
//! One idea: a sweep knows a map only as a [`SweptMap`], so that the local map, direct simulation
//! and a map written by hand are swept, observed and timed by the same code.

mod attractor;
mod course;
mod data;
mod engine;
mod observe;
mod start;
mod sweep;
mod swept_map;

pub use data::{Diagram, DiagramPoint, Sweep, SweepHeading, Timing};
pub use engine::{DiagramPlan, diagram, run_plan};
pub use observe::Observer;
pub use start::SmoothFixedPoint;
pub use sweep::SweepRequest;
pub(super) use sweep::{kept_contacts, made, name, offsets, outside};
pub use swept_map::{DirectSweep, FrozenSweep, Settled, Start, SweptMap, UnobservedSweep};
