//! Contact forces that are powers of the penetration, `k d^p` with any `p > 0`.
//!
//! Such a force has no Taylor series on the surface. In a grazing passage the penetration is `y²`
//! times a function of the time over `y`, so that `d^p` is `y^{2p}` times a positive function of
//! it: with `y^{2p}`, where it is no power of `y`, as a variable of its own the passage is a power
//! series again. Derivation: docs/mathematics/power-laws.md.

mod corrections;
mod flight;
mod law;
mod quadrature;

pub use corrections::{PowerCorrections, PowerTerm};
pub(super) use corrections::{WeightScale, exponent_of};
pub(crate) use corrections::{omitted_exponent, power_of_depth};
pub(super) use flight::PowerFlight;
pub use law::PowerLaw;
pub(super) use law::Rewritten;
