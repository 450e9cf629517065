//! What can go wrong in a study of convergence.

use crate::analysis::AnalysisError;
use crate::expansion::ExpansionError;

/// A study of convergence that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConvergenceError {
    /// No sample point of the window has an image that the map could be compared with.
    #[error(
        "of {tried} sample points in the window none returns with no contact but those of the \
            grazing passages: the window reaches beyond the local map"
    )]
    NoTruth {
        /// Points tried.
        tried: usize,
    },
    /// An image by simulation failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// An expansion failed.
    #[error(transparent)]
    Expansion(#[from] ExpansionError),
}

impl ConvergenceError {
    /// Whether an expansion failed as [`ExpansionError::is_overflow`] says.
    pub fn is_overflow(&self) -> bool {
        matches!(self, Self::Expansion(error) if error.is_overflow())
    }
}
