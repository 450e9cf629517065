//! What happens at a surface during a passage, lowered for jets, and what can be wrong with it.

use super::flown::{AffineLaw, FlightError};
use crate::flow::{Field, Program};

/// The contact law of a surface, inactive parameters folded in.
#[derive(Clone, Debug)]
pub enum ContactLaw {
    /// A reset: the state jumps.
    Rigid {
        /// The reset, a program over jets.
        reset: Program,
    },
    /// A contact field, followed until its release function vanishes.
    Compliant {
        /// The contact field; watched are the release function, then the event function.
        field: Field,
        /// The law as one that can be flown exactly, or why it cannot.
        flight: Box<Result<AffineLaw, FlightError>>,
    },
}

/// A contact law that has no expansion in powers of `y` at this graze.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactLawError {
    /// A function at its corner or singularity on the surface.
    #[error(
        "the contact law of surface `{surface}` is not analytic at the graze: {function} of {argument:e} there; it has no Taylor series on the surface (a power of the depth that is not whole, as Hertz's, would need integrals over the contact in its place)"
    )]
    NotAnalytic {
        /// Name of the surface.
        surface: String,
        /// The function, with its exponent for a power.
        function: String,
        /// Its argument at the grazing point (for `min` and `max` the difference).
        argument: f64,
    },
    /// The contact field presses the state further in.
    #[error(
        "h'' = {contact_acceleration:e} along the contact field of surface `{surface}` at the graze (free: {free_acceleration:e}): the contact does not push back, and there is no release near the graze"
    )]
    Acceleration {
        /// Name of the surface.
        surface: String,
        /// `h''` along the contact field.
        contact_acceleration: f64,
        /// `h''` along the free field.
        free_acceleration: f64,
    },
    /// The release function has no positive root that vanishes with `y`.
    #[error(
        "the contact of surface `{surface}` has no release near the graze: the release function is {release:e} at the grazing point (h'' in contact {contact_acceleration:e}), and its leading balance has no positive root"
    )]
    NoRelease {
        /// Name of the surface.
        surface: String,
        /// The release function at the grazing point.
        release: f64,
        /// `h''` along the contact field.
        contact_acceleration: f64,
    },
    /// The first positive root of the leading balance is not simple.
    #[error(
        "the release of surface `{surface}` is not decided at leading order: its balance only touches zero, at contact time {factor:e} y^{power}"
    )]
    NotSimple {
        /// Name of the surface.
        surface: String,
        /// The root.
        factor: f64,
        /// Power of `y` of the contact time.
        power: usize,
    },
    /// The contact time goes with a fractional power of `y`.
    #[error(
        "the contact time of surface `{surface}` goes with y^({numerator}/{denominator}) at the graze: its expansion is not in whole powers of y"
    )]
    FractionalPower {
        /// Name of the surface.
        surface: String,
        /// Numerator of the power.
        numerator: usize,
        /// Denominator of the power.
        denominator: usize,
    },
    /// The balance at the grazing point does not hold beside it.
    #[error(
        "the release of surface `{surface}` changes its leading balance beside the grazing point: a coefficient {coefficient:e} of y^{power} in time power {time_power} vanishes only there"
    )]
    NotUniform {
        /// Name of the surface.
        surface: String,
        /// Power of the contact time.
        time_power: usize,
        /// Power of `y`.
        power: usize,
        /// The coefficient.
        coefficient: f64,
    },
}
