//! What can go wrong in an expansion.

use super::{ContactLawError, FlightError};
use crate::flow::FlowError;
use crate::jet::JetError;
use crate::numeric::NumericError;

/// Error of an expansion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExpansionError {
    /// A jet space or an operation on jets.
    #[error(transparent)]
    Jet(#[from] JetError),
    /// The flow under an expansion.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The contact law of a compliant surface.
    #[error(transparent)]
    ContactLaw(#[from] ContactLawError),
    /// A contact that cannot be flown exactly.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// A flown map was asked for where every stop is rigid.
    #[error("there is no contact to fly: every stop is rigid; use the shape `factored`")]
    NothingToFly,
    /// A composed form was asked for where a contact is flown.
    #[error("a map with a flown contact has no composed form: its contact is no polynomial")]
    FlownIsNoPolynomial,
    /// Small linear algebra.
    #[error(transparent)]
    Numeric(#[from] NumericError),
    /// The depth cannot stand in the place of a coordinate.
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
    /// The reset moves a state that only touches.
    #[error(
        "the reset of surface `{surface}` moves a state that touches with zero normal velocity (by {displacement:e}): its discontinuity mapping is not the identity at y = 0"
    )]
    ResetNotIdentityAtTangency {
        /// Name of the surface.
        surface: String,
        /// Largest coefficient of the displacement.
        displacement: f64,
    },
    /// The orbit handed over does not close on the section.
    #[error(
        "the orbit misses its own section point by {defect:e}: it is not periodic to the accuracy of an expansion"
    )]
    NotPeriodic {
        /// Largest constant term of `P_smooth` in offsets.
        defect: f64,
    },
    /// A coefficient is not finite.
    #[error("a coefficient of {part} is not finite")]
    NotFinite {
        /// Which part of the map.
        part: &'static str,
    },
}

impl ExpansionError {
    /// Whether a contact is not flown, or not at these orders: its law does not allow it, or its
    /// coefficients leave the finite numbers.
    pub fn is_not_flown(&self) -> bool {
        matches!(self, Self::Flight(_) | Self::NothingToFly) || self.is_overflow()
    }

    /// Whether coefficients, or what they are computed from, left the finite numbers, as those of
    /// high orders can.
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
