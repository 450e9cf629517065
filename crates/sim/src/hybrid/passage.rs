//! Starts, goals and ends of flights and of the searches of gaps, for one gap or for one in every
//! lane; the log of minima at which a flight does not stop; and one step along a field, as the
//! search sees it.

use crate::flow::Step;
use crate::numeric::{Branched, Real};

/// Direction in which a gap changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heading {
    /// The slope is negative.
    Falling,
    /// The slope is not negative.
    Rising,
    /// The direction is unknown, and not needed.
    Unknown,
}

/// Starts of steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start<S: Branched> {
    /// Masks: the gap rose before; the gap fell before. Both as far as its minima were searched.
    pub(super) rose: S::Mask,
    pub(super) fell: S::Mask,
    /// Times within which a minimum is the one at the end of the previous step.
    pub(super) within: S,
    /// Mask: the state has just left the surface; then the rounding of its gap there. Dips within
    /// it are not events.
    pub(super) leaving: S::Mask,
    pub(super) rounding: S,
}

/// Goals of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal<S: Branched> {
    /// Mask: minima of any depth are sought, and crossings are flown through. In other lanes the
    /// goals are minima with a gap from 0 to `near`, and the first crossing.
    pub(super) minima: S::Mask,
    /// Mask: minima end the search.
    pub(super) stopping: S::Mask,
    /// Largest gap of a minimum that is sought.
    pub(super) near: S,
}

/// Surfaces that are flown through, and the surface at whose minima the flight stops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Approach {
    pub(super) ignored: Ignored,
    pub(super) stop_at: Option<usize>,
    /// Whether minima at which the flight does not stop are left out of its record.
    pub(super) unrecorded: bool,
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

/// Reason why a flight stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stop<S> {
    /// The time asked for was reached.
    Horizon,
    /// Contact with a surface, whose response is not yet applied.
    Contact { surface: usize },
    /// Minimum of the gap of [`Approach::stop_at`]; the gap is known to rise from there for a time.
    Minimum { gap: S, rises_for: S },
    /// End of the present contact or sticking, not yet applied.
    Release,
}

/// Goal of a backward flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Back {
    /// First local minimum of the gap, of any depth.
    ToMinimum,
    /// Zero at which the gap, negative at the start, becomes positive.
    ToSurface,
}

/// Function whose zero ends a flight.
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

/// Factor by which a Newton step must reduce a distance that exceeds rounding.
pub(super) const REDUCED: f64 = 0.5;

/// Mask: a Newton step ends before the function turns, judged by its second derivative:
/// `|g g''| < g'²`.
///
/// NOTE: if the distance is itself rounding, a step may reduce it to nothing, however far it leads;
/// then only this test decides.
#[inline(always)]
pub(super) fn ends_before_turn<S: Branched>(value: S, slope: S, curvature: S) -> S::Mask {
    (value * curvature).abs().is_below(slope * slope)
}

/// Log of the minima at which the flight does not stop.
pub(super) trait MinimumLog<S: Branched> {
    /// Records a minimum of a surface's gap, at a time of the step.
    fn miss(&mut self, wanted: S::Mask, surface: usize, time: S, gap: S);
}

/// Log of searches that end at every minimum.
pub(super) struct NoLog;

impl Heading {
    /// Heading from the sign of the slope.
    pub(super) fn falling(falls: bool) -> Self {
        if falls { Self::Falling } else { Self::Rising }
    }
}

impl<S: Real> Start<S> {
    /// Start anywhere, with a given earlier heading.
    pub(super) fn inside(before: Heading, within: S) -> Self {
        Self {
            rose: before == Heading::Rising,
            fell: before == Heading::Falling,
            within,
            leaving: false,
            rounding: S::zero(),
        }
    }

    /// Start on a zero of the gap that was just left.
    pub(super) fn leaving(rounding: S) -> Self {
        Self { leaving: true, rounding, ..Self::inside(Heading::Unknown, S::zero()) }
    }
}

impl<S: Branched> Goal<S> {
    /// Mask: minima with these gaps are sought.
    #[inline(always)]
    pub(super) fn admits(&self, gap: S) -> S::Mask {
        self.minima | (S::zero().is_at_most(gap) & gap.is_at_most(self.near))
    }
}

impl<S: Branched> MinimumLog<S> for NoLog {
    #[inline(always)]
    fn miss(&mut self, _: S::Mask, _: usize, _: S, _: S) {}
}

/// Records the time of the step, the surface, and the gap.
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

    /// Time scale of the motion.
    fn time_scale(&self) -> S;

    /// Whether the step ends at a corner of the field.
    fn ends_at_corner(&self) -> bool {
        false
    }

    /// Knowledge of a watched function on `[0, length]` before the search.
    fn outlook(&mut self, watch: usize, length: S, goal: &Goal<S>) -> Outlook;

    /// Taylor coefficients of a watched function and of its derivative.
    fn polynomials(&mut self, watch: usize) -> (&[S], &[S]);

    /// Writes the full state at a time; `false` if it is not finite.
    fn land(&mut self, time: S, state: &mut [S]) -> bool;
}

/// Knowledge of a watched function before its events are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outlook {
    /// There is no event, and no minimum that is sought.
    NoEvent,
    /// Nothing is known.
    Undecided,
}

/// A Taylor step of any field.
pub(super) struct TaylorFlight<'s, S: Real> {
    step: Step<'s, S>,
    length: S,
    /// Length of the step before it was cut at corners of the field.
    whole: S,
}

impl<'s, S: Real> TaylorFlight<'s, S> {
    /// Step of Taylor's method, cut where a watched function is no longer resolved; `watches` is
    /// their number, and `direction` is 1, or −1 for a backward flight.
    ///
    /// NOTE: the states alone do not limit a step at rest on a surface: their series ends, so that
    /// a step of any length is exact. The series of the force that ends the rest does not.
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
