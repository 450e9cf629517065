//! Emitted code: compiled, run, and compared with the maps it was emitted from.

#[path = "../support/mod.rs"]
mod support;

mod c;
mod generated;
mod rust;
mod scripts;
mod single;
