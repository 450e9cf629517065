//! Parts that several programs of the studies share, or that tests of the whole take a part of.
//!
//! A study is a program under `src/bin`, through the library alone; each writes its page, tables
//! and figures into `docs/studies`, or prints a table.

pub mod adversary;
pub mod agreement;
pub mod extremes;
pub mod held;
pub mod soft_to_rigid;
pub mod study;

use std::path::Path;

/// Folder of the workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}
