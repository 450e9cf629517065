//! Newton's method in brackets, in lanes: [`NewtonSteps`](crate::numeric::NewtonSteps) where every
//! step serves.
//!
//! One idea: nearly all searches are a few steps of Newton's method that stay in their brackets.
//! Those have the operations of one number; a lane whose step leaves its bracket, or is not half as
//! long as the one before the last, is left to the search of one number.

use crate::numeric::{Branched, LaneMask, Lanes, Scalar};

/// Searches under way, each in its own bracket.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneNewton<const N: usize> {
    lower: Lanes<N>,
    upper: Lanes<N>,
    /// Where the functions are positive at the lower ends.
    falling: LaneMask<N>,
    tolerance: Lanes<N>,
    /// The lengths of the steps before the last and of the last.
    steps: [Lanes<N>; 2],
    /// Where the functions are asked for next.
    pub(super) at: Lanes<N>,
}

/// Where steps lead.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneNewtonStep<const N: usize> {
    pub(super) next: Lanes<N>,
    /// Where that is the root.
    pub(super) settled: LaneMask<N>,
    /// Where it is neither the root nor a step of Newton's that serves.
    pub(super) open: LaneMask<N>,
}

impl<const N: usize> LaneNewton<N> {
    /// From points inside brackets whose lower ends are the smaller ones.
    #[inline(always)]
    pub(super) fn new(
        [lower, upper]: [Lanes<N>; 2],
        falling: LaneMask<N>,
        start: Lanes<N>,
        tolerance: Lanes<N>,
    ) -> Self {
        Self {
            lower,
            upper,
            falling,
            tolerance,
            steps: [(upper - lower).abs(); 2],
            at: start,
        }
    }

    /// Moves on with the values and the derivatives of the functions at `at`.
    #[inline(always)]
    pub(super) fn advance(&mut self, value: Lanes<N>, derivative: Lanes<N>) -> LaneNewtonStep<N> {
        let (zero, at) = (Lanes::splat(0.0), self.at);
        let is_zero = value.is_equal(zero);
        let is_lower =
            (zero.is_below(value) & self.falling) | (value.is_below(zero) & !self.falling);
        self.lower = Lanes::select(is_lower, at, self.lower);
        self.upper = Lanes::select(is_lower, self.upper, at);
        let next = Lanes::select(is_zero, at, at - value / derivative);
        let step = (next - at).abs();
        let resolution = at.abs() * Lanes::splat(4.0 * <f64 as Scalar>::ROUNDOFF);
        let stays = self.lower.is_at_most(next) & next.is_at_most(self.upper);
        let settled = step.is_at_most(self.tolerance + resolution);
        let serves = (step * Lanes::splat(2.0)).is_at_most(self.steps[0]);
        self.steps = [self.steps[1], step];
        self.at = next;
        LaneNewtonStep {
            next,
            settled: settled & stays,
            open: !stays | !(settled | serves),
        }
    }
}
