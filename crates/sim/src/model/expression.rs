//! The expression language: text in, a node of the graph out.
//!
//! A Pratt parser that builds the graph as it reads, so that there is no tree whose depth a hostile
//! text could choose. Grammar, loosest first: `+ -`, `* /`, unary `-` `+`, `^` (to the right, so
//! `-x^2 = -(x^2)` and `2^-1` is a half), then numbers, names, `pi`, function calls and
//! parentheses.

mod error;
mod lexer;
mod parser;

pub use error::ExpressionError;
pub(super) use error::Spanned;
pub(super) use lexer::names_in;
pub(super) use parser::{Resolved, parse};
