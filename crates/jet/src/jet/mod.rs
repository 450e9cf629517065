//! Truncated power series ("jets") over an explicit, shared [`JetSpace`].
//!
//! Deliberately absent: differential equations, impacts.

mod calculus;
pub mod elementary;
mod error;
mod evaluation;
mod functions;
mod graded;
mod implicit;
pub mod kernel;
mod linear;
mod map;
mod monomials;
mod operators;
mod power_series;
mod product;
mod selection;
mod series;
mod space;
mod substitution;
mod truncated;

pub use error::JetError;
pub use graded::{Graded, HeadFunction, Span, TimeSeries, scalar_head};
pub use implicit::{implicit_root, implicit_roots};
pub use linear::solve_linear;
pub use map::JetMap;
pub use power_series::{power_series_at, power_series_with_slope_at};
pub use product::PartOf;
pub use selection::{Selection, VariableSet, variables_of_monomial, variables_of_monomials};
pub use series::JetSeries;
pub use space::{JetSpace, MAX_PRODUCTS};
pub use substitution::{Substitution, substitute, substitute_all};
pub use truncated::Jet;
