//! Atlases: the map of a section tabulated over a whole region, to a tolerance.
//!
//! [`atlas::Atlas`] divides a region of section coordinates and parameters into dyadic boxes, and
//! holds in each a polynomial of the map, or two that meet where the orbit grazes. Boxes are
//! divided when an orbit first comes to them. The floors below are re-exported under their names.
//! See docs/mathematics/atlas.md.

pub use grazemap_sim::{flow, hybrid, interruption, jet, model, numeric};

pub mod atlas;
