//! Newton's method kept inside a bracket.

use super::{Bracket, BracketOutcome, ITERATION_LIMIT, middle, resolution};
use crate::numeric::{Branched, Mask, Real};

/// Newton's method in brackets, a step at a time, for one function or for one in every lane: for
/// searches that know of their own when to end.
///
/// ```
/// use grazemap_jet::numeric::NewtonSteps;
/// let mut search = NewtonSteps::new([0.0, 2.0], false, 1.0, 1e-8);
/// let root = loop {
///     let x: f64 = search.at();
///     let step = search.advance(x * x - 2.0, 2.0 * x);
///     if step.settled {
///         break step.next;
///     }
/// };
/// assert!((root - 2f64.sqrt()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct NewtonSteps<S: Branched> {
    lower: S,
    upper: S,
    /// Where the functions are positive at the lower ends.
    falling: S::Mask,
    at: S,
    tolerance: S,
    /// The lengths of the step before the last and of the last.
    steps: [S; 2],
    has_left: S::Mask,
}

/// Where a step of [`NewtonSteps`] leads. Where it is neither the root nor Newton's step, that does
/// not serve: it leads to an end of the bracket, or to its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonStep<S: Branched> {
    /// The next point.
    pub next: S,
    /// Where that is the root: Newton's step is below the tolerance, or the value is 0.
    pub settled: S::Mask,
    /// Where that is Newton's step, and not the last.
    pub newton: S::Mask,
}

impl<S: Real> Bracket<S> {
    /// The root by Newton's method with the function's value and derivative, from the middle: see
    /// [`newton_from`](Self::newton_from).
    pub fn newton(self, tolerance: S, function: impl FnMut(S) -> (S, S)) -> BracketOutcome<S> {
        self.newton_from(self.middle(), tolerance, function)
    }

    /// The root by Newton's method with the function's value and derivative, from a point inside;
    /// steps that do not serve are replaced as [`NewtonSteps::advance`] says.
    ///
    /// Stops when a step of Newton's falls below `tolerance` plus four units of rounding, and that
    /// step is taken still: Newton's method squares the error, so half the digits will do for a
    /// tolerance. It may be zero.
    #[inline]
    pub fn newton_from(
        self,
        start: S,
        tolerance: S,
        mut function: impl FnMut(S) -> (S, S),
    ) -> BracketOutcome<S> {
        let falling = self.sign_lower > S::zero();
        let mut search = NewtonSteps::new([self.lower, self.upper], falling, start, tolerance);
        for evaluations in 1..=ITERATION_LIMIT {
            let at = search.at();
            let (value, derivative) = function(at);
            if !value.is_finite() {
                return BracketOutcome::NotFinite { at, evaluations };
            }
            let step = search.advance(value, derivative);
            if step.settled {
                let root = step.next;
                return BracketOutcome::Converged { root, evaluations };
            }
        }
        BracketOutcome::IterationLimit {
            lower: search.lower,
            upper: search.upper,
        }
    }
}

impl<S: Branched> NewtonSteps<S> {
    /// From points inside brackets with these lower and upper ends, in either order.
    ///
    /// `falling`: where the functions are positive at the lower ends. Steps below `tolerance` plus
    /// four units of rounding settle a search.
    #[inline(always)]
    pub fn new([lower, upper]: [S; 2], falling: S::Mask, start: S, tolerance: S) -> Self {
        Self {
            lower,
            upper,
            falling,
            at: start,
            tolerance,
            steps: [(upper - lower).abs(); 2],
            has_left: S::Mask::NONE,
        }
    }

    /// Where the functions are asked for next.
    #[inline(always)]
    pub fn at(&self) -> S {
        self.at
    }

    /// Moves on with the values, which are not NaN, and the derivatives of the functions at
    /// [`at`](Self::at).
    ///
    /// A step out of the bracket goes to its end the first time, where the root may well be:
    /// brackets are often halves of what is searched. After that, and where a step is not half
    /// as long as the one before the last, what is left is halved (Press et al., *Numerical
    /// Recipes*, `rtsafe`).
    #[inline(always)]
    pub fn advance(&mut self, value: S, derivative: S) -> NewtonStep<S> {
        let (zero, at) = (S::zero(), self.at);
        let is_zero = value.is_equal(zero);
        let is_lower =
            (zero.is_below(value) & self.falling) | (value.is_below(zero) & !self.falling);
        self.lower = S::select(is_lower, at, self.lower);
        self.upper = S::select(is_lower, self.upper, at);
        let next = S::select(is_zero, at, at - value / derivative);
        let step = (next - at).abs();
        let least = self.tolerance + resolution(at);
        let settled = step.is_at_most(least);
        let halves = (step * S::from_f64(2.0)).is_at_most(self.steps[0]);
        let stays = self.lower.is_at_most(next) & next.is_at_most(self.upper);
        let mut moved = NewtonStep {
            next,
            settled,
            newton: halves & !settled,
        };
        self.steps = [self.steps[1], step];
        if (!stays | !(settled | halves)).any() {
            self.replace(at, least, &mut moved);
        }
        self.at = moved.next;
        moved
    }

