//! Roots in brackets: Newton steps where they converge, bisection where they do not.
//!
//! All roots of the program are refined here: with a derivative by [`Bracket::newton`] (step by
//! step [`NewtonSteps`]), from values alone by [`Bracket::itp`], from yes or no by
//! [`last_that_holds`]. [`polynomial`](super::polynomial) isolates all roots of a polynomial, and
//! refines them here.
//!
//! Systems of equations are solved by Newton's method with damped steps, [`damped_newton`].

use std::iter;

use super::{Branched, Mask, NumericError, Real, Scalar};

/// Iterations that bisection alone needs for any bracket of [`Dd`](super::Dd), twice over.
const ITERATION_LIMIT: usize = 400;

/// An interval at whose ends a continuous function has opposite signs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket<S> {
    lower: S,
    upper: S,
    sign_lower: S,
}

/// Outcome of a search inside a [`Bracket`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BracketOutcome<S> {
    /// A root was found to the requested tolerance.
    Converged {
        /// The root.
        root: S,
        /// Evaluations of the function.
        evaluations: usize,
    },
    /// The function returned NaN or an infinity.
    NotFinite {
        /// Argument at which the function is not finite.
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
    /// The best root known: the root that was found, or the middle of the last bracket; `None` if
    /// the function was not finite.
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
    /// Only the signs of the values are used. One value may be zero; it is given the sign opposite
    /// to the other.
    ///
    /// # Errors
    ///
    /// [`NumericError::NoSignChange`] if both values are positive, both negative, both zero, or one
    /// is NaN.
    pub fn new(lower: S, upper: S, value_lower: S, value_upper: S) -> Result<Self, NumericError> {
        let (at_lower, at_upper) = (value_lower.signum(), value_upper.signum());
        let sign_lower = if at_lower == S::zero() { -at_upper } else { at_lower };
        if (at_lower * at_upper).to_f64() <= 0.0 && sign_lower != S::zero() {
            return Ok(Bracket { lower, upper, sign_lower });
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
                return BracketOutcome::Converged { root: centre, evaluations };
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
                return BracketOutcome::Converged { root: x, evaluations };
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

    /// Replaces the end at which the function has the sign of `value`, and returns that end.
    fn shrink(&mut self, x: S, value: S) -> End {
        if value.signum() == self.sign_lower {
            self.lower = x;
            End::Lower
        } else {
            self.upper = x;
            End::Upper
        }
    }

    /// Whether a point lies strictly inside; the ends may be in either order.
    fn contains(&self, x: S) -> bool {
        (self.lower < x && x < self.upper) || (self.upper < x && x < self.lower)
    }

    fn middle(&self) -> S {
        middle(self.lower, self.upper)
    }

    fn left_over(self) -> BracketOutcome<S> {
        BracketOutcome::IterationLimit { lower: self.lower, upper: self.upper }
    }
}

/// Newton's method in brackets, one step at a time, for one function or one in every lane: for
/// searches with a stopping rule of their own.
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
    /// Mask: the function is positive at the lower end.
    falling: S::Mask,
    at: S,
    tolerance: S,
    /// Lengths of the last two steps, the earlier one first.
    steps: [S; 2],
    has_left: S::Mask,
}

/// A step of [`NewtonSteps`]. Newton's step is replaced by one to an end of the bracket, or to its
/// middle, if it leads out of the bracket or converges too slowly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonStep<S: Branched> {
    /// The next point.
    pub next: S,
    /// Mask: the next point is the root, because Newton's step is below the tolerance or the value
    /// is 0.
    pub settled: S::Mask,
    /// Mask: the next point is that of Newton's step, and the search goes on.
    pub newton: S::Mask,
}

impl<S: Real> Bracket<S> {
    /// The root by Newton's method with the function's value and derivative, from the middle: see
    /// [`newton_from`](Self::newton_from).
    pub fn newton(self, tolerance: S, function: impl FnMut(S) -> (S, S)) -> BracketOutcome<S> {
        self.newton_from(self.middle(), tolerance, function)
    }

    /// The root by Newton's method with the function's value and derivative, from a point inside;
    /// steps that do not converge are replaced, see [`NewtonSteps::advance`].
    ///
    /// The search stops when a Newton step falls below `tolerance` plus four units of rounding;
    /// that last step is still taken. Newton's method squares the error, so a tolerance of half the
    /// digits is enough. `tolerance` may be zero.
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
        BracketOutcome::IterationLimit { lower: search.lower, upper: search.upper }
    }
}

impl<S: Branched> NewtonSteps<S> {
    /// Starts at points inside brackets with these lower and upper ends, in either order.
    ///
    /// `falling` is the mask of functions that are positive at the lower end. Steps below
    /// `tolerance` plus four units of rounding settle a search.
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

    /// Points at which the functions are to be evaluated next.
    #[inline(always)]
    pub fn at(&self) -> S {
        self.at
    }

    /// Makes a step, from the values, which are not NaN, and the derivatives of the functions at
    /// [`at`](Self::at).
    ///
    /// The first step out of the bracket goes to its end, where the root may well be: brackets are
    /// often halves of a searched interval. After that, and if a step is more than half as long as
    /// the one before the last, the bracket is halved (Press et al., *Numerical Recipes*,
    /// `rtsafe`).
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
        let mut moved = NewtonStep { next, settled, newton: halves & !settled };
        self.steps = [self.steps[1], step];
        if (!stays | !(settled | halves)).any() {
            self.replace(at, least, &mut moved);
        }
        self.at = moved.next;
        moved
    }

    /// Replaces the steps that converge too slowly or lead out of their brackets.
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
        // NOTE: the last step of a settled search may be rounding, and lead out of the bracket.
        moved.next = S::select(moved.settled | moved.newton | to_end, nearest, middle);
        let kept = !moved.settled & !moved.newton;
        let step = (moved.next - at).abs();
        self.steps[1] = S::select(kept, step, self.steps[1]);
        moved.settled |= kept & step.is_at_most(least);
    }
}

