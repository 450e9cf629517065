//! `P_smooth`, the discontinuity mapping `D`, legs, and their composition, as jets.
//!
//! Deliberately absent: the direct simulator (agreement with it must be evidence, not an echo), text,
//! templates.

mod composition;
mod discontinuity;
mod error;
mod expand;
mod leg;
mod local_map;
mod lowering;
mod passage;
mod section_chart;
mod variables;

pub use composition::compose;
pub use discontinuity::discontinuity;
pub use error::ExpansionError;
pub use expand::{Expander, Legs};
pub use leg::LegExpansion;
pub use local_map::{
    ActiveParameter, ComposedMap, Contact, Leg, LocalMap, MapOrders, MapSection, MapWindow,
    SectionKind, Stage,
};
pub use lowering::MapKernel;
pub use passage::Passage;
pub use section_chart::SectionChart;
pub use variables::{DEVIATION_WEIGHT, Variables};
