//! Path from a scene to its grazing orbit, its local map and every analysis that uses the map.
//!
//! Every step returns an owned value, `Send + Sync`, that can be saved and read back bit by bit:
//! [`Scene`](crate::Scene), [`Graze`], [`Settled`], [`Map`]. Section, orders and shape are settled
//! once between these steps, and each expansion is computed once.
//!
//! The program's commands are functions here, with keys and defaults, that return an [`Answer`].
//!
//! Deliberately absent: numerics of its own, arguments, words for people.

mod answer;
mod branch_graze;
mod commands;
mod device;
mod emit;
mod error;
mod graze;
mod keys;
mod map;
mod memory;
mod offsets;
#[cfg(feature = "cli")]
pub mod options;
mod points;
mod positions;
mod run;
mod saved;
mod simulated;
mod sweeps;

pub use answer::{Answer, Extent, Results};
pub use branch_graze::{BranchPlace, SearchFromBranch};
pub use commands::{
    AskedTrajectory, AtlasFile, AtlasKeys, BranchKeys, Command, ContactKeys, ConvergenceKeys,
    CurveKeys, DerivativesKeys, FitKeys, FoldsAndFlips, LociKeys, NearestKeys, NoiseKeys,
    OrbitsKeys, SafeKeys, TrajectoryKeys,
};
pub use device::Device;
pub use emit::{EmitRequest, write_emitted};
pub use error::{BranchPlaceError, Ended, Error};
pub use graze::{FindGraze, Graze, Settled, StudyRequest, parameter_number};
pub use keys::{KeyError, OrbitsOf};
pub use map::{Image, Map, Plan};
pub use memory::refuse_memory;
pub use points::{Images, Points};
pub use positions::{Counting, Ends, Origin, Position, finite};
pub use run::{RunWatch, run};
pub use saved::{Source, bounded, is_standard};
pub use sweeps::{BasinKeys, Drawable, Drawn};
