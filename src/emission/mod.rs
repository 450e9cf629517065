//! Emission of local maps as source code in seven languages, and as WebAssembly. One straight-line
//! kernel is printed in the syntax of a language, one constant each, by templates that hold only
//! layout; or written as instructions.
//!
//! Deliberately absent: dynamics. This floor sees polynomials.

mod emitted_crate;
mod error;
mod language;
mod layout;
mod module;
mod names;
mod options;
mod syntax;
mod wasm;

pub use emitted_crate::{Difference, EmittedCrate};
pub use error::EmissionError;
pub use module::{EmittedModule, emitted_module};
pub use names::{checked_identifier, comment, shell_word, string_literal};
pub use options::{EmitOptions, EmittedShape, FORMAT, Target};
