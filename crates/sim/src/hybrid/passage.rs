//! What the search of a step is asked and what it answers: where the step starts, what is looked
//! for, what is found.

use crate::numeric::Real;

/// Which way a gap goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Heading {
    /// Its slope is negative.
    Falling,
    /// Its slope is not negative.
    Rising,
    /// Not known, and of no interest.
    Unknown,
}

impl Heading {
    /// Falling or rising.
    pub(crate) fn falling(falls: bool) -> Self {
        if falls { Self::Falling } else { Self::Rising }
    }
}

/// Where a step starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Start<S> {
    /// Anywhere.
    Inside {
        /// Which way the gap went on the step before, as far as its minima were searched.
        before: Heading,
        /// Time within which a minimum is the one that the step before ended with.
        within: S,
    },
    /// On the zero of the gap, just left: dips within the rounding of the gap (given) are not
    /// events.
    Leaving {
        /// Rounding of the gap.
        rounding: S,
    },
}

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Goal<S> {
    /// Minima with a gap of at least 0 and at most this, and the first crossing.
    Crossing {
        /// Largest gap of a minimum that is reported.
        near: S,
    },
    /// Minima of any depth; crossings are flown through.
    Minima,
}

impl<S: Real> Start<S> {
    /// Whether the gap fell before.
    pub(crate) fn fell(&self) -> bool {
        matches!(self, Start::Inside { before, .. } if *before == Heading::Falling)
    }
}

impl<S: Real> Goal<S> {
    /// Whether a minimum with this gap is looked for.
    pub(crate) fn admits(&self, gap: S) -> bool {
        match *self {
            Goal::Minima => true,
            Goal::Crossing { near } => gap >= S::zero() && gap <= near,
        }
    }
}

/// An event of one gap within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Passage<S> {
    /// A local minimum.
    Minimum {
        /// Time since the start of the step.
        time: S,
        /// The gap there.
        gap: S,
    },
    /// The gap falls through 0.
    Crossing {
        /// Time since the start of the step.
        time: S,
    },
}

impl<S: Real> Passage<S> {
    /// Time since the start of the step.
    pub(crate) fn time(&self) -> S {
        match *self {
            Passage::Minimum { time, .. } | Passage::Crossing { time } => time,
        }
    }
}
