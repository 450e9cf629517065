//! What flights and searches of gaps are asked, and why flights stop: where a step starts, what is
//! looked for, where minima at which no flight stops are logged, where a flight lands. For one gap
//! or for one in every lane. And one step along a field, as the search of events sees it.

use crate::flow::Step;
use crate::numeric::{Branched, Real};

/// Which way a gap goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heading {
    /// Its slope is negative.
    Falling,
    /// Its slope is not negative.
    Rising,
    /// Not known, and of no interest.
    Unknown,
}

/// Where steps start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start<S: Branched> {
    /// Where the gap rose before, or fell, as far as its minima were searched.
    pub(super) rose: S::Mask,
    pub(super) fell: S::Mask,
    /// Times within which a minimum is the one that the step before ended with.
    pub(super) within: S,
    /// Where the surface has just been left, and the rounding of its gap there: dips within it are
    /// not events.
    pub(super) leaving: S::Mask,
    pub(super) rounding: S,
}

/// What is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal<S: Branched> {
    /// Where minima of any depth are, and crossings are flown through; elsewhere minima with a gap
    /// of at least 0 and at most `near`, and the first crossing.
    pub(super) minima: S::Mask,
    /// Where minima end the search.
    pub(super) stopping: S::Mask,
    /// Largest gap of a minimum that is looked for.
    pub(super) near: S,
}

/// Surfaces that are flown through, and the surface at whose minima the flight stops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Approach {
    pub(super) ignored: Ignored,
    pub(super) stop_at: Option<usize>,
}

/// Surfaces that are flown through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Ignored {
    #[default]
    None,
    Surface(usize),
    All,
}

impl Ignored {
    pub(super) fn holds(self, surface: usize) -> bool {
        match self {
            Self::None => false,
            Self::Surface(ignored) => ignored == surface,
            Self::All => true,
        }
    }
}

/// Why a flight stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stop<S> {
    /// The time asked for.
    Horizon,
    /// A surface is met; its response is not yet applied.
    Contact { surface: usize },
    /// A minimum of the gap of [`Approach::stop_at`], which is known to rise for a time from there
    /// on.
    Minimum { gap: S, rises_for: S },
    /// The present contact or sticking ends; not yet applied.
    Release,
}

/// Where a backward flight ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Back {
    /// At the first local minimum of the gap, whatever its depth.
    ToMinimum,
    /// Where the gap, negative at the start, rises through zero.
    ToSurface,
}

/// The function that is zero where a flight has landed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Landing {
    /// The gap of a surface.
    Contact {
        /// The surface.
        surface: usize,
    },
    /// The release function of a compliant surface.
    Release {
        /// The surface.
        surface: usize,
    },
}

/// Share of itself to which a step of Newton's method must reduce a distance that is more than
/// rounding.
pub(super) const REDUCED: f64 = 0.5;

/// Where a step of Newton's method ends short of where the function turns, by its second
/// derivative: `|g g''| < g'²`.
///
/// NOTE: of a distance that is rounding itself the step may leave nothing, however far it leads;
/// then only this tells.
#[inline(always)]
pub(super) fn ends_before_turn<S: Branched>(value: S, slope: S, curvature: S) -> S::Mask {
    (value * curvature).abs().is_below(slope * slope)
}

/// Log of the minima at which the flight does not stop.
pub(super) trait MinimumLog<S: Branched> {
    /// Takes a minimum of the gap of a surface, at a time of the step.
    fn miss(&mut self, wanted: S::Mask, surface: usize, time: S, gap: S);
}

/// For searches that end at every minimum.
pub(super) struct NoLog;

impl Heading {
    /// Falling or rising.
    pub(super) fn falling(falls: bool) -> Self {
        if falls { Self::Falling } else { Self::Rising }
    }
}

impl<S: Real> Start<S> {
    /// Anywhere, the gap having gone this way before.
    pub(super) fn inside(before: Heading, within: S) -> Self {
        Self {
            rose: before == Heading::Rising,
            fell: before == Heading::Falling,
            within,
            leaving: false,
            rounding: S::zero(),
        }
    }

