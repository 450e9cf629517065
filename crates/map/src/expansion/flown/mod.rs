//! Contacts flown exactly: passages of a compliant stop whose contact field is affine.
//!
//! One idea: what the contact adds to the free flight, `z = x − x_free`, obeys a linear equation
//! `z' = A z + g(t)` with a force `g` that is smooth on the scale of the free flight. A Taylor
//! series in time of a fixed number of terms solves it to rounding whatever the stiffness, so the
//! only truncated series left are those of the free flow. Derivation:
//! docs/mathematics/flown-contacts.md.

pub(super) mod contact;
pub(super) mod plan;
mod smooth;

pub use contact::{Arithmetic, FlightPlan, FlownContact, Numbers};
pub use plan::{FlightWindow, flown_contact};
