//! The program as users see it, README and the pages of the guide, and the architecture.

#[path = "../support/mod.rs"]
mod support;

mod architecture;
mod bad_input;
mod benchmark;
mod cli;
mod documents;
#[cfg(unix)]
mod fuzz;
mod gallery;
mod guide;
mod packaging;
mod quickstart;
mod readme;
mod tutorials;
mod window_edges;