    /// On the zero of the gap, just left.
    pub(super) fn leaving(rounding: S) -> Self {
        Self { leaving: true, rounding, ..Self::inside(Heading::Unknown, S::zero()) }
    }
}

impl<S: Branched> Goal<S> {
    /// Where minima with these gaps are looked for.
    #[inline(always)]
    pub(super) fn admits(&self, gap: S) -> S::Mask {
        self.minima | (S::zero().is_at_most(gap) & gap.is_at_most(self.near))
    }
}

impl<S: Branched> MinimumLog<S> for NoLog {
    #[inline(always)]
    fn miss(&mut self, _: S::Mask, _: usize, _: S, _: S) {}
}

/// Time of the step, surface, gap.
impl<S: Real> MinimumLog<S> for &mut Vec<(S, usize, S)> {
    #[inline(always)]
    fn miss(&mut self, wanted: bool, surface: usize, time: S, gap: S) {
        if wanted {
            self.push((time, surface, gap));
        }
    }
}

/// One step of a smooth flight.
pub(super) trait Flight<S: Real> {
    /// Length of the step.
    fn length(&self) -> S;

    /// The time in which the motion changes.
    fn time_scale(&self) -> S;

    /// Whether the step ends at a corner of the field.
    fn ends_at_corner(&self) -> bool {
        false
    }

    /// What is known beforehand of a watched function on `[0, length]`.
    fn outlook(&mut self, watch: usize, length: S, goal: &Goal<S>) -> Outlook;

    /// Taylor coefficients of a watched function and of its derivative.
    fn polynomials(&mut self, watch: usize) -> (&[S], &[S]);

    /// Writes the full state at a time; `false` if it is not finite.
    fn land(&mut self, time: S, state: &mut [S]) -> bool;
}

/// What is known of a watched function before its events are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outlook {
    /// No event, and no minimum that is looked for.
    NoEvent,
    /// Nothing.
    Undecided,
}

/// A Taylor step of any field.
pub(super) struct TaylorFlight<'s, S: Real> {
    step: Step<'s, S>,
    length: S,
    /// The length that the step has but for corners of the field.
    whole: S,
}

impl<'s, S: Real> TaylorFlight<'s, S> {
    /// `watches`: number of watched functions; `direction`: 1, or −1 for a flight back.
    ///
    /// NOTE: a state at rest on a surface is a polynomial of any length while the force that will
    /// release it is not, so the watched functions limit the step as well.
    pub(super) fn new(step: Step<'s, S>, watches: usize, direction: f64) -> Self {
        let length = (0..watches)
            .fold(step.length.to_f64(), |length, watch| length.min(step.watched_length(2 * watch)));
        let whole = S::from_f64(length);
        let length = step.until_corner(whole * S::from_f64(direction)).abs();
        Self { step, length, whole }
    }
}

impl<S: Real> Flight<S> for TaylorFlight<'_, S> {
    fn length(&self) -> S {
        self.length
    }

    fn time_scale(&self) -> S {
        self.whole
    }

    fn ends_at_corner(&self) -> bool {
        self.length < self.whole
    }

    fn outlook(&mut self, watch: usize, length: S, goal: &Goal<S>) -> Outlook {
        let near = goal.near.to_f64().max(0.0);
        let bound = || self.step.watched_lower_bound(2 * watch, length.to_f64());
        match !goal.minima && near < f64::INFINITY && bound() > near {
            true => Outlook::NoEvent,
            false => Outlook::Undecided,
        }
    }

    fn polynomials(&mut self, watch: usize) -> (&[S], &[S]) {
        (self.step.watched_coefficients(2 * watch), self.step.watched_coefficients(2 * watch + 1))
    }

    fn land(&mut self, time: S, state: &mut [S]) -> bool {
        self.step.state_at(time, state);
        true
    }
}