    /// Replaces the steps from a point that do not serve, or lead out of their brackets.
    #[inline(always)]
    fn replace(&mut self, at: S, least: S, moved: &mut NewtonStep<S>) {
        let (next, middle) = (moved.next, middle(self.lower, self.upper));
        let (low, high) = (self.lower.min(self.upper), self.lower.max(self.upper));
        let (below, above) = (next.is_below(low), high.is_below(next));
        let stays = low.is_at_most(next) & next.is_at_most(high);
        let nearest = S::select(above, high, S::select(stays, next, middle));
        let nearest = S::select(below, low, nearest);
        moved.newton &= stays;
        let leaves = !stays & !moved.settled;
        let to_end = leaves & !self.has_left & !nearest.is_equal(at);
        self.has_left |= leaves;
        // NOTE: what is left of a settled search may be rounding, and lead out of the bracket.
        moved.next = S::select(moved.settled | moved.newton | to_end, nearest, middle);
        let kept = !moved.settled & !moved.newton;
        let step = (moved.next - at).abs();
        self.steps[1] = S::select(kept, step, self.steps[1]);
        moved.settled |= kept & step.is_at_most(least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    #[test]
    fn square_root_of_two_is_found_to_the_precision_of_the_type() {
        let bracket = Bracket::new(Dd::ZERO, Dd::from(2.0), -Dd::ONE, Dd::ONE).unwrap();
        let two = Dd::from(2.0);
        let root = bracket
            .newton(Dd::ZERO, |x| (x * x - two, two * x))
            .root()
            .unwrap();
        assert!((root - Dd::SQRT_2).abs().to_f64() < 1e-31);
    }

    #[test]
    fn flat_derivative_and_reversed_ends_fall_back_to_bisection() {
        let bracket = Bracket::new(3.0, -1.0, 1.0, -1.0).unwrap();
        let outcome = bracket.newton(0.0, |x: f64| ((x - 0.3).powi(9), 0.0));
        assert!((outcome.root().unwrap() - 0.3).abs() < 1e-15);
        let outcome = bracket.newton(0.0, |x: f64| ((x - 0.3).signum(), f64::NAN));
        assert!((outcome.root().unwrap() - 0.3).abs() < 1e-15);
    }

    #[test]
    fn a_root_on_an_end_needs_as_few_evaluations_as_any_other() {
        // Newton's steps for the sine overshoot its zero.
        for (zero, other) in [(1.0_f64, 0.5_f64), (0.5, 1.0)] {
            let sine = |x: f64| ((x - zero).sin(), (x - zero).cos());
            let bracket = Bracket::new(zero, other, 0.0, sine(other).0).unwrap();
            match bracket.newton(1e-9, sine) {
                BracketOutcome::Converged { root, evaluations } => {
                    assert_eq!((root, evaluations), (zero, 2));
                }
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn a_step_away_from_the_root_is_replaced_and_not_taken_for_the_last() {
        // The derivative has the wrong sign on half the bracket.
        let bracket = Bracket::new(0.0, 1.0, -1.0, 1.0).unwrap();
        let outcome = bracket.newton(0.0, |x: f64| (x - 0.7, if x < 0.6 { -1.0 } else { 1.0 }));
        assert!((outcome.root().unwrap() - 0.7).abs() < 1e-15);
    }

    #[test]
    fn steps_to_and_fro_do_not_keep_from_the_root() {
        // Newton's method on the square root of the distance goes as far to the other side, and
        // back.
        let bracket = Bracket::new(-1.0, 1.5, -1.0, 1.0).unwrap();
        let root_of_distance = |x: f64| {
            let root = (x - 0.1).abs().sqrt();
            (root * (x - 0.1).signum(), 0.5 / root)
        };
        match bracket.newton_from(0.3, 1e-12, root_of_distance) {
            BracketOutcome::Converged { root, evaluations } => {
                assert!((root - 0.1).abs() < 1e-11, "{root}");
                assert!(evaluations < 100, "{evaluations}");
            }
            other => panic!("{other:?}"),
        }
    }
}
