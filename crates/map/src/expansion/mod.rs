//! `P_smooth`, the discontinuity mapping `D`, legs, and their composition, as jets.
//!
//! Deliberately absent: the direct simulator (agreement with it must be evidence, not an echo),
//! text, templates.

mod approach;
mod composition;
mod depth_series;
mod discontinuity;
mod error;
mod expand;
mod flown;
mod free_flight;
mod local_map;
mod lost_digits;
mod lowering;
mod passage;
mod power_law;
mod pruning;
mod release;
mod routes;
mod sides;
mod variables;

pub use composition::{ComposedMap, DepthPolynomial, DepthTerm, compose};
pub use depth_series::{DepthSeries, LeadingLaw, WindowEdge};
pub use discontinuity::{ImpactSpeed, discontinuity, impact_speed, lacks_release};
pub use error::{ContactLawError, ExpansionError, FlightError, LawKind, PowerProblem};
pub use expand::{Expander, Legs, RADIUS_ORDER};
pub use flown::{Arithmetic, FlightPlan, FlightWindow, FlownContact, Numbers, flown_contact};
pub use free_flight::free_flight;
pub use local_map::{
    ActiveParameter, Contact, DepthForm, ExceededBound, Leg, LocalMap, MapSection, MapWindow,
    SectionKind, Stage,
};
pub use lost_digits::{LostDigits, NaturalWindow};
pub use lowering::MapKernel;
pub use passage::{AffineLaw, ContactLaw, Passage};
pub use power_law::{PowerCorrections, PowerLaw, PowerTerm};
pub(crate) use power_law::{omitted_exponent, power_of_depth};
pub use pruning::{PruneReport, prune, prune_composed};
pub use routes::{Graze, Route, RouteEnd, Routes, SectionChart};
pub use sides::{SidesError, SidesOfGraze, sides_of_graze};
pub use variables::{DEVIATION_WEIGHT, Variables, check_orders};

pub use crate::model::MapOrders;
