//! Truncation orders against direct simulation: errors, rates, times, and the choice of a map and
//! its section.
//!
//! The one place where expansion and simulation meet, so that their agreement is evidence.
//! Deliberately absent: plotting. See docs/mathematics/convergence.md.

mod accuracy;
mod attempts;
mod candidates;
mod choice;
mod chooser;
mod data;
mod economise;
mod engine;
mod error;
mod errors;
mod family;
mod fit;
mod forecast;
mod form;
mod joint;
mod judge;
mod level;
mod measured;
mod next_depth;
mod pareto;
mod rates;
mod rule;
mod sample;
mod sections;
mod timing;
mod truth;
mod validity;

pub use accuracy::{DepthAccuracy, WindowAccuracy};
pub use choice::{ChoiceOptions, choose, choose_orders, chosen_map};
pub use chooser::Chooser;
pub use data::{
    Choice, ConvergenceStudy, DirectSummary, ErrorSummary, FactorRate, Limit, Monomials,
    OrderResult, Polynomials, Rate, SampleSummary,
};
pub use engine::{ConvergenceOptions, converge};
pub use error::ConvergenceError;
pub use family::{MapFamily, cut_legs};
pub use fit::{SlopeFit, fit_slope};
pub use measured::{ExactImages, MeasuredError, measured_error};
pub use next_depth::LeastOrders;
pub use pareto::{ParetoMap, ParetoPoint};
pub use rule::{Decay, OrderRule};
pub use sample::{SamplePoint, WindowSample};
pub use sections::{SectionChoice, SectionVerdict, SettledScene, choose_sections, settle_section};
pub use timing::{multiply_add_ns, step_ns};
pub use validity::{Validity, validity};
