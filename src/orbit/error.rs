//! What can go wrong before the mathematics of an orbit begins.

use crate::flow::FlowError;
use crate::jet::JetError;

/// Wrong input to the location of a grazing orbit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// The scene grazes more than once a period.
    #[error(
        "the scene names {passages} grazing passages; one passage per period is what can be located"
    )]
    SeveralPassages {
        /// Number of passages named.
        passages: usize,
    },
    /// The scene asks for a symmetric orbit.
    #[error("`symmetry = \"half-period\"` is not supported; use \"none\"")]
    HalfPeriodSymmetry,
    /// Not exactly one parameter is adjusted.
    #[error("one parameter is adjusted for one graze; `solve_for` names {named}")]
    AdjustedParameters {
        /// Number of parameters named.
        named: usize,
    },
    /// A stroboscopic section of an autonomous system.
    #[error("a stroboscopic section needs a forcing phase; the model has none")]
    StroboscopicWithoutPhase,
    /// An autonomous system whose limit cycle nothing points to.
    #[error(
        "without a forcing phase the orbit is found from a `guess` of its grazing point; [grazing] gives none"
    )]
    AutonomousWithoutGuess,
    /// The forcing does not advance.
    #[error("the phase must advance: its rate is {rate:e}")]
    PhaseRate {
        /// The rate at the scene's parameters.
        rate: f64,
    },
    /// A guess of the wrong length.
    #[error("the guess has {found} components, the full state has {expected}")]
    GuessLength {
        /// Components expected.
        expected: usize,
        /// Components found.
        found: usize,
    },
    /// The second parameter of a curve cannot be one that is already adjusted, or does not exist.
    #[error("parameter {parameter} cannot be the second parameter of a grazing curve")]
    SecondParameter {
        /// Its index.
        parameter: usize,
    },
    /// The flow could not be computed.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// First-order jets could not be set up.
    #[error(transparent)]
    Jet(#[from] JetError),
}
