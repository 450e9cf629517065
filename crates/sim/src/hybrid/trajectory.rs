//! What a simulation hands up: events in time, the final state, and how it ended.

use crate::numeric::Real;

/// Something that happened on a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<S> {
    /// Time since the start of the simulation.
    pub time: S,
    /// The surface it happened at: an index into
    /// [`Model::surfaces`](crate::model::Model::surfaces).
    pub surface: usize,
    /// What happened.
    pub kind: EventKind<S>,
}

/// Kinds of events. Speeds are `|h'|` in units of the event function per time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<S> {
    /// A rigid impact.
    Impact {
        /// Normal speed at which the surface was met.
        speed: S,
        /// Normal speed at which it was left.
        rebound: S,
    },
    /// A local minimum of the gap without contact.
    NearMiss {
        /// The gap there, at least 0.
        gap: S,
    },
    /// Infinitely many impacts were completed by their geometric series.
    ChatterEnd {
        /// Time the completed impacts took.
        duration: S,
    },
    /// The state stays on a rigid surface from here.
    Stick,
    /// It leaves the rigid surface it stuck to.
    Release,
    /// A compliant contact begins.
    ContactBegin {
        /// Normal speed at which the surface was met.
        speed: S,
    },
    /// A compliant contact ends.
    ContactEnd {
        /// Normal speed at which it was left.
        speed: S,
    },
}

/// How a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<S> {
    /// The time asked for was reached.
    Completed,
    /// The solution left the finite numbers, or its steps became too short to advance time (a
    /// singularity).
    Diverged {
        /// Time reached.
        time: S,
    },
    /// The state is beyond a rigid surface: the initial state was, or another surface's reset put
    /// it there.
    Penetrating {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
        /// The gap, negative.
        gap: S,
    },
    /// Two surfaces hold the state at once: no field of the model stands for both.
    HeldTwice {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time reached.
        time: S,
    },
    /// The state must stay on a rigid surface whose reset defines no direction of a contact force,
    /// or moves a state at rest there (a tangential restitution).
    NoStickingField {
        /// The surface.
        surface: usize,
        /// Time reached.
        time: S,
    },
    /// The limit on steps was reached.
    StepLimit {
        /// The limit.
        limit: usize,
        /// Time reached.
        time: S,
    },
}

/// A simulated trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<S> {
    /// Events in order of time.
    pub events: Vec<Event<S>>,
    /// The full state at the end; the phase is reduced modulo its period.
    pub state: Vec<S>,
    /// Time simulated.
    pub time: S,
    /// How it ended.
    pub outcome: Outcome<S>,
}

impl<S: Real> Trajectory<S> {
    /// Number of contacts that began: impacts and compliant contacts.
    pub fn contacts(&self) -> usize {
        self.events.iter().filter(|event| event.kind.is_contact()).count()
    }

    /// Speeds at which surfaces were met, in order.
    pub fn contact_speeds(&self) -> impl Iterator<Item = S> + '_ {
        self.events.iter().filter_map(|event| event.kind.contact_speed())
    }
}

impl<S: Real> EventKind<S> {
    /// Whether a contact begins here.
    pub fn is_contact(&self) -> bool {
        self.contact_speed().is_some()
    }

    /// The speed at which the surface is met, where a contact begins here.
    pub fn contact_speed(&self) -> Option<S> {
        match *self {
            EventKind::Impact { speed, .. } | EventKind::ContactBegin { speed } => Some(speed),
            _ => None,
        }
    }
}
