//! Errors of an expansion, of a contact law, and of an exactly flown contact.

use std::fmt;

use crate::flow::FlowError;
use crate::jet::JetError;
use crate::numeric::NumericError;
use crate::orbit::{NotLocated, OrbitError};

/// Error of an expansion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExpansionError {
    /// A jet space or an operation on jets failed.
    #[error(transparent)]
    Jet(#[from] JetError),
    /// Orders are so high that a map would take minutes.
    #[error(
        "`expansion.{key} = {order}`: one product of two series in {variables} variables takes \
         {products} products of coefficients, at most {most} are made; the highest that is not \
         refused is {highest}"
    )]
    TooMuchWork {
        /// `smooth_order` or `contact_weight`.
        key: &'static str,
        /// Value of that key.
        order: u32,
        /// Variables of the series.
        variables: usize,
        /// Products of coefficients in one product of two series.
        products: u128,
        /// Largest number of products allowed.
        most: u128,
        /// Highest value of the key that is allowed.
        highest: u32,
    },
    /// The flow of an expansion failed.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The flow through the hits of an orbit failed.
    #[error(transparent)]
    Orbit(Box<OrbitError>),
    /// The contact law of a compliant surface has no expansion.
    #[error(transparent)]
    ContactLaw(#[from] ContactLawError),
    /// A contact cannot be flown exactly.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// A flown map is requested, but every stop is rigid.
    #[error("there is no contact to fly: every stop is rigid; use the shape `factored`")]
    NothingToFly,
    /// A composed form is requested of a map with a flown contact.
    #[error("a map with a flown contact has no composed form: its contact is no polynomial")]
    FlownIsNoPolynomial,
    /// Linear algebra failed.
    #[error(transparent)]
    Numeric(#[from] NumericError),
    /// The depth cannot replace a coordinate.
    #[error("the depth -h_min has no slope along any coordinate of the section at the graze")]
    DepthWithoutSlope,
    /// The graze is not simple.
    #[error(
        "h'' = {normal_acceleration:e} at the grazing point: a simple graze needs a positive one"
    )]
    DegenerateGraze {
        /// Normal acceleration at the graze.
        normal_acceleration: f64,
    },
    /// The reset moves a state that only touches the surface.
    #[error(
        "the reset of surface `{surface}` moves a state that touches with zero normal velocity (by \
         {displacement:e}): its discontinuity mapping is not the identity at y = 0"
    )]
    ResetNotIdentityAtTangency {
        /// Name of the surface.
        surface: String,
        /// Largest coefficient of the displacement.
        displacement: f64,
    },
    /// The orbit is not an orbit of the oscillator with its stops.
    #[error(transparent)]
    NotAnOrbit(Box<NotLocated>),
    /// The orbit does not close on the section.
    #[error(
        "the orbit misses its own section point by {defect:e}: it is not periodic to the accuracy \
         of an expansion"
    )]
    NotPeriodic {
        /// Largest constant term of `P_smooth` in offsets.
        defect: f64,
    },
    /// A coefficient is not finite.
    #[error("a coefficient of {part} is not finite")]
    NotFinite {
        /// Part of the map.
        part: &'static str,
    },
}

impl From<OrbitError> for ExpansionError {
    fn from(error: OrbitError) -> Self {
        Self::Orbit(Box::new(error))
    }
}

impl ExpansionError {
    /// Whether the reason is that a contact cannot be flown at all, or not at these orders: its law
    /// does not allow it, or its coefficients overflow.
    pub fn is_not_flown(&self) -> bool {
        matches!(self, Self::Flight(_) | Self::NothingToFly) || self.is_overflow()
    }

    /// Whether coefficients, or their inputs, overflowed, which happens at high orders.
    pub fn is_overflow(&self) -> bool {
        matches!(
            self,
            Self::NotFinite { .. }
                | Self::Jet(JetError::NotFinite { .. })
                | Self::Flow(
                    FlowError::NotFinite { .. } | FlowError::Jet(JetError::NotFinite { .. })
                )
                | Self::Numeric(NumericError::NotFinite { .. })
        )
    }
}

impl From<NotLocated> for ExpansionError {
    fn from(reason: NotLocated) -> Self {
        Self::NotAnOrbit(Box::new(reason))
    }
}

/// Kind of the law of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawKind {
    /// Reset of a rigid stop.
    Impact,
    /// Field and release of a compliant stop.
    Contact,
}

impl fmt::Display for LawKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Impact => "impact",
            Self::Contact => "contact law",
        })
    }
}

