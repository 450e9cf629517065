//! Work on the repository: the record of all bits, campaigns, the benchmark's tables, emitted
//! maps.
//!
//! Every module is a command of the program; tests of the whole run a short part of it.

pub mod benchmark;
pub mod fuzz;
pub mod generated;
pub mod independent;
pub mod interruptions;
pub mod near_grazing;
mod program;
mod random;
pub mod random_oscillators;
pub mod record;
pub mod section_phases;

use std::error::Error;
use std::path::Path;

/// Result of a command: what it found, or why it could not look.
pub type Outcome = Result<Verdict, Box<dyn Error>>;

/// Finding of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Everything is as it should be.
    Good,
    /// Something is not; it was printed.
    Faulty,
}

impl Verdict {
    /// Verdict by the number of faults.
    fn of(faults: usize) -> Self {
        if faults == 0 { Self::Good } else { Self::Faulty }
    }
}

/// Folder of the workspace.
fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}
