//! A root held between two points: Newton steps where they help, bisection where they do not.
//!
//! The one polish of a root of the program: with a derivative [`Bracket::newton`] (step by step
//! [`NewtonSteps`]), from values alone [`Bracket::itp`], from yes and no [`last_that_holds`]. All
//! roots of a polynomial are isolated, and polished here, by
//! [`polynomial`](super::polynomial).

use super::{NumericError, Real};

/// Enough for bisection alone to resolve any bracket of [`Dd`](super::Dd), twice over.
const ITERATION_LIMIT: usize = 400;

/// An interval at whose ends a continuous function has opposite signs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket<S> {
    lower: S,
    upper: S,
    sign_lower: S,
}

/// How a search inside a [`Bracket`] ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BracketOutcome<S> {
    /// A root to the tolerance asked for.
    Converged {
        /// The root.
        root: S,
        /// Evaluations of the function.
        evaluations: usize,
    },
    /// The function returned NaN or an infinity.
    NotFinite {
        /// Where it did.
        at: S,
        /// Evaluations of the function.
        evaluations: usize,
    },
    /// The tolerance was not reached; the root lies between the two points.
    IterationLimit {
        /// Lower end of the last bracket.
        lower: S,
        /// Upper end of the last bracket.
        upper: S,
    },
}

impl<S: Real> BracketOutcome<S> {
    /// The best root known: that found, or the middle of the last bracket; `None` if the function was
    /// not finite.
    pub fn root(&self) -> Option<S> {
        match *self {
            BracketOutcome::Converged { root, .. } => Some(root),
            BracketOutcome::IterationLimit { lower, upper } => Some(middle(lower, upper)),
            BracketOutcome::NotFinite { .. } => None,
        }
    }
}

impl<S: Real> Bracket<S> {
    /// The bracket `[lower, upper]` (in either order) of a function with these values at its ends.
    ///
    /// Only the signs of the values are used; one of them may be zero, which then takes the sign
    /// opposite to the other.
    ///
    /// # Errors
    ///
    /// [`NumericError::NoSignChange`] if both values are positive, both negative, both zero, or one
    /// is NaN.
    pub fn new(lower: S, upper: S, value_lower: S, value_upper: S) -> Result<Self, NumericError> {
        let (at_lower, at_upper) = (value_lower.signum(), value_upper.signum());
        let sign_lower = if at_lower == S::zero() {
            -at_upper
        } else {
            at_lower
        };
        if (at_lower * at_upper).to_f64() <= 0.0 && sign_lower != S::zero() {
            return Ok(Bracket {
                lower,
                upper,
                sign_lower,
            });
        }
        Err(NumericError::NoSignChange {
            lower: lower.to_f64(),
            upper: upper.to_f64(),
            value_lower: value_lower.to_f64(),
            value_upper: value_upper.to_f64(),
        })
    }

    /// The root from values alone, by the ITP method (Oliveira and Takahashi 2021): never slower
    /// than bisection by more than one evaluation, superlinear on smooth functions.
    ///
    /// `value_lower` and `value_upper` are the values at the ends; stops when the bracket is
    /// shorter than twice `tolerance` plus a few units of rounding.
    pub fn itp(
        self,
        (value_lower, value_upper): (S, S),
        tolerance: S,
        mut function: impl FnMut(S) -> S,
    ) -> BracketOutcome<S> {
        let two = S::from_f64(2.0);
        let mut bracket = self;
        let (mut at_lower, mut at_upper) = (value_lower, value_upper);
        let scale = S::from_f64(0.2) / (bracket.upper - bracket.lower).abs();
        let mut reach = (bracket.upper - bracket.lower).abs();
        for evaluations in 0..ITERATION_LIMIT {
            let (lower, upper) = (bracket.lower, bracket.upper);
            let width = upper - lower;
            let centre = bracket.middle();
            if width.abs() <= two * tolerance + resolution(centre) {
                return BracketOutcome::Converged {
                    root: centre,
                    evaluations,
                };
            }
            let falsi = (upper * at_lower - lower * at_upper) / (at_lower - at_upper);
            let truncation = scale * width * width;
            let radius = (reach - width.abs() / two).max(S::zero());
            let x = projected(falsi, centre, truncation, radius);
            let x = if bracket.contains(x) { x } else { centre };
            let value = function(x);
            if !value.is_finite() {
                return BracketOutcome::NotFinite { at: x, evaluations };
            }
            if value == S::zero() {
                return BracketOutcome::Converged {
                    root: x,
                    evaluations,
                };
            }
            if bracket.shrink(x, value) == End::Lower {
                at_lower = value;
            } else {
                at_upper = value;
            }
            reach /= two;
        }
        bracket.left_over()
    }

