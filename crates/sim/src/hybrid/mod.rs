//! Direct event-driven simulation: impacts, contact phases, chattering, sticking.
//!
//! Direct simulation is the reference for every expansion, and competitive in speed: exact steps
//! where free flight is affine, Taylor steps elsewhere. The polynomials of the gap are searched for
//! *every* crossing and *every* local minimum, so that no low-velocity impact is missed, in `f64`
//! and in double-double.
//!
//! Deliberately absent: expansions of Poincaré maps, orbits, truncation. See
//! docs/mathematics/direct-simulation.md.

mod affine;
mod lane_flight;
mod lane_flow;
mod lane_returns;
mod motion;
mod passage;
mod response;
mod return_map;
mod rough_contact;
mod rough_variation;
mod sampling;
mod search;
mod simulator;
mod stationary;
mod stepping;
mod system;
mod trajectory;
mod variation;
mod varied_return;

pub use lane_returns::{LaneImages, LaneReturns};
pub use motion::Regime;
pub use return_map::DirectReturn;
pub use sampling::{Moment, MomentEvent, Recorder};
pub use simulator::Simulator;
pub use system::{FlowMethod, HybridSystem};
pub use trajectory::{
    Event, EventKind, HybridError, NominalPassage, Outcome, Return, ReturnOutcome, ReturnSection,
    Trajectory,
};
pub use variation::Variation;
pub use varied_return::VariedReturn;
