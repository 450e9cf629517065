//! Grazing orbits: sections, shooting, the extended system, monodromy, `xi_n`, grazing curves.
//!
//! Deliberately absent: the direct simulator. Every orbit here is one of the free flow, surfaces
//! ignored.

mod conditions;
mod continuation;
mod corners;
mod curve;
mod describe;
mod diagnosis;
mod error;
mod geometry;
mod grazes;
mod itinerary;
mod kick;
mod locate;
mod minima;
mod monodromy;
mod newton;
mod outcome;
mod passages;
mod point;
mod scaled;
mod search;
mod section;
mod shooting;
mod solving;
mod special;
mod station;
mod symmetry;
mod system;
mod tracer;

pub use conditions::GrazingConditions;
pub use curve::{
    CurveEnd, CurveOptions, CurveOutcome, CurvePoint, GrazingCurve, SpecialKind, SpecialPoint,
    curve,
};
pub use error::OrbitError;
pub use itinerary::FollowingPassage;
pub use locate::locate;
pub use outcome::{Location, NamedValues, NotLocated};
pub use point::{GrazingOrbit, GrazingPoint};
pub use section::{PoincareSection, PoincareSectionKind};
