//! Local maps as Rust source text.
