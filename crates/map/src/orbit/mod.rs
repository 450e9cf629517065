//! Grazing orbits: sections, shooting, the extended system, monodromy, `xi_n`, grazing curves.
//!
//! Deliberately absent: the direct simulator. Every orbit here is one of the free flow, which
//! ignores the surfaces, and of the hits that the scene names.

mod curve;
mod curve_context;
mod derivatives;
mod effort;
mod free_flow;
mod grazing_curve;
mod grazing_orbit;
mod locate;
mod margin;
mod monodromy;
mod newton;
mod outcome;
mod passages;
mod piecewise;
mod search;
mod section;
mod system;
mod theory;

pub use curve::{curve, watched_curve};
pub use derivatives::{
    DerivativesError, EventDerivatives, JetsAlong, jets_along, watched_jets_along,
};
pub(crate) use derivatives::{Trajectory, Turn};
pub use grazing_curve::{
    CurveEnd, CurveOptions, CurveOutcome, CurvePoint, GrazingCurve, SpecialKind, SpecialPoint,
    UnresolvedStretch,
};
pub use grazing_orbit::{
    FollowingHit, FollowingPassage, GrazingConditions, GrazingOrbit, GrazingPoint, Location,
    OrbitHit, Penetration,
};
pub use locate::locate;
pub use margin::{Margin, MarginOutcome, margin, watched_margin};
pub use outcome::{NamedValues, NotLocated, OrbitError};
pub use piecewise::{BRIEF, FlowEvent, JetsThrough, PiecewiseFlow};
pub use search::{ClearInterval, IntervalEnd, clear_interval};
pub use section::{PoincareSection, PoincareSectionKind, rigid_stops_beyond};
pub use theory::{
    AttractorRoute, Expectation, GrazeTheory, OneContactOrbit, Unfolding, graze_theory,
};
