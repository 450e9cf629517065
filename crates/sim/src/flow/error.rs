//! What can go wrong along a smooth flow.

use crate::jet::JetError;

/// Error of an integration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// The solution or the field left the finite numbers.
    #[error("the vector field is not finite here (Taylor coefficient {degree})")]
    NotFinite {
        /// Degree of the first Taylor coefficient looked at that is not finite.
        degree: usize,
    },
    /// The step limit was reached.
    #[error("no end after {limit} steps; {remaining:e} of the time remains")]
    TooManySteps {
        /// The limit.
        limit: usize,
        /// Time left.
        remaining: f64,
    },
    /// The space of jets could not be made.
    #[error(transparent)]
    Jet(#[from] JetError),
}
