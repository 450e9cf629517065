//! Contacts flown exactly: passages of a compliant stop whose contact field is affine.
//!
//! One idea: what the contact adds to the free flight, `z = x − x_free`, obeys a linear equation
//! `z' = A z + g(t)` with a force `g` that is smooth on the scale of the free flight. A Taylor
//! series in time of a fixed number of terms solves it to rounding whatever the stiffness, so the
//! only truncated series left are those of the free flow. Derivation:
//! docs/mathematics/flown-contacts.md.

mod affine;
mod arithmetic;
mod build;
mod contact;
mod error;
mod flight;
mod impulse;
mod reference;
mod smooth;
mod start;

pub use affine::AffineLaw;
pub use arithmetic::{Arithmetic, Numbers};
pub use build::{FlightWindow, flown_contact};
pub use contact::{FlightPlan, FlownContact};
pub use error::FlightError;