/// Reason why a contact law has no expansion in powers of `y` at this graze.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactLawError {
    /// A function is at its corner or singularity on the surface.
    #[error(
        "the {law} of surface `{surface}` is not analytic at the graze: {function} of \
         {argument:.1e} there; it has no Taylor series on the surface and no map has its contacts; \
         direct simulation needs none (method `direct`)"
    )]
    NotAnalytic {
        /// Name of the surface.
        surface: String,
        /// Kind of the law.
        law: LawKind,
        /// Name of the function, with its exponent for a power.
        function: String,
        /// Argument of the function at the grazing point (the difference for `min` and `max`).
        argument: f64,
    },
    /// A power of the penetration has no place in an expansion.
    #[error(
        "the contact of surface `{surface}` has a power {exponent} of the penetration: {problem}"
    )]
    Power {
        /// Name of the surface.
        surface: String,
        /// Exponent of the power.
        exponent: f64,
        /// Reason.
        problem: PowerProblem,
    },
    /// The contact field pushes the state further in.
    #[error(
        "h'' = {contact_acceleration:e} along the contact field of surface `{surface}` at the \
         graze (free: {free_acceleration:e}): the contact does not push back, and there is no \
         release near the graze"
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
        "the contact of surface `{surface}` has no release near the graze: the release function is \
         {release:e} at the grazing point (h'' in contact {contact_acceleration:e}), and its \
         leading balance has no positive root"
    )]
    NoRelease {
        /// Name of the surface.
        surface: String,
        /// Release function at the grazing point.
        release: f64,
        /// `h''` along the contact field.
        contact_acceleration: f64,
    },
    /// The first positive root of the leading balance is not simple.
    #[error(
        "the release of surface `{surface}` is not decided at leading order: its balance only \
         touches zero, at contact time {factor:e} y^{power}"
    )]
    NotSimple {
        /// Name of the surface.
        surface: String,
        /// Contact time over the power of `y`, at the root.
        factor: f64,
        /// Power of `y` of the contact time.
        power: usize,
    },
    /// The contact time has a fractional leading power of `y`.
    #[error(
        "the contact time of surface `{surface}` goes with y^({numerator}/{denominator}) at the \
         graze: its expansion is not in whole powers of y"
    )]
    FractionalPower {
        /// Name of the surface.
        surface: String,
        /// Numerator of the power.
        numerator: usize,
        /// Denominator of the power.
        denominator: usize,
    },
    /// The leading balance at the grazing point does not hold near it.
    #[error(
        "the release of surface `{surface}` changes its leading balance beside the grazing point: \
         a coefficient {coefficient:e} of y^{power} in time power {time_power} vanishes only there"
    )]
    NotUniform {
        /// Name of the surface.
        surface: String,
        /// Power of the contact time.
        time_power: usize,
        /// Power of `y` of the coefficient.
        power: usize,
        /// Value of the coefficient.
        coefficient: f64,
    },
}

/// Reason why a power of the penetration has no place in an expansion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PowerProblem {
    /// An active parameter moves the exponent.
    #[error("an active parameter moves its exponent; leave that parameter out of `active`")]
    ActiveExponent,
    /// The base is not proportional to the penetration.
    #[error("its base vanishes at the graze and is not proportional to the penetration; write `d`")]
    OtherBase,
    /// The power acts on the rate of the gap.
    #[error("it acts on the rate of the gap itself, expected on a rate of that")]
    OnRate,
    /// The exponent is not between 0.05 and 32.
    #[error(
        "a map is expanded for exponents from 0.05 to 32; direct simulation takes any (method \
         `direct`)"
    )]
    OutOfRange,
    /// A square root, or a smaller power, of the penetration in a contact that ends before the
    /// surface.
    #[error(
        "exponents up to 1/2 are expanded for a release at the surface alone; direct simulation \
         takes any (method `direct`)"
    )]
    EarlyRoot,
}

/// Reason why a contact cannot be flown exactly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// The contact field is not affine with constant coefficients.
    #[error(
        "the contact of surface `{surface}` cannot be flown: the rate of `{component}` is not \
         affine in `{state}` with a coefficient that no active parameter moves; use the shape \
         `factored`"
    )]
    Field {
        /// Name of the surface.
        surface: String,
        /// State whose rate is not affine.
        component: String,
        /// State in which the rate is not affine.
        state: String,
    },
    /// The contact has powers of the penetration.
    #[error(
        "the contact of surface `{surface}` cannot be flown: it has powers of the penetration; use \
         the shape `factored`"
    )]
    Powers {
        /// Name of the surface.
        surface: String,
    },
    /// The release function is not affine with constant coefficients.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its release function is not affine in \
         `{state}` with a coefficient that no active parameter moves; use the shape `factored`"
    )]
    Release {
        /// Name of the surface.
        surface: String,
        /// State in which the release function is not affine.
        state: String,
    },
    /// The contact time is not proportional to the depth variable.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its contact time begins with \
         y^{power}, expected y^1"
    )]
    ContactTime {
        /// Name of the surface.
        surface: String,
        /// Leading power of `y` in the contact time.
        power: usize,
    },
    /// The largest depth is not positive and finite.
    #[error(
        "the contact of surface `{surface}` cannot be flown up to depth {depth:e}: expected a \
         positive, finite one"
    )]
    Depth {
        /// Name of the surface.
        surface: String,
        /// Depth `y²`.
        depth: f64,
    },
    /// A contact of the window does not end.
    #[error(
        "the contact of surface `{surface}` cannot be flown: at depth {depth:e} it has no release \
         within {steps} steps"
    )]
    NoRelease {
        /// Name of the surface.
        surface: String,
        /// Depth `y²`.
        depth: f64,
        /// Number of steps tried.
        steps: usize,
    },
    /// A contact takes too many steps, because its law is too strongly damped.
    #[error(
        "the contact of surface `{surface}` cannot be flown: its longest contact takes {steps} \
         steps, at most {most} are emitted; the law is too strongly damped"
    )]
    TooLong {
        /// Name of the surface.
        surface: String,
        /// Number of steps needed.
        steps: f64,
        /// Largest number of steps emitted.
        most: usize,
    },
    /// The fixed number of steps is not enough for every contact of the window.
    #[error(
        "the contact of surface `{surface}` cannot be flown in a fixed number of steps: at depth \
         {depth:e} the image errs by {error:e} of the kick"
    )]
    Inexact {
        /// Name of the surface.
        surface: String,
        /// Depth `y²` of the worst contact.
        depth: f64,
        /// Largest error, relative to the contribution of the contact.
        error: f64,
    },
}
