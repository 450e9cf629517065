//! Stops that harden: their scenes, their jumps by direct simulation, laws uniform in their
//! stiffness, and the law by which they tend to the rigid stop.

pub mod direct;
pub mod family;
pub mod law;
mod uniform;
