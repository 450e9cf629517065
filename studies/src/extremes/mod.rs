//! Cases of the study, and the measurement of a case.
//!
//! Every expansion has an estimate of its accuracy: the smaller of truncation (`WindowEdge`) and
//! rounding (`LostDigits`). A case whose measured digits fall short of its estimate is a silent
//! loss.

pub mod cases;
mod closed_form;
pub mod data;
pub mod measure;
