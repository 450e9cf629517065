//! One step along a field, however it is computed: what the search of events needs of it.

use super::passage::Goal;
use crate::flow::Step;
use crate::numeric::Real;

/// One step of a smooth flight.
pub(super) trait Flight<S: Real> {
    /// Length of the step.
    fn length(&self) -> S;

    /// The time in which the motion changes.
    fn time_scale(&self) -> S;

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
}

impl<'s, S: Real> TaylorFlight<'s, S> {
    /// `watches`: number of watched functions.
    ///
    /// NOTE: a state at rest on a surface is a polynomial of any length while the force that will
    /// release it is not, so the watched functions limit the step as well.
    pub(super) fn new(step: Step<'s, S>, watches: usize) -> Self {
        let length = (0..watches)
            .fold(step.length.to_f64(), |length, watch| length.min(step.watched_length(2 * watch)));
        let length = S::from_f64(length);
        Self { step, length }
    }
}

impl<S: Real> Flight<S> for TaylorFlight<'_, S> {
    fn length(&self) -> S {
        self.length
    }

    fn time_scale(&self) -> S {
        self.length
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
