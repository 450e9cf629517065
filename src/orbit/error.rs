//! What can go wrong before the mathematics of an orbit begins.

use crate::flow::FlowError;
use crate::jet::JetError;
use crate::numeric::{NumericError, Shown};

/// Wrong input to the location of a grazing orbit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// Not one adjusted parameter per independent graze.
    #[error(
        "one parameter is adjusted for every independent graze: `solve_for` names {named}, and {most} at most are independent"
    )]
    AdjustedParameters {
        /// Number of parameters named.
        named: usize,
        /// Most independent grazes: the passages, or the pairs of mirrored ones.
        most: usize,
    },
    /// A symmetric orbit with a passage that has no mirror image.
    #[error(
        "with `symmetry = \"half-period\"` the second half of the passages mirrors the first; {passages} cannot be halved"
    )]
    UnpairedPassages {
        /// Number of passages named.
        passages: usize,
    },
    /// A symmetric orbit of an even number of forcing periods.
    #[error(
        "no orbit of {periods} forcing periods is its own image under (x, theta) -> (-x, theta + period/2): its half lasts whole periods"
    )]
    EvenPeriods {
        /// Forcing periods of the orbit.
        periods: usize,
    },
    /// A model that lacks the symmetry asked for.
    #[error(
        "the model lacks the half-period symmetry: at the phase {phase} the rate of `{component}` is {rate:.6e}, at the mirrored state {mirrored:.6e} and not its negative"
    )]
    NotSymmetric {
        /// The state component.
        component: String,
        /// Phase of the point.
        phase: f64,
        /// Its rate at the point.
        rate: f64,
        /// Its rate at the mirror image.
        mirrored: f64,
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
    #[error("the phase must advance: its rate is {}", Shown(*rate))]
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
    /// The multipliers could not be computed.
    #[error(transparent)]
    Numeric(#[from] NumericError),
}
