//! Jets of a flow over a time: two methods that share nothing but the field's program.

mod taylor;

pub(crate) use taylor::JetExpansion;
pub use taylor::jet_transport_taylor;
