//! From a scene to its grazing orbit, its local map, and all that a map is used for.
//!
//! Every step returns an owned value, `Send + Sync`, that can be saved and read back with the same
//! bits: [`Scene`](crate::Scene), [`Graze`], [`Settled`], [`Map`]. Section, orders and shape are
//! settled once, on the way from one to the next, and each expansion is made once.
//!
//! Deliberately absent: numerics of its own, arguments, words for people.

mod emit;
mod error;
mod graze;
mod map;
mod saved;

pub use emit::{EmitRequest, write_emitted};
pub use error::Error;
pub use graze::{FindGraze, Graze, Settled, StudyRequest, parameter_number};
pub use map::{Image, Map, Plan};
pub use saved::{Source, is_standard};
