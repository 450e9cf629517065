//! Local maps as source text, in Rust, C or CUDA: one straight-line kernel, printed by templates
//! that hold layout only.
//!
//! Deliberately absent: dynamics. This floor sees polynomials.

mod arrangement;
mod comparison;
mod emitted_crate;
mod error;
mod header;
mod language;
mod layout;
mod module;
mod names;
mod printing;
mod pruning;
mod target;

pub use emitted_crate::{Difference, EmittedCrate};
pub use error::EmissionError;
pub use module::{EmitOptions, EmittedModule, EmittedShape, FORMAT, emitted_module};
pub use names::{checked_identifier, comment, string_literal};
pub use pruning::{PruneReport, prune, prune_composed};
pub use target::Target;
