//! Newton's method kept inside a bracket.

use super::{Bracket, BracketOutcome, ITERATION_LIMIT, resolution};
use crate::numeric::Real;

/// Newton's method in a [`Bracket`], a step at a time: for searches that know of their own when to
/// end.
///
/// ```
/// use grazemap_jet::numeric::{Bracket, NewtonStep};
/// let bracket = Bracket::new(0.0, 2.0, -2.0, 2.0)?;
/// let mut search = bracket.newton_steps(1.0, 1e-8);
/// let root = loop {
///     let x: f64 = search.at();
///     if let NewtonStep::Settled(root) = search.advance(x * x - 2.0, 2.0 * x) {
///         break root;
///     }
/// };
/// assert!((root - 2f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), grazemap_jet::numeric::NumericError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct NewtonSteps<S> {
    bracket: Bracket<S>,
    at: S,
    tolerance: S,
    /// The lengths of the step before the last and of the last.
    steps: [S; 2],
    has_left: bool,
}

/// Where a step of [`NewtonSteps`] leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NewtonStep<S> {
    /// Newton's step is below the tolerance, or the value is 0: this is the root.
    Settled(S),
    /// Newton's step.
    Newton(S),
    /// Newton's step does not serve: an end of the bracket, or its middle.
    Kept(S),
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
        let mut search = self.newton_steps(start, tolerance);
        for evaluations in 1..=ITERATION_LIMIT {
            let at = search.at();
            let (value, derivative) = function(at);
            if !value.is_finite() {
                return BracketOutcome::NotFinite { at, evaluations };
            }
            if let NewtonStep::Settled(root) = search.advance(value, derivative) {
                return BracketOutcome::Converged { root, evaluations };
            }
        }
        search.bracket.left_over()
    }

    /// Newton's method from a point inside, a step at a time; steps below `tolerance` plus four
    /// units of rounding end it.
    #[inline]
    pub fn newton_steps(self, start: S, tolerance: S) -> NewtonSteps<S> {
        NewtonSteps {
            bracket: self,
            at: start,
            tolerance,
            steps: [(self.upper - self.lower).abs(); 2],
            has_left: false,
        }
    }

    /// The nearest point of the bracket; its middle if there is none, for NaN.
    #[inline]
    fn nearest(&self, x: S) -> S {
        let (low, high) = if self.lower < self.upper {
            (self.lower, self.upper)
        } else {
            (self.upper, self.lower)
        };
        if low <= x && x <= high {
            x
        } else if x < low {
            low
        } else if x > high {
            high
        } else {
            self.middle()
        }
    }
}

impl<S: Real> NewtonSteps<S> {
    /// Where the function is asked for next.
    #[inline]
    pub fn at(&self) -> S {
        self.at
    }

    /// Moves on with the value, which is not NaN, and the derivative of the function at
    /// [`at`](Self::at).
    ///
    /// A step out of the bracket goes to its end the first time, where the root may well be:
    /// brackets are often halves of what is searched. After that, and where a step is not half
    /// as long as the one before the last, what is left is halved (Press et al., *Numerical
    /// Recipes*, `rtsafe`).
    #[inline]
    pub fn advance(&mut self, value: S, derivative: S) -> NewtonStep<S> {
        let x = self.at;
        self.bracket.shrink(x, value);
        let newton = if value == S::zero() {
            x
        } else {
            x - value / derivative
        };
        let inside = self.bracket.nearest(newton);
        let least = self.tolerance + resolution(x);
        if (newton - x).abs() <= least {
            // NOTE: what is left may be rounding, and lead out of the bracket.
            return NewtonStep::Settled(inside);
        }
        let stays = newton == inside;
        let serves = if stays {
            (newton - x).abs() * S::from_f64(2.0) <= self.steps[0]
        } else {
            !self.has_left && inside != x
        };
        self.has_left |= !stays;
        let next = if serves {
            inside
        } else {
            self.bracket.middle()
        };
        let step = (next - x).abs();
        self.steps = [self.steps[1], step];
        self.at = next;
        match stays && serves {
            true => NewtonStep::Newton(next),
            false if step <= least => NewtonStep::Settled(next),
            false => NewtonStep::Kept(next),
        }
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
