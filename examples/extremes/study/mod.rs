//! The cases of the study, and one case measured.
//!
//! One idea: every expansion comes with an estimate of what it is worth, the smaller of what its
//! truncation leaves out and what rounding took (`WindowEdge`, `LostDigits`); a case whose measured
//! digits fall short of it is a silent loss.

pub(crate) mod cases;
mod closed_form;
pub(crate) mod data;
pub(crate) mod measure;
