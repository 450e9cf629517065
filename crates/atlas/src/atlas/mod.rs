//! A map tabulated over a region: the tree of boxes, their polynomials, and the stroboscopic return
//! of an oscillator as the map.
//!
//! The tree knows of no dynamics: any [`Tabulated`] map may be held. Deliberately absent: files,
//! threads.

mod cell;
mod flight;
mod patch;
mod region;
mod strobe;
mod tree;

pub use cell::Cell;
pub use patch::{Patch, Piece, Side};
pub use region::{Axis, AxisInput, Region, RegionError};
pub use strobe::StroboscopicReturn;
pub use tree::{
    Answer, Atlas, AtlasOptions, Expansion, LeafCounts, Measurement, OptionsError, Tabulated,
};
