//! Code shared by several test binaries.
#![allow(dead_code, reason = "each binary uses a part of it")]

pub(crate) mod complex;
pub(crate) mod driver;
pub(crate) mod exact_flight;
pub(crate) mod foale;
pub(crate) mod reference;
pub(crate) mod scenes;
pub(crate) mod soft;
pub(crate) mod stages;
pub(crate) mod synthetic;
pub(crate) mod systems;
pub(crate) mod tiers;

use std::io::Write as _;

/// Whether this machine has registers of four doubles or more; without them nothing is simulated in
/// lanes.
///
/// If not, the test must return. This function then prints past the harness that the test was
/// skipped.
pub(crate) fn needs_wide_registers() -> bool {
    let is_wide = grazemap::numeric::is_wide();
    if !is_wide {
        let thread = std::thread::current();
        let test = thread.name().unwrap_or("a test");
        let reason = "there are no lanes without wide registers (AVX2, AVX-512 or NEON)";
        writeln!(std::io::stderr(), "skipped: {test}: {reason}").expect("standard error is open");
    }
    is_wide
}