    /// Replaces the end at which the function has the sign of `value`, and says which.
    fn shrink(&mut self, x: S, value: S) -> End {
        if value.signum() == self.sign_lower {
            self.lower = x;
            End::Lower
        } else {
            self.upper = x;
            End::Upper
        }
    }

    /// Whether a point lies strictly inside, whichever end is the larger.
    fn contains(&self, x: S) -> bool {
        (self.lower < x && x < self.upper) || (self.upper < x && x < self.lower)
    }

    fn middle(&self) -> S {
        middle(self.lower, self.upper)
    }

    fn left_over(self) -> BracketOutcome<S> {
        BracketOutcome::IterationLimit {
            lower: self.lower,
            upper: self.upper,
        }
    }
}

/// Newton's method in a [`Bracket`], a step at a time: for searches with their own rule to stop.
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
    /// as long as the one before the last, the bracket is halved (Press et al., *Numerical
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
            // NOTE: the last step may be rounding, and lead out of the bracket.
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

/// The last point known to meet a condition that `holds` meets and `fails` does not, after so many
/// halvings of the interval between them; the ends may be in either order.
///
/// For conditions that are only known as yes or no; a root of a function of which the values are
/// known is found faster by [`Bracket`].
///
/// ```
/// use grazemap_jet::numeric::last_that_holds;
/// let root = last_that_holds(0.0, 2.0, 60, |x: f64| x * x <= 2.0);
/// assert!((root - 2f64.sqrt()).abs() < 1e-15);
/// ```
pub fn last_that_holds<S: Real>(
    mut holds: S,
    mut fails: S,
    halvings: usize,
    mut condition: impl FnMut(S) -> bool,
) -> S {
    for _ in 0..halvings {
        let middle = S::from_f64(0.5) * (holds + fails);
        if condition(middle) {
            holds = middle;
        } else {
            fails = middle;
        }
    }
    holds
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Lower,
    Upper,
}

fn middle<S: Real>(lower: S, upper: S) -> S {
    lower + (upper - lower) * S::from_f64(0.5)
}

/// Four units of rounding of a number: steps below it are noise.
fn resolution<S: Real>(x: S) -> S {
    x.abs() * S::from_f64(4.0 * S::ROUNDOFF)
}

/// The false position moved towards the centre by the truncation, then into the radius around the
/// centre.
fn projected<S: Real>(falsi: S, centre: S, truncation: S, radius: S) -> S {
    let towards_centre = (centre - falsi).signum();
    let moved = if truncation <= (centre - falsi).abs() {
        falsi + towards_centre * truncation
    } else {
        centre
    };
    if (moved - centre).abs() <= radius {
        moved
    } else {
        centre - towards_centre * radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    #[test]
    fn itp_finds_the_square_root_of_two_to_the_precision_of_the_type() {
        let bracket = Bracket::new(Dd::ZERO, Dd::from(2.0), -Dd::ONE, Dd::ONE).unwrap();
        let two = Dd::from(2.0);
        let root = bracket
            .itp((-two, two), Dd::ZERO, |x| x * x - two)
            .root()
            .unwrap();
        assert!((root - Dd::SQRT_2).abs().to_f64() < 1e-31);
    }

    #[test]
    fn itp_needs_few_evaluations_on_a_smooth_function() {
        let function = |x: f64| x.exp() - 3.0;
        let bracket = Bracket::new(0.0, 4.0, -2.0, 51.0).unwrap();
        match bracket.itp((function(0.0), function(4.0)), 1e-15, function) {
            BracketOutcome::Converged { root, evaluations } => {
                assert!((root - 3.0_f64.ln()).abs() < 4e-15);
                assert!(evaluations < 20, "{evaluations}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn values_of_one_sign_and_functions_that_are_not_finite_are_reported() {
        assert!(matches!(
            Bracket::new(0.0, 1.0, 1.0, 2.0),
            Err(NumericError::NoSignChange { .. })
        ));
        assert!(Bracket::new(0.0, 1.0, f64::NAN, 2.0).is_err());
        assert!(Bracket::new(0.0, 1.0, 0.0, 0.0).is_err());
        let bracket = Bracket::new(0.0, 1.0, -1.0, 2.0).unwrap();
        let outcome = bracket.newton(0.0, |_| (f64::NAN, 1.0));
        assert_eq!(
            outcome,
            BracketOutcome::NotFinite {
                at: 0.5,
                evaluations: 1
            }
        );
    }

    #[test]
    fn newton_finds_the_square_root_of_two_to_the_precision_of_the_type() {
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
