//! What can be wrong with what the simulator is asked.

/// Wrong input to a direct simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HybridError {
    /// The state has another length than the model's full state.
    #[error("the full state has {expected} components, {found} were given")]
    StateLength {
        /// Components of the full state.
        expected: usize,
        /// Components given.
        found: usize,
    },
    /// The parameter vector has another length than the model's.
    #[error("the model has {expected} parameters, {found} were given")]
    ParameterLength {
        /// Parameters of the model.
        expected: usize,
        /// Parameters given.
        found: usize,
    },
    /// A component of the state, a parameter or a duration is not finite.
    #[error("component {component} of the input is not a finite number")]
    NotFinite {
        /// Position in the input: the full state, then the parameters.
        component: usize,
    },
    /// No such surface.
    #[error("surface {surface} does not exist: the model has {surfaces}")]
    NoSuchSurface {
        /// Index asked for.
        surface: usize,
        /// Surfaces of the model.
        surfaces: usize,
    },
    /// The first passage of a return from a passage is not the one it starts at.
    #[error("the first passage must be that of the section: at surface {surface}, at time 0")]
    FirstPassage {
        /// Surface of the section.
        surface: usize,
    },
    /// A passage is not within the return.
    #[error("passage {passage} at time {time:e} is not within a return that takes {duration:e}")]
    PassageTime {
        /// Number of the passage, from 0.
        passage: usize,
        /// Its nominal time.
        time: f64,
        /// Nominal return time.
        duration: f64,
    },
    /// The system has no forcing phase, so it has no forcing period.
    #[error("the model has no forcing phase, so no forcing period")]
    NoPhase,
    /// The phase does not advance.
    #[error("the phase advances at the rate {rate:e}; a positive rate is needed")]
    PhaseRate {
        /// Its rate.
        rate: f64,
    },
}
