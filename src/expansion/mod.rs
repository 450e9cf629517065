//! `P_smooth`, the discontinuity mapping `D`, legs, and their composition, as jets.
//!
//! Deliberately absent: the direct simulator (agreement with it must be evidence, not an echo),
//! text, templates.

mod analyticity;
mod approach;
mod composition;
mod contact_law;
mod departure;
mod depth_chart;
mod depth_polynomial;
mod depth_series;
mod description;
mod discontinuity;
mod error;
mod expand;
mod flown;
mod graze;
mod impact_speed;
mod leg;
mod local_map;
mod lost_digits;
mod lowering;
mod passage;
mod release;
mod rounding;
mod routes;
mod section_chart;
mod variables;
mod window_edge;

pub use composition::compose;
pub use contact_law::{ContactLaw, ContactLawError};
pub use depth_polynomial::{DepthPolynomial, DepthTerm};
pub use depth_series::{DepthSeries, LeadingLaw};
pub use discontinuity::discontinuity;
pub use error::ExpansionError;
pub use expand::{Expander, Legs, RADIUS_ORDER};
pub use flown::{
    AffineLaw, Arithmetic, FlightError, FlightPlan, FlightWindow, FlownContact, Numbers,
    flown_contact,
};
pub use impact_speed::{ImpactSpeed, impact_speed};
pub use leg::LegExpansion;
pub use local_map::{
    ActiveParameter, ComposedMap, Contact, DepthForm, Leg, LocalMap, MapSection, MapWindow,
    SectionKind, Stage,
};
pub use lost_digits::LostDigits;
pub use lowering::MapKernel;
pub use passage::Passage;
pub use routes::{Route, RouteEnd, Routes};
pub use section_chart::SectionChart;
pub use variables::{DEVIATION_WEIGHT, Variables};
pub use window_edge::WindowEdge;

pub use crate::model::MapOrders;
