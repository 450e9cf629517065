//! The program as its users meet it, the pages of the guide, and the floors of the house.

#[path = "../support/mod.rs"]
mod support;

mod architecture;
mod bad_input;
mod benchmark;
mod cli;
#[cfg(unix)]
mod fuzz;
mod gallery;
mod guide;
mod packaging;
mod quickstart;
mod window_edges;
