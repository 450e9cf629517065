//! What a return map is asked and what it answers: the section, the image, how it ended.

use super::trajectory::Outcome;

/// The section of a return map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnSection {
    /// Local minima of the gap of a surface along the free flow: `h' = 0`, `h'' > 0`.
    Tangency {
        /// The surface.
        surface: usize,
    },
    /// The forcing phase of a graze: the passage nearest to the start comes first, that nearest to
    /// the end is flown with the surface ignored.
    GrazingPhase {
        /// The surface.
        surface: usize,
    },
    /// Any other forcing phase: everything in between is simulated.
    OtherPhase,
}

/// One image of a section point.
#[derive(Clone, Debug, PartialEq)]
pub struct Return<S> {
    /// The full state at the next section point, the nominal advance of the phase removed.
    pub state: Vec<S>,
    /// Time from one section point to the next.
    pub elapsed: S,
    /// Speed at which each passage of the itinerary met its surface, in their order; `None`
    /// without contact.
    pub passages: Vec<Option<S>>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Contacts beyond one per passage, and those at surfaces without a passage.
    pub extra_contacts: usize,
    /// All contacts per surface of the model.
    pub hits: Vec<usize>,
    /// Normal speeds at which surfaces were met, in order.
    pub impact_speeds: Vec<S>,
    /// Gaps of local minima without contact on the way, in order.
    pub near_misses: Vec<S>,
    /// How it ended.
    pub outcome: ReturnOutcome<S>,
}

/// How a return ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReturnOutcome<S> {
    /// At the section.
    Returned,
    /// No section point within three nominal return times.
    NoReturn {
        /// Time reached.
        time: S,
    },
    /// The section falls inside a contact with a surface, or on the way through it, that the
    /// coordinates of the section do not tell: the return has no image that they could hold.
    Ambiguous {
        /// The surface.
        surface: usize,
    },
    /// The simulation ended otherwise.
    Ended(Outcome<S>),
}

impl ReturnSection {
    /// The surface whose passage the section itself is; none for a phase between passages.
    pub fn surface(self) -> Option<usize> {
        match self {
            ReturnSection::Tangency { surface } | ReturnSection::GrazingPhase { surface } => {
                Some(surface)
            }
            ReturnSection::OtherPhase => None,
        }
    }
}
