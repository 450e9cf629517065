//! Truncated power series ("jets") over an explicit, shared [`JetSpace`].
//!
//! Deliberately absent: differential equations, impacts.

pub mod elementary;
mod graded;
mod implicit;
pub mod kernel;
mod map;
mod product;
mod space;
mod truncated;

pub use graded::{Graded, HeadFunction, JetSeries, Span, TimeSeries, scalar_head};
pub use implicit::{
    implicit_root, implicit_roots, power_series_at, power_series_with_slope_at, solve_linear,
};
pub use map::{JetMap, Substitution, substitute, substitute_all};
pub use product::PartOf;
pub use space::{
    JetError, JetSpace, MAX_PRODUCTS, Selection, VariableSet, variables_of_monomial,
    variables_of_monomials,
};
pub use truncated::Jet;
