//! A map tabulated over a region: the tree of boxes, their polynomials, and the stroboscopic return
//! of an oscillator as the map.
//!
//! The tree knows of no dynamics: any [`Tabulated`] map may be held. Deliberately absent: files,
//! threads.

mod cell;
mod flight;
mod frozen;
mod interpolation;
mod patch;
mod region;
mod saved;
mod strobe;
mod tree;

pub use cell::Cell;
pub use frozen::FrozenLeaves;
pub use interpolation::Interpolation;
pub use patch::{Patch, Piece, Side};
pub use region::{Axis, AxisInput, Region, RegionError};
pub use saved::{RestoreError, SavedAtlas};
pub use strobe::StroboscopicReturn;
pub use tree::{
    Answer, Atlas, AtlasOptions, Expansion, LeafBox, LeafCounts, LeafKind, LeafShares, Measurement,
    OptionsError, Tabulated,
};
