//! Truncated power series ("jets") over an explicit, shared [`JetSpace`].
//!
//! Deliberately absent: differential equations, impacts.

pub mod elementary;
mod error;
mod functions;
mod graded;
mod implicit;
pub mod kernel;
mod map;
mod power_series;
mod product;
mod saved;
mod space;
mod substitution;
mod truncated;

pub use error::JetError;
pub use graded::{Graded, HeadFunction, JetSeries, Span, TimeSeries, scalar_head};
pub use implicit::{implicit_root, implicit_roots, solve_linear};
pub use map::JetMap;
pub use power_series::{power_series_at, power_series_with_slope_at};
pub use product::PartOf;
pub use space::{
    JetSpace, MAX_PRODUCTS, Selection, VariableSet, variables_of_monomial, variables_of_monomials,
};
pub use substitution::{Substitution, substitute, substitute_all};
pub use truncated::Jet;
