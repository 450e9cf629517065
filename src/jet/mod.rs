//! Truncated power series ("jets") over an explicit, shared [`JetSpace`].
//!
//! Deliberately absent: differential equations, impacts.

pub mod elementary;
mod error;
mod graded;
mod series;
mod space;
mod truncated;

pub use error::JetError;
pub use graded::{Graded, HeadFunction, Span, TimeSeries, scalar_head};
pub use series::JetSeries;
pub use space::{JetSpace, MAX_PRODUCTS};
pub use truncated::Jet;
