//! A root held between two points: Newton steps where they help, bisection where they do not.

mod newton;

pub use newton::{NewtonStep, NewtonSteps};

use super::{NumericError, Real, Scalar};

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
        /// Lower end of what is left.
        lower: S,
        /// Upper end of what is left.
        upper: S,
    },
}

impl<S: Real> BracketOutcome<S> {
    /// The best root known: that found, or the middle of what is left; `None` if the function was
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Lower,
    Upper,
}

#[inline(always)]
fn middle<S: Scalar>(lower: S, upper: S) -> S {
    lower + (upper - lower) * S::from_f64(0.5)
}

/// Four units of rounding of a number: steps below it are noise.
#[inline(always)]
fn resolution<S: Scalar>(x: S) -> S {
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
    fn square_root_of_two_is_found_to_the_precision_of_the_type() {
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
}
