//! The map, and the section, chosen for a tolerance: the one with the fewest operations that meets
//! it.

mod candidates;
mod chooser;
mod data;
mod economise;
mod forecast;
mod judge;
mod next_depth;
mod sections;

pub use chooser::{ChoiceOptions, Chooser, choose, choose_orders};
pub use data::{Choice, Limit, Monomials, Polynomials, chosen_map};
pub use forecast::{Decay, OrderRule};
pub use next_depth::LeastOrders;
pub use sections::{SectionChoice, SectionVerdict, SettledScene, choose_sections, settle_section};
