//! Why a contact cannot be flown.

/// What keeps a contact from being flown exactly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// The contact field is not affine with constant coefficients.
    #[error(
        "the contact of surface `{surface}` cannot be flown: the rate of `{component}` is not affine in `{state}` with a coefficient that no active parameter moves; use the shape `factored`"
    )]
    Field {
        /// Name of the surface.
        surface: String,
        /// State whose rate it is.
        component: String,
        /// State on which the rate depends otherwise.
        state: String,
    },
    /// The release function is not affine with constant coefficients.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its release function is not affine in `{state}` with a coefficient that no active parameter moves; use the shape `factored`"
    )]
    Release {
        /// Name of the surface.
        surface: String,
        /// State on which the release function depends otherwise.
        state: String,
    },
    /// The contact time is not proportional to the depth variable.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its contact time begins with y^{power}, expected y^1"
    )]
    ContactTime {
        /// Name of the surface.
        surface: String,
        /// Power of `y`.
        power: usize,
    },
    /// The largest depth is none.
    #[error(
        "the contact of surface `{surface}` cannot be flown up to depth {depth:e}: expected a positive, finite one"
    )]
    Depth {
        /// Name of the surface.
        surface: String,
        /// `y²`.
        depth: f64,
    },
    /// A contact of the window does not end.
    #[error(
        "the contact of surface `{surface}` cannot be flown: at depth {depth:e} it has no release within {steps} steps"
    )]
    NoRelease {
        /// Name of the surface.
        surface: String,
        /// `y²`.
        depth: f64,
        /// Steps tried.
        steps: usize,
    },
    /// A contact lasts for many of its own times.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its longest contact takes {steps} steps, at most {most} are emitted; the law is too strongly damped"
    )]
    TooLong {
        /// Name of the surface.
        surface: String,
        /// Steps it takes.
        steps: f64,
        /// Steps emitted at most.
        most: usize,
    },
    /// A fixed number of steps does not fly every contact of the window.
    #[error(
        "the contact of surface `{surface}` cannot be flown in a fixed number of steps: at depth {depth:e} the image errs by {error:e} of the kick"
    )]
    Inexact {
        /// Name of the surface.
        surface: String,
        /// `y²` of the worst contact.
        depth: f64,
        /// Largest error, relative to what the contact adds.
        error: f64,
    },
}