/// The last point known to meet a condition, after `halvings` halvings of the interval between
/// `holds`, which meets the condition, and `fails`, which does not; the ends may be in either
/// order.
///
/// This search is for conditions that are known only as yes or no; [`Bracket`] finds a root of a
/// function faster from its values.
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

#[inline(always)]
fn middle<S: Scalar>(lower: S, upper: S) -> S {
    lower + (upper - lower) * S::from_f64(0.5)
}

/// Four units of rounding of a number: steps below it are noise.
#[inline(always)]
fn resolution<S: Scalar>(x: S) -> S {
    x.abs() * S::from_f64(4.0 * S::ROUNDOFF)
}

/// The point of the false position, moved towards the centre by the truncation, then into the
/// radius around the centre.
fn projected<S: Real>(falsi: S, centre: S, truncation: S, radius: S) -> S {
    let towards_centre = (centre - falsi).signum();
    let moved = if truncation <= (centre - falsi).abs() {
        falsi + towards_centre * truncation
    } else {
        centre
    };
    if (moved - centre).abs() <= radius { moved } else { centre - towards_centre * radius }
}

/// Outcome of a search by [`damped_newton`], with the last iterate.
#[derive(Clone, Debug, PartialEq)]
pub enum NewtonOutcome<P, T, E> {
    /// The search ended at a root.
    Root(P),
    /// An iterate has no step.
    NoStep {
        /// The iterate.
        at: P,
        /// Reason why there is no step.
        reason: E,
        /// Steps made.
        steps: usize,
    },
    /// No share of the step from the iterate leads nearer to a root.
    NotNearer {
        /// The iterate.
        at: P,
        /// The step.
        step: T,
    },
    /// The largest number of steps was made; the last iterate.
    StepLimit(P),
}

/// Newton's method from an iterate, each step halved until it leads nearer to a root.
///
/// `step` gives Newton's step at an iterate. `moved` gives the iterate that lies a share (1, 1/2,
/// 1/4, …) of a step away, or `None` if it is not enough nearer to a root. `is_root` tells, from an
/// iterate and the step that led to it, whether the search ends.
///
/// ```
/// use grazemap_jet::numeric::{NewtonOutcome, damped_newton};
/// // Without damping the method diverges on the arc tangent from here.
/// let outcome = damped_newton(
///     3.0_f64,
///     [20, 10],
///     |x| Ok::<_, ()>(x.atan() * (1.0 + x * x)),
///     |x, step, share| Some(x - share * step).filter(|next| next.abs() < x.abs()),
///     |x, _| x.abs() < 1e-12,
/// );
/// assert!(matches!(outcome, NewtonOutcome::Root(_)));
/// ```
pub fn damped_newton<P, T, E>(
    start: P,
    [most_steps, most_halvings]: [usize; 2],
    mut step: impl FnMut(&P) -> Result<T, E>,
    mut moved: impl FnMut(&P, &T, f64) -> Option<P>,
    mut is_root: impl FnMut(&P, &T) -> bool,
) -> NewtonOutcome<P, T, E> {
    let mut at = start;
    for steps in 0..most_steps {
        let step = match step(&at) {
            Ok(step) => step,
            Err(reason) => return NewtonOutcome::NoStep { at, reason, steps },
        };
        let shares = iter::successors(Some(1.0), |share| Some(0.5 * share));
        let mut shares = shares.take(most_halvings + 1);
        let Some(next) = shares.find_map(|share| moved(&at, &step, share)) else {
            return NewtonOutcome::NotNearer { at, step };
        };
        at = next;
        if is_root(&at, &step) {
            return NewtonOutcome::Root(at);
        }
    }
    NewtonOutcome::StepLimit(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    #[test]
    fn itp_finds_the_square_root_of_two_to_the_precision_of_the_type() {
        let bracket = Bracket::new(Dd::ZERO, Dd::from(2.0), -Dd::ONE, Dd::ONE).unwrap();
        let two = Dd::from(2.0);
        let root = bracket.itp((-two, two), Dd::ZERO, |x| x * x - two).root().unwrap();
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
        assert!(matches!(Bracket::new(0.0, 1.0, 1.0, 2.0), Err(NumericError::NoSignChange { .. })));
        assert!(Bracket::new(0.0, 1.0, f64::NAN, 2.0).is_err());
        assert!(Bracket::new(0.0, 1.0, 0.0, 0.0).is_err());
        let bracket = Bracket::new(0.0, 1.0, -1.0, 2.0).unwrap();
        let outcome = bracket.newton(0.0, |_| (f64::NAN, 1.0));
        assert_eq!(outcome, BracketOutcome::NotFinite { at: 0.5, evaluations: 1 });
    }

    #[test]
    fn newton_finds_the_square_root_of_two_to_the_precision_of_the_type() {
        let bracket = Bracket::new(Dd::ZERO, Dd::from(2.0), -Dd::ONE, Dd::ONE).unwrap();
        let two = Dd::from(2.0);
        let root = bracket.newton(Dd::ZERO, |x| (x * x - two, two * x)).root().unwrap();
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
        // Newton's steps for the sine overshoot the zero.
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
        // Newton's method on the square root of the distance goes equally far to the other side,
        // and back.
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
